//! A row's result is its own: the same bits whatever its neighbours, lane, thread, CPU path or batch.

mod common;
#[path = "common/bits.rs"]
mod comparison;

use common::{Problem, layout, random_rows};
use comparison::bits;
use hdfast::batch::{Direction, MethodName, Outputs, paths};
use hdfast::model::Base;

const ROWS: usize = 75;

fn same(left: &Outputs, right: &Outputs) {
    for row in 0..left.status.len() {
        assert_eq!(bits(left, row), bits(right, row), "row {row}");
    }
}

fn reference(base: Base) -> (Vec<Vec<f64>>, Outputs) {
    let rows = random_rows(&layout(base), ROWS);
    let outputs = Problem { base, ..Problem::new(rows.clone()) }.run();
    assert!(outputs.status.iter().all(|status| *status == 0));
    (rows, outputs)
}

#[test]
fn exact_bits_on_every_cpu_path() {
    for base in [Base::TwoInertia, Base::OneInertia] {
        let (rows, expected) = reference(base);
        for path in paths() {
            same(&expected, &Problem { base, path, ..Problem::new(rows.clone()) }.run());
        }
    }
}

#[test]
fn exact_bits_on_every_cpu_path_with_every_method() {
    let rows = random_rows(&layout(Base::TwoInertia), 20);
    for method in [MethodName::Bs3, MethodName::Tsit5, MethodName::Dopri5, MethodName::Rodas5p] {
        let run = |path| Problem { path, method, rtol: 1e-4, ..Problem::new(rows.clone()) }.run();
        let expected = run(paths()[0]);
        for path in paths() {
            same(&expected, &run(path));
        }
    }
}

#[test]
fn exact_bits_on_any_number_of_threads() {
    let (rows, expected) = reference(Base::TwoInertia);
    for threads in [2, 3] {
        same(&expected, &Problem { threads, ..Problem::new(rows.clone()) }.run());
    }
}

#[test]
fn exact_bits_in_any_row_order_and_batch() {
    let (rows, expected) = reference(Base::TwoInertia);
    let mut reversed = rows.clone();
    reversed.reverse();
    let backwards = Problem::new(reversed).run();
    for row in 0..ROWS {
        assert_eq!(bits(&expected, row), bits(&backwards, ROWS - 1 - row), "row {row}");
    }
    for start in [0, 1, 17, 40, ROWS - 1] {
        let part = Problem::new(rows[start..].to_vec()).run();
        assert_eq!(bits(&expected, start), bits(&part, 0), "batch from {start}");
    }
}

#[test]
fn exact_bits_whether_the_error_is_shared_or_per_row() {
    let (rows, expected) = reference(Base::TwoInertia);
    same(&expected, &Problem { own_error: true, ..Problem::new(rows) }.run());
}

#[test]
fn exact_bits_of_derivatives() {
    let rows = random_rows(&layout(Base::TwoInertia), 20);
    let directions = vec![Direction::Parameter(2), Direction::Initial(1), Direction::Parameter(8)];
    let problem = || Problem { directions: directions.clone(), ..Problem::new(rows.clone()) };
    let expected = problem().run();
    assert!(expected.samples.tangents.iter().all(|tangent| tangent.is_finite()));
    for path in paths() {
        same(&expected, &Problem { path, ..problem() }.run());
    }
    same(&expected, &Problem { threads: 3, ..problem() }.run());
    let values = Problem::new(rows.clone()).run();
    for (plain, with) in [(&values.metrics, &expected.metrics), (&values.samples, &expected.samples)] {
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&plain.values), bits(&with.values));
    }
}

//! Rows with every kind of term: the same bits on every path, thread and in every company.

mod common;
#[path = "common/bits.rs"]
mod comparison;

use common::{Problem, layout, random_rows};
use comparison::bits;
use hdfast::batch::{MethodName, paths};
use hdfast::model::terms::{Choice, TERMS};
use hdfast::model::{Base, Layout};

const ROWS: usize = 24;

/// As many terms as the base takes and have room for their hidden states together, from the first or the last one on.
fn sets(base: Base) -> Vec<Vec<String>> {
    let fill = |terms: &mut dyn Iterator<Item = usize>| {
        let mut ids = Vec::new();
        for index in terms.filter(|&index| TERMS[index].bases.contains(&base)) {
            ids.push(TERMS[index].id.to_string());
            if Choice::of(&ids).is_err() {
                ids.pop();
            }
        }
        ids
    };
    vec![fill(&mut (0..TERMS.len())), fill(&mut (0..TERMS.len()).rev()), vec!["coulomb_friction".into()]]
}

fn check(base: Base) {
    for ids in sets(base) {
        let terms = Choice::of(&ids).expect("room for their states");
        let rows = random_rows(&Layout { terms: terms.clone(), ..layout(base) }, ROWS);
        for method in [MethodName::Dop853, MethodName::Tsit5, MethodName::Rodas5p] {
            let problem = |rows: &[Vec<f64>]| Problem {
                base,
                terms: terms.clone(),
                method,
                rtol: 1e-5,
                max_steps: 4_000,
                ..Problem::new(rows.to_vec())
            };
            let expected = problem(&rows).run();
            assert!(expected.steps.iter().all(|&steps| steps > 100), "rows of {ids:?} hardly move with {method:?}");
            for path in paths() {
                let found = Problem { path, ..problem(&rows) }.run();
                (0..ROWS).for_each(|row| assert_eq!(bits(&expected, row), bits(&found, row), "{path:?} row {row}"));
            }
            let threaded = Problem { threads: 3, ..problem(&rows) }.run();
            let part = problem(&rows[7..]).run();
            (0..ROWS).for_each(|row| assert_eq!(bits(&expected, row), bits(&threaded, row), "threads, row {row}"));
            (7..ROWS).for_each(|row| assert_eq!(bits(&expected, row), bits(&part, row - 7), "batch, row {row}"));
        }
    }
}

#[test]
fn exact_bits_with_terms() {
    check(Base::TwoInertia);
}

#[test]
fn exact_bits_with_terms_on_a_rigid_gear() {
    check(Base::OneInertia);
}

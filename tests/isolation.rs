//! A row that cannot be simulated ends with its own status and leaves the others untouched.

mod common;
#[path = "common/bits.rs"]
mod comparison;

use common::{Problem, layout, random_rows};
use comparison::bits;
use hdfast::batch::MethodName;
use hdfast::model::Base;
use hdfast::solve::Status;

const ROWS: usize = 60;
const BAD: usize = 23;

/// Runs the rows with row `BAD` spoiled, and checks that no other row has changed.
fn spoiled(spoil: impl Fn(&mut Problem)) -> (u8, i32) {
    spoiled_with(MethodName::Dop853, spoil)
}

fn spoiled_with(method: MethodName, spoil: impl Fn(&mut Problem)) -> (u8, i32) {
    let rows = random_rows(&layout(Base::TwoInertia), ROWS);
    let mut problem = Problem { method, ..Problem::new(rows) };
    let expected = problem.run();
    spoil(&mut problem);
    let outputs = problem.run();
    for row in (0..ROWS).filter(|row| *row != BAD) {
        assert_eq!(bits(&expected, row), bits(&outputs, row), "row {row}");
    }
    assert!(outputs.metrics.values.iter().skip(BAD).step_by(ROWS).all(|value| value.is_nan()));
    (outputs.status[BAD], outputs.detail[BAD])
}

#[test]
fn exact_neighbours_of_a_nan_row() {
    let (status, detail) = spoiled(|problem| problem.rows[BAD][2] = f64::NAN);
    assert_eq!((status, detail), (Status::BadParameters as u8, 2));
}

#[test]
fn exact_neighbours_of_a_negative_inertia() {
    let (status, detail) = spoiled(|problem| problem.rows[BAD][1] = -1e-4);
    assert_eq!((status, detail), (Status::BadParameters as u8, 1));
}

#[test]
fn exact_neighbours_of_a_spring_that_gives_way() {
    let (status, detail) = spoiled(|problem| problem.rows[BAD][13] = 2.5e-3);
    assert_eq!((status, detail), (Status::BadParameters as u8, 13));
}

#[test]
fn exact_neighbours_of_a_row_that_needs_too_many_steps() {
    let (status, _) = spoiled(|problem| {
        problem.max_steps = 3_000;
        problem.rows[BAD][2] = 1e-7;
    });
    assert_eq!(status, Status::MaxSteps as u8);
}

#[test]
fn exact_neighbours_of_a_row_that_blows_up() {
    let (status, _) = spoiled(|problem| problem.rows[BAD][6] = 1e300);
    assert!([Status::NotFinite as u8, Status::StepTooSmall as u8].contains(&status), "{status}");
}

#[test]
fn exact_neighbours_of_a_row_that_panics() {
    let (status, _) = spoiled(|problem| problem.poison = Some(BAD));
    assert_eq!(status, Status::Internal as u8);
}

#[test]
fn exact_neighbours_of_bad_rows_with_the_stiff_method() {
    let (status, detail) = spoiled_with(MethodName::Rodas5p, |problem| problem.rows[BAD][2] = f64::NAN);
    assert_eq!((status, detail), (Status::BadParameters as u8, 2));
    let (status, _) = spoiled_with(MethodName::Rodas5p, |problem| problem.rows[BAD][8] = 1e300);
    assert!([Status::NotFinite as u8, Status::StepTooSmall as u8].contains(&status), "{status}");
}

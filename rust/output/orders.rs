//! Amplitudes at orders of the motor revolution: least squares against the angle, not against time.

use super::Signal;
use super::least_squares::fit;
use super::steady::Steady;
use crate::solve::{Retrace, Seat};
use std::f64::consts::TAU;

/// Amplitude of each wanted order in a signal over the whole revolutions of the steady run.
///
/// The orders of the model's own kinematic error are fitted along, so that they do not leak.
pub fn amplitudes<const N: usize>(
    seat: &Seat<N>,
    retrace: &mut dyn Retrace<N>,
    signal: Signal,
    wanted: &[f64],
    known: &[f64],
    steady: &Steady,
) -> Vec<f64> {
    let missing = vec![f64::NAN; wanted.len()];
    if steady.revolutions == 0 {
        return missing;
    }
    let travel = TAU * f64::from(steady.revolutions);
    let lowest = 1.0 / f64::from(steady.revolutions);
    let mut orders = wanted.to_vec();
    orders.extend(known.iter().filter(|order| !wanted.contains(order) && **order >= lowest));
    let grid = seat.assignment.grids[1].clone();
    let (from, to) = steady.window;
    let mut angles = Vec::new();
    let mut data = Vec::new();
    for (&t, state) in grid.iter().zip(&seat.samples[1]) {
        if t >= from && t < to {
            angles.push(state[0]);
            data.push(signal.value(seat, retrace, t, state));
        }
    }
    if angles.len() < 2 * orders.len() + 2 || travel == 0.0 {
        return missing;
    }
    let mut columns = vec![vec![1.0; angles.len()]];
    for &order in &orders {
        columns.push(angles.iter().map(|angle| (order * angle).cos()).collect());
        columns.push(angles.iter().map(|angle| (order * angle).sin()).collect());
    }
    fit(&columns, &data)
        .map_or(missing, |found| (0..wanted.len()).map(|k| found[2 * k + 1].hypot(found[2 * k + 2])).collect())
}

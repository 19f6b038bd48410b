//! Amplitudes at orders of the motor revolution: least squares against the angle, not against time.

use super::Signal;
use super::least_squares::LeastSquares;
use super::steady::Steady;
use crate::solve::{Retrace, Seat};

/// Amplitude of each wanted order in a signal over the whole revolutions of the steady run.
///
/// The orders of the model's own kinematic error are fitted along, so that they do not leak; each wanted order
/// beyond them is fitted on its own, so that it does not depend on its company.
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
    let lowest = 1.0 / f64::from(steady.revolutions);
    let known: Vec<f64> = known.iter().copied().filter(|order| *order >= lowest).collect();
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
    let unknown: Vec<f64> = wanted.iter().copied().filter(|order| !known.contains(order)).collect();
    if angles.len() < 2 * known.len() + 4 {
        return missing;
    }
    let mut problem = LeastSquares::new(&data);
    let mut determined = problem.push(vec![1.0; angles.len()]);
    for (cosine, sine) in waves(&known, &angles) {
        determined = determined.and_then(|()| problem.push(cosine)).and_then(|()| problem.push(sine));
    }
    if determined.is_none() {
        return missing;
    }
    let amplitude = |problem: &LeastSquares, place: usize| {
        let found = problem.solve();
        found[2 * place + 1].hypot(found[2 * place + 2])
    };
    let mut found: Vec<(f64, f64)> =
        known.iter().enumerate().map(|(k, &order)| (order, amplitude(&problem, k))).collect();
    let own = problem.len();
    for (&order, (cosine, sine)) in unknown.iter().zip(waves(&unknown, &angles)) {
        problem.truncate(own);
        let pushed = problem.push(cosine).and_then(|()| problem.push(sine));
        found.push((order, pushed.map_or(f64::NAN, |()| amplitude(&problem, known.len()))));
    }
    let of = |order: f64| found.iter().find(|entry| entry.0 == order).map_or(f64::NAN, |entry| entry.1);
    wanted.iter().map(|&order| of(order)).collect()
}

/// Cosine and sine of every order at every angle; integer orders by repeated rotation.
fn waves(orders: &[f64], angles: &[f64]) -> Vec<(Vec<f64>, Vec<f64>)> {
    let empty = (Vec::with_capacity(angles.len()), Vec::with_capacity(angles.len()));
    let mut waves = vec![empty; orders.len()];
    let whole = |order: f64| order.fract() == 0.0;
    let highest = orders.iter().copied().filter(|order| whole(*order)).fold(0.0, f64::max) as usize;
    let mut turns = vec![(1.0, 0.0); highest + 1];
    for &angle in angles {
        let (sine, cosine) = angle.sin_cos();
        for n in 1..=highest {
            let (c, s) = turns[n - 1];
            turns[n] = (c * cosine - s * sine, c * sine + s * cosine);
        }
        for (&order, (cosines, sines)) in orders.iter().zip(&mut waves) {
            let (c, s) = if whole(order) {
                turns[order as usize]
            } else {
                let (s, c) = (order * angle).sin_cos();
                (c, s)
            };
            cosines.push(c);
            sines.push(s);
        }
    }
    waves
}

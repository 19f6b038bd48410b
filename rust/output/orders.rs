//! Amplitudes at orders of the motor revolution: least squares against the angle, not against time.

use super::Signal;
use super::least_squares::LeastSquares;
use super::steady::Steady;
use crate::real::Scalar;
use crate::solve::{Retrace, Seat};

/// Amplitude of each wanted order in a signal over the whole revolutions of the steady run.
///
/// The orders of the model's own kinematic error are fitted along, so that they do not leak; each wanted order
/// beyond them is fitted on its own, so that it does not depend on its company.
pub fn amplitudes<S: Scalar, const N: usize>(
    seat: &Seat<S, N>,
    retrace: &mut dyn Retrace<S, N>,
    signal: Signal,
    wanted: &[f64],
    known: &[f64],
    steady: &Steady<S>,
) -> Vec<S> {
    let absent = S::splat(f64::NAN);
    let missing = vec![absent; wanted.len()];
    if steady.revolutions == 0 {
        return missing;
    }
    let lowest = 1.0 / f64::from(steady.revolutions);
    let known: Vec<f64> = known.iter().copied().filter(|order| *order >= lowest).collect();
    let (from, to) = steady.window;
    let mut angles = Vec::new();
    let mut data = Vec::new();
    for (t, state) in seat.assignment.probes.iter().map(|t| t.plain()).zip(&seat.samples[1]) {
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
    let mut determined = problem.push(vec![S::splat(1.0); angles.len()]);
    for (cosine, sine) in waves(&known, &angles) {
        determined = determined.and_then(|()| problem.push(cosine)).and_then(|()| problem.push(sine));
    }
    if determined.is_none() {
        return missing;
    }
    let amplitude = |problem: &LeastSquares<S>, place: usize| {
        let found = problem.solve();
        length(found[2 * place + 1], found[2 * place + 2])
    };
    let mut found: Vec<(f64, S)> =
        known.iter().enumerate().map(|(k, &order)| (order, amplitude(&problem, k))).collect();
    let own = problem.len();
    for (&order, (cosine, sine)) in unknown.iter().zip(waves(&unknown, &angles)) {
        problem.truncate(own);
        let pushed = problem.push(cosine).and_then(|()| problem.push(sine));
        found.push((order, pushed.map_or(absent, |()| amplitude(&problem, known.len()))));
    }
    let of = |order: f64| found.iter().find(|entry| entry.0 == order).map_or(absent, |entry| entry.1);
    wanted.iter().map(|&order| of(order)).collect()
}

/// Length of a vector.
fn length<S: Scalar>(x: S, y: S) -> S {
    let value = x.plain().hypot(y.plain());
    S::splat(value).with_tangent((x.plain() * x.tangent() + y.plain() * y.tangent()) / value)
}

/// Cosine and sine of every order at every angle; integer orders by repeated rotation.
fn waves<S: Scalar>(orders: &[f64], angles: &[S]) -> Vec<(Vec<S>, Vec<S>)> {
    let empty = (Vec::with_capacity(angles.len()), Vec::with_capacity(angles.len()));
    let mut waves = vec![empty; orders.len()];
    let whole = |order: f64| order.fract() == 0.0;
    let highest = orders.iter().copied().filter(|order| whole(*order)).fold(0.0, f64::max) as usize;
    let mut turns = vec![(S::splat(1.0), S::zero()); highest + 1];
    for &angle in angles {
        let (sine, cosine) = turn(angle);
        for n in 1..=highest {
            let (c, s) = turns[n - 1];
            turns[n] = (c * cosine - s * sine, c * sine + s * cosine);
        }
        for (&order, (cosines, sines)) in orders.iter().zip(&mut waves) {
            let (c, s) = if whole(order) {
                turns[order as usize]
            } else {
                let (s, c) = turn(S::splat(order) * angle);
                (c, s)
            };
            cosines.push(c);
            sines.push(s);
        }
    }
    waves
}

/// Sine and cosine of the standard library.
fn turn<S: Scalar>(angle: S) -> (S, S) {
    let (sine, cosine) = angle.plain().sin_cos();
    let number = |value: f64, slope: f64| S::splat(value).with_tangent(slope * angle.tangent());
    (number(sine, cosine), number(cosine, -sine))
}

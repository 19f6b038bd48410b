//! Amplitudes at orders of the motor revolution: least squares against the angle, not against time.

use super::least_squares::{LeastSquares, dot};
use super::probe::orders_from;
use super::steady::Steady;
use crate::model::Signal;
use crate::real::Scalar;
use crate::solve::Seat;
use std::f64::consts::TAU;

/// Samples per period below which an order is taken for another one; 2 are the least.
const LEAST_PER_PERIOD: f64 = 2.5;
/// Up to this order a wave is found by rotating those before it.
const ROTATED: f64 = 32.0;
/// A whole turn, but for rounding.
const TURN: f64 = 1.0 - 1e-9;

/// What is fitted, and how it follows a parameter.
#[derive(Default)]
struct Samples {
    angles: Vec<f64>,
    data: Vec<f64>,
    angle_tangents: Vec<f64>,
    data_tangents: Vec<f64>,
}

impl Samples {
    /// The highest order that they tell from others, wherever they are farthest apart.
    fn highest_order(&self) -> f64 {
        let farthest = self.angles.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        TAU / (LEAST_PER_PERIOD * farthest)
    }
}

/// Amplitude of each wanted order in a signal over the whole revolutions of the steady run.
///
/// The orders of the model's own kinematic error, `lines`, are fitted along, so that they do not leak; each wanted order
/// beyond them is fitted on its own, so that it does not depend on its company. NaN where less than one revolution was
/// turned, or so slowly that the samples do not reach back over the steady run, where they are too few for an order, or
/// where the run holds less than one turn of it, or of its difference to another line.
pub fn amplitudes<S: Scalar, const N: usize>(
    seat: &Seat<S, N>,
    signal: Signal,
    wanted: &[f64],
    lines: &[f64],
    steady: &Steady<S>,
) -> Vec<S> {
    let missing = vec![S::splat(f64::NAN); wanted.len()];
    let sampled = orders_from(&seat.assignment.row, &seat.assignment.program).plain();
    if steady.revolutions == 0 || steady.window.0 < sampled {
        return missing;
    }
    let turns = |order: f64| order.abs() * f64::from(steady.revolutions) >= TURN;
    let apart = |order: f64| lines.iter().all(|line| *line == order || turns(order - line));
    let known: Vec<f64> = lines.iter().copied().filter(|order| turns(*order)).collect();
    let samples = samples(seat, signal, steady.window);
    let highest = samples.highest_order();
    if samples.angles.len() < 2 * known.len() + 4 || known.iter().any(|order| *order > highest) {
        return missing;
    }
    let mut problem = LeastSquares::new(&samples.data);
    let mut determined = problem.push(vec![1.0; samples.angles.len()]);
    for (cosine, sine) in waves(&known, &samples.angles) {
        determined = determined.and_then(|()| problem.push(cosine)).and_then(|()| problem.push(sine));
    }
    if determined.is_none() {
        return missing;
    }
    let mut found: Vec<(f64, S)> = known.iter().copied().zip(lengths(&problem, &known, &samples)).collect();
    let told = |order: &f64| turns(*order) && *order <= highest && apart(*order);
    let unknown: Vec<f64> = wanted.iter().copied().filter(|order| told(order) && !known.contains(order)).collect();
    let own = problem.len();
    for (&order, (cosine, sine)) in unknown.iter().zip(waves(&unknown, &samples.angles)) {
        problem.truncate(own);
        if problem.push(cosine).and_then(|()| problem.push(sine)).is_some() {
            let orders = [known.as_slice(), &[order]].concat();
            found.push((order, lengths(&problem, &orders, &samples)[known.len()]));
        }
    }
    let of = |order: &f64| found.iter().find(|entry| entry.0 == *order && told(order));
    wanted.iter().map(|order| of(order).map_or(S::splat(f64::NAN), |entry| entry.1)).collect()
}

/// A signal over the motor angle inside a window.
fn samples<S: Scalar, const N: usize>(seat: &Seat<S, N>, signal: Signal, (from, to): (f64, f64)) -> Samples {
    let mut samples = Samples::default();
    let values = seat.samples.probed(Signal::ThetaM).zip(seat.samples.probed(signal));
    for (t, (angle, value)) in seat.samples.probes().zip(values) {
        if t >= from && t < to {
            samples.angles.push(angle.plain());
            samples.data.push(value.plain());
            if S::DIFFERENTIATES {
                samples.angle_tangents.push(angle.tangent());
                samples.data_tangents.push(value.tangent());
            }
        }
    }
    samples
}

/// Amplitudes of the waves of a problem whose columns are one constant, then cosine and sine of every order.
fn lengths<S: Scalar>(problem: &LeastSquares, orders: &[f64], samples: &Samples) -> Vec<S> {
    let found = problem.solve();
    let changes = if S::DIFFERENTIATES { changes(problem, orders, samples, &found) } else { vec![0.0; found.len()] };
    let length = |(x, change): (&[f64], &[f64])| {
        let value = x[0].hypot(x[1]);
        S::splat(value).with_tangent((x[0] * change[0] + x[1] * change[1]) / value)
    };
    found[1..].chunks_exact(2).zip(changes[1..].chunks_exact(2)).map(length).collect()
}

/// Derivatives of the coefficients, from those of the normal equations.
fn changes(problem: &LeastSquares, orders: &[f64], samples: &Samples, found: &[f64]) -> Vec<f64> {
    let columns = problem.columns();
    let mut residual: Vec<f64> = samples.data.iter().map(|value| value - found[0]).collect();
    let mut slope = vec![0.0; residual.len()];
    for ((&order, waves), x) in orders.iter().zip(columns[1..].chunks_exact(2)).zip(found[1..].chunks_exact(2)) {
        for (index, (cosine, sine)) in waves[0].iter().zip(&waves[1]).enumerate() {
            residual[index] -= x[0] * cosine + x[1] * sine;
            slope[index] += order * (x[1] * cosine - x[0] * sine);
        }
    }
    let tangents = || samples.angle_tangents.iter();
    let by_angle: Vec<f64> = residual.iter().zip(tangents()).map(|(rest, tangent)| rest * tangent).collect();
    let along = samples.data_tangents.iter().zip(slope.iter().zip(tangents()));
    let unexplained: Vec<f64> = along.map(|(tangent, (slope, angle))| tangent - slope * angle).collect();
    let mut products = vec![unexplained.iter().sum()];
    for (&order, waves) in orders.iter().zip(columns[1..].chunks_exact(2)) {
        products.push(dot(&waves[0], &unexplained) - order * dot(&waves[1], &by_angle));
        products.push(dot(&waves[1], &unexplained) + order * dot(&waves[0], &by_angle));
    }
    problem.solve_for(&products)
}

/// Cosine and sine of every order at every angle; small integer orders by repeated rotation.
fn waves(orders: &[f64], angles: &[f64]) -> Vec<(Vec<f64>, Vec<f64>)> {
    let room = || Vec::with_capacity(angles.len());
    let mut waves: Vec<_> = orders.iter().map(|_| (room(), room())).collect();
    let rotated = |order: f64| order.fract() == 0.0 && order <= ROTATED;
    let highest = orders.iter().copied().filter(|order| rotated(*order)).fold(0.0, f64::max) as usize;
    let mut turns = vec![(1.0, 0.0); highest + 1];
    for &angle in angles {
        let (sine, cosine) = angle.sin_cos();
        for n in 1..=highest {
            let (c, s) = turns[n - 1];
            turns[n] = (c * cosine - s * sine, c * sine + s * cosine);
        }
        for (&order, (cosines, sines)) in orders.iter().zip(&mut waves) {
            let (c, s) = if rotated(order) {
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

#[cfg(test)]
mod tests {
    use super::waves;

    #[test]
    fn exact_waves() {
        let angles: Vec<f64> = (0..200).map(|k| 0.37 * f64::from(k) - 20.0).collect();
        for order in [0.5, 1.0, 2.0, 32.0, 33.0, 10_000.0] {
            let (cosines, sines) = &waves(&[2.0, order], &angles)[1];
            for (angle, (cosine, sine)) in angles.iter().zip(cosines.iter().zip(sines)) {
                let error = (cosine - (order * angle).cos()).hypot(sine - (order * angle).sin());
                assert!(error < 1e-14, "order {order}: {error}");
            }
        }
    }
}

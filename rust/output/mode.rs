//! The torsional mode after an event: a damped sinusoid fitted to the windup rate.

use super::least_squares::{LeastSquares, dot};
use crate::model::{Layout, Row, Signal};
use crate::real::Scalar;
use crate::solve::Seat;
use std::f64::consts::TAU;

/// Samples over the window of the fit.
pub const SAMPLES: usize = 128;
/// How many lines of the kinematic error are fitted along.
const LINES: usize = 4;
/// A wave that is there is found in half as many; more of them find what a ramp or a line forces.
const ITERATIONS: usize = 12;
/// Of the wave, rms over rms, what the fit may leave unexplained.
const UNEXPLAINED: f64 = 0.25;

/// A fitted mode.
#[derive(Clone, Copy, Debug)]
pub struct Mode {
    /// Frequency [Hz].
    pub frequency: f64,
    /// Decay rate [1/s].
    pub decay: f64,
    /// Amplitude of the output speed at the event [rad/s].
    pub amplitude: f64,
}

const MISSING: Mode = Mode { frequency: f64::NAN, decay: f64::NAN, amplitude: f64::NAN };

/// The longest window of the fit after an event [s]: five decay times.
pub fn window<S: Scalar>(row: &Row<S>) -> S {
    S::splat(5.0) / row.free_decay()
}

/// Fits the mode in the samples between two times, with an offset, a slope and the strongest lines of the kinematic error
/// that turn at least once. Begins from the free mode about the mean windup, where a loaded spring is stiffer; NaN
/// where no single damped wave fits.
pub fn mode<S: Scalar, const N: usize>(layout: &Layout, seat: &Seat<S, N>, from: f64, to: f64) -> Mode {
    let row = &seat.assignment.row;
    let mut times = Vec::with_capacity(SAMPLES);
    let mut angles = Vec::with_capacity(SAMPLES);
    let mut data = Vec::with_capacity(SAMPLES);
    let mut windup = 0.0;
    let interval = (to - from) / SAMPLES as f64;
    let probed = |signal| seat.samples.probed(signal);
    let values = probed(Signal::ThetaM).zip(probed(Signal::WindupRate)).zip(probed(Signal::Windup));
    for (t, ((angle, rate), wound)) in seat.samples.probes().zip(values) {
        let place = (t - from) / interval;
        let is_own = (place - place.round()).abs() < 1e-6; // and not another metric's
        if t > from && t <= to && is_own && place.round() as usize == times.len() + 1 {
            times.push(t - from);
            angles.push(angle.plain());
            data.push(rate.plain());
            windup += wound.plain();
        }
    }
    if times.len() < SAMPLES / 2 {
        return MISSING;
    }
    let mut problem = LeastSquares::new(&data);
    let travel = angles[angles.len() - 1] - angles[0];
    problem.push(vec![1.0; times.len()]);
    problem.push(times.clone());
    for order in strongest_lines(&layout.orders, &row.forcing, travel) {
        problem.push(angles.iter().map(|angle| (order * angle).cos()).collect());
        problem.push(angles.iter().map(|angle| (order * angle).sin()).collect());
    }
    let background = problem.len();
    let stiffness = row.stiffness(layout, S::splat(windup / times.len() as f64));
    let (mut omega, mut decay) = (row.free_frequency(stiffness).plain(), row.free_decay().plain());
    for _ in 0..ITERATIONS {
        problem.truncate(background);
        let Some([a, b, c, d]) = wave_coefficients(&mut problem, &times, omega, decay) else { return MISSING };
        let square = a * a + b * b;
        let (omega_change, decay_change) = ((c * b - d * a) / square, -(c * a + d * b) / square);
        let limit = 0.2 * omega;
        omega += omega_change.clamp(-limit, limit);
        decay += decay_change.clamp(-limit, limit);
        if omega_change.abs() + decay_change.abs() < 1e-9 * omega {
            let [even, odd] = [0, 1].map(|wave| &problem.columns()[background + wave]);
            let wave = a * a * dot(even, even) + 2.0 * a * b * dot(even, odd) + b * b * dot(odd, odd);
            if problem.unexplained() > UNEXPLAINED * UNEXPLAINED * wave {
                return MISSING;
            }
            let c = &row.constants;
            let reflected = c.reflected_inertia();
            let share = (reflected / (reflected + c.j_l)).plain();
            return Mode { frequency: omega / TAU, decay, amplitude: share * square.sqrt() };
        }
    }
    MISSING
}

/// Orders that force the mode most, among those that turn at least once.
fn strongest_lines(orders: &[f64], forcing: &[f64], travel: f64) -> Vec<f64> {
    let turns = |(order, forcing): &(f64, f64)| *forcing > 0.0 && (order * travel).abs() > TAU;
    let mut lines: Vec<_> = orders.iter().copied().zip(forcing.iter().copied()).filter(turns).collect();
    lines.sort_by(|left, right| right.1.total_cmp(&left.1));
    lines.iter().take(LINES).map(|line| line.0).collect()
}

/// Coefficients of e^(-decay t) (cos, sin, t cos, t sin): the last two tell how omega and decay are off.
fn wave_coefficients(problem: &mut LeastSquares, times: &[f64], omega: f64, decay: f64) -> Option<[f64; 4]> {
    let mut columns: [Vec<f64>; 4] = std::array::from_fn(|_| Vec::with_capacity(times.len()));
    let interval = times[0];
    let turn = ((omega * interval).cos(), (omega * interval).sin());
    let fade = (-decay * interval).exp();
    let (mut c, mut s) = (1.0, 0.0);
    for t in times {
        (c, s) = (fade * (c * turn.0 - s * turn.1), fade * (c * turn.1 + s * turn.0));
        for (column, value) in columns.iter_mut().zip([c, s, t * c, t * s]) {
            column.push(value);
        }
    }
    let first = problem.len();
    for column in columns {
        problem.push(column)?;
    }
    problem.solve()[first..].try_into().ok()
}

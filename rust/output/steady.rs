//! The steady run: the last whole number of motor revolutions before the stop that last half a second.

use crate::solve::{Mark, Retrace, Seat, root};
use std::f64::consts::TAU;

const SHORTEST: f64 = 0.5;

/// The steady run of a row.
#[derive(Clone, Copy, Debug)]
pub struct Steady {
    /// Start and end [s].
    pub window: (f64, f64),
    /// Mean motor speed [rad/s].
    pub omega_m: f64,
    /// Mean load speed [rad/s].
    pub omega_l: f64,
    /// Whole motor revolutions in the window; 0 where not one fits.
    pub revolutions: u32,
}

/// The steady run of a recorded row; all NaN where the row did not reach the stop.
pub fn steady<const N: usize>(seat: &Seat<N>, retrace: &mut dyn Retrace<N>) -> Steady {
    let end = seat.time_of(Mark::Off);
    let count = seat.records.partition_point(|record| record.t <= end);
    let Some(last) = count.checked_sub(1).map(|index| seat.records[index]).filter(|record| record.t == end) else {
        return Steady { window: (f64::NAN, f64::NAN), omega_m: f64::NAN, omega_l: f64::NAN, revolutions: 0 };
    };
    let records = &seat.records[..count];
    let from = records.partition_point(|record| record.t < seat.time_of(Mark::On));
    let direction = last.state[0] - records[from].state[0];
    let travelled = |record: &crate::solve::Record<N>| (last.state[0] - record.state[0]) * direction.signum();
    let late_enough = |record: &&crate::solve::Record<N>| end - record.t >= SHORTEST;
    let turns = records[from..].iter().rev().find(late_enough).map_or(f64::INFINITY, |r| (travelled(r) / TAU).ceil());
    let available = (direction.abs() / TAU).floor();
    let mut revolutions = turns.max(1.0);
    let mut start = f64::NAN;
    while revolutions <= available {
        let index = from + records[from..].partition_point(|record| travelled(record) > revolutions * TAU);
        start = passing_time(seat, retrace, index, last.state[0] - direction.signum() * revolutions * TAU);
        if end - start >= SHORTEST {
            break;
        }
        revolutions += 1.0;
    }
    if revolutions > available {
        revolutions = 0.0;
        start = seat.time_of(Mark::Run);
    }
    let state = state_at(seat, retrace, start);
    let theta_l = |theta_m: f64, te: f64| theta_m * seat.assignment.row.constants.inverse_ratio - te;
    let first = retrace.rates(seat, start, &state);
    let final_te = retrace.rates(seat, end, &last.state).te;
    let mean = |from: f64, to: f64| (to - from) / (end - start);
    Steady {
        window: (start, end),
        omega_m: mean(state[0], last.state[0]),
        omega_l: mean(theta_l(state[0], first.te), theta_l(last.state[0], final_te)),
        revolutions: revolutions as u32,
    }
}

/// When the motor angle passes `angle` in the step that ends at a record.
fn passing_time<const N: usize>(seat: &Seat<N>, retrace: &mut dyn Retrace<N>, index: usize, angle: f64) -> f64 {
    let end = &seat.records[index];
    if index == 0 || end.step == 0.0 {
        return end.t;
    }
    let start = &seat.records[index - 1];
    let dense = retrace.dense(seat, start, end.step);
    let share = root(|share| dense.at(share)[0] - angle, start.state[0] - angle, end.state[0] - angle);
    dense.t + share * dense.step
}

/// The state at a time inside the recorded steps.
fn state_at<const N: usize>(seat: &Seat<N>, retrace: &mut dyn Retrace<N>, t: f64) -> [f64; N] {
    let index = seat.records.partition_point(|record| record.t < t);
    let end = &seat.records[index.min(seat.records.len() - 1)];
    if index == 0 || end.t == t || end.step == 0.0 {
        return end.state;
    }
    let dense = retrace.dense(seat, &seat.records[index - 1], end.step);
    dense.at((t - dense.t) / dense.step)
}

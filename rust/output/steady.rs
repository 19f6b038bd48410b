//! The steady run: the last whole revolutions that the motor turned before the stop in half a second or more.

use crate::model::SHORTEST_RUN;
use crate::real::Scalar;
use crate::solve::{Mark, Record, Retrace, Seat, moving, root};
use std::f64::consts::TAU;

/// The steady run of a row.
#[derive(Clone, Copy, Debug)]
pub struct Steady<S> {
    /// Start and end [s].
    pub window: (f64, f64),
    /// Mean motor speed [rad/s].
    pub omega_m: S,
    /// Mean load speed [rad/s].
    pub omega_l: S,
    /// Whole motor revolutions in the window; 0 where not one fits.
    pub revolutions: u32,
    /// Largest speeds of motor and load at the ends of steps [rad/s].
    pub fastest: [f64; 2],
}

impl<S: Scalar> Steady<S> {
    /// Of a row that did not reach the stop, or whose steps there are forgotten.
    fn missing() -> Self {
        let missing = S::splat(f64::NAN);
        Self {
            window: (f64::NAN, f64::NAN),
            omega_m: missing,
            omega_l: missing,
            revolutions: 0,
            fastest: [f64::NAN; 2],
        }
    }
}

/// The steady run of a recorded row; all NaN where the row did not reach the stop, or where it began is forgotten.
pub fn steady<S: Scalar, const N: usize>(seat: &Seat<S, N>, retrace: &mut dyn Retrace<S, N>) -> Steady<S> {
    let end = seat.time_of(Mark::Off);
    let count = seat.records.partition_point(|record| record.t <= end);
    let Some(last) = count.checked_sub(1).map(|index| seat.records[index]).filter(|record| record.t == end) else {
        return Steady::missing();
    };
    let records = &seat.records[..count];
    let on = records.partition_point(|record| record.t < seat.time_of(Mark::On));
    let forgotten = records.iter().rposition(|record| record.step.is_nan()).filter(|place| *place > on);
    let from = forgotten.unwrap_or(on);
    let (start, revolutions) = match whole_revolutions(seat, retrace, &records[from..]) {
        Some(found) => found,
        None if forgotten.is_some() => return Steady::missing(),
        None => (seat.moment_of(Mark::Run), 0.0),
    };
    let state = state_at(seat, retrace, start);
    let theta_l = |theta_m: S, te: S| theta_m * seat.assignment.row.constants.inverse_ratio - te;
    let first = retrace.rates(seat, start.plain(), &state);
    let final_te = retrace.rates(seat, end, &last.state).te;
    let mean = |from: S, to: S| (to - from) / (S::splat(end) - start);
    Steady {
        window: (start.plain(), end),
        omega_m: mean(state[0], last.state[0]),
        omega_l: mean(theta_l(state[0], first.te), theta_l(last.state[0], final_te)),
        revolutions: revolutions as u32,
        fastest: seat.records.iter().fold([0.0, 0.0], |[motor, load], record| {
            [f64::max(motor, record.state[1].plain().abs()), f64::max(load, record.omega_l.abs())]
        }),
    }
}

/// When the last whole revolutions of some records began that last [`SHORTEST_RUN`], and how many they are. Where the
/// motor also turned back, it may have passed their first angle more than once: the last time counts.
fn whole_revolutions<S: Scalar, const N: usize>(
    seat: &Seat<S, N>,
    retrace: &mut dyn Retrace<S, N>,
    records: &[Record<S, N>],
) -> Option<(S, f64)> {
    let last = records.last()?;
    let way = |record: &Record<S, N>| last.state[0].plain() - record.state[0].plain();
    let (early, late) = records.split_at(records.partition_point(|record| last.t - record.t >= SHORTEST_RUN));
    let at_least = way(early.last()?).abs().min(way(late.first()?).abs());
    let mut revolutions = (at_least / TAU).ceil().max(1.0);
    loop {
        let place = early.iter().rposition(|record| way(record).abs() >= revolutions * TAU)?;
        let angle = last.state[0] - S::splat(way(&early[place]).signum() * revolutions * TAU);
        let start = passing_time(seat, retrace, [&records[place], &records[place + 1]], angle);
        if last.t - start.plain() >= SHORTEST_RUN {
            return Some((start, revolutions));
        }
        revolutions += 1.0;
    }
}

/// When the motor angle passes `angle` in the step between two records.
fn passing_time<S: Scalar, const N: usize>(
    seat: &Seat<S, N>,
    retrace: &mut dyn Retrace<S, N>,
    [start, end]: [&Record<S, N>; 2],
    angle: S,
) -> S {
    if end.step == 0.0 {
        return S::splat(end.t);
    }
    let dense = retrace.dense(seat, start, end.step);
    let beyond = |share: S| dense.at(share)[0] - angle;
    let (before, after) = ((start.state[0] - angle).plain(), (end.state[0] - angle).plain());
    let share = moving(beyond, root(|share| beyond(S::splat(share)).plain(), before, after));
    S::splat(dense.t) + share * S::splat(dense.step)
}

/// The state at a time inside the recorded steps.
fn state_at<S: Scalar, const N: usize>(seat: &Seat<S, N>, retrace: &mut dyn Retrace<S, N>, t: S) -> [S; N] {
    let index = seat.records.partition_point(|record| record.t < t.plain());
    let end = &seat.records[index.min(seat.records.len() - 1)];
    if index == 0 || end.step == 0.0 || (end.t == t.plain() && t.tangent() == 0.0) {
        return end.state;
    }
    let dense = retrace.dense(seat, &seat.records[index - 1], end.step);
    let inside = dense.at((t - S::splat(dense.t)) / S::splat(dense.step));
    if end.t == t.plain() { std::array::from_fn(|k| end.state[k].with_tangent(inside[k].tangent())) } else { inside }
}

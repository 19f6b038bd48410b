//! The steady run: the last whole revolutions that the motor turned before the stop in half a second or more.

use crate::model::SHORTEST_RUN;
use crate::real::Scalar;
use crate::solve::{Mark, Record, Retrace, Seat, moving, root};
use std::f64::consts::TAU;

/// Of the way at the largest speed of a step, how far a motor that turns back in it gets beyond its ends at most.
const TURNING: f64 = 0.5;

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
    let [before, after] = [early.last()?, late.first()?].map(|record| way(record).abs());
    let at_least = if after > before {
        let latest = state_at(seat, retrace, S::splat(last.t - SHORTEST_RUN));
        (last.state[0] - latest[0]).plain().abs()
    } else {
        after
    };
    let mut revolutions = (at_least / TAU).ceil().max(1.0);
    loop {
        let mut steps = (0..early.len()).rev().map(|place| [&records[place], &records[place + 1]]);
        let start = steps.find_map(|step| passing_time(seat, retrace, step, (last.state[0], revolutions * TAU)))?;
        if last.t - start.plain() >= SHORTEST_RUN {
            return Some((start, revolutions));
        }
        revolutions += 1.0;
    }
}

/// When the motor last passes, in the step between two records, an angle that is so far from a later one. The step may
/// begin beyond it, or be where the motor turns back.
fn passing_time<S: Scalar, const N: usize>(
    seat: &Seat<S, N>,
    retrace: &mut dyn Retrace<S, N>,
    [start, end]: [&Record<S, N>; 2],
    (later, distance): (S, f64),
) -> Option<S> {
    let way = |angle: S| (later - angle).plain();
    let [from, to] = [start, end].map(|record| (way(record.state[0]), record.state[1].plain()));
    let begins_beyond = from.0.abs() >= distance;
    let reach = TURNING * end.step * from.1.abs().max(to.1.abs());
    let may_turn = from.1 * to.1 < 0.0 && from.0.abs().max(to.0.abs()) + reach >= distance;
    if !begins_beyond && !may_turn {
        return None;
    }
    if end.step == 0.0 {
        return Some(S::splat(end.t));
    }
    let dense = retrace.dense(seat, start, end.step);
    let angle_at = |share: f64| dense.at(S::splat(share))[0];
    let farthest = if begins_beyond { 0.0 } else { root(|share| dense.at(S::splat(share))[1].plain(), from.1, to.1) };
    let away = way(angle_at(farthest));
    if away.abs() < distance {
        return None;
    }
    let angle = later - S::splat(away.signum() * distance);
    let beyond = |share: f64| (angle_at(share) - angle).plain();
    let width = 1.0 - farthest;
    let local = root(|part| beyond(farthest + part * width), beyond(farthest), (end.state[0] - angle).plain());
    let share = moving(|share| dense.at(share)[0] - angle, farthest + local * width);
    Some(S::splat(dense.t) + share * S::splat(dense.step))
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

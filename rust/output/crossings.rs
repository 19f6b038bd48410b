//! Times at which a speed passes a level, located inside the steps.

use crate::model::Signal;
use crate::real::Scalar;
use crate::solve::{Record, Retrace, Seat, moving, root};

/// Which crossing of a window is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// The first upward one.
    FirstUp,
    /// The first downward one.
    FirstDown,
    /// The last downward one.
    LastDown,
}

/// Equal parts of a step that are looked at one by one.
const PARTS: usize = 12;

/// The time at which `sign` times a signal (omega_m or omega_l) passes `level` in a window; NaN where it never does, or
/// where it may have done so in steps that are forgotten.
pub fn crossing<S: Scalar, const N: usize>(
    seat: &Seat<S, N>,
    retrace: &mut dyn Retrace<S, N>,
    signal: Signal,
    sign: f64,
    level: S,
    window: (f64, f64),
    wanted: Wanted,
) -> S {
    let height = level.plain();
    let read = |record: &Record<S, N>| match signal {
        Signal::OmegaM => (sign * record.state[1].plain() - height, sign * record.alpha_m),
        _ => (sign * record.omega_l - height, sign * record.alpha_l),
    };
    let from = seat.records.partition_point(|record| record.t < window.0);
    let to = seat.records.partition_point(|record| record.t <= window.1);
    let Some(records) = seat.records.get(from..to) else { return S::splat(f64::NAN) };
    let mut inside = |index: usize| {
        let (start, end) = (&records[index - 1], &records[index]);
        if end.step.is_nan() {
            return Some(S::splat(f64::NAN));
        }
        may_pass(read(start), read(end), end.step)
            .then(|| passing(seat, retrace, signal, (sign, level), (start, end), wanted))
            .flatten()
    };
    let mut steps = 1..records.len().max(1);
    let found =
        if wanted == Wanted::LastDown { steps.rev().find_map(&mut inside) } else { steps.find_map(&mut inside) };
    found.unwrap_or(S::splat(f64::NAN))
}

/// Whether a signal with these values and rates at the ends of a step can be zero inside.
fn may_pass(start: (f64, f64), end: (f64, f64), step: f64) -> bool {
    let same_side = (start.0 > 0.0) == (end.0 > 0.0) && end.0 != 0.0;
    let turns = start.1 * end.1 <= 0.0;
    let reach = 0.2 * step * (start.1.abs() + end.1.abs());
    step > 0.0 && (!same_side || (turns && start.0.abs().min(end.0.abs()) < reach))
}

/// The wanted crossing inside one step, if there is one.
fn passing<S: Scalar, const N: usize>(
    seat: &Seat<S, N>,
    retrace: &mut dyn Retrace<S, N>,
    signal: Signal,
    (sign, level): (f64, S),
    (start, end): (&Record<S, N>, &Record<S, N>),
    wanted: Wanted,
) -> Option<S> {
    let dense = retrace.dense(seat, start, end.step);
    let mut over = |share: S| {
        let state = dense.at(share);
        S::splat(sign) * retrace.signal(signal, seat, dense.t + share.plain() * dense.step, &state) - level
    };
    let mut excess = |share: f64| over(S::splat(share)).plain();
    let share_of = |part: usize| part as f64 / PARTS as f64;
    let values: [f64; PARTS + 1] = std::array::from_fn(|part| excess(share_of(part)));
    let passes = |part: &usize| match wanted {
        Wanted::FirstUp => values[*part] < 0.0 && values[part + 1] >= 0.0,
        _ => values[*part] > 0.0 && values[part + 1] <= 0.0,
    };
    let part = if wanted == Wanted::LastDown { (0..PARTS).rfind(passes) } else { (0..PARTS).find(passes) }?;
    let width = share_of(1);
    let share = root(|local| excess(share_of(part) + local * width), values[part], values[part + 1]);
    let share = moving(over, share_of(part) + share * width);
    Some(S::splat(dense.t) + S::splat(dense.step) * share)
}

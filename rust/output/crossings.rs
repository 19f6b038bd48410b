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
/// Of the change at the largest rate of a step, how far a signal gets beyond the step's ends at most.
const REACH: f64 = 0.4;

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
    let reach = REACH * step * start.1.abs().max(end.1.abs());
    step > 0.0 && (!same_side || start.0.abs().min(end.0.abs()) < reach)
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
    let looks = looks(&mut excess);
    let mut pairs = looks.windows(2).map(|pair| [pair[0], pair[1]]);
    let passes = |[from, to]: &[Look; 2]| match wanted {
        Wanted::FirstUp => from.excess < 0.0 && to.excess >= 0.0,
        _ => from.excess > 0.0 && to.excess <= 0.0,
    };
    let [from, to] = if wanted == Wanted::LastDown { pairs.rfind(passes) } else { pairs.find(passes) }?;
    let width = to.share - from.share;
    let local = root(|local| excess(from.share + local * width), from.excess, to.excess);
    let share = moving(over, from.share + local * width);
    Some(S::splat(dense.t) + S::splat(dense.step) * share)
}

/// A place in a step, and what a signal there exceeds a level by.
#[derive(Clone, Copy)]
struct Look {
    share: f64,
    excess: f64,
}

/// Looks at the ends of equal parts of a step, and where parabolas through them come nearest to the level from one side.
fn looks(mut excess: impl FnMut(f64) -> f64) -> Vec<Look> {
    let mut look = |share: f64| Look { share, excess: excess(share) };
    let even: [Look; PARTS + 1] = std::array::from_fn(|part| look(part as f64 / PARTS as f64));
    let mut found = even.to_vec();
    for near in even.windows(3) {
        let [before, here, after] = [near[0], near[1], near[2]].map(|one| one.excess * near[1].excess.signum());
        let bend = before - here + (after - here);
        let shift = 0.5 * (before - after) / bend;
        if before.min(here).min(after) > 0.0 && bend > 0.0 && shift.abs() <= 1.0 {
            found.push(look(near[1].share + shift / PARTS as f64));
        }
    }
    found.sort_unstable_by(|one, other| one.share.total_cmp(&other.share));
    found
}

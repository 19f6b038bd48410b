//! Largest value of a watched signal over a window, located inside the steps.

use crate::real::Scalar;
use crate::solve::{Candidate, Mark, Retrace, Seat, Watched};

/// Points inside a step at which a candidate is looked at before the refinement.
const LOOKS: usize = 6;
const REFINEMENTS: usize = 5;

/// The largest value of `sign` times a signal between two marks; NaN where no time lies between them or the row
/// did not get that far.
pub fn largest<S: Scalar, const N: usize>(
    seat: &Seat<S, N>,
    retrace: &mut dyn Retrace<S, N>,
    signal: Watched,
    sign: f64,
    window: (Mark, Mark),
) -> S {
    highest(seat, retrace, signal, &[sign], window)
}

/// The largest magnitude of a signal between two marks; NaN like [`largest`].
pub fn farthest<S: Scalar, const N: usize>(
    seat: &Seat<S, N>,
    retrace: &mut dyn Retrace<S, N>,
    signal: Watched,
    window: (Mark, Mark),
) -> S {
    highest(seat, retrace, signal, &[1.0, -1.0], window)
}

/// The largest of the signal times any of the signs. The most promising steps come first, so few need a closer look.
fn highest<S: Scalar, const N: usize>(
    seat: &Seat<S, N>,
    retrace: &mut dyn Retrace<S, N>,
    signal: Watched,
    signs: &[f64],
    window: (Mark, Mark),
) -> S {
    let intervals = seat.between(window.0, window.1);
    let Some(ranges) = seat.ranges.get(intervals.clone()) else { return S::splat(f64::NAN) };
    if seat.time_of(window.0) >= seat.time_of(window.1) {
        return S::splat(f64::NAN);
    }
    let mut best = S::splat(f64::NEG_INFINITY);
    for range in ranges.iter().map(|range| range[signal as usize]) {
        for &sign in signs {
            best = larger(best, if sign > 0.0 { range.high } else { -range.low });
        }
    }
    let mut candidates: Vec<&Candidate<S, N>> = seat
        .candidates
        .iter()
        .filter(|(interval, it)| intervals.contains(interval) && it.signal == signal && signs.contains(&it.sign))
        .filter(|(_, it)| it.at_most > best.plain())
        .map(|(_, it)| it)
        .collect();
    candidates.sort_unstable_by(|left, right| right.at_most.total_cmp(&left.at_most));
    for candidate in candidates {
        if candidate.at_most <= best.plain() {
            break;
        }
        best = larger(best, peak_inside(seat, retrace, candidate));
    }
    best
}

/// The larger of two numbers; NaN only where both are.
fn larger<S: Scalar>(left: S, right: S) -> S {
    if right.plain() > left.plain() || left.plain().is_nan() { right } else { left }
}

/// The largest value inside one step: looks on a grid, then parabolas through the three best points.
fn peak_inside<S: Scalar, const N: usize>(
    seat: &Seat<S, N>,
    retrace: &mut dyn Retrace<S, N>,
    candidate: &Candidate<S, N>,
) -> S {
    let dense = retrace.dense(seat, &candidate.start, candidate.step);
    let mut look = |share: f64| {
        let state = dense.at(S::splat(share));
        let value = match (candidate.signal, N) {
            (Watched::Windup, 5) => state[2] - retrace.kinematic_error(state[0]).0,
            (Watched::Te, 5..) => state[2],
            (Watched::OmegaL, 5..) => state[3],
            (signal, _) => {
                let rates = retrace.rates(seat, dense.t + share * dense.step, &state);
                match signal {
                    Watched::Windup => rates.windup,
                    Watched::Te => rates.te,
                    Watched::OmegaL => rates.omega_l,
                }
            }
        };
        S::splat(candidate.sign) * value
    };
    let share_of = |index: usize| index as f64 / (LOOKS - 1) as f64;
    let looks: [S; LOOKS] = std::array::from_fn(|index| look(share_of(index)));
    let values = looks.map(S::plain);
    let top = (0..LOOKS).max_by(|&a, &b| values[a].total_cmp(&values[b])).unwrap_or(0);
    let middle = top.clamp(1, LOOKS - 2);
    let mut points = [middle - 1, middle, middle + 1].map(|index| (share_of(index), values[index]));
    let mut best = looks[top];
    for _ in 0..REFINEMENTS {
        let Some(share) = parabola_vertex(&points) else { break };
        if share <= points[0].0 || share >= points[2].0 || share == points[1].0 {
            break;
        }
        let value = look(share);
        let gain = (value - best).plain();
        best = larger(best, value);
        if gain.abs() <= 1e-15 * best.plain().abs() {
            break;
        }
        points = narrowed(points, (share, value.plain()));
    }
    best
}

fn parabola_vertex(points: &[(f64, f64); 3]) -> Option<f64> {
    let [(a, fa), (b, fb), (c, fc)] = *points;
    let left = (b - a) * (fb - fc);
    let right = (b - c) * (fb - fa);
    let denominator = 2.0 * (left - right);
    (denominator != 0.0).then(|| b - ((b - a) * left - (b - c) * right) / denominator)
}

/// Three points around the larger of the middle and the new point.
fn narrowed(points: [(f64, f64); 3], new: (f64, f64)) -> [(f64, f64); 3] {
    let [a, b, c] = points;
    match (new.0 < b.0, new.1 > b.1) {
        (true, true) => [a, new, b],
        (true, false) => [new, b, c],
        (false, true) => [b, new, c],
        (false, false) => [a, b, new],
    }
}

//! Largest and smallest value of a signal over a window, located inside the steps.

use super::Signal;
use crate::solve::{Record, Retrace, Seat};

/// Interior points of a step at which a candidate is looked at before the refinement.
const LOOKS: usize = 8;
/// Candidates within this share of the range are refined.
const MARGIN: f64 = 0.02;
const MOST_CANDIDATES: usize = 8;

/// A signal with its rate at the ends of steps.
fn at_record<const N: usize>(signal: Signal, record: &Record<N>, inverse_ratio: f64) -> (f64, f64) {
    match signal {
        Signal::Te => (record.te, record.state[1] * inverse_ratio - record.omega_l),
        Signal::Windup => (record.windup, record.windup_rate),
        Signal::OmegaM => (record.state[1], record.alpha_m),
        _ => (record.omega_l, record.alpha_l),
    }
}

/// The largest value of `sign` times a signal between two times; NaN where no step lies between them.
///
/// Signals: te, windup, omega_m or omega_l.
pub fn largest<const N: usize>(
    seat: &Seat<N>,
    retrace: &mut dyn Retrace<N>,
    signal: Signal,
    sign: f64,
    window: (f64, f64),
) -> f64 {
    let inverse_ratio = seat.assignment.row.constants.inverse_ratio;
    let records = &seat.records;
    let from = records.partition_point(|record| record.t < window.0);
    let to = records.partition_point(|record| record.t <= window.1);
    let Some(records) = records.get(from..to).filter(|part| !part.is_empty()) else {
        return f64::NAN;
    };
    let mut best = f64::NEG_INFINITY;
    let mut least = f64::INFINITY;
    for record in records {
        let value = sign * at_record(signal, record, inverse_ratio).0;
        best = best.max(value);
        least = least.min(value);
    }
    let mut candidates: Vec<(f64, usize)> = Vec::new();
    for index in 1..records.len() {
        let step = records[index].step;
        let (start, start_rate) = at_record(signal, &records[index - 1], inverse_ratio);
        let (end, end_rate) = at_record(signal, &records[index], inverse_ratio);
        let bound = sign * if sign > 0.0 { start.max(end) } else { start.min(end) };
        let reach = 0.15 * step * (start_rate.abs() + end_rate.abs());
        if step > 0.0 && bound + reach > best {
            candidates.push((
                hermite_peak(sign * start, sign * end, sign * step * start_rate, sign * step * end_rate),
                index,
            ));
        }
    }
    candidates.sort_by(|left, right| right.0.total_cmp(&left.0));
    let promising = candidates.first().map_or(best, |first| first.0.max(best)) - MARGIN * (best - least);
    for &(_, index) in candidates.iter().take_while(|entry| entry.0 >= promising).take(MOST_CANDIDATES) {
        best = best.max(peak_inside(seat, retrace, signal, sign, &records[index - 1], &records[index]));
    }
    sign * best
}

/// The peak of the cubic through two values and rates (per step).
fn hermite_peak(start: f64, end: f64, start_rate: f64, end_rate: f64) -> f64 {
    (1..16)
        .map(|look| {
            let x = f64::from(look) / 16.0;
            let y = 1.0 - x;
            y * y * ((1.0 + 2.0 * x) * start + x * start_rate) + x * x * ((1.0 + 2.0 * y) * end - y * end_rate)
        })
        .fold(start.max(end), f64::max)
}

/// The largest value inside one step: looks on a grid, then parabolas through the three best points.
fn peak_inside<const N: usize>(
    seat: &Seat<N>,
    retrace: &mut dyn Retrace<N>,
    signal: Signal,
    sign: f64,
    start: &Record<N>,
    end: &Record<N>,
) -> f64 {
    let dense = retrace.dense(seat, start, end);
    let inverse_ratio = seat.assignment.row.constants.inverse_ratio;
    let mut look = |share: f64| {
        let state = dense.at(share);
        let value = match (signal, N) {
            (Signal::Windup, 5) => state[2] - retrace.kinematic_error(state[0]).0,
            (Signal::OmegaM, _) => state[1],
            _ => signal.value(seat, retrace, dense.t + share * dense.step, &state),
        };
        sign * value
    };
    let mut values = [0.0; LOOKS + 2];
    values[0] = sign * at_record(signal, start, inverse_ratio).0;
    values[LOOKS + 1] = sign * at_record(signal, end, inverse_ratio).0;
    let share_of = |index: usize| index as f64 / (LOOKS + 1) as f64;
    for (index, value) in values.iter_mut().enumerate().take(LOOKS + 1).skip(1) {
        *value = look(share_of(index));
    }
    let top = (0..LOOKS + 2).max_by(|&a, &b| values[a].total_cmp(&values[b])).unwrap_or(0);
    let middle = top.clamp(1, LOOKS);
    let mut points = [middle - 1, middle, middle + 1].map(|index| (share_of(index), values[index]));
    let mut best = values[top];
    for _ in 0..4 {
        let Some(share) = parabola_vertex(&points) else { break };
        if share <= points[0].0 || share >= points[2].0 || share == points[1].0 {
            break;
        }
        let value = look(share);
        best = best.max(value);
        points = narrowed(points, (share, value));
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

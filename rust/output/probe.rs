//! Times at which metrics look at the state while a row runs.

use super::catalogue::{Metric, Phase};
use super::mode;
use crate::model::{Layout, Program, Row};
use crate::real::Scalar;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Samples per period of the highest order.
const SAMPLES_PER_PERIOD: f64 = 8.0;
const MOST_SAMPLES: f64 = 20_000.0;
/// The steady run is found afterwards: at a quarter of the set speed it takes four times as long.
const EARLIER: f64 = 4.0;
/// Up to this order the samples do not depend on which orders are asked for.
const ALWAYS: f64 = 20.0;
/// Times closer than this share of the whole are one.
const SAME: f64 = 1e-12;

/// The times the metrics need, ascending; they may move with the row's parameters.
pub fn probe_grid<S: Scalar>(metrics: &[Metric], layout: &Layout, row: &Row<S>, program: &Program) -> Arc<[S]> {
    let number = S::splat;
    let mut times = Vec::new();
    let highest = metrics
        .iter()
        .filter_map(|metric| if let Metric::Order(_, order) = metric { Some(*order) } else { None })
        .fold(f64::NAN, f64::max);
    if !highest.is_nan() {
        let highest = layout.orders.iter().copied().fold(highest.max(ALWAYS), f64::max);
        let start = orders_from(row, program);
        let periods = highest * (program.off - start.plain()) * row.omega_set.plain().abs() / TAU;
        let unknowns = 2 * layout.orders.len() + 4;
        let count = (SAMPLES_PER_PERIOD * periods).clamp(2.0 * EARLIER * unknowns as f64, MOST_SAMPLES);
        add_uniform(&mut times, start, number(program.off), count as usize);
    }
    for (phase, event, end) in [(Phase::Start, program.on, program.off), (Phase::Stop, program.off, program.end)] {
        if metrics.iter().any(|metric| metric.looks_at_mode(phase)) {
            let end = number(end).min(number(event) + mode::window(row));
            add_uniform(&mut times, number(event), end, mode::SAMPLES);
        }
    }
    times.retain(|t| (0.0..=program.end).contains(&t.plain()));
    times.sort_by(|left, right| left.plain().total_cmp(&right.plain()));
    times.dedup_by(|next, kept| next.plain() - kept.plain() < SAME * program.end);
    times.into()
}

/// When the samples for order amplitudes begin.
pub fn orders_from<S: Scalar>(row: &Row<S>, program: &Program) -> S {
    let off = S::splat(program.off);
    (off - S::splat(EARLIER) * (off - program.last_revolutions(row.omega_set))).max(S::splat(program.on))
}

fn add_uniform<S: Scalar>(times: &mut Vec<S>, from: S, to: S, count: usize) {
    times.extend((1..=count).map(|k| from + (to - from) * S::splat(k as f64) / S::splat(count as f64)));
}

//! Times at which a speed passes a level, located inside the steps.

use super::Signal;
use crate::solve::{Record, Retrace, Seat, root};

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

/// The time at which `sign` times a signal (omega_m or omega_l) passes `level` after `from`; NaN where it never does.
pub fn crossing<const N: usize>(
    seat: &Seat<N>,
    retrace: &mut dyn Retrace<N>,
    signal: Signal,
    sign: f64,
    level: f64,
    window: (f64, f64),
    wanted: Wanted,
) -> f64 {
    let value = |record: &Record<N>| sign * if signal == Signal::OmegaM { record.state[1] } else { record.omega_l };
    let from = seat.records.partition_point(|record| record.t < window.0);
    let to = seat.records.partition_point(|record| record.t <= window.1);
    let Some(records) = seat.records.get(from..to) else { return f64::NAN };
    let passes = |index: &usize| {
        let (start, end) = (value(&records[index - 1]), value(&records[*index]));
        match wanted {
            Wanted::FirstUp => start < level && end >= level,
            _ => start > level && end <= level,
        }
    };
    let mut steps = 1..records.len().max(1);
    let found = if wanted == Wanted::LastDown { steps.rfind(passes) } else { steps.find(passes) };
    found.map_or(f64::NAN, |index| {
        let (start, end) = (&records[index - 1], &records[index]);
        if end.step == 0.0 {
            return end.t;
        }
        let dense = retrace.dense(seat, start, end.step);
        let excess = |share: f64| {
            let state = dense.at(share);
            sign * signal.value(seat, retrace, dense.t + share * dense.step, &state) - level
        };
        dense.t + dense.step * root(excess, value(start) - level, value(end) - level)
    })
}

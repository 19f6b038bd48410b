//! Largest values of watched signals over windows: those at the ends of the steps, and inside the steps that may hold
//! a larger one.

use super::seat::{Mark, Seat};
use super::watch::{Candidate, Watched};
use crate::real::Scalar;
use std::ops::Range;

/// Looks that an extreme asks for at once: fewer take more rounds, more are wasted where the first decides.
const AHEAD: usize = 2;

const HIGHEST: &[f64] = &[1.0];
const LOWEST: &[f64] = &[-1.0];
const FARTHEST: &[f64] = &[1.0, -1.0];

/// The largest product of a signal and any of the signs between two marks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extreme {
    /// The signal.
    pub signal: Watched,
    signs: &'static [f64],
    window: (Mark, Mark),
}

impl Extreme {
    /// The largest magnitude.
    pub fn farthest(signal: Watched, window: (Mark, Mark)) -> Self {
        Self { signal, signs: FARTHEST, window }
    }

    /// The largest value, and the negative of the smallest.
    pub fn both_ends(signal: Watched, window: (Mark, Mark)) -> [Self; 2] {
        [HIGHEST, LOWEST].map(|signs| Self { signal, signs, window })
    }

    /// Asks for closer looks at the steps of a finished row that may decide it; nothing once it is known.
    pub fn ask<S: Scalar, const N: usize>(&self, seat: &mut Seat<S, N>) {
        let Some((mut best, intervals)) = self.without_looks(seat) else { return };
        let mut ahead = 0;
        for nth in 0..seat.ranked.len() {
            let (interval, candidate) = &mut seat.candidates[seat.ranked[nth]];
            if candidate.at_most <= best.plain() {
                return;
            }
            if !intervals.contains(interval) || !self.concerns(candidate) {
                continue;
            }
            match candidate.peak {
                Some(peak) if ahead == 0 => best = larger(best, peak),
                _ => {
                    candidate.asked = candidate.peak.is_none();
                    ahead += 1;
                }
            }
            if ahead == AHEAD {
                return;
            }
        }
    }

    /// The value, once nothing is asked for any more; NaN where no time lies between the marks or the row did not get
    /// that far.
    pub fn value<S: Scalar, const N: usize>(&self, seat: &Seat<S, N>) -> S {
        let Some((mut best, intervals)) = self.without_looks(seat) else { return S::splat(f64::NAN) };
        for &place in &seat.ranked {
            let (interval, candidate) = &seat.candidates[place];
            if candidate.at_most <= best.plain() {
                break;
            }
            if let Some(peak) = candidate.peak.filter(|_| intervals.contains(interval) && self.concerns(candidate)) {
                best = larger(best, peak);
            }
        }
        best
    }

    /// The value at the ends of the steps, and the intervals of the window.
    fn without_looks<S: Scalar, const N: usize>(&self, seat: &Seat<S, N>) -> Option<(S, Range<usize>)> {
        let intervals = seat.between(self.window.0, self.window.1);
        let ranges = seat.ranges.get(intervals.clone())?;
        if seat.time_of(self.window.0) >= seat.time_of(self.window.1) {
            return None;
        }
        let mut best = S::splat(f64::NEG_INFINITY);
        for range in ranges.iter().map(|range| range[self.signal as usize]) {
            for &sign in self.signs {
                best = larger(best, if sign > 0.0 { range.high } else { -range.low });
            }
        }
        Some((best, intervals))
    }

    fn concerns<S, const N: usize>(&self, candidate: &Candidate<S, N>) -> bool {
        candidate.signal == self.signal && self.signs.contains(&candidate.sign)
    }
}

/// Ranks the candidates of a finished row that may decide any of the extremes by what they promise.
pub(super) fn rank<S: Scalar, const N: usize>(extremes: &[Extreme], seat: &mut Seat<S, N>) {
    for extreme in extremes {
        let Some((best, intervals)) = extreme.without_looks(seat) else { continue };
        let may_decide = |(interval, candidate): &(usize, Candidate<S, N>)| {
            candidate.at_most > best.plain() && intervals.contains(interval) && extreme.concerns(candidate)
        };
        let Seat { candidates, ranked, .. } = &mut *seat;
        ranked.extend((0..candidates.len()).filter(|&place| may_decide(&candidates[place])));
    }
    let Seat { candidates, ranked, .. } = seat;
    let at_most = |place: &usize| candidates[*place].1.at_most;
    ranked.sort_unstable_by(|left, right| at_most(right).total_cmp(&at_most(left)).then(left.cmp(right)));
    ranked.dedup();
}

/// The larger of two numbers; NaN only where both are.
fn larger<S: Scalar>(left: S, right: S) -> S {
    if right.plain() > left.plain() || left.plain().is_nan() { right } else { left }
}

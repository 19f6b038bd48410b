//! Corners of the laws, located inside the step and landed on: no step runs over one.
//!
//! A step is taken on the pieces of the laws that are in force where it begins. Where it leaves one of them, be it for
//! a moment between its ends, it is repeated to end at the corner, and the next step begins on the next piece. The laws
//! are continuous: slopes, step size and derivatives by parameters go on as they are.

use super::Method;
use super::advance::Advance;
use super::events::{EARLIEST, Landing};
use super::record::Dense;
use super::replay::Lane;
use super::root::root;
use super::stepper::Trial;
use crate::model::{CORNERS, Model};
use crate::real::{Mask, Path, Real};

/// Parts of a step at whose ends a margin is looked at where it is not simply used up from start to end.
const PARTS: usize = 8;
/// Stages may straddle a bend that just leaves a piece: a margin that dips to this share of its range is looked at.
const CLOSE: f64 = 0.25;
/// How far behind a corner the next piece is asked for, as a share of the step.
const BEHIND: f64 = 1e-6;

impl<P: Path, M: Model<N>, T: Method, const N: usize> Advance<'_, P, M, T, N> {
    /// How far a piece may be left, in natural sizes, before the step is cut short.
    fn leeway(&self) -> f64 {
        self.demand.rtol * self.demand.floor
    }

    /// Lanes whose step may have left a piece.
    #[inline(always)]
    pub(super) fn off_piece(&self, accepted: <P::Lanes as Real>::Mask, trial: &Trial<P::Lanes, N>) -> u64 {
        if !self.stepper.cornered {
            return 0;
        }
        let number = <P::Lanes as Real>::Plain::splat;
        let [least, most] = trial.margins;
        let range = most - least;
        let dips = least.lt(self.stepper.margin.min(trial.rates.margin)) & number(self.leeway()).lt(range);
        let left = least.lt(number(-self.leeway()));
        (accepted & (left | (dips & least.lt(range * number(CLOSE))))).to_bits()
    }

    /// Where in the step the first corner lies, and what is in force behind it.
    pub(super) fn first_corner(&mut self, lane: usize, dense: &Dense<Lane<P>, N>) -> Option<(f64, Landing)> {
        let (branch, enough) = (self.branch(lane), -self.leeway());
        let seat = self.seats[lane].take()?;
        self.replay.load(&seat, self.harmonics);
        let mut corners = |share: f64, held: bool| {
            let state = dense.at(Lane::<P>::splat(share));
            self.replay.corners(&seat, dense.t + share * dense.step, &state, branch, held)
        };
        let (start, end) = (corners(0.0, true), corners(1.0, true));
        let mut found = Vec::new();
        for corner in (0..CORNERS).filter(|&corner| start[corner] > 0.0 && end[corner] < enough) {
            found.push((root(|share| corners(share, true)[corner], start[corner], end[corner]), corner));
        }
        if found.is_empty() {
            let mut samples = [start; PARTS + 1];
            for (part, sample) in samples.iter_mut().enumerate().skip(1) {
                *sample = corners(part as f64 / PARTS as f64, true);
            }
            for corner in 0..CORNERS {
                let left = samples.map(|sample| sample[corner]);
                let share = used_up(&left, |share| corners(share, true)[corner], enough);
                found.extend(share.map(|share| (share, corner)));
            }
        }
        let first = found.iter().map(|corner| corner.0).min_by(f64::total_cmp);
        let next = first.map(|first| {
            let behind = corners((first + BEHIND).min(1.0), false);
            let mut next = branch;
            for &(_, corner) in found.iter().filter(|corner| corner.0 <= first + BEHIND) {
                next.pieces[corner] = behind[corner] as i8;
            }
            (first.max(EARLIEST), Landing::Corner(next))
        });
        self.seats[lane] = Some(seat);
        next.filter(|next| next.1 != Landing::Corner(branch))
    }
}

/// Where a margin is used up first, from its values at the ends of equal parts of the step.
fn used_up(samples: &[f64; PARTS + 1], mut left: impl FnMut(f64) -> f64, enough: f64) -> Option<f64> {
    let place = |part: usize| part as f64 / PARTS as f64;
    if let Some(part) = (1..=PARTS).find(|&part| samples[part] < enough) {
        let (mut end, mut at_end) = (place(part), samples[part]);
        if samples[part - 1] > 0.0 {
            return Some(between(left, [place(part - 1), end], [samples[part - 1], at_end]));
        }
        // The piece has just been entered: it may be left after a moment, or at once.
        for _ in 0..20 {
            let middle = 0.5 * (place(part - 1) + end);
            let value = left(middle);
            if value > 0.0 {
                return Some(between(left, [middle, end], [value, at_end]));
            }
            (end, at_end) = (middle, value);
        }
        return Some(place(part - 1));
    }
    let lowest = (1..PARTS).min_by(|&one, &other| samples[one].total_cmp(&samples[other]))?;
    let (before, here, after) = (samples[lowest - 1], samples[lowest], samples[lowest + 1]);
    let shift = 0.5 * (before - after) / (before - here + (after - here));
    let inside = shift.abs() <= 1.0;
    if before <= 0.0 || !inside {
        return None;
    }
    let bottom = (lowest as f64 + shift) / PARTS as f64;
    let value = left(bottom);
    (value < enough).then(|| between(left, [place(lowest - 1), bottom], [before, value]))
}

/// The root of a function between two places at which its signs differ.
fn between(mut function: impl FnMut(f64) -> f64, places: [f64; 2], values: [f64; 2]) -> f64 {
    let place = |share: f64| (places[1] - places[0]).mul_add(share, places[0]);
    place(root(|share| function(place(share)), values[0], values[1]))
}

//! Corners of the laws, located inside the step and landed on: no step runs over one.
//!
//! A step is taken on the pieces of the laws that are in force where it begins. Where it leaves one of them, be it for
//! a moment between its ends, it is repeated to end at the corner, and the next step begins on the next piece. The laws
//! are continuous: slopes, step size and derivatives by parameters go on as they are.
//!
//! Most steps simply run over a corner: those corners are located in all lanes together. What is left, steps that leave
//! a piece for a moment or one they have just come to, is looked at lane by lane.

use super::Method;
use super::advance::{Advance, Plain};
use super::events::{EARLIEST, Landing};
use super::record::Branch;
use super::replay::Lane;
use super::root::{PARTS, Search, used_up};
use super::stepper::{Stepper, Trial};
use crate::model::{CORNERS, Drivetrain, Model, Pieces};
use crate::real::{Mask, Path, Real, Task};
use std::marker::PhantomData;

/// How far behind a corner the next piece is asked for, as a share of the step.
const BEHIND: f64 = 1e-6;
/// Where corners are first looked for in a step that begins on one.
const AWAY: f64 = 0.125;

/// The corners over which lanes simply run.
pub(super) struct Turns<R: Real> {
    /// The lanes.
    lanes: u64,
    /// Where in the step.
    shares: R::Plain,
    /// What is in force behind them.
    next: Pieces<R::Plain>,
}

impl<P: Path, M: Model<N>, T: Method, const N: usize> Advance<'_, P, M, T, N> {
    /// How far a piece may be left or a reserve overdrawn, in natural sizes, before the step is cut short.
    pub(super) fn leeway(&self) -> f64 {
        self.demand.rtol * self.demand.floor
    }

    /// Lanes whose step may have left a piece.
    #[inline(always)]
    pub(super) fn off_piece(&self, accepted: <P::Lanes as Real>::Mask, trial: &Trial<P::Lanes, N>) -> u64 {
        if self.stepper.held.is_none() {
            return 0;
        }
        let (margin, leeway) = (&self.stepper.margin, self.leeway());
        let left = margin.least().lt(Plain::<P>::splat(-leeway));
        (accepted & (left | margin.dips(trial.rates.margin, leeway))).to_bits()
    }

    /// The corners over which the step last interpolated runs in these lanes.
    #[inline(always)]
    pub(super) fn turns(&self, lanes: u64, step: Plain<P>, trial: &Trial<P::Lanes, N>) -> Option<Turns<P::Lanes>> {
        let (end, leeway) = (trial.rates.margin, self.leeway());
        let left = <P::Lanes as Real>::Mask::from_bits(lanes) & end.lt(Plain::<P>::splat(-leeway));
        if !left.any() {
            return None;
        }
        let stepper = &self.stepper;
        Some(P::Lanes::apart(FindTurns { stepper, lanes: left, step, end, leeway, model: PhantomData::<M> }))
    }

    /// Where in the step the first corner lies in a lane, and what is in force behind it.
    pub(super) fn first_corner(
        &mut self,
        lane: usize,
        turns: Option<&Turns<P::Lanes>>,
        step: &Plain<P>,
    ) -> Option<(f64, Landing)> {
        let branch = self.branch(lane);
        let found = match turns.filter(|turns| turns.lanes >> lane & 1 == 1) {
            Some(Turns { shares, next, .. }) => {
                let pieces = std::array::from_fn(|corner| next[corner].get(lane) as i8);
                Some((shares.get(lane), Branch { pieces, ..branch }))
            }
            None => self.hidden_corner(lane, branch, step),
        };
        found.filter(|found| found.1 != branch).map(|(share, next)| (share.max(EARLIEST), Landing::Corner(next)))
    }

    /// The same for corners that the ends of the step do not show, or not all of them: one that is left at once and one
    /// that is left later.
    fn hidden_corner(&mut self, lane: usize, branch: Branch, step: &Plain<P>) -> Option<(f64, Branch)> {
        let (dense, enough) = (self.dense_in(lane, step), -self.leeway());
        let seat = self.seats[lane].take()?;
        self.replay.load(&seat);
        let mut corners = |share: f64, held: bool| {
            let state = dense.at(Lane::<P>::splat(share));
            self.replay.corners(&seat, dense.t + share * dense.step, &state, branch, held)
        };
        let samples: [_; PARTS + 1] = std::array::from_fn(|part| corners(part as f64 / PARTS as f64, true));
        let mut found = Vec::new();
        for corner in 0..CORNERS {
            let left = samples.map(|sample| sample[corner]);
            let share = used_up(&left, |share| corners(share, true)[corner], enough);
            found.extend(share.map(|share| (share, corner)));
        }
        let first = found.iter().map(|corner| corner.0).min_by(f64::total_cmp);
        let next = first.map(|first| {
            let behind = corners((first + BEHIND).min(1.0), false);
            let mut next = branch;
            for &(_, corner) in found.iter().filter(|corner| corner.0 <= first + BEHIND) {
                next.pieces[corner] = behind[corner] as i8;
            }
            (first, next)
        });
        self.seats[lane] = Some(seat);
        next
    }
}

struct FindTurns<'a, R: Real, M, const N: usize> {
    stepper: &'a Stepper<R, N>,
    lanes: R::Mask,
    step: R::Plain,
    /// Margins at the end of the step.
    end: R::Plain,
    leeway: f64,
    model: PhantomData<M>,
}

impl<R: Real, M: Model<N>, const N: usize> FindTurns<'_, R, M, N> {
    #[inline(always)]
    fn margin(&self, share: R::Plain) -> R::Plain {
        let (t, state) = self.stepper.moment::<M>(self.step, share);
        M::rates(&self.stepper.drive(), t, &state).margin
    }

    /// The pieces of the laws on which the lanes are.
    #[inline(always)]
    fn pieces(&self, share: R::Plain) -> Pieces<R::Plain> {
        let (t, state) = self.stepper.moment::<M>(self.step, share);
        M::corners(&Drivetrain { pieces: None, ..self.stepper.drive() }, t, &state)
    }
}

impl<R: Real, M: Model<N>, const N: usize> Task for FindTurns<'_, R, M, N> {
    type Output = Turns<R>;

    #[inline(always)]
    fn run(self) -> Turns<R> {
        let number = R::Plain::splat;
        let Self { stepper, lanes, leeway, .. } = self;
        // Steps end behind the corner, by no more than the leeway.
        let aim = number(0.5 * leeway);
        let on_corner = lanes & stepper.margin.start.le(number(leeway));
        let (mut place, mut before) = (R::Plain::zero(), stepper.margin.start);
        if on_corner.any() {
            place = R::Plain::select(on_corner, number(AWAY), place);
            before = R::Plain::select(on_corner, self.margin(place), before);
        }
        // An input that bends may bring a corner into play that was none where the step before ended.
        let lanes = lanes & R::Plain::zero().lt(before) & before.le(number(f64::MAX));
        let mut search = Search::new(lanes, [place, number(1.0)], [before + aim, self.end + aim], 0.5 * leeway);
        while let Some(share) = search.next() {
            search.take(share, self.margin(share) + aim);
        }
        let shares = search.found();
        let next = self.pieces((shares + number(BEHIND)).min(number(1.0)));
        Turns { lanes: lanes.to_bits(), shares, next }
    }
}

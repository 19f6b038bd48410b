//! Time with the windup outside the fitted range of the spring: the ends of an excursion are located inside the step.

use super::Method;
use super::advance::{Advance, Plain};
use super::interpolant::ALL_STATES;
use super::root::Search;
use super::stepper::{Stepper, Trial};
use super::watch::Watched;
use crate::model::{Base, Model};
use crate::real::{Mask, Path, Real, Task};
use std::marker::PhantomData;

/// Parts of a step that are looked at one by one, each divided at its turning point.
const PARTS: usize = 4;
/// Distance from the range's end [rad] that is as good as none.
const ENOUGH: f64 = 1e-12;

impl<P: Path, M: Model<N>, T: Method, const N: usize> Advance<'_, P, M, T, N> {
    /// Adds the time that the accepted steps spend outside.
    #[inline(always)]
    pub(super) fn count_outside(
        &mut self,
        accepted: <P::Lanes as Real>::Mask,
        step: Plain<P>,
        trial: &Trial<P::Lanes, N>,
    ) {
        if const { matches!(M::BASE, Base::OneInertia) } || !self.demand.outside {
            return;
        }
        let stepper = &self.stepper;
        let limit = stepper.constants.phi_max.plain();
        let [low, high] = stepper.watch.bounds(Watched::Windup, step, &trial.rates, &stepper.constants);
        let lanes = accepted & <P::Lanes as Real>::Mask::from_bits(self.occupied);
        let touched = lanes & limit.lt(high.max(-low));
        if !touched.any() {
            return;
        }
        let wholly = touched & (limit.lt(low) | high.lt(-limit));
        let mut share = Plain::<P>::select(wholly, Plain::<P>::splat(1.0), Plain::<P>::zero());
        let partly = touched & !wholly;
        if partly.any() {
            self.stepper.interpolate::<M, T>(step, ALL_STATES);
            let stepper = &self.stepper;
            let found = P::Lanes::apart(ShareOutside { stepper, lanes: partly, step, model: PhantomData::<M> });
            share = Plain::<P>::select(partly, found, share);
        }
        self.stepper.watch.add_outside(touched, share * step);
    }
}

/// The share of the step last interpolated that lies outside.
struct ShareOutside<'a, R: Real, M, const N: usize> {
    stepper: &'a Stepper<R, N>,
    lanes: R::Mask,
    step: R::Plain,
    model: PhantomData<M>,
}

/// A place in the step.
#[derive(Clone, Copy)]
struct Place<V> {
    share: V,
    /// How far outside the windup is [rad].
    excess: V,
    rate: V,
}

impl<R: Real, M: Model<N>, const N: usize> ShareOutside<'_, R, M, N> {
    #[inline(always)]
    fn look(&self, share: R::Plain) -> Place<R::Plain> {
        let Self { stepper, step, .. } = self;
        R::apart(Look::<R, M, N> { stepper, step: *step, share, model: PhantomData })
    }

    /// How much of the part between two places lies outside, where no more than one end of an excursion does.
    #[inline(always)]
    fn between(&self, start: Place<R::Plain>, end: Place<R::Plain>) -> R::Plain {
        let zero = R::Plain::zero();
        let leaves = start.excess.le(zero) & zero.lt(end.excess);
        let returns = end.excess.le(zero) & zero.lt(start.excess);
        let whole = R::Plain::select(zero.lt(start.excess), end.share - start.share, zero);
        let crossing = self.lanes & (leaves | returns);
        if !crossing.any() {
            return whole;
        }
        let mut search = Search::new(crossing, [start.share, end.share], [start.excess, end.excess], ENOUGH);
        while let Some(share) = search.next() {
            search.take(share, self.look(share).excess);
        }
        let found = search.found();
        let crossed = R::Plain::select(leaves, end.share - found, found - start.share);
        R::Plain::select(crossing, crossed, whole)
    }
}

impl<R: Real, M: Model<N>, const N: usize> Task for ShareOutside<'_, R, M, N> {
    type Output = R::Plain;

    #[inline(always)]
    fn run(self) -> R::Plain {
        let number = R::Plain::splat;
        let mut total = R::Plain::zero();
        let mut start = self.look(R::Plain::zero());
        for part in 1..=PARTS {
            let end = self.look(number(part as f64 / PARTS as f64));
            let width = number(1.0 / PARTS as f64);
            let turns = (start.rate * end.rate).lt(R::Plain::zero());
            let turning = start.rate / (start.rate - end.rate);
            let middle = R::Plain::select(turns, turning, number(0.5)).mul_add(width, start.share);
            let middle = self.look(middle);
            total = total + self.between(start, middle) + self.between(middle, end);
            start = end;
        }
        total
    }
}

struct Look<'a, R: Real, M, const N: usize> {
    stepper: &'a Stepper<R, N>,
    step: R::Plain,
    share: R::Plain,
    model: PhantomData<M>,
}

impl<R: Real, M: Model<N>, const N: usize> Task for Look<'_, R, M, N> {
    type Output = Place<R::Plain>;

    #[inline(always)]
    fn run(self) -> Place<R::Plain> {
        let Self { stepper, step, share, .. } = self;
        let (t, state) = stepper.moment::<M>(step, share);
        let rates = M::rates(&stepper.drive(), t, &state);
        let (windup, rate) = (rates.windup.plain(), rates.windup_rate.plain());
        let excess = windup.abs() - stepper.constants.phi_max.plain();
        let rate = R::Plain::select(windup.lt(R::Plain::zero()), -rate, rate);
        Place { share, excess, rate }
    }
}

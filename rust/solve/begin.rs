//! What a step begins with: its first slopes, and the pieces of the laws on which the lanes lie.

use super::integrals::INTEGRALS;
use super::slack::left;
use super::stepper::Stepper;
use crate::model::{Model, Rates};
use crate::real::{Real, Task};
use std::marker::PhantomData;

impl<R: Real, const N: usize> Stepper<R, N> {
    /// Puts the lanes on the pieces on which they lie.
    pub fn settle<M: Model<N>>(&mut self, lanes: R::Mask) {
        if self.held.is_some() {
            R::apart(Settle::<R, M, N>::of(self, lanes));
        }
    }

    /// Lets the shafts slide the way they move, on the pieces on which the lanes lie.
    #[inline(always)]
    pub fn slide<M: Model<N>>(&mut self, lanes: R::Mask) {
        let zero = R::zero();
        for (direction, &speed) in self.directions.iter_mut().zip(M::STICKING) {
            let (one, speed) = (R::splat(1.0), self.state[speed]);
            let forward = R::select(zero.lt(speed), one, zero);
            *direction = R::select(speed.lt(zero), -one, forward);
        }
        self.settle::<M>(lanes);
    }

    /// Evaluates the first slope anew in the given lanes.
    #[inline(always)]
    pub fn refresh<M: Model<N>>(&mut self, lanes: R::Mask) -> Rates<R, N> {
        R::apart(Refresh::<R, M, N>::of(self, lanes))
    }

    /// Evaluates the derivatives of the first slope anew in the given lanes, where an input bends without a jump.
    pub fn refresh_tangents<M: Model<N>>(&mut self, lanes: R::Mask) {
        R::apart(RefreshTangents::<R, M, N>::of(self, lanes));
    }

    /// The integrands at the start of the step in one lane.
    pub fn integrands_in(&self, lane: usize) -> [f64; INTEGRALS] {
        std::array::from_fn(|index| self.starting[index].plain().get(lane))
    }

    /// Takes rates as the first slope in the given lanes.
    #[inline(always)]
    pub(super) fn begin<M: Model<N>, const HELD: bool>(&mut self, lanes: R::Mask, rates: &Rates<R, N>) {
        for index in 0..self.used::<M>() {
            self.slopes[0][index] = R::select(lanes, rates.slope[index], self.slopes[0][index]);
        }
        self.windup = R::select(lanes, rates.windup, self.windup);
        if HELD && self.held.is_some() {
            self.margin.begin(lanes, rates.margin);
        }
        if M::STICKS {
            let left = left::<R, M, N>(&self.directions, &self.state, rates);
            self.slack.iter_mut().zip(left).for_each(|(course, left)| course.begin(lanes, left));
        }
        self.watch.begin(lanes, rates, &self.constants);
        if self.integrands.count() > 0 {
            let mut values = [R::zero(); INTEGRALS];
            self.integrands.add(R::splat(1.0), rates, &self.constants, &mut values);
            for index in 0..self.integrands.count() {
                self.starting[index] = R::select(lanes, values[index], self.starting[index]);
            }
        }
    }
}

/// Work on some lanes of a stepper, in a function of its own.
macro_rules! in_lanes {
    ($name:ident($stepper:ident, $lanes:ident) -> $output:ty $body:block) => {
        struct $name<'a, R: Real, M, const N: usize> {
            stepper: &'a mut Stepper<R, N>,
            lanes: R::Mask,
            model: PhantomData<M>,
        }

        impl<'a, R: Real, M: Model<N>, const N: usize> $name<'a, R, M, N> {
            #[inline(always)]
            fn of(stepper: &'a mut Stepper<R, N>, lanes: R::Mask) -> Self {
                Self { stepper, lanes, model: PhantomData }
            }
        }

        impl<R: Real, M: Model<N>, const N: usize> Task for $name<'_, R, M, N> {
            type Output = $output;

            #[inline(always)]
            fn run(self) -> $output {
                let Self { stepper: $stepper, lanes: $lanes, .. } = self;
                $body
            }
        }
    };
}

in_lanes! {
    Refresh(stepper, lanes) -> Rates<R, N> {
        let rates = stepper.rates::<M>(R::constant(stepper.t), &stepper.state);
        stepper.begin::<M, true>(lanes, &rates);
        rates
    }
}

in_lanes! {
    Settle(stepper, lanes) -> () {
        let found = M::corners(&stepper.drive_on::<false>(), R::constant(stepper.t), &stepper.state);
        for (piece, own) in stepper.held.iter_mut().flat_map(|pieces| pieces.iter_mut()).zip(found) {
            *piece = R::Plain::select(lanes, own, *piece);
        }
    }
}

in_lanes! {
    RefreshTangents(stepper, lanes) -> () {
        let rates = stepper.rates::<M>(R::constant(stepper.t), &stepper.state);
        for index in 0..N {
            renew(lanes, &mut stepper.slopes[0][index], rates.slope[index]);
        }
        let mut values = [R::zero(); INTEGRALS];
        stepper.integrands.add(R::splat(1.0), &rates, &stepper.constants, &mut values);
        for index in 0..stepper.integrands.count() {
            renew(lanes, &mut stepper.starting[index], values[index]);
        }
    }
}

/// Takes over derivatives in the given lanes.
#[inline(always)]
fn renew<R: Real>(lanes: R::Mask, old: &mut R, new: R) {
    *old = R::select(lanes, old.with_tangent(new.tangent()), *old);
}

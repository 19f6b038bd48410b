//! The dense output of an attempted step.

use super::Method;
use super::record::{DENSE_TERMS, value_at};
use super::stages::unrolled;
use super::stepper::Stepper;
use crate::model::Model;
use crate::real::{Real, Task};
use std::marker::PhantomData;

/// Every state of a model, as a set of bits.
pub const ALL_STATES: u64 = u64::MAX;

/// Share of the bound of stability up to which the dense output of a motion that dies away does so as well: at -5 that of
/// `dop853` strays by nine tenths of what is left of it, at -2.75 by a thousandth.
pub(super) const FOLLOWED: f64 = 0.55;

impl<R: Real, const N: usize> Stepper<R, N> {
    /// Makes polynomials of the attempted step, for the states that are wanted.
    #[inline(always)]
    pub fn interpolate<M: Model<N>, T: Method>(&mut self, step: R::Plain, wanted: u64) {
        R::apart(Interpolate::<R, M, T, N> { stepper: self, step, wanted, types: PhantomData });
    }

    /// Evaluates a stage that the dense output needs.
    #[inline(always)]
    fn further_stage<M: Model<N>, T: Method>(&mut self, stage: usize, step: R::Plain) {
        let state = self.stage_state::<M, T>(stage, step);
        let t = self.stage_time::<T>(stage, step);
        self.slopes[stage] = self.rates::<M>(R::constant(t), &state).slope;
    }

    /// Makes the polynomial of a state whose rate takes no more than speeds, from the rates of those.
    #[inline(always)]
    fn interpolate_position<M: Model<N>, T: Method>(&mut self, index: usize, step: R::Plain) {
        let mut sums = [R::zero(); DENSE_TERMS];
        unrolled!(J => {
            if let Some(&weights) = T::POSITION_DENSE.get(J) && !weights.is_empty() {
                let acceleration = M::position_rates(&self.constants, &self.slopes[J])[index];
                for power in 0..weights.len() {
                    if weights[power] != 0.0 {
                        sums[power + 2] = acceleration.mul_add_plain(R::Plain::splat(weights[power]), sums[power + 2]);
                    }
                }
            }
        });
        for sum in &mut sums {
            *sum = sum.mul_add_plain(step, R::zero());
        }
        sums[0] = self.state[index];
        sums[1] = self.slopes[0][index];
        self.polynomials[index] = sums;
    }

    /// The wanted states after a share of the step last interpolated; the others are NaN.
    #[inline(always)]
    pub fn inside(&self, step: R::Plain, share: R, wanted: u64) -> [R; N] {
        R::apart(Inside { polynomials: &self.polynomials, step, share, wanted })
    }

    /// Time and state after a share of the step last interpolated.
    #[inline(always)]
    pub(super) fn moment<M: Model<N>>(&self, step: R::Plain, share: R::Plain) -> (R, [R; N]) {
        let state = self.inside(step, R::constant(share), (1 << self.used::<M>()) - 1);
        (R::constant(share.mul_add(step, self.t)), state)
    }
}

struct Inside<'a, R: Real, const N: usize> {
    polynomials: &'a [[R; DENSE_TERMS]; N],
    step: R::Plain,
    share: R,
    wanted: u64,
}

impl<R: Real, const N: usize> Task for Inside<'_, R, N> {
    type Output = [R; N];

    #[inline(always)]
    fn run(self) -> [R; N] {
        let mut state = [R::splat(f64::NAN); N];
        for index in (0..N).filter(|index| self.wanted >> index & 1 == 1) {
            state[index] = value_at(&self.polynomials[index], self.step, self.share);
        }
        state
    }
}

struct Interpolate<'a, R: Real, M, T, const N: usize> {
    stepper: &'a mut Stepper<R, N>,
    step: R::Plain,
    wanted: u64,
    types: PhantomData<(M, T)>,
}

impl<R: Real, M: Model<N>, T: Method, const N: usize> Task for Interpolate<'_, R, M, T, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { stepper, step, wanted, .. } = self;
        let positions = if T::POSITION_DENSE.is_empty() { 0 } else { M::POSITIONS };
        unrolled!(INDEX => {
            if const { M::POSITIONS >> INDEX & 1 == 1 } && positions & wanted >> INDEX & 1 == 1 {
                stepper.interpolate_position::<M, T>(INDEX, step);
            }
        });
        let wanted = wanted & !positions;
        if wanted == 0 {
            return;
        }
        if const { M::HIDDEN > 0 } {
            for stage in T::STAGES..T::STAGES + T::DENSE_STAGES {
                stepper.further_stage::<M, T>(stage, step);
            }
        } else {
            // One by one: a loop computes the first terms of all of them in advance and keeps them in memory.
            unrolled!(S => {
                if const { S >= T::STAGES && S < T::STAGES + T::DENSE_STAGES } {
                    stepper.further_stage::<M, T>(S, step);
                }
            });
        }
        for index in (0..stepper.used::<M>()).filter(|index| wanted >> index & 1 == 1) {
            let mut sums = [R::zero(); DENSE_TERMS];
            unrolled!(J => {
                if let Some(&weights) = T::DENSE.get(J) {
                    for power in 0..weights.len() {
                        if weights[power] != 0.0 {
                            let weight = R::Plain::splat(weights[power]);
                            sums[power + 1] = stepper.slopes[J][index].mul_add_plain(weight, sums[power + 1]);
                        }
                    }
                }
            });
            sums[0] = stepper.state[index];
            stepper.polynomials[index] = sums;
        }
    }
}

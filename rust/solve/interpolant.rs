//! The dense output of an attempted step.

use super::Method;
use super::record::{DENSE_TERMS, state_at};
use super::stepper::{Stepper, unrolled};
use crate::model::Model;
use crate::real::{Real, Task};
use std::marker::PhantomData;

/// Every state of a model, as a set of bits.
pub const ALL_STATES: u64 = u64::MAX;

impl<R: Real, const N: usize> Stepper<R, N> {
    /// The attempted step as polynomials in the elapsed share; NaN for states that are not wanted.
    #[inline(always)]
    pub fn dense<M: Model<N>, T: Method>(&mut self, step: R::Plain, wanted: u64) -> [[R; DENSE_TERMS]; N] {
        R::apart(Interpolate::<R, M, T, N> { stepper: self, step, wanted, types: PhantomData })
    }
}

/// States inside a step, as a task of its own.
pub struct StateAt<'a, R, const N: usize> {
    pub coefficients: &'a [[R; DENSE_TERMS]; N],
    pub share: R,
}

impl<R: Real, const N: usize> Task for StateAt<'_, R, N> {
    type Output = [R; N];

    #[inline(always)]
    fn run(self) -> [R; N] {
        state_at(self.coefficients, self.share)
    }
}

struct Interpolate<'a, R: Real, M, T, const N: usize> {
    stepper: &'a mut Stepper<R, N>,
    step: R::Plain,
    wanted: u64,
    types: PhantomData<(M, T)>,
}

impl<R: Real, M: Model<N>, T: Method, const N: usize> Task for Interpolate<'_, R, M, T, N> {
    type Output = [[R; DENSE_TERMS]; N];

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { stepper, step, wanted, .. } = self;
        for stage in T::STAGES..T::STAGES + T::DENSE_STAGES {
            let state = stepper.stage_state::<T>(stage, step);
            let t = stepper.stage_time::<T>(stage, step);
            let is_last = stage == T::STAGES + T::DENSE_STAGES - 1;
            stepper.slopes[stage] = if is_last && wanted & !M::POSITIONS == 0 {
                M::position_rates(&stepper.constants, &state)
            } else {
                stepper.rates::<M>(R::constant(t), &state).slope
            };
        }
        let mut coefficients = [[R::splat(f64::NAN); DENSE_TERMS]; N];
        for index in (0..N).filter(|index| wanted >> index & 1 == 1) {
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
            for power in 1..DENSE_TERMS {
                coefficients[index][power] = sums[power] * R::constant(step);
            }
            coefficients[index][0] = stepper.state[index];
        }
        coefficients
    }
}

//! The dense output of an attempted step.

use super::Method;
use super::record::DENSE_TERMS;
use super::stepper::Stepper;
use crate::model::Model;
use crate::real::{Real, Task};
use std::marker::PhantomData;

impl<R: Real, const N: usize> Stepper<R, N> {
    /// The attempted step as polynomials in the elapsed share, for the lanes that ask for it.
    #[inline(always)]
    pub fn dense<M: Model<N>, T: Method>(&mut self, step: R::Plain) -> [[R; DENSE_TERMS]; N] {
        R::apart(Interpolate::<R, M, T, N> { stepper: self, step, types: PhantomData })
    }
}

struct Interpolate<'a, R: Real, M, T, const N: usize> {
    stepper: &'a mut Stepper<R, N>,
    step: R::Plain,
    types: PhantomData<(M, T)>,
}

impl<R: Real, M: Model<N>, T: Method, const N: usize> Task for Interpolate<'_, R, M, T, N> {
    type Output = [[R; DENSE_TERMS]; N];

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { stepper, step, .. } = self;
        for stage in T::STAGES..T::STAGES + T::DENSE_STAGES {
            let state = stepper.stage_state::<T>(stage, step);
            let t = stepper.stage_time::<T>(stage, step);
            stepper.slopes[stage] = stepper.rates::<M>(R::constant(t), &state).slope;
        }
        let mut coefficients = [[R::zero(); DENSE_TERMS]; N];
        for index in 0..N {
            let mut sums = [R::zero(); DENSE_TERMS];
            for (slopes, weights) in stepper.slopes.iter().zip(T::DENSE) {
                for (power, &weight) in weights.iter().enumerate() {
                    sums[power + 1] = slopes[index].mul_add_plain(R::Plain::splat(weight), sums[power + 1]);
                }
            }
            for power in 1..DENSE_TERMS {
                coefficients[index][power] = sums[power] * R::constant(step);
            }
            coefficients[index][0] = stepper.state[index];
        }
        coefficients
    }
}

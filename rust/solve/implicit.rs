//! What a Rosenbrock step does beyond an explicit one.
//!
//! Derivatives by a parameter obey the differentiated system of the stage: the same matrix, and on the right-hand side
//! the derivative of the matrix times what the stage contributes. That is a second derivative of the equations: a
//! central difference, along the stage, of the derivatives that dual numbers give. A Rosenbrock method loses no order by
//! a matrix that is off by the difference's 1e-8.

use super::Method;
use super::integrals::{GAUSS, INTEGRALS};
use super::interpolant::ALL_STATES;
use super::record::value_at;
use super::stepper::{Stepper, plain};
use super::tableau::Rosenbrock;
use crate::model::Model;
use crate::real::{Real, Task};
use std::marker::PhantomData;

impl<R: Real, const N: usize> Stepper<R, N> {
    /// Derivatives and matrix of a Rosenbrock step.
    #[inline(always)]
    pub(super) fn linearise<M: Model<N>>(&mut self, method: &Rosenbrock, step: R::Plain) {
        R::apart(Linearise::<R, M, N> { stepper: self, method, step, model: PhantomData });
    }

    /// Turns the slope of a Rosenbrock stage into what the stage contributes.
    #[inline(always)]
    pub(super) fn solve_stage<M: Model<N>>(&mut self, method: &Rosenbrock, stage: usize, step: R::Plain) {
        let Some(linear) = &self.linear else { return };
        let mut values = plain(&self.slopes[stage]);
        let lead = step * R::Plain::splat(method.times[stage]);
        for index in 0..N {
            for (earlier, &weight) in self.slopes.iter().zip(method.coupling[stage]) {
                values[index] = earlier[index].plain().mul_add(R::Plain::splat(weight), values[index]);
            }
            values[index] = linear.by_time()[index].mul_add(lead, values[index]);
        }
        linear.solve(&mut values);
        if R::DIFFERENTIATES {
            R::apart(SolveTangents::<R, M, N> { stepper: self, method, stage, step, values, model: PhantomData });
        } else {
            self.slopes[stage] = values.map(R::constant);
        }
    }

    /// Quadratures over the step, by Gauss's rule on the dense output.
    #[inline(always)]
    pub(super) fn integrate<M: Model<N>, T: Method>(&mut self, step: R::Plain) {
        R::apart(Integrate::<R, M, T, N> { stepper: self, step, types: PhantomData });
    }
}

struct Linearise<'a, R: Real, M, const N: usize> {
    stepper: &'a mut Stepper<R, N>,
    method: &'a Rosenbrock,
    step: R::Plain,
    model: PhantomData<M>,
}

impl<R: Real, M: Model<N>, const N: usize> Task for Linearise<'_, R, M, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { stepper, method, step, .. } = self;
        if let Some(mut linear) = stepper.linear.take() {
            linear.differentiate::<R, M>(&stepper.drive(), stepper.t, &stepper.state);
            linear.factorise(step, method.gamma);
            stepper.linear = Some(linear);
        }
    }
}

/// How far along a stage the equations are differenced.
const REACH: f64 = 1e-4;

struct SolveTangents<'a, R: Real, M, const N: usize> {
    stepper: &'a mut Stepper<R, N>,
    method: &'a Rosenbrock,
    stage: usize,
    step: R::Plain,
    values: [R::Plain; N],
    model: PhantomData<M>,
}

impl<R: Real, M: Model<N>, const N: usize> Task for SolveTangents<'_, R, M, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { stepper, method, stage, step, values, .. } = self;
        let mut along = [[R::zero(); N]; 2];
        for (slopes, reach) in along.iter_mut().zip([REACH, -REACH]) {
            let reach = R::Plain::splat(reach) * step;
            let t = reach.mul_add(R::Plain::splat(method.times[stage]), stepper.t);
            let mut state = stepper.state;
            for index in 0..N {
                state[index] = state[index] + R::constant(reach * values[index]);
            }
            *slopes = stepper.rates::<M>(R::constant(t), &state).slope;
        }
        let [ahead, behind] = along;
        let mut tangents = [R::Plain::zero(); N];
        for index in 0..N {
            tangents[index] = stepper.slopes[stage][index].tangent();
            for (earlier, &weight) in stepper.slopes.iter().zip(method.coupling[stage]) {
                tangents[index] = earlier[index].tangent().mul_add(R::Plain::splat(weight), tangents[index]);
            }
            let bend = (ahead[index].tangent() - behind[index].tangent()) * R::Plain::splat(0.5 / REACH);
            tangents[index] = tangents[index] + bend;
        }
        if let Some(linear) = &stepper.linear {
            linear.solve(&mut tangents);
        }
        for index in 0..N {
            stepper.slopes[stage][index] = R::constant(values[index]).with_tangent(tangents[index]);
        }
    }
}

struct Integrate<'a, R: Real, M, T, const N: usize> {
    stepper: &'a mut Stepper<R, N>,
    step: R::Plain,
    types: PhantomData<(M, T)>,
}

impl<R: Real, M: Model<N>, T: Method, const N: usize> Task for Integrate<'_, R, M, T, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { stepper, step, .. } = self;
        stepper.step_integrals = [R::zero(); INTEGRALS];
        stepper.interpolate::<M, T>(step, ALL_STATES);
        for (share, weight) in GAUSS {
            let mut state = [R::zero(); N];
            for index in 0..N {
                state[index] = value_at(&stepper.polynomials[index], step, R::splat(share));
            }
            let t = step.mul_add(R::Plain::splat(share), stepper.t);
            let rates = stepper.rates::<M>(R::constant(t), &state);
            stepper.integrands.add(R::splat(weight), &rates, &stepper.constants, &mut stepper.step_integrals);
        }
    }
}

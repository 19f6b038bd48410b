//! The linear systems of a Rosenbrock step, in lanes: (1/gamma - h J) s = r.
//!
//! J comes column by column from the equations themselves, run with dual numbers. The factors are taken without
//! pivoting: damping and stored energy keep the leading minors away from zero; where one vanishes all the same, the
//! step is rejected like any other that is not finite.

use super::along::Along;
use super::stepper::plain;
use crate::model::terms::Terms;
use crate::model::{Drivetrain, Harmonics, Model};
use crate::real::Real;

/// Derivatives of the right-hand side at the start of a step, and the factors of the step's matrix.
pub struct Linear<V: Real<Plain = V, Lane = f64>, const N: usize> {
    along: Along<V>,
    /// How many states are in use.
    active: usize,
    /// Columns: derivatives by each state, then by time.
    derivatives: Vec<[V; N]>,
    /// Rows of both factors; the diagonal holds the inverse pivots.
    factors: [[V; N]; N],
}

impl<V: Real<Plain = V, Lane = f64>, const N: usize> Linear<V, N> {
    pub fn new<R: Real<Plain = V>>(harmonics: &Harmonics<R>, terms: &Terms<R>, active: usize) -> Self {
        Self {
            along: Along::new(harmonics, terms),
            active,
            derivatives: vec![[V::zero(); N]; active + 1],
            factors: [[V::zero(); N]; N],
        }
    }

    /// Differentiates the right-hand side.
    #[inline(always)]
    pub fn differentiate<R: Real<Plain = V>, M: Model<N>>(&mut self, drive: &Drivetrain<R>, t: V, state: &[R; N]) {
        let held = self.along.hold(drive);
        for (column, derivative) in self.derivatives.iter_mut().enumerate() {
            let along = |index: usize| V::splat(if index == column { 1.0 } else { 0.0 });
            *derivative = held.change::<M, N>((t, along(self.active)), &plain(state), &std::array::from_fn(along));
        }
    }

    /// Derivative by time.
    #[inline(always)]
    pub fn by_time(&self) -> &[V; N] {
        &self.derivatives[self.active]
    }

    /// Factors the matrix of a step.
    #[inline(always)]
    pub fn factorise(&mut self, step: V, gamma: f64) {
        let n = self.active;
        for row in 0..n {
            for column in 0..n {
                let diagonal = V::splat(if row == column { 1.0 / gamma } else { 0.0 });
                self.factors[row][column] = (-step).mul_add(self.derivatives[column][row], diagonal);
            }
        }
        for pivot in 0..n {
            let inverse = V::splat(1.0) / self.factors[pivot][pivot];
            self.factors[pivot][pivot] = inverse;
            for row in pivot + 1..n {
                let factor = self.factors[row][pivot] * inverse;
                self.factors[row][pivot] = factor;
                for column in pivot + 1..n {
                    let reduced = (-factor).mul_add(self.factors[pivot][column], self.factors[row][column]);
                    self.factors[row][column] = reduced;
                }
            }
        }
    }

    /// Solves for one right-hand side, in place.
    #[inline(always)]
    pub fn solve(&self, values: &mut [V; N]) {
        let n = self.active;
        for row in 1..n {
            for column in 0..row {
                values[row] = (-self.factors[row][column]).mul_add(values[column], values[row]);
            }
        }
        for row in (0..n).rev() {
            for column in row + 1..n {
                values[row] = (-self.factors[row][column]).mul_add(values[column], values[row]);
            }
            values[row] = values[row] * self.factors[row][row];
        }
    }
}

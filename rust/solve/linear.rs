//! The linear systems of a Rosenbrock step, in lanes: (1/gamma - h J) s = r.
//!
//! J comes column by column from the equations themselves, run with dual numbers. The factors are taken without
//! pivoting: damping and stored energy keep the leading minors away from zero; where one vanishes all the same, the
//! step is rejected like any other that is not finite.

use crate::model::terms::Terms;
use crate::model::{Drivetrain, Harmonics, Model};
use crate::real::{Dual, Real};

/// Derivatives of the right-hand side at the start of a step, and the factors of the step's matrix.
pub struct Linear<V: Real, const N: usize> {
    harmonics: Harmonics<Dual<V>>,
    terms: Terms<Dual<V>>,
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
            harmonics: harmonics.map(steady),
            terms: terms.map(steady),
            active,
            derivatives: vec![[V::zero(); N]; active + 1],
            factors: [[V::zero(); N]; N],
        }
    }

    /// Differentiates the right-hand side.
    #[inline(always)]
    pub fn differentiate<R: Real<Plain = V>, M: Model<N>>(&mut self, drive: &Drivetrain<R>, t: V, state: &[R; N]) {
        self.harmonics.copy_from(drive.harmonics, steady);
        self.terms.copy_from(drive.terms, steady);
        let drive = Drivetrain {
            constants: &drive.constants.map(steady),
            harmonics: &self.harmonics,
            input: &drive.input.map(steady),
            spring: drive.spring,
            terms: &self.terms,
            directions: &drive.directions.map(steady),
            pieces: drive.pieces,
        };
        for (column, derivative) in self.derivatives.iter_mut().enumerate() {
            let along = |index: usize| V::splat(if index == column { 1.0 } else { 0.0 });
            let mut moved = [Dual::zero(); N];
            for index in 0..N {
                moved[index] = steady(state[index]).with_tangent(along(index));
            }
            let t = Dual::constant(t).with_tangent(along(self.active));
            let rates = M::rates(&drive, t, &moved);
            for index in 0..N {
                derivative[index] = rates.slope[index].tangent();
            }
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

/// A number that the differentiation leaves alone.
#[inline(always)]
fn steady<R: Real<Plain = V>, V: Real<Plain = V, Lane = f64>>(number: R) -> Dual<V> {
    Dual::constant(number.plain())
}

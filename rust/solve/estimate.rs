//! How far an attempted step is off, and how stiff it looks.

use super::Method;
use super::stages::unrolled;
use super::stepper::{Stepper, Trial, plain};
use crate::model::Model;
use crate::real::Real;

/// A sum of fractions over one denominator.
struct Fraction<P> {
    numerator: P,
    denominator: P,
}

impl<P: Real> Fraction<P> {
    /// Adds (error / scale)^2.
    #[inline(always)]
    fn add(&mut self, error: P, scale: P) {
        let square = scale * scale;
        self.numerator = (error * error).mul_add(self.denominator, self.numerator * square);
        self.denominator = self.denominator * square;
    }
}

impl<R: Real, const N: usize> Stepper<R, N> {
    /// The squared error of the attempted step in units of the tolerance.
    #[inline(always)]
    pub fn squared_error<M: Model<N>, T: Method>(
        &self,
        step: R::Plain,
        trial: &Trial<R, N>,
        rtol: f64,
        floor: f64,
    ) -> R::Plain {
        let before = M::sizes(&plain(&self.state), self.windup.plain());
        let after = M::sizes(&plain(&trial.state), trial.rates.windup.plain());
        let mut scales = [R::Plain::zero(); N];
        for index in 0..self.used::<M>() {
            let size = before[index].max(after[index]) + R::Plain::splat(floor * self.scales[index]);
            scales[index] = size;
        }
        let first = self.error_ratio::<M>(T::ERROR, &scales);
        let square = step * step * R::Plain::splat(1.0 / (self.used::<M>() as f64 * rtol * rtol));
        if T::SECOND_ERROR.is_empty() {
            return first * square;
        }
        let second = self.error_ratio::<M>(T::SECOND_ERROR, &scales);
        let mixed = first * first / second.mul_add(R::Plain::splat(0.01), first);
        R::Plain::select(first.le(R::Plain::zero()), R::Plain::zero(), mixed * square)
    }

    /// Sum over the states of (weighted slopes / scale)^2, with one division for the model's own and one for the terms':
    /// the product of all scales could underflow.
    #[inline(always)]
    fn error_ratio<M: Model<N>>(&self, weights: &[f64], scales: &[R::Plain; N]) -> R::Plain {
        let own = N - M::HIDDEN;
        let mut errors = [R::Plain::zero(); N];
        unrolled!(J => {
            if let Some(&weight) = weights.get(J) && weight != 0.0 {
                for index in 0..own {
                    errors[index] = self.slopes[J][index].plain().mul_add(R::Plain::splat(weight), errors[index]);
                }
            }
        });
        let mut sum = Fraction { numerator: errors[0] * errors[0], denominator: scales[0] * scales[0] };
        for index in 1..own {
            sum.add(errors[index], scales[index]);
        }
        if M::HIDDEN == 0 {
            return sum.numerator / sum.denominator;
        }
        let mut hidden = Fraction { numerator: R::Plain::zero(), denominator: R::Plain::splat(1.0) };
        for index in own..self.used::<M>() {
            let mut error = R::Plain::zero();
            unrolled!(J => {
                if let Some(&weight) = weights.get(J) && weight != 0.0 {
                    error = self.slopes[J][index].plain().mul_add(R::Plain::splat(weight), error);
                }
            });
            hidden.add(error, scales[index]);
        }
        sum.numerator / sum.denominator + hidden.numerator / hidden.denominator
    }

    /// Squared distances between the new state and the last stage before it: of the slopes, and of the states.
    #[inline(always)]
    pub fn last_stages<M: Model<N>, T: Method>(&self, step: R::Plain, state: &[R::Plain; N]) -> (R::Plain, R::Plain) {
        let last = T::STAGES - 1;
        let before = plain(&self.stage_state::<M, T>(last - 1, step));
        let mut sums = [R::Plain::zero(); 2];
        for index in 0..self.used::<M>() {
            let weight = R::Plain::splat(1.0 / self.scales[index]);
            let slopes = self.slopes[last][index].plain() - self.slopes[last - 1][index].plain();
            for (sum, difference) in sums.iter_mut().zip([slopes, state[index] - before[index]]) {
                let scaled = difference * weight;
                *sum = scaled.mul_add(scaled, *sum);
            }
        }
        (sums[0], sums[1])
    }
}

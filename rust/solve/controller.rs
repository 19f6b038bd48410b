//! The step size: proportional-integral control of the scaled error, lane by lane.
//!
//! Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section IV.2 of volume II
//! for the controller with memory; gains as usual for explicit methods.

use super::Method;
use crate::real::{Mask, Real};

const LOG2_SAFETY: f64 = -0.15;
const LOG2_LOWEST_ERROR: f64 = -40.0;
const LOG2_STRONGEST_GROWTH: f64 = 2.5;
const LOG2_STRONGEST_CUT: f64 = -2.5;
const PROPORTIONAL: f64 = 0.7;
const INTEGRAL: f64 = 0.2;

/// Memory of the controller: the logarithm of the last accepted error.
#[derive(Clone, Copy)]
pub struct Controller<R> {
    previous: R,
}

/// What became of an attempted step.
pub struct Verdict<R: Real> {
    /// Lanes whose error is within the tolerance.
    pub accepted: R::Mask,
    /// By how much the step may change.
    pub factor: R,
}

impl<R: Real<Lane = f64>> Controller<R> {
    pub fn new() -> Self {
        Self { previous: R::zero() }
    }

    /// Forgets the past of one lane.
    pub fn reset_lane(&mut self, lane: usize) {
        self.previous.set(lane, 0.0);
    }

    /// Judges the squared scaled error of an attempt.
    #[inline(always)]
    pub fn judge<T: Method>(&mut self, squared_error: R) -> Verdict<R> {
        let order = f64::from(T::ERROR_ORDER);
        let accepted = squared_error.le(R::splat(1.0));
        let log = squared_error.rough_log2() * R::splat(0.5);
        let log = R::select(squared_error.lt(R::splat(1e-24)), R::splat(LOG2_LOWEST_ERROR), log);
        let grow = log.mul_add(
            R::splat(-PROPORTIONAL / order),
            self.previous.mul_add(R::splat(INTEGRAL / order), R::splat(LOG2_SAFETY)),
        );
        let cut = log.mul_add(R::splat(-1.0 / order), R::splat(LOG2_SAFETY)).min(R::zero());
        let change = R::select(accepted, grow, cut);
        let change = change.max(R::splat(LOG2_STRONGEST_CUT)).min(R::splat(LOG2_STRONGEST_GROWTH));
        self.previous = R::select(accepted, log, self.previous);
        Verdict { accepted, factor: change.rough_exp2() }
    }
}

/// Steps that end exactly on the next stop instead of just before it, none of them longer than the longest.
#[inline(always)]
pub fn fit_to_stop<R: Real>(step: R, remaining: R, longest: R) -> (R, R::Mask) {
    let landing = remaining.le((step * R::splat(1.01)).min(longest));
    let halved = R::select(remaining.lt(step * R::splat(2.0)), remaining * R::splat(0.5), step);
    (R::select(landing, remaining, halved), landing)
}

/// Lanes whose step no longer moves time.
#[inline(always)]
pub fn stuck<R: Real>(rejected: R::Mask, step: R, t: R) -> u64 {
    let resolution = (t + R::splat(1e-3)) * R::splat(8.0 * f64::EPSILON);
    (rejected & step.le(resolution)).to_bits()
}

#[cfg(test)]
mod tests {
    use super::fit_to_stop;

    #[test]
    fn exact_no_step_is_longer_than_the_longest() {
        assert_eq!(fit_to_stop(1.0, 1.005, f64::INFINITY), (1.005, true));
        assert_eq!(fit_to_stop(1.0, 1.005, 1.0), (0.5025, false));
        assert_eq!(fit_to_stop(1.0, 1.0, 1.0), (1.0, true));
        assert_eq!(fit_to_stop(1.0, 2.5, 1.0), (1.0, false));
    }
}

//! Rows whose steps are held down by stability instead of accuracy, found on the way.
//!
//! The two last stages of an explicit step stand at the same time; how far their slopes are apart, over how far their
//! states are apart, is the largest rate of the motion (Hairer, Wanner 1996, section IV.2). Where it stays at the bound
//! of the method's stability while the steps are short beside the torsional mode, a Rosenbrock method is cheaper.

use super::Method;
use super::advance::{Advance, Plain};
use super::stepper::{Trial, plain};
use crate::model::Model;
use crate::real::{Mask, Path, Real};

/// Short steps that have to look stiff; one that does not takes back as much as one that does adds.
const ENOUGH: f64 = 40.0;
/// Steps shorter than this share of the mode's radian are worth a more expensive one.
pub(super) const SHORT: f64 = 0.12;

impl<P: Path, M: Model<N>, T: Method, const N: usize> Advance<'_, P, M, T, N> {
    /// Lanes whose row had better be run by a method for stiff motions.
    #[inline(always)]
    pub(super) fn find_stiff(
        &mut self,
        accepted: <P::Lanes as Real>::Mask,
        step: Plain<P>,
        trial: &Trial<P::Lanes, N>,
    ) -> u64 {
        if !M::STICKS || !self.demand.find_stiff || T::STABILITY.is_infinite() {
            return 0;
        }
        let short = accepted & step.lt(self.short_step);
        if !short.any() {
            return 0;
        }
        let number = Plain::<P>::splat;
        let (rates, states) = self.stepper.last_stages::<M, T>(step, &plain(&trial.state));
        let bound = number(T::STABILITY * T::STABILITY);
        let mut stiff = (states * bound).lt(rates * step * step);
        if let Some(unseen) = &self.unseen {
            stiff = stiff | (number(0.0).lt(unseen.longest) & unseen.longest.le(step));
        }
        let one = Plain::<P>::select(stiff, number(1.0), number(-1.0));
        let count = (self.stiffness + one).max(Plain::<P>::zero());
        self.stiffness = Plain::<P>::select(short, count, self.stiffness);
        (short & number(ENOUGH).le(self.stiffness)).to_bits() & self.occupied
    }
}

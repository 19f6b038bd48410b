//! Energies of an imposed motion. Any step follows it exactly, so that states do not tell how short steps have to be for
//! the powers; there Gauss's rule tells how far their sums are off.

use super::Method;
use super::integrals::Integral;
use super::stepper::Stepper;
use crate::model::Model;
use crate::real::{Mask, Real};

/// Whose sums tell.
const POWERS: [usize; 3] = [Integral::MotorPower as usize, Integral::LoadPower as usize, Integral::TermPower as usize];
/// Share of the largest of the energies that the others count for at least.
const LEAST: f64 = 1e-3;
/// Share of the time since a little before the start: energies alone make no step shorter, so that no row fails by them.
const SHORTEST: f64 = 1e-7;

impl<R: Real, const N: usize> Stepper<R, N> {
    /// The squared error of the attempted step in units of the tolerance: of its states, and where the motion is imposed of
    /// the energies, as shares of what has been summed up; none is asked for below that of the motor's inertia at the
    /// speed below which it is not.
    #[inline(always)]
    pub fn with_sums<M: Model<N>, T: Method>(
        &mut self,
        lanes: R::Mask,
        step: R::Plain,
        error: R::Plain,
        rtol: f64,
        floor: f64,
    ) -> R::Plain {
        let Some(imposed) = self.input.motion().filter(|_| self.integrands.energy && !T::IS_IMPLICIT) else {
            return error;
        };
        let shortest = (self.t + R::Plain::splat(1e-3)) * R::Plain::splat(SHORTEST);
        let lanes = lanes & imposed & error.le(R::Plain::splat(1.0)) & shortest.lt(step);
        if !lanes.any() {
            return error;
        }
        let own = self.step_integrals;
        self.integrate::<M, T>(step);
        let again = std::mem::replace(&mut self.step_integrals, own);
        let crawl = self.constants.j_m.plain() * R::Plain::splat(floor * self.scales[1] * self.scales[1]);
        let sizes = POWERS.map(|power| {
            let (sum, start) = (own[power].plain(), self.starting[power].plain());
            let total = step.mul_add(sum, self.integrals[power].plain());
            step.mul_add(sum.abs() + start.abs(), total.abs())
        });
        let least = sizes[0].max(sizes[1].max(sizes[2])).mul_add(R::Plain::splat(LEAST), crawl);
        let mut largest = error;
        for (power, size) in POWERS.into_iter().zip(sizes) {
            let off = step * (again[power] - own[power]).plain();
            let share = off / (size.max(least) * R::Plain::splat(rtol));
            let found = share * share;
            largest = R::Plain::select(largest.lt(found), found, largest);
        }
        R::Plain::select(lanes, largest, error)
    }
}

//! The kinematic error of a drive that begins in a motion.

use super::stepper::Stepper;
use crate::model::Corners;
use crate::model::terms::{HIDDEN, Internals, Mesh, Motion};
use crate::real::{Real, Task};

impl<R: Real, const N: usize> Stepper<R, N> {
    /// The kinematic error [rad] and its slope, terms included, under a load torque.
    pub(super) fn kinematic_error(&self, motion: &Motion<R>, load_torque: R) -> (R, R) {
        R::apart(KinematicError { stepper: self, motion, load_torque })
    }
}

struct KinematicError<'a, R: Real, const N: usize> {
    stepper: &'a Stepper<R, N>,
    motion: &'a Motion<R>,
    load_torque: R,
}

impl<R: Real, const N: usize> Task for KinematicError<'_, R, N> {
    type Output = (R, R);

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { stepper: Stepper { harmonics, terms, .. }, motion, load_torque } = self;
        let own = harmonics.value_and_slope(motion.theta_m);
        let mut mesh = Mesh::new(own, R::zero(), load_torque);
        let mut states = [R::zero(); HIDDEN];
        terms.begin(motion, &mut states);
        terms.mesh(motion, &mut mesh, &mut Internals::new(&states, Corners::new(None)));
        (mesh.error, mesh.error_slope)
    }
}

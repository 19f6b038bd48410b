//! Mesh friction in proportion to the torque carried.

use super::sizes::MOTOR_TORQUE;
use super::{Dry, Hidden, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct LoadDependentFriction;

impl Term for LoadDependentFriction {
    const INFO: TermInfo = TermInfo {
        id: "load_dependent_friction",
        place: Place::Mesh,
        bases: Base::ALL,
        description: "Dry friction in proportion to the gear torque, with shares of their own for driving and \
            back-driving; sticks truly.",
        equation: "tau_fm += c abs(T_g / i) sgn(omega_m), c = c_drive where T_g omega_m / i > 0, else c_back",
        source: "share from the catalogue efficiency of 0.77 at 67 N m, about half of the loss load-dependent; \
            Shi, Yin, Li 2022",
        amplitude: "c_drive",
        parameters: &[
            TermParameter::new("c_drive", "1", "share of the torque lost when driving")
                .size_25(0.12, 0.1, 0.15)
                .within(0.0, 1.0),
            TermParameter::new("c_back", "1", "share of the torque lost when back-driven")
                .size_25(0.12, 0.1, 0.15)
                .within(0.0, 1.0),
        ],
        states: &[],
    };
    const SUSTAINED: bool = true;
    const CORNERS: usize = 1;

    #[inline(always)]
    fn motor_friction<R: Real>(p: &[R], motion: &Motion<R>, dry: &mut Dry<R>, mut hidden: Hidden<R>) {
        let half = R::splat(0.5) * dry.gear_torque * motion.inverse_ratio;
        let level = (p[0] + p[1]) * half * hidden.sign(0, half, MOTOR_TORQUE);
        dry.add(level, level, (p[0] - p[1]) * half);
    }
}

//! Friction that differs between the directions.

use super::sizes::MOTOR_SPEED;
use super::{Dry, Hidden, Motion, Place, Term, TermInfo, TermParameter, at_rest};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct AsymmetricFriction;

impl Term for AsymmetricFriction {
    const INFO: TermInfo = TermInfo {
        id: "asymmetric_friction",
        place: Place::Motor,
        bases: Base::ALL,
        description: "Dry level and viscous drag of the motor shaft that differ between the directions; at rest the \
            hold is shifted to match.",
        equation: "T_c -> T_c (1 + eps_c sgn(omega_m)), B -> B (1 + eps_B sgn(omega_m)); T_c the level of any dry \
            law, sgn smoothed as in the law where it is",
        source: "Kircanski, Goldenberg 1997; +8 and -7 mN m reported on a smaller joint",
        amplitude: "eps_c",
        parameters: &[
            TermParameter::new("eps_c", "1", "relative asymmetry of the dry level")
                .size_25(0.1, -0.15, 0.15)
                .within(-0.99, 0.99),
            TermParameter::new("eps_B", "1", "relative asymmetry of the viscous drag")
                .size_25(0.0, -0.15, 0.15)
                .within(-0.99, 0.99),
        ],
        states: &[],
    };
    const SUSTAINED: bool = true;
    const CORNERS: usize = 1;

    #[inline(always)]
    fn motor_friction<R: Real>(p: &[R], motion: &Motion<R>, dry: &mut Dry<R>, mut hidden: Hidden<R>) {
        dry.lean = p[0];
        let onward = dry.direction.mul_add(R::splat(f64::MIN_POSITIVE), motion.omega_m);
        let way = hidden.sign(0, onward, MOTOR_SPEED);
        let held = at_rest(dry.direction);
        dry.drag = R::select(held, dry.drag, dry.drag * p[1].mul_add(way, R::splat(1.0)));
        dry.held_apart = R::select(held, p[1], R::zero());
    }
}

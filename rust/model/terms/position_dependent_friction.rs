//! Friction that varies over a turn.

use super::{Dry, Hidden, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct PositionDependentFriction;

impl Term for PositionDependentFriction {
    const INFO: TermInfo = TermInfo {
        id: "position_dependent_friction",
        place: Place::Mesh,
        bases: Base::ALL,
        description: "The friction of all terms on the motor shaft varies with the motor angle; odd under reversal, \
            unlike a kinematic error.",
        equation: "tau_fm -> tau_fm [1 + c cos(n theta_m + psi)]; of presliding_friction the level g alone",
        source: "Gandhi, Ghorbel, Dabney 2002; orders 1, 2, 4 and multiples of 1/i",
        amplitude: "friction_ripple",
        parameters: &[
            TermParameter::new("friction_ripple", "1", "relative amplitude")
                .symbol("c")
                .size_25(0.1, 0.05, 0.2)
                .within(0.0, 0.99),
            TermParameter::new("order", "1", "cycles per motor revolution")
                .symbol("n")
                .size_25(2.0, 0.008, 4.0)
                .within(0.0, 10000.0),
            TermParameter::phase("psi", "phase"),
        ],
        states: &[],
    };

    #[inline(always)]
    fn motor_friction<R: Real>(p: &[R], motion: &Motion<R>, dry: &mut Dry<R>, _hidden: Hidden<R>) {
        let wave = p[1].mul_add(motion.theta_m, p[2]).sin_cos().1;
        dry.grip = dry.grip * p[0].mul_add(wave, R::splat(1.0));
    }
}

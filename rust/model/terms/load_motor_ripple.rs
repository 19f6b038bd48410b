//! Ripple of the machine that loads the drive.

use super::{Hidden, Load, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct LoadMotorRipple;

impl Term for LoadMotorRipple {
    const INFO: TermInfo = TermInfo {
        id: "load_motor_ripple",
        place: Place::Load,
        bases: Base::ALL,
        description: "Ripple of the load torque over the output angle, in proportion to it.",
        equation: "tau_load -> tau_load [1 + r cos(q theta_l + psi)]",
        source: "load machines, 0.5 to 2 % of their torque",
        amplitude: "load_ripple",
        parameters: &[
            TermParameter::new("load_ripple", "1", "relative amplitude")
                .symbol("r")
                .size_25(0.01, 0.005, 0.02)
                .within(0.0, 1.0),
            TermParameter::new("order", "1", "cycles per output revolution")
                .symbol("q")
                .size_25(6.0, 1.0, 60.0)
                .within(0.0, 10000.0),
            TermParameter::phase("psi", "phase"),
        ],
        states: &[],
    };

    #[inline(always)]
    fn load<R: Real>(p: &[R], motion: &Motion<R>, load: &mut Load<R>, _hidden: Hidden<R>) {
        let wave = p[1].mul_add(motion.theta_l, p[2]).sin_cos().1;
        load.torque = load.torque * p[0].mul_add(wave, R::splat(1.0));
    }
}

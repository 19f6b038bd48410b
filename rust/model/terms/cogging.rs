//! Detents of magnets and slots.

use super::{Actuator, Hidden, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct Cogging;

impl Term for Cogging {
    const INFO: TermInfo = TermInfo {
        id: "cogging",
        place: Place::Motor,
        bases: Base::ALL,
        description: "Detent torque between magnets and slots, the same at any current; ripple of the speed falls as \
            speed grows.",
        equation: "tau_a += T_1 sin(n theta_m + psi_1) + T_2 sin(2 n theta_m + psi_2)",
        source: "order n = lcm(slots, poles) of permanent-magnet machines; 5 to 25 mN m",
        amplitude: "T_cog",
        parameters: &[
            TermParameter::new("order", "1", "cycles per motor revolution")
                .symbol("n")
                .size_25(24.0, 8.0, 120.0)
                .within(1.0, 10000.0),
            TermParameter::new("T_cog", "N m", "amplitude")
                .symbol("T_1")
                .size_25(0.01, 0.0, 0.025)
                .within(0.0, f64::INFINITY),
            TermParameter::phase("psi_1", "its phase"),
            TermParameter::new("T_cog_2", "N m", "amplitude at twice the order")
                .symbol("T_2")
                .size_25(0.0, 0.0, 0.025)
                .within(0.0, f64::INFINITY),
            TermParameter::phase("psi_2", "its phase"),
        ],
        states: &[],
    };

    #[inline(always)]
    fn actuator<R: Real>(p: &[R], motion: &Motion<R>, actuator: &mut Actuator<R>, _hidden: Hidden<R>) {
        let angle = p[0] * motion.theta_m;
        let once = (angle + p[2]).sin_cos().0;
        let twice = R::splat(2.0).mul_add(angle, p[4]).sin_cos().0;
        actuator.torque = p[1].mul_add(once, p[3].mul_add(twice, actuator.torque));
    }
}

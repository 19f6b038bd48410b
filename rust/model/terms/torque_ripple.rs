//! Torque ripple of the currents.

use super::{Actuator, Hidden, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct TorqueRipple;

impl Term for TorqueRipple {
    const INFO: TermInfo = TermInfo {
        id: "torque_ripple",
        place: Place::Actuator,
        bases: Base::ALL,
        description: "Ripple from current offset, gain mismatch and dead time, at 1, 2 and 6 times the pole pairs.",
        equation: "tau_a = tau_c [1 + r_2 cos(2 p theta_m + psi_2) + r_6 cos(6 p theta_m + psi_6)] + tau_off \
            cos(p theta_m + psi_1)",
        source: "field-oriented control of a machine with p pole pairs, 0.5 to 3 %",
        amplitude: "r_2",
        parameters: &[
            TermParameter::new("pole_pairs", "1", "pole pairs of the motor")
                .symbol("p")
                .size_25(4.0, 4.0, 5.0)
                .within(1.0, 100.0),
            TermParameter::new("r_2", "1", "ripple from gain mismatch").size_25(0.01, 0.005, 0.03).within(0.0, 1.0),
            TermParameter::phase("psi_2", "its phase"),
            TermParameter::new("r_6", "1", "ripple from dead time").size_25(0.01, 0.005, 0.03).within(0.0, 1.0),
            TermParameter::phase("psi_6", "its phase"),
            TermParameter::new("tau_off", "N m", "ripple from current offset")
                .size_25(0.002, 0.0, 0.02)
                .within(0.0, f64::INFINITY),
            TermParameter::phase("psi_1", "its phase"),
        ],
        states: &[],
    };

    #[inline(always)]
    fn actuator<R: Real>(p: &[R], motion: &Motion<R>, actuator: &mut Actuator<R>, _hidden: Hidden<R>) {
        let angle = p[0] * motion.theta_m;
        let mismatch = R::splat(2.0).mul_add(angle, p[2]).sin_cos().1;
        let dead_time = R::splat(6.0).mul_add(angle, p[4]).sin_cos().1;
        let offset = (angle + p[6]).sin_cos().1;
        let factor = p[1].mul_add(mismatch, p[3].mul_add(dead_time, R::splat(1.0)));
        actuator.torque = actuator.torque.mul_add(factor, p[5] * offset);
    }
}

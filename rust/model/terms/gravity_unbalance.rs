//! A payload off the axis.

use super::{Hidden, Load, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct GravityUnbalance;

impl Term for GravityUnbalance {
    const INFO: TermInfo = TermInfo {
        id: "gravity_unbalance",
        place: Place::Load,
        bases: Base::ALL,
        description: "Weight of a payload off the output axis, in phase with the output angle.",
        equation: "tau_load += T_w sin(theta_l + psi), T_w = m g r",
        source: "pendulum; 3e-6 to 3e-4 rad of windup",
        amplitude: "T_gravity",
        parameters: &[
            TermParameter::new("T_gravity", "N m", "weight times lever")
                .symbol("T_w")
                .size_25(2.0, 0.1, 10.0)
                .within(0.0, f64::INFINITY),
            TermParameter::phase("psi", "angle of the payload at theta_l = 0"),
        ],
        states: &[],
    };

    #[inline(always)]
    fn load<R: Real>(p: &[R], motion: &Motion<R>, load: &mut Load<R>, _hidden: Hidden<R>) {
        load.torque = p[0].mul_add((motion.theta_l + p[1]).sin_cos().0, load.torque);
    }
}

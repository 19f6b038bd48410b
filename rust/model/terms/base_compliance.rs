//! A housing that turns on its foundation.

use super::wound::twist;
use super::{Gear, Hidden, Mesh, Motion, Place, Reaction, Term, TermInfo, TermParameter, TermState, Wound};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct BaseCompliance;

impl Term for BaseCompliance {
    const INFO: TermInfo = TermInfo {
        id: "base_compliance",
        place: Place::Structure,
        bases: &[Base::TwoInertia],
        description: "Housing on a spring: turns under the gear torque and adds its angle to the windup; the angles \
            stay absolute.",
        equation: "J_b domega_b/dt = -(1 - 1/i) T_g - c_b omega_b - k_b theta_b; phi = theta_m/i + (1 - 1/i) \
            theta_b - theta_e(theta_m) - theta_l",
        source: "Lagrange's equations of the gear with a free housing; the shift of theta_e by theta_b, below \
            1e-3 of it, is left out on both sides; 50 to 500 Hz",
        amplitude: "k_b",
        parameters: &[
            TermParameter::new("k_b", "N m/rad", "stiffness of the mounting")
                .size_25(300000.0, 100000.0, 1000000.0)
                .within(0.0, f64::INFINITY),
            TermParameter::new("c_b", "N m s/rad", "damping of the mounting")
                .size_25(12.0, 1.0, 100.0)
                .within(0.0, f64::INFINITY),
            TermParameter::new("J_b", "kg m^2", "inertia of the housing")
                .size_25(0.3, 0.1, 1.0)
                .within(1e-6, f64::INFINITY),
        ],
        states: &[
            TermState { name: "theta_b", unit: "rad", scale: 1e-6 },
            TermState { name: "omega_b", unit: "rad/s", scale: 1e-3 },
        ],
    };

    #[inline(always)]
    fn wind<R: Real>(p: &[R], wound: &mut Wound<R>, states: &mut [R]) {
        let arm = R::splat(1.0) - wound.inverse_ratio;
        states[0] = -twist(arm * wound.load_torque, p[0]);
        wound.added_windup = arm.mul_add(states[0], wound.added_windup);
    }

    #[inline(always)]
    fn stored<R: Real>(p: &[R], _gear: &Gear<R>, states: &[R]) -> R {
        let (angle, speed) = (states[0], states[1]);
        R::splat(0.5) * (p[0] * angle).mul_add(angle, p[2] * speed * speed)
    }

    #[inline(always)]
    fn mesh<R: Real>(_p: &[R], motion: &Motion<R>, mesh: &mut Mesh<R>, hidden: Hidden<R>) {
        let arm = R::splat(1.0) - motion.inverse_ratio;
        mesh.added_windup = arm.mul_add(hidden.states[0], mesh.added_windup);
        mesh.added_windup_rate = arm.mul_add(hidden.states[1], mesh.added_windup_rate);
    }

    #[inline(always)]
    fn reaction<R: Real>(p: &[R], motion: &Motion<R>, reaction: &mut Reaction<R>, hidden: Hidden<R>) {
        let arm = R::splat(1.0) - motion.inverse_ratio;
        let (angle, speed) = (hidden.states[0], hidden.states[1]);
        let resisting = arm.mul_add(reaction.gear_torque, p[1].mul_add(speed, p[0] * angle));
        hidden.rates[0] = speed;
        hidden.rates[1] = (reaction.on_housing - resisting) / p[2];
    }
}

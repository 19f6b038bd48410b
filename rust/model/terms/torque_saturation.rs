//! What current limit and supply voltage leave of a command.

use super::sizes::{MOTOR_SPEED, MOTOR_TORQUE};
use super::{Actuator, Hidden, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct TorqueSaturation;

impl Term for TorqueSaturation {
    const INFO: TermInfo = TermInfo {
        id: "torque_saturation",
        place: Place::Actuator,
        bases: Base::ALL,
        description: "Torque limit of the drive, lowered at speed by the supply voltage.",
        equation: "tau_a = clip(tau_c, +-min(tau_limit, tau_stall (1 - abs(omega_m) / omega_free))), at least 0",
        source: "voltage line k_t (V - k_e abs(omega)) / R with stall torque k_t V / R and free speed V / k_e; \
            drive data sheets",
        amplitude: "tau_limit",
        parameters: &[
            TermParameter::new("tau_limit", "N m", "torque at the current limit")
                .size_25(1.5, 0.6, 3.0)
                .within(1e-6, f64::INFINITY),
            TermParameter::new("tau_stall", "N m", "torque at full voltage and standstill")
                .size_25(6.0, 3.0, 20.0)
                .within(1e-6, f64::INFINITY),
            TermParameter::new("omega_free", "rad/s", "speed at full voltage without torque")
                .size_25(600.0, 300.0, 1000.0)
                .within(0.001, f64::INFINITY),
        ],
        states: &[],
    };
    const CORNERS: usize = 4;

    #[inline(always)]
    fn actuator<R: Real>(p: &[R], motion: &Motion<R>, actuator: &mut Actuator<R>, mut hidden: Hidden<R>) {
        let speed = hidden.sign(0, motion.omega_m, MOTOR_SPEED) * motion.omega_m;
        let least = hidden.min(1, p[0], p[1] * (R::splat(1.0) - speed / p[2]), MOTOR_TORQUE);
        let limit = -hidden.min(2, -least, R::zero(), MOTOR_TORQUE);
        actuator.torque = hidden.clamp(3, actuator.torque, limit, MOTOR_TORQUE);
    }
}

//! A rotor that is not the wave generator.

use super::wound::twist;
use super::{Actuator, Hidden, Motion, Place, Term, TermInfo, TermParameter, TermState, Wound};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct InputCompliance;

impl Term for InputCompliance {
    const INFO: TermInfo = TermInfo {
        id: "input_compliance",
        place: Place::Motor,
        bases: &[Base::TwoInertia],
        description: "Coupling between rotor and wave generator; angle, speed and torque of the motor and the energy \
            it puts in are those of the wave generator, behind the inertia of the rotor.",
        equation: "J_r domega_r/dt = tau_a - tau_k, tau_k = k_ci u + c_ci (omega_r - omega_m), du/dt = omega_r - \
            omega_m, J_r = share J_m; tau_k drives the rest of J_m",
        source: "two masses, 1.9e-4 and 1.1e-4 kg m^2; 130 to 430 Hz",
        amplitude: "k_ci",
        parameters: &[
            TermParameter::new("k_ci", "N m/rad", "stiffness of the coupling")
                .size_25(200.0, 50.0, 500.0)
                .within(0.0, f64::INFINITY),
            TermParameter::new("c_ci", "N m s/rad", "damping of the coupling")
                .size_25(0.02, 0.0, 0.05)
                .within(0.0, f64::INFINITY),
            TermParameter::new("rotor_share", "1", "share of J_m in the rotor")
                .size_25(0.63, 0.3, 0.8)
                .within(0.01, 0.99),
        ],
        states: &[
            TermState { name: "input_twist", unit: "rad", scale: 1e-4 },
            TermState { name: "omega_r", unit: "rad/s", scale: 0.1 },
        ],
    };

    #[inline(always)]
    fn begin<R: Real>(_p: &[R], motion: &Motion<R>, states: &mut [R]) {
        states[1] = motion.omega_m;
    }

    #[inline(always)]
    fn wind<R: Real>(p: &[R], wound: &mut Wound<R>, states: &mut [R]) {
        states[0] = twist(wound.motor_torque, p[0]);
    }

    #[inline(always)]
    fn actuator<R: Real>(p: &[R], motion: &Motion<R>, actuator: &mut Actuator<R>, hidden: Hidden<R>) {
        let rotor = p[2] * actuator.inertia;
        let slip = hidden.states[1] - motion.omega_m;
        let coupling = p[0].mul_add(hidden.states[0], p[1] * slip);
        hidden.rates[0] = slip;
        hidden.rates[1] = (actuator.torque - coupling) / rotor;
        actuator.torque = coupling;
        actuator.inertia = actuator.inertia - rotor;
    }
}

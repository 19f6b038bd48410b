//! A current loop of finite bandwidth.

use super::{Actuator, Hidden, Motion, Place, Term, TermInfo, TermParameter, TermState, Wound};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct ActuatorLag;

impl Term for ActuatorLag {
    const INFO: TermInfo = TermInfo {
        id: "actuator_lag",
        place: Place::Actuator,
        bases: Base::ALL,
        description: "Lag of first order between commanded and actual torque: the current loop, or the winding.",
        equation: "tau_e dtau_a/dt = tau_c - tau_a",
        source: "current loops of 300 to 1000 Hz; L/R for a winding without loop",
        amplitude: "tau_e",
        parameters: &[TermParameter::new("tau_e", "s", "time constant")
            .size_25(0.0003, 0.00016, 0.005)
            .within(1e-7, f64::INFINITY)],
        states: &[TermState { name: "tau_a", unit: "N m", scale: 1e-3 }],
    };

    #[inline(always)]
    fn wind<R: Real>(_p: &[R], wound: &mut Wound<R>, states: &mut [R]) {
        states[0] = wound.motor_torque;
    }

    #[inline(always)]
    fn actuator<R: Real>(p: &[R], _motion: &Motion<R>, actuator: &mut Actuator<R>, hidden: Hidden<R>) {
        hidden.rates[0] = (actuator.torque - hidden.states[0]) / p[0];
        actuator.torque = hidden.states[0];
    }
}

//! A command that arrives late.

use super::{Actuator, Hidden, Motion, Place, Term, TermInfo, TermParameter, TermState, Wound};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct Delay;

impl Term for Delay {
    const INFO: TermInfo = TermInfo {
        id: "delay",
        place: Place::Actuator,
        bases: Base::ALL,
        description: "Dead time of the drive as an all-pass of order 2: right phase up to about 2/tau_d, a spike of \
            a third of tau_d at an edge.",
        equation: "tau_a / tau_c = (1 - s tau_d/2 + s^2 tau_d^2/12) / (1 + s tau_d/2 + s^2 tau_d^2/12)",
        source: "Pade approximation of exp(-s tau_d)",
        amplitude: "tau_d",
        parameters: &[TermParameter::new("tau_d", "s", "dead time")
            .size_25(0.001, 0.0001, 0.004)
            .within(1e-6, f64::INFINITY)],
        states: &[
            TermState { name: "slow", unit: "N m", scale: 1e-3 },
            TermState { name: "fast", unit: "N m", scale: 1e-3 },
        ],
    };

    #[inline(always)]
    fn wind<R: Real>(_p: &[R], wound: &mut Wound<R>, states: &mut [R]) {
        states[0] = wound.motor_torque;
    }

    #[inline(always)]
    fn actuator<R: Real>(p: &[R], _motion: &Motion<R>, actuator: &mut Actuator<R>, hidden: Hidden<R>) {
        let (slow, fast) = (hidden.states[0], hidden.states[1]);
        hidden.rates[0] = fast * R::splat(2.0) / p[0];
        hidden.rates[1] = (actuator.torque - fast - slow) * R::splat(6.0) / p[0];
        actuator.torque = fast.mul_add(R::splat(-2.0), actuator.torque);
    }
}

//! Creep of the flexspline under load.

use super::{Gear, Hidden, Motion, Place, Term, TermInfo, TermParameter, TermState, Wound};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct Viscoelastic;

impl Term for Viscoelastic {
    const INFO: TermInfo = TermInfo {
        id: "viscoelastic",
        place: Place::Mesh,
        bases: &[Base::TwoInertia],
        description: "Two Maxwell branches beside the spring, a short and a long one: creep under load and nearly \
            constant phase lag. What a drive bears when it begins it has long borne.",
        equation: "tau_h = (K_v / 2) [(phi - q_1) + (phi - q_2)]; dq_1/dt = (phi - q_1) / tau_short, dq_2/dt = \
            (phi - q_2) / tau_long",
        source: "generalised Maxwell model; Preissner, Royston, Shu 2012; loss factor about K_v / 2K",
        amplitude: "K_v",
        parameters: &[
            TermParameter::new("K_v", "N m/rad", "stiffness of both branches together")
                .size_25(3000.0, 1240.0, 6200.0)
                .within(0.0, f64::INFINITY),
            TermParameter::new("tau_short", "s", "short relaxation time")
                .size_25(0.5, 0.1, 10.0)
                .within(1e-6, f64::INFINITY),
            TermParameter::new("tau_long", "s", "long relaxation time")
                .size_25(60.0, 10.0, 300.0)
                .within(1e-6, f64::INFINITY),
        ],
        states: &[
            TermState { name: "q_1", unit: "rad", scale: 1e-6 },
            TermState { name: "q_2", unit: "rad", scale: 1e-6 },
        ],
    };

    #[inline(always)]
    fn wind<R: Real>(_p: &[R], wound: &mut Wound<R>, states: &mut [R]) {
        states[..2].fill(wound.windup);
    }

    #[inline(always)]
    fn stored<R: Real>(p: &[R], gear: &Gear<R>, states: &[R]) -> R {
        let (short, long) = (gear.windup - states[0], gear.windup - states[1]);
        R::splat(0.25) * p[0] * short.mul_add(short, long * long)
    }

    #[inline(always)]
    fn gear<R: Real>(p: &[R], _motion: &Motion<R>, gear: &mut Gear<R>, hidden: Hidden<R>) {
        let short = gear.windup - hidden.states[0];
        let long = gear.windup - hidden.states[1];
        hidden.rates[0] = short / p[1];
        hidden.rates[1] = long / p[2];
        gear.added_torque = (R::splat(0.5) * p[0]).mul_add(short + long, gear.added_torque);
    }
}

//! Dry friction of constant level on the motor shaft, with true sticking.

use super::{Dry, Hidden, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct CoulombFriction;

impl Term for CoulombFriction {
    const INFO: TermInfo = TermInfo {
        id: "coulomb_friction",
        place: Place::Motor,
        bases: Base::ALL,
        description: "Dry friction of constant level on the motor shaft; stops the shaft exactly and holds it until \
            breakaway.",
        equation: "tau_fm += T_c sgn(omega_m); at rest any torque up to T_c",
        source: "Armstrong-Helouvry, Dupont, Canudas de Wit 1994; level bounded by the catalogue starting \
            torque of 0.069 N m",
        amplitude: "T_c",
        parameters: &[TermParameter::new("T_c", "N m", "friction torque at the motor")
            .size_25(0.03, 0.02, 0.07)
            .within(0.0, f64::INFINITY)],
        states: &[],
    };
    const SUSTAINED: bool = true;

    #[inline(always)]
    fn motor_friction<R: Real>(p: &[R], _motion: &Motion<R>, dry: &mut Dry<R>, _hidden: Hidden<R>) {
        dry.add(p[0], p[0], R::zero());
    }
}

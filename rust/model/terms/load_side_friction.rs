//! Dry friction of bearing and seal at the output, with true sticking.

use super::{Dry, Hidden, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct LoadSideFriction;

impl Term for LoadSideFriction {
    const INFO: TermInfo = TermInfo {
        id: "load_side_friction",
        place: Place::Load,
        bases: Base::ALL,
        description: "Dry friction of constant level on the output; shifts the windup with direction and holds the \
            output until breakaway.",
        equation: "tau_fl += T_cl sgn(omega_l); at rest any torque up to T_cl",
        source: "Yao, Chen, Xing 2022; level chosen, 3e-6 to 1e-4 rad of windup",
        amplitude: "T_cl",
        parameters: &[TermParameter::new("T_cl", "N m", "friction torque at the output")
            .size_25(0.5, 0.1, 3.0)
            .within(0.0, f64::INFINITY)],
        states: &[],
    };
    const SUSTAINED: bool = true;

    #[inline(always)]
    fn load_friction<R: Real>(p: &[R], _motion: &Motion<R>, dry: &mut Dry<R>, _hidden: Hidden<R>) {
        dry.add(p[0], p[0], R::zero());
    }
}

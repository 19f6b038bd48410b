//! A torque of fixed frequency from outside.

use super::{Hidden, Load, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct ExternalPeriodicTorque;

impl Term for ExternalPeriodicTorque {
    const INFO: TermInfo = TermInfo {
        id: "external_periodic_torque",
        place: Place::Load,
        bases: Base::ALL,
        description: "Torque of fixed frequency on the output, whatever the speed.",
        equation: "tau_load += A sin(2 pi f t + psi)",
        source: "neighbouring machines and mains, often 50 or 60 Hz and multiples",
        amplitude: "T_external",
        parameters: &[
            TermParameter::new("T_external", "N m", "amplitude")
                .symbol("A")
                .size_25(1.0, 0.0, 10.0)
                .within(0.0, f64::INFINITY),
            TermParameter::new("f_external", "Hz", "frequency")
                .symbol("f")
                .size_25(50.0, 0.1, 400.0)
                .within(0.0, 100000.0),
            TermParameter::phase("psi", "phase"),
        ],
        states: &[],
    };

    const BY_TIME: bool = true;

    #[inline(always)]
    fn frequency<R: Real>(p: &[R]) -> R {
        p[1]
    }

    #[inline(always)]
    fn load<R: Real>(p: &[R], motion: &Motion<R>, load: &mut Load<R>, _hidden: Hidden<R>) {
        let angle = (p[1] * motion.t).mul_add(R::splat(std::f64::consts::TAU), p[2]);
        load.torque = p[0].mul_add(angle.sin_cos().0, load.torque);
    }
}

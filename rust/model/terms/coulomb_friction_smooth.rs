//! Dry friction with the jump at standstill smoothed away: the shaft creeps where it should stick.

use super::{Dry, Hidden, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct CoulombFrictionSmooth;

impl Term for CoulombFrictionSmooth {
    const INFO: TermInfo = TermInfo {
        id: "coulomb_friction_smooth",
        place: Place::Motor,
        bases: Base::ALL,
        description: "Dry friction of constant level on the motor shaft, smoothed around standstill: creeps instead \
            of sticking.",
        equation: "tau_fm += T_c tanh(omega_m / omega_eps)",
        source: "regularised Coulomb law, Armstrong-Helouvry, Dupont, Canudas de Wit 1994",
        amplitude: "T_c",
        parameters: &[
            TermParameter::new("T_c", "N m", "friction torque at the motor")
                .size_25(0.03, 0.02, 0.07)
                .within(0.0, f64::INFINITY),
            TermParameter::new("omega_eps", "rad/s", "speed over which the friction builds up")
                .size_25(0.05, 0.01, 0.5)
                .within(1e-6, f64::INFINITY),
        ],
        states: &[],
    };
    const SUSTAINED: bool = true;

    #[inline(always)]
    fn motor_friction<R: Real>(p: &[R], motion: &Motion<R>, dry: &mut Dry<R>, _hidden: Hidden<R>) {
        let way = (motion.omega_m / p[1]).tanh();
        dry.resisting = (p[0] * dry.strength(way)).mul_add(way, dry.resisting);
    }
}

//! A spring that is softer near zero torque.

use super::{Gear, Hidden, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct SoftWindup;

impl Term for SoftWindup {
    const INFO: TermInfo = TermInfo {
        id: "soft_windup",
        place: Place::Mesh,
        bases: &[Base::TwoInertia],
        description: "Lower stiffness around zero windup, as teeth come into full contact only under torque.",
        equation: "tau_s -> tau_s - delta_K phi_0 tanh(phi / phi_0), delta_K = K_1 - K_0",
        source: "catalogue stiffness curves; K_0/K_1 of 0.5 to 0.9 up to 1 to 2 N m",
        amplitude: "delta_K",
        parameters: &[
            TermParameter::new(
                "delta_K",
                "N m/rad",
                "stiffness missing at zero windup; what is left of the spring's has to be positive",
            )
            .size_25(9000.0, 3100.0, 15500.0)
            .within(0.0, f64::INFINITY),
            TermParameter::new("phi_0", "rad", "windup over which it comes in")
                .size_25(4.5e-5, 3e-5, 6.5e-5)
                .within(1e-9, f64::INFINITY),
        ],
        states: &[],
    };

    const SPRING: bool = true;

    #[inline(always)]
    fn added_spring_energy<R: Real>(p: &[R], windup: R) -> R {
        // ln cosh x = |x| + ln(1 + exp(-2 |x|)) - ln 2
        let x = (windup / p[1]).abs();
        let ln_cosh = x + ((x * R::splat(-2.0)).exp() + R::splat(1.0)).ln() - R::splat(std::f64::consts::LN_2);
        -(p[0] * p[1] * p[1] * ln_cosh)
    }

    #[inline(always)]
    fn added_stiffness<R: Real>(p: &[R], windup: R) -> R {
        let tanh = (windup / p[1]).tanh();
        p[0] * tanh.mul_add(tanh, -R::splat(1.0))
    }

    #[inline(always)]
    fn gear<R: Real>(p: &[R], _motion: &Motion<R>, gear: &mut Gear<R>, _hidden: Hidden<R>) {
        let missing = p[0] * p[1] * (gear.spring_windup / p[1]).tanh();
        gear.added_spring_torque = gear.added_spring_torque - missing;
    }
}

//! Bristle friction: springs before it slides.

use super::sizes::MOTOR_SPEED;
use super::{Dry, Gear, Hidden, Motion, Place, Term, TermInfo, TermParameter, TermState};
use crate::model::Base;
use crate::real::Real;

/// Torque while sliding at a speed [N m].
#[inline(always)]
fn sliding<R: Real>(p: &[R], speed: R) -> R {
    let (one, reduced) = (R::splat(1.0), speed / p[4]);
    p[2] * (p[3] - one).mul_add((-(reduced * reduced)).exp(), one)
}

/// See [`Term::INFO`].
pub struct PreslidingFriction;

impl Term for PreslidingFriction {
    const INFO: TermInfo = TermInfo {
        id: "presliding_friction",
        place: Place::Motor,
        bases: Base::ALL,
        description: "LuGre friction on the motor shaft: elastic bristles that bend before they slide, with damping \
            that never feeds energy in.",
        equation: "dz/dt = omega_m - sigma_0 abs(omega_m) z / g; tau_fm += sigma_0 z + sigma_1 (dz/dt) / (1 + \
            sigma_1 abs(omega_m) / (4 g)); g = T_c [1 + (r_s - 1) exp(-(omega_m / omega_s)^2)]",
        source: "Canudas de Wit, Olsson, Astrom, Lischinsky 1995; bristle damping limited for passivity as \
            required by Barabanov, Ortega 2000",
        amplitude: "T_c",
        parameters: &[
            TermParameter::new("sigma_0", "N m/rad", "bristle stiffness")
                .size_25(3.0, 1.3, 8.0)
                .within(0.0, f64::INFINITY),
            TermParameter::new("sigma_1", "N m s/rad", "bristle damping at standstill")
                .size_25(0.03, 0.003, 0.1)
                .within(0.0, f64::INFINITY),
            TermParameter::new("T_c", "N m", "sliding friction torque at the motor")
                .size_25(0.03, 0.02, 0.07)
                .within(0.0001, f64::INFINITY),
            TermParameter::new("breakaway_ratio", "1", "breakaway torque over sliding torque")
                .symbol("r_s")
                .size_25(1.3, 1.0, 1.5)
                .within(1.0, f64::INFINITY),
            TermParameter::new("omega_s", "rad/s", "Stribeck speed")
                .size_25(3.0, 1.0, 10.0)
                .within(1e-6, f64::INFINITY),
        ],
        states: &[TermState { name: "z", unit: "rad", scale: 1e-3 }],
    };
    const SUSTAINED: bool = true;
    const CORNERS: usize = 1;

    #[inline(always)]
    fn stored<R: Real>(p: &[R], _gear: &Gear<R>, states: &[R]) -> R {
        R::splat(0.5) * p[0] * states[0] * states[0]
    }

    #[inline(always)]
    fn settle<R: Real>(p: &[R], motion: &Motion<R>, dry: &Dry<R>, states: &mut [R]) {
        let (zero, way) = (R::zero(), dry.direction);
        let level = sliding(p, motion.omega_m) * dry.strength(way);
        states[0] = R::select(zero.lt(p[0]), way * level / p[0], zero);
    }

    #[inline(always)]
    fn motor_friction<R: Real>(p: &[R], motion: &Motion<R>, dry: &mut Dry<R>, mut hidden: Hidden<R>) {
        let (stiffness, damping) = (p[0], p[1]);
        let one = R::splat(1.0);
        let (bristle, way) = (hidden.states[0], hidden.sign(0, motion.omega_m, MOTOR_SPEED));
        let speed = motion.omega_m * way;
        let limit = sliding(p, speed) * dry.strength(way);
        let rate = motion.omega_m - stiffness * speed * bristle / limit;
        let passive = damping / (damping * speed / limit).mul_add(R::splat(0.25), one);
        dry.resisting = dry.resisting + stiffness.mul_add(bristle, passive * rate);
        hidden.rates[0] = rate;
    }
}

//! Dry friction that falls from breakaway to sliding with speed.

use super::{Dry, Hidden, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct StribeckFriction;

impl Term for StribeckFriction {
    const INFO: TermInfo = TermInfo {
        id: "stribeck_friction",
        place: Place::Motor,
        bases: Base::ALL,
        description: "Dry friction on the motor shaft that falls from breakaway to sliding level as speed grows; \
            sticks truly.",
        equation: "tau_fm += T_c [1 + (r_s - 1) exp(-abs(omega_m / omega_s)^delta)] sgn(omega_m); at rest any \
            torque up to r_s T_c",
        source: "Armstrong-Helouvry, Dupont, Canudas de Wit 1994; levels and speeds as for joint friction in \
            Wolf, Iskandar 2018",
        amplitude: "T_c",
        parameters: &[
            TermParameter::new("T_c", "N m", "sliding friction torque at the motor")
                .size_25(0.03, 0.02, 0.07)
                .within(0.0, f64::INFINITY),
            TermParameter::new("breakaway_ratio", "1", "breakaway torque over sliding torque")
                .symbol("r_s")
                .size_25(1.3, 1.2, 1.5)
                .within(1.0, f64::INFINITY),
            TermParameter::new("omega_s", "rad/s", "Stribeck speed")
                .size_25(3.0, 1.0, 10.0)
                .within(1e-6, f64::INFINITY),
            TermParameter::new("stribeck_shape", "1", "shape exponent")
                .symbol("delta")
                .size_25(1.0, 0.5, 2.0)
                .within(0.1, 10.0),
        ],
        states: &[],
    };
    const SUSTAINED: bool = true;

    #[inline(always)]
    fn motor_friction<R: Real>(p: &[R], motion: &Motion<R>, dry: &mut Dry<R>, _hidden: Hidden<R>) {
        let [sliding, ratio, speed, shape] = [p[0], p[1], p[2], p[3]];
        let pace = motion.omega_m.abs() / speed;
        let cusp = pace.le(R::zero()) & shape.lt(R::splat(1.0));
        let power = R::select(cusp, R::zero(), pace.powf(shape));
        let beyond = (dry.direction * motion.omega_m).lt(R::zero());
        let decay = (-R::select(beyond, -power, power)).exp();
        let excess = sliding * (ratio - R::splat(1.0));
        dry.add(excess.mul_add(decay, sliding), excess + sliding, R::zero());
    }
}

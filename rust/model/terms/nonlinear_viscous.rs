//! Oil drag that is not proportional to speed.

use super::{Dry, Hidden, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// Speed at which the drag torque is given [rad/s].
const REFERENCE: f64 = 100.0;
/// Share of it below which the drag is proportional to speed.
const SMOOTHING: f64 = 1e-3;

/// See [`Term::INFO`].
pub struct NonlinearViscous;

impl Term for NonlinearViscous {
    const INFO: TermInfo = TermInfo {
        id: "nonlinear_viscous",
        place: Place::Motor,
        bases: Base::ALL,
        description: "Viscous drag on the motor shaft that grows as a power of speed; proportional to it below 0.1 \
            rad/s.",
        equation: "tau_fm += T_p (omega_m / 100 rad/s) [(omega_m^2 + (0.1 rad/s)^2) / (100 rad/s)^2]^((p - 1)/2)",
        source: "Tuttle, Seering 1996 (cubic), Preissner, Royston, Shu 2012; exponent near 2/3 for grease; the \
            0.1 rad/s keep the slope finite",
        amplitude: "drag_torque",
        parameters: &[
            TermParameter::new("drag_torque", "N m", "drag torque at 100 rad/s")
                .symbol("T_p")
                .size_25(0.02, 0.0, 0.1)
                .within(0.0, f64::INFINITY),
            TermParameter::new("drag_power", "1", "power of speed")
                .symbol("p")
                .size_25(2.0 / 3.0, 0.5, 3.0)
                .within(0.1, 10.0),
        ],
        states: &[],
    };
    const SUSTAINED: bool = true;

    #[inline(always)]
    fn motor_friction<R: Real>(p: &[R], motion: &Motion<R>, dry: &mut Dry<R>, _hidden: Hidden<R>) {
        let speed = motion.omega_m * R::splat(1.0 / REFERENCE);
        let square = speed.mul_add(speed, R::splat(SMOOTHING * SMOOTHING));
        let growth = square.powf((p[1] - R::splat(1.0)) * R::splat(0.5));
        dry.resisting = (dry.grip * p[0] * speed).mul_add(growth, dry.resisting);
    }
}

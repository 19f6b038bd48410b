//! A kinematic error that depends on the direction of travel.

use super::{Hidden, Mesh, Motion, Place, Term, TermInfo, TermParameter, TermState};
use crate::model::Base;
use crate::real::Real;

/// Speed over which the direction changes [rad/s].
const SMOOTHING: f64 = 0.05;

#[inline(always)]
fn direction<R: Real>(motion: &Motion<R>) -> R {
    (motion.omega_m * R::splat(1.0 / SMOOTHING)).tanh()
}

/// See [`Term::INFO`].
pub struct TeHysteresis;

impl Term for TeHysteresis {
    const INFO: TermInfo = TermInfo {
        id: "te_hysteresis",
        place: Place::Mesh,
        bases: Base::ALL,
        description: "Kinematic error that differs by direction: after a reversal it settles over an angle of the \
            motor, not over a time.",
        equation: "theta_e += delta xi; dxi/dtheta_m = s (s - xi) / Theta, s = tanh(omega_m / 0.05 rad/s)",
        source: "Iwasaki 2009 for the effect, below 1 arcmin; the settling is that of Dahl's friction law, \
            which keeps the windup rate exact",
        amplitude: "direction_offset",
        parameters: &[
            TermParameter::new("direction_offset", "rad", "half of the difference between the directions")
                .symbol("delta")
                .size_25(3e-5, 5e-6, 0.00015)
                .within(-0.01, 0.01),
            TermParameter::new("settling_angle", "rad", "motor angle over which it settles")
                .symbol("Theta")
                .size_25(0.35, 0.1, 6.3)
                .within(0.001, f64::INFINITY),
        ],
        states: &[TermState { name: "xi", unit: "1", scale: 1e-2 }],
    };

    #[inline(always)]
    fn begin<R: Real>(_p: &[R], motion: &Motion<R>, states: &mut [R]) {
        states[0] = direction(motion);
    }

    #[inline(always)]
    fn mesh<R: Real>(p: &[R], motion: &Motion<R>, mesh: &mut Mesh<R>, hidden: Hidden<R>) {
        let toward = direction(motion);
        let slope = toward * (toward - hidden.states[0]) / p[1];
        mesh.error = p[0].mul_add(hidden.states[0], mesh.error);
        mesh.error_slope = p[0].mul_add(slope, mesh.error_slope);
        mesh.error_curvature = mesh.error_curvature - p[0] * toward * slope / p[1];
        let turning = (-toward).mul_add(toward, R::splat(1.0)) * R::splat(1.0 / SMOOTHING);
        let settling = (toward + toward - hidden.states[0]) / p[1];
        mesh.slope_by_speed = (p[0] * turning).mul_add(settling, mesh.slope_by_speed);
        hidden.rates[0] = slope * motion.omega_m;
    }
}

//! What the first hours of running change.

use super::{Dry, Hidden, Mesh, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// How much of the running in is done.
#[inline(always)]
fn done<R: Real>(p: &[R]) -> R {
    R::splat(1.0) - (-(p[2] / p[3])).exp()
}

/// See [`Term::INFO`].
pub struct WearRunIn;

impl Term for WearRunIn {
    const INFO: TermInfo = TermInfo {
        id: "wear_run_in",
        place: Place::Mesh,
        bases: Base::ALL,
        description: "Friction of the motor shaft falls and the kinematic error changes with the hours run before \
            the recording.",
        equation: "tau_fm -> (1 - c_f u) tau_fm, of presliding_friction the level g alone; B -> (1 - c_f u) B, \
            theta_e -> (1 + c_e u) theta_e, u = 1 - exp(-h / h_0)",
        source: "friction about -20 % in the first hours, kinematic error +-10 %; exponential run-in chosen",
        amplitude: "friction_wear",
        parameters: &[
            TermParameter::new("friction_wear", "1", "share of the friction that wears off")
                .symbol("c_f")
                .size_25(0.2, 0.0, 0.3)
                .within(0.0, 0.99),
            TermParameter::new("error_wear", "1", "relative change of the kinematic error")
                .symbol("c_e")
                .size_25(0.0, -0.1, 0.1)
                .within(-1.0, 10.0),
            TermParameter::new("hours", "h", "hours run")
                .symbol("h")
                .size_25(10.0, 0.0, 1000.0)
                .within(0.0, f64::INFINITY),
            TermParameter::new("run_in_hours", "h", "hours of running in")
                .symbol("h_0")
                .size_25(5.0, 1.0, 50.0)
                .within(1e-6, f64::INFINITY),
        ],
        states: &[],
    };
    const SUSTAINED: bool = true;

    #[inline(always)]
    fn mesh<R: Real>(p: &[R], _motion: &Motion<R>, mesh: &mut Mesh<R>, _hidden: Hidden<R>) {
        let factor = p[1].mul_add(done(p), R::splat(1.0));
        mesh.error = mesh.error * factor;
        mesh.error_slope = mesh.error_slope * factor;
        mesh.error_curvature = mesh.error_curvature * factor;
        mesh.slope_by_speed = mesh.slope_by_speed * factor;
    }

    #[inline(always)]
    fn motor_friction<R: Real>(p: &[R], _motion: &Motion<R>, dry: &mut Dry<R>, _hidden: Hidden<R>) {
        let factor = R::splat(1.0) - p[0] * done(p);
        dry.grip = dry.grip * factor;
        dry.drag = dry.drag * factor;
    }
}

//! A damaged spot that passes once per cycle.

use super::{Hidden, Mesh, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// Both slopes of a pulse in widths.
const SLOPES: f64 = 4.0;

/// See [`Term::INFO`].
pub struct LocalFault;

impl Term for LocalFault {
    const INFO: TermInfo = TermInfo {
        id: "local_fault",
        place: Place::Mesh,
        bases: Base::ALL,
        description: "Pulses of the kinematic error where a damaged lobe, tooth or bearing element passes.",
        equation: "theta_e += A exp[(cos(n theta_m + psi) - 1) / w^2]",
        source: "GDUT harmonic-drive dataset for the effect; von Mises pulse of width w",
        amplitude: "fault_height",
        parameters: &[
            TermParameter::new("fault_height", "rad", "height of the pulse")
                .symbol("A")
                .size_25(2e-5, 5e-6, 0.0001)
                .within(-0.01, 0.01),
            TermParameter::new("order", "1", "pulses per motor revolution")
                .symbol("n")
                .size_25(2.0, 0.008, 240.0)
                .within(1e-6, 10000.0),
            TermParameter::phase("psi", "phase"),
            TermParameter::new("fault_width", "rad", "width of the pulse in its own phase")
                .symbol("w")
                .size_25(0.2, 0.05, 1.0)
                .within(0.01, 10.0),
        ],
        states: &[],
    };

    const NARROW: bool = true;

    /// A pulse's slopes on both sides; between the pulses, to the next one: an arc is longer than its chord.
    #[inline(always)]
    fn reach<R: Real>(p: &[R], theta_m: R) -> R {
        let (_, cosine) = p[1].mul_add(theta_m, p[2]).sin_cos();
        let square = R::splat(2.0) - (cosine + cosine);
        let chord = square.max(R::zero()).sqrt();
        (p[3] * R::splat(SLOPES)).max(chord) / p[1]
    }

    #[inline(always)]
    fn highest_order<R: Real>(p: &[R]) -> R {
        p[1] / p[3].min(R::splat(1.0))
    }

    #[inline(always)]
    fn repeats_at<R: Real>(p: &[R], _inverse_ratio: R) -> R {
        p[1]
    }

    #[inline(always)]
    fn mesh<R: Real>(p: &[R], motion: &Motion<R>, mesh: &mut Mesh<R>, _hidden: Hidden<R>) {
        let (sine, cosine) = p[1].mul_add(motion.theta_m, p[2]).sin_cos();
        let sharpness = R::splat(1.0) / (p[3] * p[3]);
        let pulse = p[0] * ((cosine - R::splat(1.0)) * sharpness).exp();
        mesh.error = mesh.error + pulse;
        mesh.error_slope = mesh.error_slope - p[1] * sine * sharpness * pulse;
        let bend = sharpness * (sine * sine * sharpness - cosine);
        mesh.error_curvature = (p[1] * p[1] * pulse).mul_add(bend, mesh.error_curvature);
    }
}

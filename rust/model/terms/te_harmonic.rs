//! One more line of the kinematic error.

use super::line::add_line;
use super::{Hidden, Mesh, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct TeHarmonic;

impl Term for TeHarmonic {
    const INFO: TermInfo = TermInfo {
        id: "te_harmonic",
        place: Place::Mesh,
        bases: Base::ALL,
        description: "One more line of the kinematic error, at any order.",
        equation: "theta_e += A_cos cos(n theta_m) + A_sin sin(n theta_m)",
        source: "Ghorbel, Gandhi, Alpeter 2001; Tuttle, Seering 1996; 1 to 30 arcsec",
        amplitude: "A_cos",
        parameters: &[
            TermParameter::new("order", "1", "cycles per motor revolution")
                .symbol("n")
                .size_25(120.0 / 121.0, 0.008, 60.0)
                .within(1e-6, 10000.0),
            TermParameter::new("A_cos", "rad", "cosine amplitude").size_25(1e-5, -0.00015, 0.00015).within(-0.01, 0.01),
            TermParameter::new("A_sin", "rad", "sine amplitude").size_25(0.0, -0.00015, 0.00015).within(-0.01, 0.01),
        ],
        states: &[],
    };

    #[inline(always)]
    fn highest_order<R: Real>(p: &[R]) -> R {
        p[0]
    }

    #[inline(always)]
    fn repeats_at<R: Real>(p: &[R], _inverse_ratio: R) -> R {
        p[0]
    }

    #[inline(always)]
    fn mesh<R: Real>(p: &[R], motion: &Motion<R>, mesh: &mut Mesh<R>, _hidden: Hidden<R>) {
        add_line(mesh, motion, p[0], p[1], p[2]);
    }
}

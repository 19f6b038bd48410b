//! Passage of the teeth.

use super::line::add_line;
use super::{Hidden, Mesh, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct ToothPassage;

impl Term for ToothPassage {
    const INFO: TermInfo = TermInfo {
        id: "tooth_passage",
        place: Place::Mesh,
        bases: Base::ALL,
        description: "Lines of the teeth passing one lobe and both lobes.",
        equation: "theta_e += A_1 cos(z theta_m + psi_1) + A_2 cos(2 z theta_m + psi_2)",
        source: "tooth counts of the unit, 240 on the flexspline at ratio 121; amplitudes below 1 to 3 arcsec",
        amplitude: "A_one_lobe",
        parameters: &[
            TermParameter::new("teeth", "1", "teeth of the flexspline")
                .symbol("z")
                .size_25(240.0, 200.0, 320.0)
                .within(1.0, 10000.0),
            TermParameter::new("A_one_lobe", "rad", "amplitude at one lobe")
                .symbol("A_1")
                .size_25(5e-6, 0.0, 1.5e-5)
                .within(0.0, 0.01),
            TermParameter::phase("psi_1", "phase at one lobe"),
            TermParameter::new("A_both_lobes", "rad", "amplitude at both lobes")
                .symbol("A_2")
                .size_25(2e-6, 0.0, 1.5e-5)
                .within(0.0, 0.01),
            TermParameter::phase("psi_2", "phase at both lobes"),
        ],
        states: &[],
    };

    #[inline(always)]
    fn highest_order<R: Real>(p: &[R]) -> R {
        p[0] + p[0]
    }

    #[inline(always)]
    fn repeats_at<R: Real>(p: &[R], _inverse_ratio: R) -> R {
        p[0]
    }

    #[inline(always)]
    fn mesh<R: Real>(p: &[R], motion: &Motion<R>, mesh: &mut Mesh<R>, _hidden: Hidden<R>) {
        let (one_sine, one_cosine) = p[2].sin_cos();
        let (both_sine, both_cosine) = p[4].sin_cos();
        add_line(mesh, motion, p[0], p[1] * one_cosine, -(p[1] * one_sine));
        add_line(mesh, motion, p[0] + p[0], p[3] * both_cosine, -(p[3] * both_sine));
    }
}

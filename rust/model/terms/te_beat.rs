//! Lobe passage as the circular spline sees it.

use super::line::add_line;
use super::{Hidden, Mesh, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct TeBeat;

impl Term for TeBeat {
    const INFO: TermInfo = TermInfo {
        id: "te_beat",
        place: Place::Mesh,
        bases: Base::ALL,
        description: "The line of two lobes passing the circular spline, which beats with order 2 twice per output \
            revolution.",
        equation: "theta_e += A_cos cos(n theta_m) + A_sin sin(n theta_m), n = 2 - 2/i",
        source: "Jia, Li et al. 2021; He 2025; up to the amplitude of order 2",
        amplitude: "A_cos",
        parameters: &[
            TermParameter::new("A_cos", "rad", "cosine amplitude").size_25(5e-5, -0.00015, 0.00015).within(-0.01, 0.01),
            TermParameter::new("A_sin", "rad", "sine amplitude").size_25(0.0, -0.00015, 0.00015).within(-0.01, 0.01),
        ],
        states: &[],
    };

    #[inline(always)]
    fn highest_order<R: Real>(_p: &[R]) -> R {
        R::splat(2.0)
    }

    #[inline(always)]
    fn repeats_at<R: Real>(_p: &[R], inverse_ratio: R) -> R {
        let two = R::splat(2.0);
        (-two).mul_add(inverse_ratio, two)
    }

    #[inline(always)]
    fn mesh<R: Real>(p: &[R], motion: &Motion<R>, mesh: &mut Mesh<R>, _hidden: Hidden<R>) {
        add_line(mesh, motion, Self::repeats_at(p, motion.inverse_ratio), p[0], p[1]);
    }
}

//! A line of the kinematic error that grows with the load torque.

use super::line::add_line;
use super::{Hidden, Mesh, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct TeLoadDependence;

impl Term for TeLoadDependence {
    const INFO: TermInfo = TermInfo {
        id: "te_load_dependence",
        place: Place::Mesh,
        bases: Base::ALL,
        description: "A line of the kinematic error in proportion to the load torque in force, which is taken to \
            change slowly: speeds and energies leave its changes out.",
        equation: "theta_e += tau_load [A_cos cos(n theta_m) + A_sin sin(n theta_m)]",
        source: "Ghorbel, Gandhi, Alpeter 2001; a tenth to a half of the unloaded line at 67 N m",
        amplitude: "A_cos",
        parameters: &[
            TermParameter::new("order", "1", "cycles per motor revolution")
                .symbol("n")
                .size_25(2.0, 0.008, 60.0)
                .within(1e-6, 10000.0),
            TermParameter::new("A_cos", "rad/(N m)", "cosine amplitude per load torque")
                .size_25(3e-7, -7e-7, 7e-7)
                .within(-0.0001, 0.0001),
            TermParameter::new("A_sin", "rad/(N m)", "sine amplitude per load torque")
                .size_25(0.0, -7e-7, 7e-7)
                .within(-0.0001, 0.0001),
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
        let (cosine, sine) = (p[1] * mesh.load_torque, p[2] * mesh.load_torque);
        add_line(mesh, motion, p[0], cosine, sine);
    }
}

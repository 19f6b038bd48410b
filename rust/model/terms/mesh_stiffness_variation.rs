//! A stiffness that varies over a turn, with the reactions that keep the energy.

use super::{Gear, Hidden, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct MeshStiffnessVariation;

impl Term for MeshStiffnessVariation {
    const INFO: TermInfo = TermInfo {
        id: "mesh_stiffness_variation",
        place: Place::Mesh,
        bases: &[Base::TwoInertia],
        description: "Stiffness that varies twice per motor revolution and once per output revolution, with the \
            reactions that conserve energy.",
        equation: "tau_s -> tau_s f, f = 1 + eps_2 cos(2 theta_m + psi_2) + eps_o cos(theta_l + psi_o); V_s \
            (df/dtheta_m) resists the motor, V_s (df/dtheta_l) the load",
        source: "Gu et al. 2021; reactions from the potential V_s f",
        amplitude: "eps_2",
        parameters: &[
            TermParameter::new("eps_2", "1", "relative amplitude at order 2 of the motor")
                .size_25(0.02, 0.01, 0.05)
                .within(0.0, 0.49),
            TermParameter::phase("psi_2", "phase at order 2"),
            TermParameter::new("eps_o", "1", "relative amplitude once per output revolution")
                .size_25(0.02, 0.01, 0.05)
                .within(0.0, 0.49),
            TermParameter::phase("psi_o", "phase at the output order"),
        ],
        states: &[],
    };

    #[inline(always)]
    fn gear<R: Real>(p: &[R], motion: &Motion<R>, gear: &mut Gear<R>, _hidden: Hidden<R>) {
        let two = R::splat(2.0);
        let (motor_sine, motor_cosine) = two.mul_add(motion.theta_m, p[1]).sin_cos();
        let (load_sine, load_cosine) = (motion.theta_l + p[3]).sin_cos();
        let factor = p[0].mul_add(motor_cosine, p[2].mul_add(load_cosine, R::splat(1.0)));
        gear.motor_reaction = gear.motor_reaction * factor - gear.stiffness_factor * two * p[0] * motor_sine;
        gear.load_reaction = gear.load_reaction * factor - gear.stiffness_factor * p[2] * load_sine;
        gear.stiffness_factor = gear.stiffness_factor * factor;
    }
}

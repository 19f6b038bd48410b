//! What an unbalanced rotor does to its bracket.

use super::{Hidden, Motion, Place, Reaction, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct RotorUnbalanceReaction;

impl Term for RotorUnbalanceReaction {
    const INFO: TermInfo = TermInfo {
        id: "rotor_unbalance_reaction",
        place: Place::Motor,
        bases: &[Base::TwoInertia],
        description: "Centrifugal force of the rotor on the bracket, as a torque on the housing; without \
            base_compliance it moves nothing.",
        equation: "torque on the housing = U omega_m^2 cos(theta_m + psi), U = unbalance times lever of the bracket",
        source: "rigid unbalance, order 1, grade G 6.3 at 0.1 m of lever; the motor does not pay for its \
            work on the housing, which loss_terms lacks",
        amplitude: "unbalance",
        parameters: &[
            TermParameter::new("unbalance", "kg m^2", "unbalance times lever")
                .symbol("U")
                .size_25(1e-6, 0.0, 1e-5)
                .within(0.0, f64::INFINITY),
            TermParameter::phase("psi", "phase"),
        ],
        states: &[],
    };

    #[inline(always)]
    fn reaction<R: Real>(p: &[R], motion: &Motion<R>, reaction: &mut Reaction<R>, _hidden: Hidden<R>) {
        let wave = (motion.theta_m + p[1]).sin_cos().1;
        let pull = p[0] * motion.omega_m * motion.omega_m * wave;
        reaction.on_housing = reaction.on_housing + pull;
    }
}

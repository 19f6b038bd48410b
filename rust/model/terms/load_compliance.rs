//! A payload behind a coupling.

use super::wound::twist;
use super::{Hidden, Load, Motion, Place, Term, TermInfo, TermParameter, TermState, Wound};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct LoadCompliance;

impl Term for LoadCompliance {
    const INFO: TermInfo = TermInfo {
        id: "load_compliance",
        place: Place::Load,
        bases: &[Base::TwoInertia],
        description: "Output coupling or torque cell between the output and a payload, which takes its share of the \
            inertia and all load torque; in energies it is what the output drives: what passes the coupling counts, and \
            what its damper takes does not.",
        equation: "J_2 domega_2/dt = tau_k - tau_load, tau_k = K_c u + c_c (omega_l - omega_2), du/dt = omega_l - \
            omega_2, J_2 = share J_l; tau_k loads the rest of J_l",
        source: "two masses; 1e4 to 1e5 N m/rad lowers the locked mode by 51 to 13 % with all inertia beyond it",
        amplitude: "K_c",
        parameters: &[
            TermParameter::new("K_c", "N m/rad", "stiffness of the coupling")
                .size_25(50000.0, 10000.0, 100000.0)
                .within(0.0, f64::INFINITY),
            TermParameter::new("c_c", "N m s/rad", "damping of the coupling")
                .size_25(10.0, 0.0, 100.0)
                .within(0.0, f64::INFINITY),
            TermParameter::new("payload_share", "1", "share of J_l beyond the coupling")
                .size_25(0.8, 0.1, 0.95)
                .within(0.01, 0.99),
        ],
        states: &[
            TermState { name: "output_twist", unit: "rad", scale: 1e-6 },
            TermState { name: "omega_2", unit: "rad/s", scale: 1e-3 },
        ],
    };

    #[inline(always)]
    fn begin<R: Real>(_p: &[R], motion: &Motion<R>, states: &mut [R]) {
        states[1] = motion.omega_l;
    }

    #[inline(always)]
    fn wind<R: Real>(p: &[R], wound: &mut Wound<R>, states: &mut [R]) {
        states[0] = twist(wound.load_torque, p[0]);
    }

    #[inline(always)]
    fn load<R: Real>(p: &[R], motion: &Motion<R>, load: &mut Load<R>, hidden: Hidden<R>) {
        let payload = p[2] * load.inertia;
        let slip = motion.omega_l - hidden.states[1];
        let coupling = p[0].mul_add(hidden.states[0], p[1] * slip);
        hidden.rates[0] = slip;
        hidden.rates[1] = (coupling - load.torque) / payload;
        load.torque = coupling;
        load.inertia = load.inertia - payload;
    }
}

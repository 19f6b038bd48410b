//! Windup that returns on another path and remembers where it turned.

use super::sizes::LOAD_SPEED;
use super::{Gear, Hidden, Motion, Place, Term, TermInfo, TermParameter, TermState};
use crate::model::Base;
use crate::real::Real;

/// Windups at which the elements slip, as shares of their mean.
const YIELDS: [f64; 4] = [0.25, 0.75, 1.25, 1.75];
const SHARE: f64 = 1.0 / YIELDS.len() as f64;

/// See [`Term::INFO`].
pub struct MaxwellSlip;

impl Term for MaxwellSlip {
    const INFO: TermInfo = TermInfo {
        id: "maxwell_slip",
        place: Place::Mesh,
        bases: &[Base::TwoInertia],
        description: "Rate-independent hysteresis of the flexspline from four springs that slip one after the other: \
            small loops inside of a large one nearly close.",
        equation: "tau_h = T_h (z_1 + z_2 + z_3 + z_4)/4; dz_j/dt = dphi/dt (1 - z_j^4 where z_j dphi/dt > 0) / \
            (phi_h (2 j - 1)/4)",
        source: "Iwan 1966; Al-Bender, Lampaert, Swevers 2005; slip rounded off as by Bouc-Wen with beta = 1/2, n = 4; \
            torque from a loop width of at most 1 arcmin",
        amplitude: "T_h",
        parameters: &[
            TermParameter::new("T_h", "N m", "torque of all elements while they slip")
                .size_25(2.0, 0.5, 4.5)
                .within(0.0, f64::INFINITY),
            TermParameter::new("phi_h", "rad", "windup at which they slip, on average")
                .size_25(0.0003, 0.0001, 0.001)
                .within(1e-9, f64::INFINITY),
        ],
        states: &[element("slip_1"), element("slip_2"), element("slip_3"), element("slip_4")],
    };
    const CORNERS: usize = 1;

    #[inline(always)]
    fn stored<R: Real>(p: &[R], _gear: &Gear<R>, states: &[R]) -> R {
        let stretch = |sum: R, (state, share): (&R, f64)| (R::splat(share) * *state).mul_add(*state, sum);
        R::splat(0.5 * SHARE) * p[0] * p[1] * states.iter().zip(YIELDS).fold(R::zero(), stretch)
    }

    #[inline(always)]
    fn gear<R: Real>(p: &[R], _motion: &Motion<R>, gear: &mut Gear<R>, mut hidden: Hidden<R>) {
        let rate = gear.windup_rate;
        let way = hidden.sign(0, rate, LOAD_SPEED);
        let own = rate / p[1];
        let mut carried = R::zero();
        for (element, share) in YIELDS.into_iter().enumerate() {
            let state = hidden.states[element];
            let square = state * state;
            let filled = R::select((state * way).lt(R::zero()), R::zero(), square * square);
            hidden.rates[element] = R::splat(1.0 / share) * (-own).mul_add(filled, own);
            carried = carried + state;
        }
        gear.added_torque = (R::splat(SHARE) * p[0]).mul_add(carried, gear.added_torque);
    }
}

const fn element(name: &'static str) -> TermState {
    TermState { name, unit: "1", scale: 1e-2 }
}

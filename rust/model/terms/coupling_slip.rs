//! A clamped coupling that slips.

use super::{Gear, Hidden, Motion, Place, Term, TermInfo, TermParameter, TermState};
use crate::model::Base;
use crate::real::{Real, Scalar};

/// See [`Term::INFO`].
pub struct CouplingSlip;

impl Term for CouplingSlip {
    const INFO: TermInfo = TermInfo {
        id: "coupling_slip",
        place: Place::Mesh,
        bases: &[Base::TwoInertia],
        description: "Clamped coupling in line with the gear spring: slips where the spring torque exceeds what it \
            holds, for ever, and lets go a share of the windup.",
        equation: "tau_s(phi - q); q += r (phi - q) where abs(tau_s) > T_slip",
        source: "clamping hubs; the slip is over in less than a period of the torsional mode and taken as a jump",
        amplitude: "relief",
        parameters: &[
            TermParameter::new("T_slip", "N m", "spring torque that the coupling holds")
                .size_25(100.0, 20.0, 300.0)
                .within(1e-3, f64::INFINITY),
            TermParameter::new("relief", "1", "share of the windup that a slip lets go")
                .symbol("r")
                .size_25(0.5, 0.1, 1.0)
                .within(1e-3, 1.0),
        ],
        states: &[TermState { name: "slipped", unit: "rad", scale: 1e-5 }],
    };
    const JUMPS: bool = true;

    #[inline(always)]
    fn gear<R: Real>(_p: &[R], _motion: &Motion<R>, gear: &mut Gear<R>, hidden: Hidden<R>) {
        gear.spring_windup = gear.spring_windup - hidden.states[0];
        gear.let_go = gear.let_go + hidden.states[0];
        hidden.rates[0] = R::zero();
    }

    #[inline(always)]
    fn reserve<R: Real>(p: &[R], _gear: &Gear<R>, spring_torque: R, _states: &[R]) -> R {
        p[0] - spring_torque.abs()
    }

    fn jump<S: Scalar>(p: &[S], gear: &Gear<S>, _spring_torque: S, states: &mut [S]) {
        states[0] = states[0] + p[1] * gear.left();
    }
}

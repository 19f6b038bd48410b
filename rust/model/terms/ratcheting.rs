//! Teeth that jump.

use super::{Gear, Hidden, Motion, Place, Term, TermInfo, TermParameter, TermState};
use crate::model::Base;
use crate::real::{Real, Scalar};

/// See [`Term::INFO`].
pub struct Ratcheting;

impl Term for Ratcheting {
    const INFO: TermInfo = TermInfo {
        id: "ratcheting",
        place: Place::Mesh,
        bases: &[Base::TwoInertia],
        description: "Teeth that ride over one another where the spring torque exceeds what they hold: the spring carries \
            nothing until they fall into the next gap, one pitch further for ever, or back.",
        equation: "tau_s(phi - q) while engaged, 0 while riding; riding in the way of tau_s from abs(tau_s) > T_rat until \
            abs(phi - q) = 2 pi / z, then q += 2 pi / z in that way, or until phi = q",
        source: "tooth jump of the catalogue ratcheting torque; pitch of the circular spline, 1.49 deg for 242 teeth",
        amplitude: "T_rat",
        parameters: &[
            TermParameter::new("T_rat", "N m", "spring torque that the teeth hold")
                .size_25(350.0, 250.0, 450.0)
                .within(1e-3, f64::INFINITY),
            TermParameter::new("spline_teeth", "1", "teeth of the circular spline")
                .symbol("z")
                .size_25(242.0, 62.0, 322.0)
                .within(1.0, 10000.0),
        ],
        states: &[
            TermState { name: "jumped", unit: "rad", scale: 1e-5 },
            TermState { name: "riding", unit: "1", scale: 1.0 },
        ],
    };
    const JUMPS: bool = true;

    #[inline(always)]
    fn gear<R: Real>(_p: &[R], _motion: &Motion<R>, gear: &mut Gear<R>, hidden: Hidden<R>) {
        let engaged = hidden.states[1].abs().le(R::zero());
        let seen = gear.spring_windup - hidden.states[0];
        gear.spring_windup = R::select(engaged, seen, R::zero());
        gear.let_go = gear.let_go + hidden.states[0];
        hidden.rates[0] = R::zero();
        hidden.rates[1] = R::zero();
    }

    #[inline(always)]
    fn reserve<R: Real>(p: &[R], gear: &Gear<R>, spring_torque: R, states: &[R]) -> R {
        let way = states[1];
        let ridden = way * gear.left();
        let ahead = R::splat(std::f64::consts::TAU) / p[1] - ridden;
        R::select(way.abs().le(R::zero()), p[0] - spring_torque.abs(), ridden.min(ahead))
    }

    fn jump<S: Scalar>(p: &[S], gear: &Gear<S>, spring_torque: S, states: &mut [S]) {
        let way = states[1];
        if way.plain() == 0.0 {
            states[1] = S::splat(spring_torque.plain().signum());
            return;
        }
        let pitch = S::splat(std::f64::consts::TAU) / p[1];
        if pitch.lt(S::splat(2.0) * way * gear.left()) {
            states[0] = states[0] + way * pitch;
        }
        states[1] = S::zero();
    }
}

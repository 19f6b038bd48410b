//! Windup that returns on another path, whatever the rate.

use super::sizes::{LOAD_SPEED, SHARE};
use super::{Gear, Hidden, Motion, Place, Term, TermInfo, TermParameter, TermState};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct Hysteresis;

impl Term for Hysteresis {
    const INFO: TermInfo = TermInfo {
        id: "hysteresis",
        place: Place::Mesh,
        bases: &[Base::TwoInertia],
        description: "Rate-independent hysteresis of the flexspline (normalised Bouc-Wen): the loop area grows with \
            amplitude and saturates.",
        equation: "tau_h = T_h zeta; dzeta/dt = [dphi/dt - beta abs(dphi/dt) abs(zeta)^(n-1) zeta - (1 - beta) \
            (dphi/dt) abs(zeta)^n] / phi_h",
        source: "Wen 1976; Dhaouadi, Ghorbel, Gandhi 2003; torque from a loop width of at most 1 arcmin; \
            dissipative for beta >= 0.5",
        amplitude: "T_h",
        parameters: &[
            TermParameter::new("T_h", "N m", "hysteresis torque").size_25(2.0, 0.5, 4.5).within(0.0, f64::INFINITY),
            TermParameter::new("phi_h", "rad", "windup over which it builds up")
                .size_25(0.0004, 0.0001, 0.001)
                .within(1e-9, f64::INFINITY),
            TermParameter::new("beta", "1", "share of the loop that dissipates")
                .size_25(0.7, 0.5, 1.0)
                .within(0.5, 1.0),
            TermParameter::new("loop_sharpness", "1", "sharpness of the transition")
                .symbol("n")
                .size_25(1.0, 1.0, 2.0)
                .within(1.0, 10.0),
        ],
        states: &[TermState { name: "zeta", unit: "1", scale: 1e-2 }],
    };
    const CORNERS: usize = 2;

    #[inline(always)]
    fn stored<R: Real>(p: &[R], _gear: &Gear<R>, states: &[R]) -> R {
        R::splat(0.5) * p[0] * p[1] * states[0] * states[0]
    }

    #[inline(always)]
    fn gear<R: Real>(p: &[R], _motion: &Motion<R>, gear: &mut Gear<R>, mut hidden: Hidden<R>) {
        let [torque, windup, dissipating, sharpness] = [p[0], p[1], p[2], p[3]];
        let (zeta, rate) = (hidden.states[0], gear.windup_rate);
        let (side, way) = (hidden.sign(0, zeta, SHARE), hidden.sign(1, rate, LOAD_SPEED));
        let power = zeta.abs().powf(sharpness);
        let filled = R::select((side * zeta).lt(R::zero()), -power, power);
        let slip = dissipating.mul_add(side * way * rate - rate, rate);
        hidden.rates[0] = (rate - slip * filled) / windup;
        gear.added_torque = torque.mul_add(zeta, gear.added_torque);
    }
}

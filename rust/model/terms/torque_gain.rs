//! A torque constant that is not what it should be.

use super::sizes::SHARE;
use super::{Actuator, Hidden, Motion, Place, Term, TermInfo, TermParameter};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct TorqueGain;

impl Term for TorqueGain {
    const INFO: TermInfo = TermInfo {
        id: "torque_gain",
        place: Place::Actuator,
        bases: Base::ALL,
        description: "Torque constant off by a factor, and falling towards the peak current.",
        equation: "tau_a = (1 + eps) (1 - s_k min((tau_c / tau_peak)^2, 1)) tau_c",
        source: "tolerance of torque constants +-5 to 10 %; magnetic saturation 10 to 20 % at peak current",
        amplitude: "gain_error",
        parameters: &[
            TermParameter::new("gain_error", "1", "relative error of the torque constant")
                .symbol("eps")
                .size_25(0.05, -0.1, 0.1)
                .within(-0.99, 10.0),
            TermParameter::new("saturation_share", "1", "share lost at the peak torque")
                .symbol("s_k")
                .size_25(0.0, 0.0, 0.2)
                .within(0.0, 0.33),
            TermParameter::new("tau_peak", "N m", "peak torque of the motor")
                .size_25(3.0, 0.6, 10.0)
                .within(1e-6, f64::INFINITY),
        ],
        states: &[],
    };
    const CORNERS: usize = 1;

    #[inline(always)]
    fn actuator<R: Real>(p: &[R], _motion: &Motion<R>, actuator: &mut Actuator<R>, mut hidden: Hidden<R>) {
        let one = R::splat(1.0);
        let share = actuator.torque / p[2];
        let lost = p[1] * hidden.min(0, share * share, one, SHARE);
        actuator.torque = actuator.torque * (one + p[0]) * (one - lost);
    }
}

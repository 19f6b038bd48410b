//! Oil that thins as the drive warms.

use super::{Dry, Hidden, Motion, Place, Term, TermInfo, TermParameter, TermState};
use crate::model::Base;
use crate::real::Real;

/// See [`Term::INFO`].
pub struct ThermalViscous;

impl Term for ThermalViscous {
    const INFO: TermInfo = TermInfo {
        id: "thermal_viscous",
        place: Place::Motor,
        bases: Base::ALL,
        description: "Viscous drag that falls as the lost power warms the drive; the warming starts at the ambient \
            temperature.",
        equation: "B -> B exp(-beta (theta_a + w - 20)); C dw/dt = P_loss - C w / tau_w, P_loss what B and the \
            friction of the motor shaft lose",
        source: "Wolf, Iskandar 2018 and Simoni 2018 for the exponential law; heat capacity and time constant \
            chosen for the size",
        amplitude: "beta",
        parameters: &[
            TermParameter::new("beta", "1/K", "relative fall of the drag").size_25(0.03, 0.02, 0.05).within(0.0, 1.0),
            TermParameter::new("heat_capacity", "J/K", "heat capacity")
                .symbol("C")
                .size_25(700.0, 500.0, 1000.0)
                .within(0.001, f64::INFINITY),
            TermParameter::new("cooling_time", "s", "time constant of cooling")
                .symbol("tau_w")
                .size_25(2400.0, 1200.0, 3600.0)
                .within(0.001, f64::INFINITY),
            TermParameter::new("ambient_temperature", "degC", "ambient temperature")
                .symbol("theta_a")
                .size_25(20.0, 10.0, 35.0)
                .within(-60.0, 150.0),
        ],
        states: &[TermState { name: "warming", unit: "K", scale: 1e-2 }],
    };
    const SUSTAINED: bool = true;

    #[inline(always)]
    fn motor_friction<R: Real>(p: &[R], motion: &Motion<R>, dry: &mut Dry<R>, hidden: Hidden<R>) {
        let [fall, capacity, time, ambient] = [p[0], p[1], p[2], p[3]];
        let warming = hidden.states[0];
        dry.drag = dry.drag * (-(fall * (ambient + warming - R::splat(20.0)))).exp();
        let handed_on = dry.drag * dry.handed_on * motion.omega_l;
        let loss = (dry.torque() + dry.viscous) * motion.omega_m - handed_on;
        hidden.rates[0] = loss / capacity - warming / time;
    }
}

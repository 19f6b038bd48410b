//! Quadratures carried along with the stages: exact to the order of the method, no extra evaluation.

use crate::model::{Constants, Rates};
use crate::real::Real;

/// How many quadratures there are.
pub const INTEGRALS: usize = 10;

/// Gauss's rule of order 6 on [0, 1]: places and weights.
pub const GAUSS: [(f64, f64); 3] =
    [(0.1127016653792583, 0.2777777777777778), (0.5, 0.4444444444444444), (0.8872983346207417, 0.2777777777777778)];

/// What each quadrature integrates over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Integral {
    /// Transmission error.
    Te,
    /// Its square.
    TeSquare,
    /// Square of the windup rate.
    WindupRateSquare,
    /// Load speed.
    OmegaL,
    /// Its square.
    OmegaLSquare,
    /// Power of the motor.
    MotorPower,
    /// Power taken by the load torque.
    LoadPower,
    /// Power lost in B_m.
    MotorLoss,
    /// Power lost in B_ml.
    WaveGeneratorLoss,
    /// Power taken by terms.
    TermPower,
}

/// Which quadratures a sweep needs.
#[derive(Clone, Copy, Debug, Default)]
pub struct Integrands {
    /// Transmission error and its square.
    pub te: bool,
    /// Square of the windup rate.
    pub ring: bool,
    /// Load speed and its square.
    pub speed: bool,
    /// Powers; what is lost in B_l and B_sp follows from the squares of their speeds.
    pub energy: bool,
}

impl Integrands {
    /// How many quadratures, the first ones, hold all that are needed.
    #[inline(always)]
    pub fn count(self) -> usize {
        match self {
            Self { energy: true, .. } => INTEGRALS,
            Self { speed: true, .. } => Integral::OmegaLSquare as usize + 1,
            Self { ring: true, .. } => Integral::WindupRateSquare as usize + 1,
            Self { te: true, .. } => Integral::TeSquare as usize + 1,
            _ => 0,
        }
    }

    /// Adds `weight` times the integrands to the sums.
    #[inline(always)]
    pub fn add<R: Real, const N: usize>(
        self,
        weight: R,
        rates: &Rates<R, N>,
        c: &Constants<R>,
        sums: &mut [R; INTEGRALS],
    ) {
        let mut put = |index: Integral, factor: R, value: R| {
            let sum = &mut sums[index as usize];
            *sum = factor.mul_add(value, *sum);
        };
        if self.te {
            let weighted = weight * rates.te;
            put(Integral::Te, weight, rates.te);
            put(Integral::TeSquare, weighted, rates.te);
        }
        if self.ring {
            put(Integral::WindupRateSquare, weight * rates.windup_rate, rates.windup_rate);
        }
        if self.speed {
            let weighted = weight * rates.omega_l;
            put(Integral::OmegaL, weight, rates.omega_l);
            put(Integral::OmegaLSquare, weighted, rates.omega_l);
        }
        if self.energy {
            let omega_m = rates.slope[0];
            let slip = (-c.s).mul_add(rates.omega_l, omega_m);
            put(Integral::MotorPower, weight * rates.motor_torque, omega_m);
            put(Integral::LoadPower, weight * rates.load_torque, rates.omega_l);
            put(Integral::MotorLoss, weight * c.b_m * omega_m, omega_m);
            put(Integral::WaveGeneratorLoss, weight * c.b_ml * slip, slip);
            put(Integral::TermPower, weight, rates.term_power);
        }
    }
}

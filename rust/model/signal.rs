//! Time signals a user can ask for.

use super::{Base, Layout, Rates};
use crate::real::Real;

/// One signal of a trajectory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// Motor angle.
    ThetaM,
    /// Motor speed.
    OmegaM,
    /// Load angle.
    ThetaL,
    /// Load speed.
    OmegaL,
    /// Transmission error theta_m/i - theta_l.
    Te,
    /// Windup of the gear spring.
    Windup,
    /// Its rate.
    WindupRate,
    /// Kinematic error.
    ThetaE,
    /// Motor torque.
    MotorTorque,
    /// Torque that the drive delivers.
    DriveTorque,
    /// Gear torque at the output.
    GearTorque,
}

impl Signal {
    /// All signals with name, unit and meaning.
    pub const ALL: [(Self, &str, &str, &str); 11] = [
        (Self::ThetaM, "theta_m", "rad", "motor angle"),
        (Self::OmegaM, "omega_m", "rad/s", "motor speed"),
        (Self::ThetaL, "theta_l", "rad", "load angle"),
        (Self::OmegaL, "omega_l", "rad/s", "load speed"),
        (Self::Te, "te", "rad", "transmission error theta_m/ratio - theta_l"),
        (Self::Windup, "windup", "rad", "windup of the gear spring at the output"),
        (Self::WindupRate, "windup_rate", "rad/s", "rate of the windup"),
        (Self::ThetaE, "theta_e", "rad", "kinematic error of the rigid gear at the output"),
        (
            Self::MotorTorque,
            "tau_m",
            "N m",
            "motor torque, behind the coupling of input_compliance; with imposed motion the torque it takes",
        ),
        (
            Self::DriveTorque,
            "tau_drive",
            "N m",
            "what the drive makes of the torque asked for, up to the coupling of input_compliance; tau_m unless the motion is imposed",
        ),
        (Self::GearTorque, "gear_torque", "N m", "torque of spring and mesh damping at the output"),
    ];

    /// The signal of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|entry| entry.1 == name).map(|entry| entry.0)
    }

    /// The states it is made of, as a set of bits.
    pub fn states(self, layout: &Layout) -> u64 {
        match (self, layout.base) {
            (Self::ThetaM, _) => 0b1,
            (Self::OmegaM, _) => 0b10,
            (Self::ThetaL, Base::TwoInertia) => 0b101,
            (Self::Te, Base::TwoInertia) => 0b100,
            (Self::OmegaL, Base::TwoInertia) => 0b1000,
            (Self::Windup, Base::TwoInertia) if layout.terms.on.is_empty() => 0b101,
            (Self::ThetaE, Base::TwoInertia) if layout.terms.on.is_empty() => 0b1,
            _ => u64::MAX,
        }
    }

    /// Whether the state tells it without the equations.
    pub fn is_of_state(self, base: Base) -> bool {
        matches!(
            (self, base),
            (Self::ThetaM | Self::OmegaM, _) | (Self::ThetaL | Self::Te | Self::OmegaL, Base::TwoInertia)
        )
    }

    /// Its value, out of what the equations pass through where the state alone does not tell it.
    #[inline(always)]
    pub fn value<R: Real, const N: usize>(self, state: &[R; N], rates: Option<&Rates<R, N>>, inverse_ratio: R) -> R {
        let (te, omega_l) = match rates {
            Some(rates) => (rates.te, rates.omega_l),
            None => (state[2], state[3]),
        };
        match (self, rates) {
            (Self::ThetaM, _) => state[0],
            (Self::OmegaM, _) => state[1],
            (Self::ThetaL, _) => state[0] * inverse_ratio - te,
            (Self::Te, _) => te,
            (Self::OmegaL, _) => omega_l,
            (Self::Windup, Some(rates)) => rates.windup,
            (Self::WindupRate, Some(rates)) => rates.windup_rate,
            (Self::ThetaE, Some(rates)) => rates.error,
            (Self::MotorTorque, Some(rates)) => rates.motor_torque,
            (Self::DriveTorque, Some(rates)) => rates.drive_torque,
            (Self::GearTorque, Some(rates)) => rates.gear_torque,
            (_, None) => R::splat(f64::NAN),
        }
    }
}

//! Time signals a user can ask for.

use crate::model::{Base, Layout, Quantity};
use crate::real::Scalar;
use crate::solve::{ALL_STATES, Demand, Retrace, Seat};

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
        (Self::MotorTorque, "tau_m", "N m", "motor torque; with imposed motion the torque it takes"),
        (
            Self::DriveTorque,
            "tau_drive",
            "N m",
            "torque that the drive delivers out of the one asked for; tau_m unless the motion is imposed",
        ),
        (Self::GearTorque, "gear_torque", "N m", "torque of spring and mesh damping at the output"),
    ];

    /// The signal of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|entry| entry.1 == name).map(|entry| entry.0)
    }

    /// The signal at an instant of a row.
    pub fn value<S: Scalar, const N: usize>(
        self,
        seat: &Seat<S, N>,
        retrace: &mut dyn Retrace<S, N>,
        t: f64,
        state: &[S; N],
    ) -> S {
        let inverse_ratio = seat.assignment.row.constants.inverse_ratio;
        match (self.of_state(retrace.base(), state, inverse_ratio), self.quantity()) {
            (None, Some(quantity)) => {
                let value = quantity.of(&retrace.rates(seat, t, state));
                self.of_quantity(value, state, inverse_ratio)
            }
            (told, _) => told.unwrap_or(S::splat(f64::NAN)),
        }
    }

    /// Tells the solver which states samples of the signal are made of.
    pub fn require(self, layout: &Layout, demand: &mut Demand) {
        demand.sampled |= match (self, layout.base) {
            (Self::ThetaM, _) => 0b1,
            (Self::OmegaM, _) => 0b10,
            (Self::ThetaL, Base::TwoInertia) => 0b101,
            (Self::Te, Base::TwoInertia) => 0b100,
            (Self::OmegaL, Base::TwoInertia) => 0b1000,
            (Self::Windup, Base::TwoInertia) if layout.terms.on.is_empty() => 0b101,
            (Self::ThetaE, Base::TwoInertia) if layout.terms.on.is_empty() => 0b1,
            _ => ALL_STATES,
        };
    }

    /// The state that a signal is.
    pub fn state(self, base: Base) -> Option<usize> {
        match (self, base) {
            (Self::ThetaM, _) => Some(0),
            (Self::OmegaM, _) => Some(1),
            (Self::Te, Base::TwoInertia) => Some(2),
            (Self::OmegaL, Base::TwoInertia) => Some(3),
            _ => None,
        }
    }

    /// A signal that is a state, or a sum of states.
    pub fn of_state<S: Scalar, const N: usize>(self, base: Base, state: &[S; N], inverse_ratio: S) -> Option<S> {
        match (self, base) {
            (Self::ThetaL, Base::TwoInertia) => Some(state[0] * inverse_ratio - state[2]),
            _ => self.state(base).map(|index| state[index]),
        }
    }

    /// What the equations pass through for a signal that no state tells.
    pub fn quantity(self) -> Option<Quantity> {
        match self {
            Self::ThetaM | Self::OmegaM => None,
            Self::ThetaL | Self::Te => Some(Quantity::Te),
            Self::OmegaL => Some(Quantity::OmegaL),
            Self::Windup => Some(Quantity::Windup),
            Self::WindupRate => Some(Quantity::WindupRate),
            Self::ThetaE => Some(Quantity::Error),
            Self::MotorTorque => Some(Quantity::MotorTorque),
            Self::DriveTorque => Some(Quantity::DriveTorque),
            Self::GearTorque => Some(Quantity::GearTorque),
        }
    }

    /// The signal out of that.
    pub fn of_quantity<S: Scalar, const N: usize>(self, value: S, state: &[S; N], inverse_ratio: S) -> S {
        if self == Self::ThetaL { state[0] * inverse_ratio - value } else { value }
    }
}

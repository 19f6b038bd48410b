//! Natural sizes of what has corners: nearer to a corner than these, times the tolerance, no step is cut short.

/// Windup [rad].
pub const WINDUP: f64 = 1e-5;
/// Speed of the motor [rad/s].
pub const MOTOR_SPEED: f64 = 0.1;
/// Speed of the output [rad/s].
pub const LOAD_SPEED: f64 = 1e-3;
/// Torque at the motor [N m].
pub const MOTOR_TORQUE: f64 = 1e-2;
/// Shares.
pub const SHARE: f64 = 1e-2;

//! The mean motor torque that holds the set speed.
//!
//! It balances dampers, load and friction of a drive that turns evenly, as warm as it begins. What varies about zero
//! over a turn or in time asks for nothing in the mean, dry friction for nothing at rest. What the drive makes of the
//! command is its own affair: where it delivers something else, the set speed is missed.

use super::terms::{Choice, Dry, HIDDEN, Internals, Motion, Terms};
use super::{Constants, Corners, sign};
use crate::real::Scalar;

/// The mean motor torque [N m] that holds a speed of the motor [rad/s] against a load torque [N m].
pub fn sustaining_torque<S: Scalar>(
    c: &Constants<S>,
    (terms, values): (&Choice, &[S]),
    omega_m: S,
    load_torque: S,
) -> S {
    let slip = S::splat(1.0) - c.s * c.inverse_ratio;
    let damping = c.b_m + c.b_ml * slip * slip + c.b_l * c.inverse_ratio * c.inverse_ratio;
    let mut terms = Terms::new(terms).sustained();
    terms.set_lane(0, values);
    damping * omega_m + load_torque * c.inverse_ratio + friction(c, &terms, omega_m, load_torque)
}

/// What the friction of the terms takes of it.
fn friction<S: Scalar>(c: &Constants<S>, terms: &Terms<S>, omega_m: S, load_torque: S) -> S {
    let zero = S::zero();
    let motion = Motion::of_motor(zero, omega_m, c.inverse_ratio);
    let omega_l = motion.omega_l;
    let on_motor = |gear_torque: S, states: &[S; HIDDEN]| {
        let mut dry = Dry::of_motor(sign(omega_m), c.motor_dampers(omega_m, omega_l), gear_torque);
        terms.motor_friction(&motion, &mut dry, &mut Internals::new(states, Corners::new(None)));
        dry
    };
    let mut states = [zero; HIDDEN];
    terms.begin(&motion, &mut states);
    let unloaded = on_motor(zero, &states);
    terms.settle(&motion, &unloaded, &mut states);
    let mut on_load = Dry::of_output(sign(omega_l), &unloaded);
    terms.load_friction(&motion, &mut on_load, &mut Internals::new(&states, Corners::new(None)));
    let output = taken(&on_load);
    let gear_torque = c.d_ll * omega_l - c.d_ml * omega_m + load_torque + output;
    taken(&on_motor(gear_torque, &states)) + output * c.inverse_ratio
}

/// Torque of a shaft that slides, or what is not dry of it.
fn taken<S: Scalar>(dry: &Dry<S>) -> S {
    if dry.direction.plain() == 0.0 { dry.not_dry() } else { dry.torque() }
}

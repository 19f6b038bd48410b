//! The base models with the physics they leave out.
//!
//! States: those of the base model, then the hidden states of the terms that are on.

mod elastic;
mod rigid;

pub use elastic::Extended;
pub use rigid::ExtendedRigid;

use super::input::Inputs;
use super::terms::{Actuator, Dry, HIDDEN, Internals, Load, Mesh, Motion, at_rest};
use super::two_inertia::controlled;
use super::{Corners, Drivetrain, Shaft, sign};
use crate::real::{Mask, Real};

/// Both sides of the gear at one instant, and what the terms make of them.
struct Sides<'a, R: Real> {
    drive: &'a Drivetrain<'a, R>,
    inputs: Inputs<R>,
    motion: Motion<R>,
    inner: Internals<'a, R>,
}

impl<'a, R: Real> Sides<'a, R> {
    #[inline(always)]
    fn new(drive: &'a Drivetrain<'a, R>, motion: Motion<R>, hidden: &'a [R; HIDDEN], corners: Corners<'a, R>) -> Self {
        let inputs = drive.input.at(motion.t);
        Self { drive, inputs, motion, inner: Internals::new(hidden, corners) }
    }

    /// The torque asked of the drive and the rate of the speed controller.
    #[inline(always)]
    fn controlled(&mut self, z: R) -> (R, R) {
        let Motion { t, omega_m, .. } = self.motion;
        controlled(self.drive, &mut self.inner.corners, t, self.inputs.reference, omega_m, z)
    }

    /// The torque that the drive delivers and the inertia it turns.
    #[inline(always)]
    fn actuator(&mut self, asked: R) -> Actuator<R> {
        let mut actuator = Actuator { torque: asked, inertia: self.drive.constants.j_m };
        self.drive.terms.actuator(&self.motion, &mut actuator, &mut self.inner);
        actuator
    }

    #[inline(always)]
    fn mesh(&mut self, error_curvature: R) -> Mesh<R> {
        let own = self.drive.harmonics.value_and_slope(self.motion.theta_m);
        let mut mesh = Mesh::new(own, error_curvature, self.inputs.load);
        self.drive.terms.mesh(&self.motion, &mut mesh, &mut self.inner);
        mesh
    }

    #[inline(always)]
    fn load(&mut self) -> Load<R> {
        let mut load = Load { torque: self.inputs.load, inertia: self.drive.constants.j_l };
        self.drive.terms.load(&self.motion, &mut load, &mut self.inner);
        load
    }

    #[inline(always)]
    fn motor_friction(&mut self, direction: R, gear_torque: R) -> Dry<R> {
        let mut dry = Dry::of_motor(direction, self.dampers(), gear_torque);
        self.drive.terms.motor_friction(&self.motion, &mut dry, &mut self.inner);
        dry.hold();
        dry
    }

    /// Friction that a motor without gear torque would have; its corners do not count.
    #[inline(always)]
    fn unloaded_motor_friction(&self, direction: R) -> Dry<R> {
        let mut dry = Dry::of_motor(direction, self.dampers(), R::zero());
        let mut inner = Internals::new(self.inner.states, self.inner.corners.unnoted());
        self.drive.terms.motor_friction(&self.motion, &mut dry, &mut inner);
        dry
    }

    #[inline(always)]
    fn dampers(&self) -> [R; 2] {
        self.drive.constants.motor_dampers(self.motion.omega_m, self.motion.omega_l)
    }

    #[inline(always)]
    fn load_friction(&mut self, direction: R, motor: &Dry<R>) -> Dry<R> {
        let mut dry = Dry::of_output(direction, motor);
        self.drive.terms.load_friction(&self.motion, &mut dry, &mut self.inner);
        dry
    }

    /// The way the motor slides: that of its friction, or that of a motion it is forced into.
    #[inline(always)]
    fn motor_direction(&self) -> R {
        let Some(imposed) = self.drive.input.motion() else { return self.drive.directions[0] };
        R::select(imposed, sign(self.motion.omega_m), self.drive.directions[0])
    }

    /// How a motor moves that is driven by the actuator against a torque and dry friction.
    #[inline(always)]
    fn motor(&self, asked: R, actuator: &Actuator<R>, resisting: R, dry: &Dry<R>, inertia: R) -> Motor<R> {
        let shaft = Shaft { net: actuator.torque - resisting, breakaway: dry.breakaway };
        let mut motor = Motor { shaft, alpha: acceleration(shaft.net, dry, inertia), asked, torque: actuator.torque };
        if let Some(imposed) = self.drive.input.motion() {
            motor.alpha = R::select(imposed, self.drive.input.acceleration(self.motion.t), motor.alpha);
            let needed = dry.direction.mul_add(dry.level, inertia.mul_add(motor.alpha, resisting));
            motor.asked = R::select(imposed, needed, motor.asked);
            motor.torque = R::select(imposed, needed, motor.torque);
            motor.shaft.breakaway = R::select(imposed, R::zero(), motor.shaft.breakaway);
        }
        motor
    }
}

/// The hidden states of the terms: the last ones.
#[inline(always)]
fn hidden<R, const N: usize>(state: &[R; N]) -> &[R; HIDDEN] {
    state.last_chunk().expect("room for hidden states")
}

/// The motor's shaft and acceleration, the torque asked of it and its own.
struct Motor<R> {
    shaft: Shaft<R>,
    alpha: R,
    asked: R,
    torque: R,
}

/// Acceleration of a shaft that slides in its direction, or is held.
#[inline(always)]
fn acceleration<R: Real>(net: R, dry: &Dry<R>, inertia: R) -> R {
    let held = at_rest(dry.direction) & R::zero().lt(dry.breakaway);
    let sliding = (net - dry.direction * dry.level) / inertia;
    if held.any() { R::select(held, R::zero(), sliding) } else { sliding }
}

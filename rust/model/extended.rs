//! The two-inertia drive with the physics the nominal model leaves out.
//!
//! States: those of [`super::TwoInertia`], then the hidden states of the terms that are on.

use super::terms::{Actuator, Dry, Gear, HIDDEN, Load, Mesh, Motion, Reaction, Terms};
use super::two_inertia::controlled;
use super::{Base, Drivetrain, Model, Rates, Shaft, spring};
use crate::real::{Mask, Real};

const OWN: usize = 5;
const ALL: usize = OWN + HIDDEN;

/// The two-inertia model with terms.
pub struct Extended;

impl Model<ALL> for Extended {
    const BASE: Base = Base::TwoInertia;
    const INTEGRATOR: usize = 4;
    const STICKS: bool = true;
    const SCALES: [f64; ALL] = [0.1, 0.1, 1e-5, 1e-3, 1e-2, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0];

    fn compose(full: [f64; 5]) -> [f64; ALL] {
        std::array::from_fn(|index| full.get(index).copied().unwrap_or(0.0))
    }

    fn begin(terms: &Terms<f64>, inverse_ratio: f64, state: &mut [f64; ALL]) {
        let [theta_m, omega_m, te, omega_l, ..] = *state;
        let theta_l = theta_m * inverse_ratio - te;
        let motion = Motion { t: 0.0, theta_m, omega_m, theta_l, omega_l, inverse_ratio };
        let mut hidden = [0.0; HIDDEN];
        terms.begin(&motion, &mut hidden);
        state[OWN..].copy_from_slice(&hidden);
    }

    #[inline(always)]
    fn sizes<R: Real>(state: &[R; ALL], windup: R) -> [R; ALL] {
        let mut sizes = *state;
        for size in &mut sizes {
            *size = size.abs();
        }
        sizes[0] = R::zero();
        sizes[2] = windup.abs();
        sizes
    }

    #[inline(always)]
    fn rates<R: Real>(drive: &Drivetrain<R>, t: R, state: &[R; ALL]) -> Rates<R, ALL> {
        let [theta_m, omega_m, te, omega_l, z, ..] = *state;
        let c = drive.constants;
        let terms = drive.terms;
        let zero = R::zero();
        let mut own = [zero; HIDDEN];
        own.copy_from_slice(&state[OWN..]);
        let mut hidden_rates = [zero; HIDDEN];
        let theta_l = theta_m.mul_add(c.inverse_ratio, -te);
        let motion = Motion { t, theta_m, omega_m, theta_l, omega_l, inverse_ratio: c.inverse_ratio };

        let inputs = drive.input.at(t);
        let (commanded, z_rate) = controlled(drive, inputs.torque, inputs.reference, omega_m, z);
        let mut actuator = Actuator { torque: commanded, inertia: c.j_m };
        terms.actuator(&motion, &mut actuator, &own, &mut hidden_rates);

        let (error, error_slope) = drive.harmonics.value_and_slope(theta_m);
        let mut mesh =
            Mesh { error, error_slope, added_windup: zero, added_windup_rate: zero, load_torque: inputs.load };
        terms.mesh(&motion, &mut mesh, &own, &mut hidden_rates);
        let windup = te - mesh.error + mesh.added_windup;
        let upsilon = c.inverse_ratio - mesh.error_slope;
        let windup_rate = upsilon.mul_add(omega_m, mesh.added_windup_rate - omega_l);
        let mut gear = Gear {
            spring_windup: windup,
            stiffness_factor: R::splat(1.0),
            added_torque: zero,
            motor_reaction: zero,
            load_reaction: zero,
            windup,
            windup_rate,
        };
        terms.gear(&motion, &mut gear, &own, &mut hidden_rates);
        let stored = spring::energy(drive.spring, c, gear.spring_windup);
        let elastic = gear.stiffness_factor * spring::torque(drive.spring, c, gear.spring_windup);
        let gear_torque = c.b_sp.mul_add(windup_rate, elastic + gear.added_torque);

        let dry = |direction: R, viscous: R| Dry {
            level: zero,
            breakaway: zero,
            direction,
            resisting: zero,
            viscous,
            gear_torque,
        };
        let imposed = drive.input.motion();
        let mut sliding = drive.directions[0];
        if let Some(imposed) = imposed {
            sliding = R::select(imposed, sign(omega_m), sliding);
        }
        let mut on_motor = dry(sliding, c.d_mm);
        terms.motor_friction(&motion, &mut on_motor, &own, &mut hidden_rates);
        let mut load = Load { torque: inputs.load, inertia: c.j_l };
        terms.load(&motion, &mut load, &own, &mut hidden_rates);
        let mut on_load = dry(drive.directions[1], c.d_ll);
        terms.load_friction(&motion, &mut on_load, &own, &mut hidden_rates);
        terms.reaction(&motion, &mut Reaction { gear_torque }, &own, &mut hidden_rates);

        let resisting = c.d_mm.mul_add(omega_m, upsilon.mul_add(gear_torque, -(c.d_ml * omega_l)));
        let resisting = stored.mul_add(gear.motor_reaction, resisting + on_motor.resisting);
        let mut motor = Shaft { net: actuator.torque - resisting, breakaway: on_motor.breakaway };
        let mut alpha_m = acceleration(motor.net, &on_motor, actuator.inertia);
        let mut motor_torque = actuator.torque;
        if let Some(imposed) = imposed {
            motor.breakaway = R::select(imposed, zero, motor.breakaway);
            alpha_m = R::select(imposed, inputs.acceleration, alpha_m);
            let needed = on_motor.direction.mul_add(on_motor.level, actuator.inertia.mul_add(alpha_m, resisting));
            motor_torque = R::select(imposed, needed, motor_torque);
        }
        let driving = c.d_ml.mul_add(omega_m, gear_torque) - c.d_ll.mul_add(omega_l, load.torque);
        let output =
            Shaft { net: driving - stored * gear.load_reaction - on_load.resisting, breakaway: on_load.breakaway };
        let alpha_l = acceleration(output.net, &on_load, load.inertia);

        let mut slope = [zero; ALL];
        slope[..OWN].copy_from_slice(&[omega_m, alpha_m, c.inverse_ratio.mul_add(omega_m, -omega_l), alpha_l, z_rate]);
        slope[OWN..].copy_from_slice(&hidden_rates);
        Rates {
            slope,
            error: mesh.error,
            windup,
            windup_rate,
            te,
            omega_l,
            alpha_l,
            upsilon,
            gear_torque,
            motor_torque,
            load_torque: load.torque,
            shafts: [motor, output],
        }
    }
}

/// Direction of a shaft whose motion is imposed: nothing holds it, so nothing has to be located.
#[inline(always)]
fn sign<R: Real>(speed: R) -> R {
    let zero = R::zero();
    R::select(zero.lt(speed), R::splat(1.0), R::select(speed.lt(zero), R::splat(-1.0), zero))
}

/// Acceleration of a shaft that slides in its direction, or is held.
#[inline(always)]
fn acceleration<R: Real>(net: R, dry: &Dry<R>, inertia: R) -> R {
    let held = dry.direction.abs().le(R::zero()) & R::zero().lt(dry.breakaway);
    let sliding = (net - dry.direction * dry.level) / inertia;
    if held.any() { R::select(held, R::zero(), sliding) } else { sliding }
}

//! The two-inertia drive with terms.

use super::{Motor, Sides, acceleration, hidden};
use crate::model::terms::{Gear, HIDDEN, Internals, Motion, Reaction, Terms};
use crate::model::{Base, Bends, CORNERS, Corners, Drivetrain, Energies, Model, Pieces, Rates, Shaft, kinetic, spring};
use crate::real::{Mask, Real, Scalar};

const OWN: usize = 5;
const ALL: usize = OWN + HIDDEN;

/// The two-inertia model with terms.
pub struct Extended;

impl Model<ALL> for Extended {
    const BASE: Base = Base::TwoInertia;
    const INTEGRATOR: usize = 4;
    const HIDDEN: usize = HIDDEN;
    const STICKING: &'static [usize] = &[1, 3];
    const SCALES: [f64; ALL] = [0.1, 0.1, 1e-5, 1e-3, 1e-2, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0];

    fn compose<S: Scalar>(full: [S; 5]) -> [S; ALL] {
        std::array::from_fn(|index| full.get(index).copied().unwrap_or(S::zero()))
    }

    fn begin<S: Scalar>(terms: &Terms<S>, inverse_ratio: S, mut hidden: [S; HIDDEN], state: &mut [S; ALL]) {
        let [theta_m, omega_m, te, omega_l, ..] = *state;
        let theta_l = theta_m * inverse_ratio - te;
        let motion = Motion { t: S::zero(), theta_m, omega_m, theta_l, omega_l, inverse_ratio };
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
        evaluate(drive, t, state, Corners::new(drive.pieces)).rates
    }

    #[inline(always)]
    fn corners<R: Real>(drive: &Drivetrain<R>, t: R, state: &[R; ALL]) -> Pieces<R::Plain> {
        let mut found = [R::Plain::zero(); CORNERS];
        evaluate(drive, t, state, Corners::noting(drive.pieces, &mut found));
        found
    }

    fn jump<S: Scalar>(drive: &Drivetrain<S>, t: S, state: &mut [S; ALL]) {
        let Instant { gear, spring_torque, inner, .. } = evaluate(drive, t, state, Corners::new(drive.pieces));
        let mut after = *inner.states;
        drive.terms.jump(&gear, spring_torque, &mut after);
        state[OWN..].copy_from_slice(&after);
    }

    #[inline(always)]
    fn energies<R: Real>(drive: &Drivetrain<R>, t: R, state: &[R; ALL]) -> Energies<R> {
        let Instant { rates, gear, inertias, inner, .. } = evaluate(drive, t, state, Corners::new(drive.pieces));
        Energies {
            mechanical: gear.stiffness_factor * elastic(drive, &gear) + kinetic(inertias, [state[1], rates.omega_l]),
            terms: drive.terms.stored(&gear, inner.states),
        }
    }
}

/// The rates with what else is known at that instant.
struct Instant<'a, R: Real> {
    rates: Rates<R, ALL>,
    gear: Gear<R>,
    spring_torque: R,
    inertias: [R; 2],
    inner: Internals<'a, R>,
}

/// Energy [J] of the spring with what terms add to it, at the factor 1.
#[inline(always)]
fn elastic<R: Real>(drive: &Drivetrain<R>, gear: &Gear<R>) -> R {
    let own = spring::energy(drive.spring, drive.constants, gear.spring_windup);
    own + drive.terms.added_spring_energy(gear.spring_windup)
}

#[inline(always)]
fn evaluate<'a, R: Real>(
    drive: &'a Drivetrain<'a, R>,
    t: R,
    state: &'a [R; ALL],
    corners: Corners<'a, R>,
) -> Instant<'a, R> {
    let [theta_m, omega_m, te, omega_l, z, ..] = *state;
    let c = drive.constants;
    let zero = R::zero();
    let theta_l = theta_m.mul_add(c.inverse_ratio, -te);
    let motion = Motion { t, theta_m, omega_m, theta_l, omega_l, inverse_ratio: c.inverse_ratio };
    let mut sides = Sides::new(drive, motion, hidden(state), corners);
    let (asked, z_rate) = sides.controlled(z);
    let actuator = sides.actuator(asked);

    let mesh = sides.mesh(zero);
    let windup = te - mesh.error + mesh.added_windup;
    let upsilon = c.inverse_ratio - mesh.error_slope;
    let windup_rate = upsilon.mul_add(omega_m, mesh.added_windup_rate - omega_l);
    let mut gear = Gear::new(windup, windup_rate);
    drive.terms.gear(&sides.motion, &mut gear, &mut sides.inner);
    let reacts = !(gear.motor_reaction.abs().le(zero) & gear.load_reaction.abs().le(zero));
    let stored = if reacts.any() { elastic(drive, &gear) } else { zero };
    let law = spring::held_torque(drive.spring, c, gear.spring_windup, &mut sides.inner.corners);
    let spring_torque = gear.stiffness_factor * (law + gear.added_spring_torque);
    let gear_torque = c.b_sp.mul_add(windup_rate, spring_torque + gear.added_torque);

    let on_motor = sides.motor_friction(sides.motor_direction(), gear_torque);
    let load = sides.load();
    let on_load = sides.load_friction(drive.directions[1], &on_motor);
    drive.terms.reaction(&sides.motion, &mut Reaction::new(gear_torque), &mut sides.inner);

    let resisting = c.d_mm.mul_add(omega_m, upsilon.mul_add(gear_torque, -(c.d_ml * omega_l)));
    let resisting = stored.mul_add(gear.motor_reaction, resisting + on_motor.either_way());
    let Motor { shaft, alpha: alpha_m, asked: asked_torque, torque: motor_torque } =
        sides.motor(asked, &actuator, resisting, &on_motor, actuator.inertia);
    let driving = c.d_ml.mul_add(omega_m, gear_torque) - c.d_ll.mul_add(omega_l, load.torque);
    let output =
        Shaft { net: driving - stored * gear.load_reaction - on_load.either_way(), breakaway: on_load.breakaway };
    let alpha_l = acceleration(output.net, &on_load, load.inertia);

    let friction = on_motor.torque() * omega_m + on_load.torque() * omega_l;
    let on_housing = gear_torque * mesh.added_windup_rate;
    let mut slope = [zero; ALL];
    slope[..OWN].copy_from_slice(&[omega_m, alpha_m, c.inverse_ratio.mul_add(omega_m, -omega_l), alpha_l, z_rate]);
    slope[OWN..].copy_from_slice(&sides.inner.rates);
    let rates = Rates {
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
        asked_torque,
        drive_torque: actuator.torque,
        load_torque: load.torque,
        term_power: gear.added_torque.mul_add(windup_rate, friction - on_housing),
        margin: sides.inner.corners.margin(),
        reserve: drive.terms.reserve(&gear, spring_torque, sides.inner.states),
        shafts: [shaft, output],
    };
    Instant { rates, gear, spring_torque, inertias: [actuator.inertia, load.inertia], inner: sides.inner }
}

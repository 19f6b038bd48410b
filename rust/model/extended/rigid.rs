//! The rigid limit with terms: one shaft, on which the friction of the output acts through the local ratio.
//!
//! The load turns at `omega_l = Y omega_m` and accelerates by `arm alpha_m - curvature omega_m^2`, `arm` being
//! `d omega_l / d omega_m`. The gear torque follows from the load's balance, friction on the motor may follow from the
//! gear torque, and both from the acceleration: for a given direction of sliding and sign of the gear torque all of it
//! is linear, and the sign is known beforehand.

use super::{Motor, Sides, hidden};
use crate::model::terms::{Dry, Gear, HIDDEN, Internals, Motion, Terms, at_rest};
use crate::model::{Base, Bends, CORNERS, Corners, Drivetrain, Energies, Model, Pieces, Rates, Shaft, kinetic, sign};
use crate::real::{Mask, Real, Scalar};

const OWN: usize = 4;
const ALL: usize = OWN + HIDDEN;

/// The one-inertia model with terms. States as in [`crate::model::OneInertia`].
pub struct ExtendedRigid;

impl Model<ALL> for ExtendedRigid {
    const BASE: Base = Base::OneInertia;
    const INTEGRATOR: usize = 2;
    const HIDDEN: usize = HIDDEN;
    const STICKING: &'static [usize] = &[1];
    const SCALES: [f64; ALL] = [0.1, 0.1, 1e-2, 1e-8, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0];

    fn compose<S: Scalar>(full: [S; 5]) -> [S; ALL] {
        std::array::from_fn(|index| [full[0], full[1], full[4]].get(index).copied().unwrap_or(S::zero()))
    }

    fn begin<S: Scalar>(terms: &Terms<S>, inverse_ratio: S, mut hidden: [S; HIDDEN], state: &mut [S; ALL]) {
        let [theta_m, omega_m, ..] = *state;
        let motion = Motion::of_motor(theta_m, omega_m, inverse_ratio);
        terms.begin(&motion, &mut hidden);
        state[OWN..].copy_from_slice(&hidden);
    }

    #[inline(always)]
    fn sizes<R: Real>(state: &[R; ALL], _windup: R) -> [R; ALL] {
        let mut sizes = *state;
        for size in &mut sizes {
            *size = size.abs();
        }
        sizes[0] = R::zero();
        sizes[3] = R::zero();
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

    #[inline(always)]
    fn energies<R: Real>(drive: &Drivetrain<R>, t: R, state: &[R; ALL]) -> Energies<R> {
        let Instant { rates, inertias, inner } = evaluate(drive, t, state, Corners::new(drive.pieces));
        Energies {
            mechanical: kinetic(inertias, [state[1], rates.omega_l]),
            terms: drive.terms.stored(&Gear::new(R::zero(), R::zero()), inner.states),
        }
    }
}

/// The rates with what else is known at that instant.
struct Instant<'a, R: Real> {
    rates: Rates<R, ALL>,
    inertias: [R; 2],
    inner: Internals<'a, R>,
}

#[inline(always)]
fn evaluate<'a, R: Real>(
    drive: &'a Drivetrain<'a, R>,
    t: R,
    state: &'a [R; ALL],
    corners: Corners<'a, R>,
) -> Instant<'a, R> {
    let [theta_m, omega_m, z, ..] = *state;
    let c = drive.constants;
    let zero = R::zero();
    let motion = Motion { t, ..Motion::of_motor(theta_m, omega_m, c.inverse_ratio) };
    let mut sides = Sides::new(drive, motion, hidden(state), corners);
    let (asked, z_rate) = sides.controlled(z);
    let actuator = sides.actuator(asked);

    let mesh = sides.mesh(drive.harmonics.curvature(theta_m));
    let upsilon = c.inverse_ratio - mesh.error_slope;
    let omega_l = upsilon * omega_m;
    sides.motion.theta_l = sides.motion.theta_l - mesh.error;
    sides.motion.omega_l = omega_l;

    let load = sides.load();
    let direction = sides.motor_direction();
    let side = sign(upsilon);
    let unloaded = sides.unloaded_motor_friction(direction);
    let on_load = sides.load_friction(direction * side, &unloaded);
    let arm = (-mesh.slope_by_speed).mul_add(omega_m, upsilon);
    let bend = mesh.error_curvature * omega_m * omega_m;
    let steady = c.d_ll.mul_add(omega_l, load.torque + on_load.either_way()) - c.d_ml * omega_m;
    let gear = RigidGear {
        upsilon,
        reflected: load.inertia * arm,
        steady: (-load.inertia).mul_add(bend, steady),
        on_load,
        side,
        actuator_inertia: actuator.inertia,
        free: actuator.torque - c.d_mm.mul_add(omega_m, -(c.d_ml * omega_l)),
    };
    let on_motor = gear.motor_friction(&mut sides, direction, unloaded.torque());

    let resisting = upsilon.mul_add(gear.steady, on_motor.either_way()) + (actuator.torque - gear.free);
    let on_shaft = Dry {
        level: upsilon.abs().mul_add(on_load.level, on_motor.level),
        breakaway: upsilon.abs().mul_add(on_load.breakaway, on_motor.breakaway),
        ..on_motor
    };
    let Motor { shaft, alpha: alpha_m, asked: asked_torque, torque: motor_torque } =
        sides.motor(asked, &actuator, resisting, &on_shaft, gear.inertia());
    let alpha_l = arm.mul_add(alpha_m, -bend);

    let mut slope = [zero; ALL];
    slope[..OWN].copy_from_slice(&[omega_m, alpha_m, z_rate, mesh.error]);
    slope[OWN..].copy_from_slice(&sides.inner.rates);
    let rates = Rates {
        slope,
        error: mesh.error,
        windup: zero,
        windup_rate: zero,
        te: mesh.error,
        omega_l,
        alpha_l,
        upsilon,
        gear_torque: gear.torque(direction, alpha_m, &shaft),
        motor_torque,
        asked_torque,
        drive_torque: actuator.torque,
        load_torque: load.torque,
        term_power: on_motor.torque() * omega_m + on_load.torque() * omega_l,
        reserve: R::splat(f64::INFINITY),
        margin: sides.inner.corners.margin(),
        shafts: [shaft, Shaft::free()],
    };
    Instant { rates, inertias: [actuator.inertia, load.inertia], inner: sides.inner }
}

/// What the gear has to carry, without the acceleration that is yet to be found.
struct RigidGear<R> {
    upsilon: R,
    /// Gear torque per acceleration of the motor [kg m^2].
    reflected: R,
    /// Gear torque without acceleration and dry friction [N m at the output].
    steady: R,
    on_load: Dry<R>,
    /// The way the output turns when the motor turns forward.
    side: R,
    actuator_inertia: R,
    /// Torque on the motor without gear and friction [N m].
    free: R,
}

impl<R: Real> RigidGear<R> {
    /// All inertia in the motor coordinate [kg m^2].
    #[inline(always)]
    fn inertia(&self) -> R {
        self.upsilon.mul_add(self.reflected, self.actuator_inertia)
    }

    /// Gear torque of a shaft that slides without acceleration.
    #[inline(always)]
    fn sliding(&self, direction: R) -> R {
        (direction * self.side).mul_add(self.on_load.level, self.steady)
    }

    /// Gear torque at an acceleration. At rest it is not determined: friction on both sides of the gear then
    /// carries the same share of what it can hold.
    #[inline(always)]
    fn torque(&self, direction: R, alpha: R, shaft: &Shaft<R>) -> R {
        let sliding = self.reflected.mul_add(alpha, self.sliding(direction));
        let held = at_rest(direction) & R::zero().lt(shaft.breakaway);
        if !held.any() {
            return sliding;
        }
        let share = shaft.net / shaft.breakaway;
        R::select(held, (share * self.side).mul_add(self.on_load.breakaway, self.steady), sliding)
    }

    /// Friction on the motor at the gear torque that belongs to it; `unloaded` is its torque without any.
    #[inline(always)]
    fn motor_friction(&self, sides: &mut Sides<R>, direction: R, unloaded: R) -> Dry<R> {
        let zero = R::zero();
        let sliding = self.sliding(direction);
        let inertia = self.inertia();
        let moving = self.actuator_inertia * sliding + self.reflected * (self.free - unloaded);
        let first = moving / inertia;

        let resting = at_rest(direction);
        let pushed = sign((-self.upsilon).mul_add(self.steady, self.free)) * self.side;
        let about_to_slide = pushed.mul_add(self.on_load.breakaway, self.steady);
        let mut known = resting;
        let mut gear_torque = R::select(resting, about_to_slide, first);
        if let Some(imposed) = sides.drive.input.motion() {
            let imposed_torque = self.reflected.mul_add(sides.drive.input.acceleration(sides.motion.t), sliding);
            gear_torque = R::select(imposed, imposed_torque, gear_torque);
            known = known | imposed;
        }
        let dry = sides.motor_friction(direction, gear_torque);
        let grown = dry.torque() - unloaded;
        let loop_closes = !known & zero.lt(grown.abs());
        if !loop_closes.any() {
            return dry;
        }
        let closed = (self.reflected * grown / moving) + R::splat(1.0);
        let solved = R::select(zero.lt(closed), gear_torque / closed, R::splat(f64::NAN));
        sides.motor_friction(direction, R::select(loop_closes, solved, gear_torque))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::terms::Choice;
    use crate::model::{Drive, Input, Layout, Line, Row, Segment, Spring};

    /// The friction that the gear torque is found with is asked about no torque at all, where its corner lies.
    #[test]
    fn exact_a_loaded_gear_stands_on_no_corner() {
        let terms = Choice::of(&["load_dependent_friction".into()]).expect("a known term");
        let layout = Layout { base: Base::OneInertia, spring: Spring::Polynomial, orders: Vec::new(), terms };
        let values: Vec<f64> = layout.parameters(&[]).iter().map(|parameter| parameter.default).collect();
        let row = Row::new(&layout, &values, true).expect("default parameters");
        let mut terms = Terms::new(&layout.terms);
        terms.set_lane(0, &row.terms);
        let mut state = [0.0; ALL];
        state[1] = 10.0;
        let segment = Segment {
            start: 0.0,
            drive: Drive::Torque { absolute: Line::default(), sustaining: Line::default(), holding: Line::default() },
            load: Line { value: 20.0, slope: 0.0 },
            load_set: Line::default(),
        };
        let mut input = Input::none();
        input.set_lane(0, &segment, &row);
        let free = Drivetrain {
            constants: &row.constants,
            harmonics: row.harmonics.as_ref().expect("own harmonics"),
            input: &input,
            spring: layout.spring,
            terms: &terms,
            directions: &[1.0, 0.0],
            pieces: None,
        };
        let pieces = ExtendedRigid::corners(&free, 0.0, &state);
        let rates = ExtendedRigid::rates(&Drivetrain { pieces: Some(&pieces), ..free }, 0.0, &state);
        assert!(rates.gear_torque.abs() > 1.0 && rates.margin > 0.1, "{} N m, {}", rates.gear_torque, rates.margin);
    }
}

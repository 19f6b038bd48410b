//! Motor and load inertia joined by the gear spring.
//!
//! States: theta_m, omega_m, te = theta_m/i - theta_l, omega_l, z. The load angle is integrated
//! relative to the motor's, so that windup (1e-6 rad) never is a difference of two large angles.

use super::corners::{Bends, Corners, TORQUE_LIMIT, Unheld};
use super::{Base, CORNERS, Constants, Drivetrain, Model, Pieces, Rates, Shaft, spring};
use crate::real::{Mask, Real, Scalar};

/// The default model.
pub struct TwoInertia;

impl Model<5> for TwoInertia {
    const BASE: Base = Base::TwoInertia;
    const SCALES: [f64; 5] = [0.1, 0.1, 1e-5, 1e-3, 1e-2];

    const INTEGRATOR: usize = 4;
    const POSITIONS: u64 = 0b101;

    #[inline(always)]
    fn position_rates<R: Real>(c: &Constants<R>, state: &[R; 5]) -> [R; 5] {
        let [_, omega_m, _, omega_l, _] = *state;
        [omega_m, R::zero(), c.inverse_ratio.mul_add(omega_m, -omega_l), R::zero(), R::zero()]
    }

    fn compose<S: Scalar>(full: [S; 5]) -> [S; 5] {
        full
    }

    #[inline(always)]
    fn sizes<R: Real>(state: &[R; 5], windup: R) -> [R; 5] {
        [R::zero(), state[1].abs(), windup.abs(), state[3].abs(), state[4].abs()]
    }

    #[inline(always)]
    fn rates<R: Real>(drive: &Drivetrain<R>, t: R, state: &[R; 5]) -> Rates<R, 5> {
        match drive.pieces {
            Some(_) => Self::evaluate(drive, t, state, &mut Corners::new(drive.pieces)),
            None => Self::evaluate(drive, t, state, &mut Unheld),
        }
    }

    #[inline(always)]
    fn corners<R: Real>(drive: &Drivetrain<R>, t: R, state: &[R; 5]) -> Pieces<R::Plain> {
        let mut found = [R::Plain::zero(); CORNERS];
        Self::evaluate(drive, t, state, &mut Corners::noting(drive.pieces, &mut found));
        found
    }
}

impl TwoInertia {
    #[inline(always)]
    fn evaluate<R: Real>(drive: &Drivetrain<R>, t: R, state: &[R; 5], corners: &mut impl Bends<R>) -> Rates<R, 5> {
        let [theta_m, omega_m, te, omega_l, z] = *state;
        let c = drive.constants;
        let (error, error_slope) = drive.harmonics.value_and_slope(theta_m);
        let windup = te - error;
        let upsilon = c.inverse_ratio - error_slope;
        let windup_rate = upsilon.mul_add(omega_m, -omega_l);
        let gear_torque = c.b_sp.mul_add(windup_rate, spring::held_torque(drive.spring, c, windup, corners));

        let inputs = drive.input.at(t);
        let (drive_torque, z_rate) = controlled(drive, corners, t, inputs.reference, omega_m, z);
        let friction = c.d_mm.mul_add(omega_m, -(c.d_ml * omega_l));
        let mut motor_torque = drive_torque;
        let mut alpha_m = (-upsilon).mul_add(gear_torque, motor_torque - friction) * c.inverse_j_m;
        if let Some(motion) = drive.input.motion() {
            alpha_m = R::select(motion, drive.input.acceleration(t), alpha_m);
            let resisting = upsilon.mul_add(gear_torque, friction);
            motor_torque = R::select(motion, c.j_m.mul_add(alpha_m, resisting), motor_torque);
        }
        let resisting = c.d_ll.mul_add(omega_l, c.d_ml.mul_add(-omega_m, inputs.load));
        let alpha_l = (gear_torque - resisting) * c.inverse_j_l;
        let [theta_m_rate, _, te_rate, ..] = Self::position_rates(c, state);
        Rates {
            slope: [theta_m_rate, alpha_m, te_rate, alpha_l, z_rate],
            error,
            windup,
            windup_rate,
            te,
            omega_l,
            alpha_l,
            upsilon,
            gear_torque,
            motor_torque,
            asked_torque: motor_torque,
            drive_torque,
            load_torque: inputs.load,
            term_power: R::zero(),
            reserve: R::splat(f64::INFINITY),
            margin: corners.margin(),
            shafts: [Shaft::free(), Shaft::free()],
        }
    }
}

/// Natural size of a motor torque [N m].
const SIZE: f64 = 1e-2;

/// Motor torque and integrator rate, with the speed controller where it is in force.
#[inline(always)]
pub(super) fn controlled<R: Real>(
    drive: &Drivetrain<R>,
    corners: &mut impl Bends<R>,
    t: R,
    reference: R,
    omega_m: R,
    z: R,
) -> (R, R) {
    let Some(speed) = drive.input.speed() else {
        return (drive.input.torque(t), R::zero());
    };
    let c = drive.constants;
    let error = reference - omega_m;
    let asked = c.k_p.mul_add(error, c.k_i * z);
    let (given, z_rate) = if !corners.are_held() && asked.abs().le(c.tau_max).all() {
        (asked, error)
    } else {
        let given = corners.clamp_in(speed, TORQUE_LIMIT, asked, c.tau_max, SIZE);
        (given, (given - asked).mul_add(c.inverse_k_p, error))
    };
    if speed.all() {
        return (given, z_rate);
    }
    (R::select(speed, given, drive.input.torque(t)), R::select(speed, z_rate, R::zero()))
}

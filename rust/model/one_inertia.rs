//! The rigid limit in the motor coordinate: a joint of which only the motor side is seen.
//!
//! (J_m + Y^2 J_l) omega_m' = tau_m - Y tau_load - (B_m + (1 - s Y)^2 B_ml + Y^2 B_l) omega_m + J_l Y theta_e'' omega_m^2.
//! States: theta_m, omega_m, z, and the integral of the kinematic error: no other state has to follow that error, and
//! what is computed from it needs steps that do.

use super::corners::{Bends, Corners, Unheld};
use super::two_inertia::controlled;
use super::{Base, CORNERS, Drivetrain, Model, Pieces, Rates, Shaft};
use crate::real::{Real, Scalar};

/// One inertia with kinematic error.
pub struct OneInertia;

impl Model<4> for OneInertia {
    const BASE: Base = Base::OneInertia;
    const SCALES: [f64; 4] = [0.1, 0.1, 1e-2, 1e-8];

    const INTEGRATOR: usize = 2;

    fn compose<S: Scalar>(full: [S; 5]) -> [S; 4] {
        [full[0], full[1], full[4], S::zero()]
    }

    #[inline(always)]
    fn sizes<R: Real>(state: &[R; 4], _windup: R) -> [R; 4] {
        [R::zero(), state[1].abs(), state[2].abs(), R::zero()]
    }

    #[inline(always)]
    fn rates<R: Real>(drive: &Drivetrain<R>, t: R, state: &[R; 4]) -> Rates<R, 4> {
        match drive.pieces {
            Some(_) => Self::evaluate(drive, t, state, &mut Corners::new(drive.pieces)),
            None => Self::evaluate(drive, t, state, &mut Unheld),
        }
    }

    #[inline(always)]
    fn corners<R: Real>(drive: &Drivetrain<R>, t: R, state: &[R; 4]) -> Pieces<R::Plain> {
        let mut found = [R::Plain::zero(); CORNERS];
        Self::evaluate(drive, t, state, &mut Corners::noting(drive.pieces, &mut found));
        found
    }
}

impl OneInertia {
    #[inline(always)]
    fn evaluate<R: Real>(drive: &Drivetrain<R>, t: R, state: &[R; 4], corners: &mut impl Bends<R>) -> Rates<R, 4> {
        let [theta_m, omega_m, z, _] = *state;
        let c = drive.constants;
        let (error, error_slope) = drive.harmonics.value_and_slope(theta_m);
        let curvature = drive.harmonics.curvature(theta_m);
        let upsilon = c.inverse_ratio - error_slope;
        let omega_l = upsilon * omega_m;

        let inputs = drive.input.at(t);
        let (drive_torque, z_rate) = controlled(drive, corners, t, inputs.reference, omega_m, z);
        let slip = (-c.s).mul_add(upsilon, R::splat(1.0));
        let reflected = upsilon * c.j_l;
        let damping = upsilon.mul_add(upsilon * c.b_l, slip.mul_add(slip * c.b_ml, c.b_m));
        let centrifugal = reflected * curvature * omega_m;
        let resisting = (damping - centrifugal).mul_add(omega_m, upsilon * inputs.load);
        let inertia = upsilon.mul_add(reflected, c.j_m);
        let mut motor_torque = drive_torque;
        let mut alpha_m = (motor_torque - resisting) / inertia;
        if let Some(motion) = drive.input.motion() {
            alpha_m = R::select(motion, drive.input.acceleration(t), alpha_m);
            motor_torque = R::select(motion, inertia.mul_add(alpha_m, resisting), motor_torque);
        }
        let alpha_l = upsilon.mul_add(alpha_m, -(curvature * omega_m * omega_m));
        let slip_torque = c.s * c.b_ml * slip * omega_m;
        let gear_torque = c.j_l.mul_add(alpha_l, c.b_l.mul_add(omega_l, inputs.load)) - slip_torque;
        Rates {
            slope: [omega_m, alpha_m, z_rate, error],
            error,
            windup: R::zero(),
            windup_rate: R::zero(),
            te: error,
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

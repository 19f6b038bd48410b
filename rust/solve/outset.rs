//! The state in which a row begins: wound up by its load torque, and held by its motor.

use super::seat::{Seat, Start};
use super::stepper::Stepper;
use crate::model::terms::{HIDDEN, Motion, Wound};
use crate::model::{Drive, Model, Row, Segment, spring};
use crate::real::Scalar;

impl<S: Scalar, const N: usize> Stepper<S, N> {
    /// The state at time 0 of a row that has been loaded, and the motor torque that holds its load there [N m]. A start
    /// from zero angles bears and holds nothing.
    pub(super) fn outset<M: Model<N>>(&self, seat: &Seat<S, N>) -> ([S; N], S) {
        let (number, zero) = (S::splat, S::zero());
        let (row, start) = (&seat.assignment.row, seat.assignment.start);
        let (c, segment) = (&row.constants, seat.segment());
        let imposed = matches!(segment.drive, Drive::Motion { .. });
        let [theta_m, omega_m, theta_l, omega_l, z] = seat.assignment.initial_tangent;
        let (theta_m, omega_m) = if imposed { (0.0, 0.0) } else { (theta_m, omega_m) };

        let (angle, speed) = match (segment.drive, start) {
            (Drive::Motion { angle, .. }, _) => (number(angle[0]), number(angle[1])),
            (_, Start::ZeroAngle) => (zero, zero),
            (_, Start::Given(full)) => (moved(full[0], theta_m), full[1]),
            (_, Start::Relaxed) => (row.theta_m0, zero),
        };
        let load_torque = segment.load_torque(row).value;
        let (error, slope) = self.kinematic_error(&Motion::of_motor(angle, speed, c.inverse_ratio), load_torque);
        let upsilon = c.inverse_ratio - slope;
        let bears = !matches!(start, Start::ZeroAngle);
        let holding = if bears { upsilon * load_torque } else { zero };

        let mut hidden = [zero; HIDDEN];
        let mut wound = Wound {
            load_torque,
            windup: spring::windup_at(self.spring, c, load_torque),
            motor_torque: if imposed { segment.motor_torque(row).value } else { holding },
            added_windup: zero,
            inverse_ratio: c.inverse_ratio,
        };
        if bears {
            self.terms.wind(&mut wound, &mut hidden);
        }

        let follows = upsilon * speed;
        let mut full = match start {
            Start::Given(full) if imposed => {
                [angle, speed, full[2] + (angle - full[0]) * c.inverse_ratio, full[3], full[4]]
            }
            Start::Given(full) => full,
            Start::ZeroAngle => [angle, speed, zero, follows, zero],
            Start::Relaxed => {
                let te = error + wound.windup - wound.added_windup;
                [angle, speed, te, follows, integrator(segment, row, holding)]
            }
        };
        let te = theta_m * c.inverse_ratio.plain() - theta_l;
        for (number, change) in full.iter_mut().zip([theta_m, omega_m, te, omega_l, z]) {
            *number = moved(*number, change);
        }
        let mut state = M::compose(full);
        M::begin(&self.terms, c.inverse_ratio, hidden, &mut state);
        (state, holding)
    }
}

/// A number with a derivative that is larger by a change.
fn moved<S: Scalar>(number: S, change: f64) -> S {
    number.with_tangent(number.tangent() + change)
}

/// The integrator of a speed controller that asks for a torque without an error; empty without control.
fn integrator<S: Scalar>(segment: &Segment, row: &Row<S>, torque: S) -> S {
    let gain = row.constants.k_i;
    match segment.drive {
        Drive::Speed { .. } if gain.plain() > 0.0 => torque / gain,
        _ => S::zero(),
    }
}

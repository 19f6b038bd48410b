//! The inputs in force, in lanes.

use super::constants::per_lane;
use super::{Drive, Row, Segment};
use crate::real::{Mask, Real};

per_lane! {
    /// Straight lines over the time since the segment's start.
    Lines {
        start,
        torque,
        torque_slope,
        reference,
        reference_slope,
        load,
        load_slope,
        acceleration,
        acceleration_slope,
    }
}

/// The inputs of every lane, and which of them is in force.
#[derive(Clone, Copy, Debug)]
pub struct Input<R: Real> {
    lines: Lines<R>,
    speed: u64,
    motion: u64,
}

/// The inputs of every lane at one instant.
pub struct Inputs<R> {
    /// Speed reference [rad/s].
    pub reference: R,
    /// Load torque [N m].
    pub load: R,
}

impl<R: Real> Input<R> {
    /// No input at all.
    pub fn none() -> Self {
        let zero = R::Lane::zero();
        let zeros = Lines {
            start: zero,
            torque: zero,
            torque_slope: zero,
            reference: zero,
            reference_slope: zero,
            load: zero,
            load_slope: zero,
            acceleration: zero,
            acceleration_slope: zero,
        };
        Self { lines: Lines::splat(&zeros), speed: 0, motion: 0 }
    }

    /// The same inputs converted.
    #[inline(always)]
    pub fn map<Q: Real>(&self, convert: impl Fn(R) -> Q) -> Input<Q> {
        Input { lines: self.lines.map(convert), speed: self.speed, motion: self.motion }
    }

    /// Puts a segment in force in one lane.
    pub fn set_lane(&mut self, lane: usize, segment: &Segment, row: &Row<R::Lane>) {
        let torque = segment.motor_torque(row);
        let reference = segment.reference(row);
        let load = segment.load_torque(row);
        let acceleration = match segment.drive {
            Drive::Motion { angle, .. } => [2.0 * angle[2], 6.0 * angle[3]],
            _ => [0.0; 2],
        };
        let number = <R::Lane as Real>::splat;
        let lines = Lines {
            start: number(segment.start),
            torque: torque.value,
            torque_slope: torque.slope,
            reference: reference.value,
            reference_slope: reference.slope,
            load: load.value,
            load_slope: load.slope,
            acceleration: number(acceleration[0]),
            acceleration_slope: number(acceleration[1]),
        };
        self.lines.set_lane(lane, &lines);
        let bit = 1 << lane;
        self.speed = self.speed & !bit | if matches!(segment.drive, Drive::Speed { .. }) { bit } else { 0 };
        self.motion = self.motion & !bit | if matches!(segment.drive, Drive::Motion { .. }) { bit } else { 0 };
    }

    /// What every lane has at time `t`.
    #[inline(always)]
    pub fn at(&self, t: R) -> Inputs<R> {
        let l = &self.lines;
        let elapsed = t - l.start;
        Inputs {
            reference: l.reference_slope.mul_add(elapsed, l.reference),
            load: l.load_slope.mul_add(elapsed, l.load),
        }
    }

    /// Motor torque asked for in lanes without speed control, at time `t` [N m].
    #[inline(always)]
    pub fn torque(&self, t: R) -> R {
        self.lines.torque_slope.mul_add(t - self.lines.start, self.lines.torque)
    }

    /// Imposed acceleration at time `t` [rad/s^2].
    #[inline(always)]
    pub fn acceleration(&self, t: R) -> R {
        self.lines.acceleration_slope.mul_add(t - self.lines.start, self.lines.acceleration)
    }

    /// The lanes under speed control, if any.
    #[inline(always)]
    pub fn speed(&self) -> Option<R::Mask> {
        (self.speed != 0).then(|| R::Mask::from_bits(self.speed))
    }

    /// The lanes with imposed motion, if any.
    #[inline(always)]
    pub fn motion(&self) -> Option<R::Mask> {
        (self.motion != 0).then(|| R::Mask::from_bits(self.motion))
    }
}

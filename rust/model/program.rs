//! What drives a row: piecewise-linear inputs with breakpoints, and the phases they mark.

use super::Row;
use crate::real::Scalar;

/// A straight line over the time since the start of its segment.
#[derive(Clone, Copy, Debug, Default)]
pub struct Line<S = f64> {
    /// Value at the start.
    pub value: S,
    /// Change per second.
    pub slope: S,
}

impl Line {
    /// Its sum with multiples of others.
    fn plus<S: Scalar, const N: usize>(self, others: [(S, Self); N]) -> Line<S> {
        let sum = |part: fn(Self) -> f64| {
            others.iter().fold(S::splat(part(self)), |sum, &(factor, other)| sum + factor * S::splat(part(other)))
        };
        Line { value: sum(|line| line.value), slope: sum(|line| line.slope) }
    }

    fn none<S: Scalar>() -> Line<S> {
        Line { value: S::zero(), slope: S::zero() }
    }
}

/// Inputs that meet within this share of their size at a breakpoint do not jump there: tables of slopes round.
const SAME: f64 = 1e-9;
/// The same for the acceleration of a spline through recorded angles.
const SAME_ACCELERATION: f64 = 1e-6;

/// The shortest run phase and the shortest steady run [s].
pub const SHORTEST_RUN: f64 = 0.5;
/// Revolutions fill a motion that is shorter by no more than this share: times round.
const ROUNDING: f64 = 1e-12;

/// What moves the motor during a segment.
#[derive(Clone, Copy, Debug)]
pub enum Drive {
    /// A torque.
    Torque {
        /// Absolute [N m].
        absolute: Line,
        /// In multiples of the row's sustaining torque.
        sustaining: Line,
        /// In multiples of the torque that holds the row where it starts.
        holding: Line,
    },
    /// The speed controller.
    Speed {
        /// Reference [rad/s].
        absolute: Line,
        /// Reference in multiples of the row's set speed.
        set: Line,
        /// Whether the controller takes over without a jump of the torque.
        bumpless: bool,
    },
    /// An imposed motor angle.
    Motion {
        /// Ascending coefficients [rad] in the time since the segment's start.
        angle: [f64; 4],
        /// Torque asked of the drive meanwhile [N m].
        absolute: Line,
        /// The same in multiples of the row's sustaining torque.
        sustaining: Line,
    },
}

/// The inputs between two breakpoints.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// Start [s].
    pub start: f64,
    /// Motor side.
    pub drive: Drive,
    /// Load torque [N m].
    pub load: Line,
    /// Load torque as a multiple of the row's.
    pub load_set: Line,
}

impl Segment {
    /// The load torque [N m] of a row.
    pub fn load_torque<S: Scalar>(&self, row: &Row<S>) -> Line<S> {
        self.load.plus([(row.tau_load, self.load_set)])
    }

    /// The motor torque asked of a row without speed control.
    pub fn motor_torque<S: Scalar>(&self, row: &Row<S>) -> Line<S> {
        match self.drive {
            Drive::Torque { absolute, sustaining, holding } => {
                absolute.plus([(row.sustaining_torque, sustaining), (row.holding_torque, holding)])
            }
            Drive::Motion { absolute, sustaining, .. } => absolute.plus([(row.sustaining_torque, sustaining)]),
            Drive::Speed { .. } => Line::none(),
        }
    }

    /// The speed reference of a speed-controlled row.
    pub fn reference<S: Scalar>(&self, row: &Row<S>) -> Line<S> {
        match self.drive {
            Drive::Speed { absolute, set, .. } => absolute.plus([(row.omega_set, set)]),
            _ => Line::none(),
        }
    }
}

/// Inputs from time 0 to `end`, and the marks that separate start, run and stop.
#[derive(Clone, Debug)]
pub struct Program {
    /// In order of time; the first starts at 0.
    pub segments: Vec<Segment>,
    /// End of the simulation [s].
    pub end: f64,
    /// Start of the motion [s].
    pub on: f64,
    /// Start of the stop [s].
    pub off: f64,
    /// Start of the run phase [s]; automatic where absent.
    pub run: Option<f64>,
    /// From `off` to the window of the residual ring [s].
    pub ring_delay: f64,
    /// Length of that window [s].
    pub ring_width: f64,
    /// Whether the ring is read from the load speed instead of the windup rate.
    pub ring_on_load: bool,
}

impl Program {
    /// Whether any segment holds a speed.
    pub fn is_controlled(&self) -> bool {
        self.segments.iter().any(|segment| matches!(segment.drive, Drive::Speed { .. }))
    }

    /// Start of the run phase of a row, which has to be known beforehand.
    pub fn run_start<S: Scalar>(&self, omega_set: S) -> S {
        self.run.map_or_else(|| self.last_revolutions(omega_set), S::splat)
    }

    /// Start of the last whole number of set-speed revolutions before `off` that last at least [`SHORTEST_RUN`], or half
    /// of the motion where not one revolution fits.
    pub fn last_revolutions<S: Scalar>(&self, omega_set: S) -> S {
        let revolution = S::splat(std::f64::consts::TAU) / omega_set.abs();
        let window = S::splat((SHORTEST_RUN / revolution.plain()).ceil()) * revolution;
        if window.plain() * (1.0 - ROUNDING) <= self.off - self.on {
            S::splat(self.on).max(S::splat(self.off) - window)
        } else {
            S::splat(0.5 * (self.on + self.off))
        }
    }

    /// Whether the inputs of a row jump where `index` starts.
    pub fn jumps_at<S: Scalar>(&self, index: usize, row: &Row<S>) -> bool {
        let (before, after) = (&self.segments[index - 1], &self.segments[index]);
        let elapsed = after.start - before.start;
        let jumps = |left: Line<S>, right: Line<S>| {
            differ([left.value.plain(), left.slope.plain() * elapsed], right.value.plain(), SAME)
        };
        let driven = match (&before.drive, &after.drive) {
            (Drive::Torque { .. }, Drive::Torque { .. }) => false,
            (Drive::Speed { .. }, Drive::Speed { .. }) => jumps(before.reference(row), after.reference(row)),
            (Drive::Motion { angle: left, .. }, Drive::Motion { angle: right, .. }) => {
                let [_, b, c, d] = *left;
                let powers = [elapsed, elapsed * elapsed, elapsed * elapsed * elapsed];
                differ([left[0], b * powers[0], c * powers[1], d * powers[2]], right[0], SAME)
                    || differ([b, 2.0 * c * powers[0], 3.0 * d * powers[1]], right[1], SAME)
                    || differ([2.0 * c, 6.0 * d * powers[0]], 2.0 * right[2], SAME_ACCELERATION)
            }
            _ => true,
        };
        driven
            || jumps(before.motor_torque(row), after.motor_torque(row))
            || jumps(before.load_torque(row), after.load_torque(row))
    }
}

/// Whether a sum is another number, beyond the given share of what was summed.
fn differ<const N: usize>(parts: [f64; N], other: f64, share: f64) -> bool {
    let size: f64 = parts.iter().map(|part| part.abs()).sum();
    (parts.iter().sum::<f64>() - other).abs() > share * (size + other.abs())
}

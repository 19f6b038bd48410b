//! A finished row, one step or one instant at a time: for extrema, crossings and derived signals.

use super::record::{Dense, Record};
use super::seat::{Seat, Start};
use super::stepper::Stepper;
use super::watch::WATCHED;
use super::{Integrands, Method};
use crate::model::{Base, Drive, Energies, Harmonics, Layout, Model, Rates, Row, spring};
use crate::real::{Path, Task};
use std::marker::PhantomData;

/// A finished row that can be looked at again, one step or one instant at a time.
pub trait Retrace<const N: usize> {
    /// A step from a record as polynomials.
    fn dense(&mut self, seat: &Seat<N>, start: &Record<N>, step: f64) -> Dense<N>;
    /// Everything the equations pass through at an instant; a shaft slides the way it moves.
    fn rates(&mut self, seat: &Seat<N>, t: f64, state: &[f64; N]) -> Rates<f64, N>;
    /// The energy at an instant.
    fn energies(&mut self, seat: &Seat<N>, t: f64, state: &[f64; N]) -> Energies<f64>;
    /// Which base model it is.
    fn base(&self) -> Base;
    /// The kinematic error [rad] and its slope at a motor angle.
    fn kinematic_error(&self, angle: f64) -> (f64, f64);
}

/// Recomputes single steps of the row last loaded, with the same bits as the lanes had.
pub struct Replay<P, M, T, const N: usize> {
    stepper: Stepper<f64, N>,
    methods: PhantomData<(P, M, T)>,
}

impl<P: Path, M: Model<N>, T: Method, const N: usize> Replay<P, M, T, N> {
    /// For rows like this one.
    pub fn new(layout: &Layout, row: &Row, harmonics: &Harmonics<f64>) -> Self {
        Self {
            stepper: Stepper::new::<M>(layout, row, harmonics, Integrands::default(), [false; WATCHED]),
            methods: PhantomData,
        }
    }

    /// Makes a row the one that is replayed.
    pub fn load(&mut self, seat: &Seat<N>, shared: &Harmonics<f64>) {
        seat.load(0, &mut self.stepper, shared);
    }

    /// Everything the equations pass through at an instant, with shafts that slide in given directions.
    pub fn rates_in(&mut self, seat: &Seat<N>, t: f64, state: &[f64; N], directions: [f64; 2]) -> Rates<f64, N> {
        self.stepper.directions = directions;
        self.stepper.input.set_lane(0, seat.segment_before(t), &seat.assignment.row);
        P::enter(Instant::<M, N> { stepper: &self.stepper, t, state, model: PhantomData })
    }

    /// The state after a jump of hidden states at the end of a step, and the energy that went with it [J].
    pub fn jump(&mut self, seat: &Seat<N>, t: f64, state: &[f64; N]) -> ([f64; N], f64) {
        let before = self.energies(seat, t, state).mechanical;
        let mut after = *state;
        P::enter(Jump::<M, N> { stepper: &self.stepper, t, state: &mut after, model: PhantomData });
        let lost = before - self.energies(seat, t, &after).mechanical;
        (after, lost)
    }

    /// The state at time 0 of a row just loaded.
    pub fn start(&self, seat: &Seat<N>) -> [f64; N] {
        let row = &seat.assignment.row;
        let c = &row.constants;
        let (angle, speed) = match seat.segment().drive {
            Drive::Motion { angle, .. } => (angle[0], angle[1]),
            _ => (row.theta_m0, 0.0),
        };
        let full = match seat.assignment.start {
            Start::Given(full) => match seat.segment().drive {
                Drive::Motion { .. } => [angle, speed, full[2] + (angle - full[0]) * c.inverse_ratio, full[3], full[4]],
                _ => full,
            },
            Start::ZeroAngle => [0.0; 5],
            Start::Relaxed => {
                let (error, slope) = self.kinematic_error(angle);
                let windup = spring::windup_at(self.stepper.spring, c, seat.segment().load_torque(row).value);
                [angle, speed, error + windup, (c.inverse_ratio - slope) * speed, 0.0]
            }
        };
        let mut state = M::compose(full);
        M::begin(&self.stepper.terms, c.inverse_ratio, &mut state);
        state
    }
}

impl<P: Path, M: Model<N>, T: Method, const N: usize> Retrace<N> for Replay<P, M, T, N> {
    fn dense(&mut self, seat: &Seat<N>, start: &Record<N>, step: f64) -> Dense<N> {
        self.stepper.t = start.t;
        self.stepper.state = start.state;
        self.stepper.directions = start.directions;
        self.stepper.input.set_lane(0, seat.segment_before(start.t + step), &seat.assignment.row);
        let coefficients = P::enter(DenseStep::<M, T, N> { stepper: &mut self.stepper, step, methods: PhantomData });
        Dense { t: start.t, step, coefficients }
    }

    fn rates(&mut self, seat: &Seat<N>, t: f64, state: &[f64; N]) -> Rates<f64, N> {
        let way = |shaft: usize| M::STICKING.get(shaft).map_or(0.0, |&speed| sign(state[speed]));
        self.rates_in(seat, t, state, [way(0), way(1)])
    }

    fn energies(&mut self, seat: &Seat<N>, t: f64, state: &[f64; N]) -> Energies<f64> {
        self.stepper.input.set_lane(0, seat.segment_before(t), &seat.assignment.row);
        P::enter(Energy::<M, N> { stepper: &self.stepper, t, state, model: PhantomData })
    }

    fn base(&self) -> Base {
        M::BASE
    }

    fn kinematic_error(&self, angle: f64) -> (f64, f64) {
        P::enter(KinematicError(&self.stepper.harmonics, angle))
    }
}

/// +1, -1, or 0 at zero.
fn sign(value: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value.signum() }
}

struct KinematicError<'a>(&'a Harmonics<f64>, f64);

impl Task for KinematicError<'_> {
    type Output = (f64, f64);

    #[inline(always)]
    fn run(self) -> Self::Output {
        self.0.value_and_slope(self.1)
    }
}

struct DenseStep<'a, M, T, const N: usize> {
    stepper: &'a mut Stepper<f64, N>,
    step: f64,
    methods: PhantomData<(M, T)>,
}

impl<M: Model<N>, T: Method, const N: usize> Task for DenseStep<'_, M, T, N> {
    type Output = [[f64; super::record::DENSE_TERMS]; N];

    #[inline(always)]
    fn run(self) -> Self::Output {
        self.stepper.refresh::<M>(true);
        self.stepper.attempt::<M, T>(self.step);
        self.stepper.dense::<M, T>(self.step)
    }
}

struct Instant<'a, M, const N: usize> {
    stepper: &'a Stepper<f64, N>,
    t: f64,
    state: &'a [f64; N],
    model: PhantomData<M>,
}

impl<M: Model<N>, const N: usize> Task for Instant<'_, M, N> {
    type Output = Rates<f64, N>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        self.stepper.rates::<M>(self.t, self.state)
    }
}

struct Energy<'a, M, const N: usize> {
    stepper: &'a Stepper<f64, N>,
    t: f64,
    state: &'a [f64; N],
    model: PhantomData<M>,
}

impl<M: Model<N>, const N: usize> Task for Energy<'_, M, N> {
    type Output = Energies<f64>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        self.stepper.energies::<M>(self.t, self.state)
    }
}

struct Jump<'a, M, const N: usize> {
    stepper: &'a Stepper<f64, N>,
    t: f64,
    state: &'a mut [f64; N],
    model: PhantomData<M>,
}

impl<M: Model<N>, const N: usize> Task for Jump<'_, M, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        M::jump(&self.stepper.drive(), self.t, self.state);
    }
}

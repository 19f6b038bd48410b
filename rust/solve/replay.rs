//! A finished row, one step or one instant at a time: for extrema, crossings and derived signals.

use super::advance::Ended;
use super::again::Again;
use super::record::{Branch, Dense, Record};
use super::seat::Seat;
use super::stepper::Stepper;
use super::watch::WATCHED;
use super::{Integrands, Method};
use crate::model::terms::Motion;
use crate::model::{Base, Drivetrain, Energies, Harmonics, Layout, Model, Pieces, Rates, Row, Signal};
use crate::real::{Path, Real, Scalar, Task};
use std::marker::PhantomData;

/// A finished row that can be looked at again, one step or one instant at a time.
pub trait Retrace<S: Scalar, const N: usize> {
    /// A step from a record as polynomials.
    fn dense(&mut self, seat: &Seat<S, N>, start: &Record<S, N>, step: f64) -> Dense<S, N>;
    /// Everything the equations pass through at an instant; a shaft slides the way it moves and at rest is held as
    /// long as dry friction can hold it.
    fn rates(&mut self, seat: &Seat<S, N>, t: f64, state: &[S; N]) -> Rates<S, N>;
    /// A signal at an instant.
    fn signal(&mut self, signal: Signal, seat: &Seat<S, N>, t: f64, state: &[S; N]) -> S {
        let inverse_ratio = seat.assignment.row.constants.inverse_ratio;
        let rates = (!signal.is_of_state(self.base())).then(|| self.rates(seat, t, state));
        signal.value(state, rates.as_ref(), inverse_ratio)
    }
    /// The energy at an instant.
    fn energies(&mut self, seat: &Seat<S, N>, t: f64, state: &[S; N]) -> Energies<S>;
    /// Which base model it is.
    fn base(&self) -> Base;
    /// The slope of the kinematic error, terms included, of a drive that begins at the set speed under a load torque.
    fn error_slope(&self, seat: &Seat<S, N>, angle: S, load_torque: S) -> S;
    /// The same at many motor angles, as many at once as there are lanes.
    fn error_slopes(&mut self, seat: &Seat<S, N>, angles: &[f64], load_torque: S) -> Vec<f64>;
    /// Highest order per motor revolution that terms add to it.
    fn highest_order(&self) -> f64;
    /// Orders per motor revolution at which what terms add to it repeats.
    fn repeat_at(&self) -> Vec<f64>;
}

/// What stands in one lane of a path.
pub type Lane<P> = <<P as Path>::Lanes as Real>::Lane;

/// Recomputes single steps of the row last loaded, with the same bits as the lanes had.
pub struct Replay<'a, P: Path, M, T, const N: usize> {
    stepper: Stepper<Lane<P>, N>,
    again: Again<P::Lanes, M, T, N>,
    shared: &'a Harmonics<Lane<P>>,
}

impl<'a, P: Path, M: Model<N>, T: Method, const N: usize> Replay<'a, P, M, T, N> {
    /// For rows like this one.
    pub fn new(layout: &Layout, row: &Row<Lane<P>>, shared: &'a Harmonics<Lane<P>>) -> Self {
        Self {
            stepper: Stepper::new::<M, T>(layout, row, shared, Integrands::default(), [false; WATCHED]),
            again: Again::new(layout, row, shared),
            shared,
        }
    }

    /// Makes a row the one that is replayed.
    pub fn load(&mut self, seat: &Seat<Lane<P>, N>) {
        seat.load(0, &mut self.stepper, self.shared);
    }

    /// Takes the closer looks that rows which have ended ask for, as many at once as there are lanes.
    pub(super) fn look(&mut self, ended: &mut [Ended<Lane<P>, N>]) {
        let mut places = Vec::new();
        for (row, Ended { seat, .. }) in ended.iter().enumerate() {
            places.extend(seat.asked().map(|place| (row, place)));
        }
        for part in places.chunks(P::Lanes::LANES) {
            let mut candidates = Vec::with_capacity(part.len());
            for (lane, &(row, place)) in part.iter().enumerate() {
                let seat = &ended[row].seat;
                let candidate = &seat.candidates[place].1;
                self.again.set_lane(lane, seat, (&candidate.start, candidate.step), self.shared);
                candidates.push(candidate);
            }
            self.again.take();
            let peaks = self.again.peaks(&candidates);
            for (lane, &(row, place)) in part.iter().enumerate() {
                let candidate = &mut ended[row].seat.candidates[place].1;
                (candidate.peak, candidate.asked) = (Some(peaks.get(lane)), false);
            }
        }
    }

    fn set_branch(&mut self, branch: Branch) {
        self.stepper.directions = branch.directions.map(|direction| Lane::<P>::splat(f64::from(direction)));
        if let Some(pieces) = &mut self.stepper.held {
            **pieces = branch.pieces.map(f64::from);
        }
    }

    /// Lets go of shafts at rest that are pulled too hard. True where anything changed.
    fn release(&mut self, rates: &Rates<Lane<P>, N>) -> bool {
        let before = self.stepper.directions;
        for (shaft, &speed) in M::STICKING.iter().enumerate() {
            let (speed, held) = (self.stepper.state[speed].plain(), before[shaft].plain());
            self.stepper.directions[shaft] = Lane::<P>::splat(rates.shafts[shaft].onward(0, speed, held));
        }
        before.iter().zip(&self.stepper.directions).any(|(before, after)| before.plain() != after.plain())
    }

    /// What the corners find at an instant of the present step: how much is left of the pieces, or the pieces where none is held.
    pub fn corners(
        &mut self,
        seat: &Seat<Lane<P>, N>,
        t: f64,
        state: &[Lane<P>; N],
        branch: Branch,
        held: bool,
    ) -> Pieces<f64> {
        self.set_branch(branch);
        self.stepper.input.set_lane(0, seat.segment(), &seat.assignment.row);
        Lane::<P>::apart(FindCorners::<Lane<P>, M, N> { stepper: &self.stepper, t, state, held, model: PhantomData })
    }

    /// Everything the equations pass through at an instant of the present step on a branch of theirs.
    pub fn rates_in(
        &mut self,
        seat: &Seat<Lane<P>, N>,
        t: Lane<P>,
        state: &[Lane<P>; N],
        branch: Branch,
    ) -> Rates<Lane<P>, N> {
        self.set_branch(branch);
        self.stepper.input.set_lane(0, seat.segment(), &seat.assignment.row);
        Lane::<P>::apart(Instant::<Lane<P>, M, N> { stepper: &self.stepper, t, state, model: PhantomData })
    }

    /// The derivative of a function of the equations, and how fast it changes along the motion.
    pub fn change_and_rate(
        &mut self,
        seat: &Seat<Lane<P>, N>,
        t: f64,
        (state, slope): (&[Lane<P>; N], &[f64; N]),
        branch: Branch,
        function: impl Fn(&Rates<Lane<P>, N>) -> Lane<P>,
    ) -> (f64, f64) {
        let mut tangent = |pace: f64| {
            let moving = |number: Lane<P>, rate: f64| number.with_tangent(rate.mul_add(pace, number.tangent()));
            let state = std::array::from_fn(|index| moving(state[index], slope[index]));
            function(&self.rates_in(seat, moving(Lane::<P>::splat(t), 1.0), &state, branch)).tangent()
        };
        let change = tangent(0.0);
        (change, tangent(1.0) - change)
    }

    /// The state after a jump of hidden states at the end of a step, and the energy that went with it [J].
    pub fn jump(&mut self, seat: &Seat<Lane<P>, N>, t: f64, state: &[Lane<P>; N]) -> ([Lane<P>; N], Lane<P>) {
        let before = self.energies(seat, t, state).mechanical;
        let mut after = *state;
        Lane::<P>::apart(Jump::<Lane<P>, M, N> { stepper: &self.stepper, t, state: &mut after, model: PhantomData });
        let lost = before - self.energies(seat, t, &after).mechanical;
        (after, lost)
    }

    /// The state at time 0 of a row just loaded, and the motor torque that holds its load there [N m].
    pub fn start(&self, seat: &Seat<Lane<P>, N>) -> ([Lane<P>; N], Lane<P>) {
        self.stepper.outset::<M>(seat)
    }
}

impl<P: Path, M: Model<N>, T: Method, const N: usize> Retrace<Lane<P>, N> for Replay<'_, P, M, T, N> {
    fn dense(&mut self, seat: &Seat<Lane<P>, N>, start: &Record<Lane<P>, N>, step: f64) -> Dense<Lane<P>, N> {
        self.again.set_lane(0, seat, (start, step), self.shared);
        self.again.take();
        self.again.dense(0)
    }

    fn rates(&mut self, seat: &Seat<Lane<P>, N>, t: f64, state: &[Lane<P>; N]) -> Rates<Lane<P>, N> {
        seat.place(0, &mut self.stepper, seat.segment_before(t), (t, state));
        self.stepper.slide::<M>(true);
        let t = Lane::<P>::splat(t);
        let rates = Lane::<P>::apart(Instant::<Lane<P>, M, N> { stepper: &self.stepper, t, state, model: PhantomData });
        if !self.release(&rates) {
            return rates;
        }
        Lane::<P>::apart(Instant::<Lane<P>, M, N> { stepper: &self.stepper, t, state, model: PhantomData })
    }

    fn energies(&mut self, seat: &Seat<Lane<P>, N>, t: f64, state: &[Lane<P>; N]) -> Energies<Lane<P>> {
        seat.place(0, &mut self.stepper, seat.segment_before(t), (t, state));
        self.stepper.settle::<M>(true);
        Lane::<P>::apart(Energy::<Lane<P>, M, N> { stepper: &self.stepper, t, state, model: PhantomData })
    }

    fn base(&self) -> Base {
        M::BASE
    }

    fn error_slope(&self, seat: &Seat<Lane<P>, N>, angle: Lane<P>, load_torque: Lane<P>) -> Lane<P> {
        let row = &seat.assignment.row;
        let motion = Motion::of_motor(angle, row.omega_set, row.constants.inverse_ratio);
        self.stepper.kinematic_error(&motion, load_torque).1
    }

    fn error_slopes(&mut self, seat: &Seat<Lane<P>, N>, angles: &[f64], load_torque: Lane<P>) -> Vec<f64> {
        self.again.load(seat, self.shared);
        self.again.error_slopes(seat.assignment.row.omega_set, angles, load_torque)
    }

    fn highest_order(&self) -> f64 {
        self.stepper.terms.highest_order().plain()
    }

    fn repeat_at(&self) -> Vec<f64> {
        self.stepper.terms.repeat_at(self.stepper.constants.inverse_ratio)
    }
}

struct Instant<'a, S: Scalar, M, const N: usize> {
    stepper: &'a Stepper<S, N>,
    t: S,
    state: &'a [S; N],
    model: PhantomData<M>,
}

impl<S: Scalar, M: Model<N>, const N: usize> Task for Instant<'_, S, M, N> {
    type Output = Rates<S, N>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        self.stepper.rates::<M>(self.t, self.state)
    }
}

struct FindCorners<'a, S: Scalar, M, const N: usize> {
    stepper: &'a Stepper<S, N>,
    t: f64,
    state: &'a [S; N],
    held: bool,
    model: PhantomData<M>,
}

impl<S: Scalar, M: Model<N>, const N: usize> Task for FindCorners<'_, S, M, N> {
    type Output = Pieces<f64>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { stepper, t, state, held, .. } = self;
        let drive = stepper.drive();
        M::corners(&Drivetrain { pieces: drive.pieces.filter(|_| held), ..drive }, S::splat(t), state)
    }
}

struct Energy<'a, S: Scalar, M, const N: usize> {
    stepper: &'a Stepper<S, N>,
    t: f64,
    state: &'a [S; N],
    model: PhantomData<M>,
}

impl<S: Scalar, M: Model<N>, const N: usize> Task for Energy<'_, S, M, N> {
    type Output = Energies<S>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        self.stepper.energies::<M>(S::splat(self.t), self.state)
    }
}

struct Jump<'a, S: Scalar, M, const N: usize> {
    stepper: &'a Stepper<S, N>,
    t: f64,
    state: &'a mut [S; N],
    model: PhantomData<M>,
}

impl<S: Scalar, M: Model<N>, const N: usize> Task for Jump<'_, S, M, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        M::jump(&self.stepper.drive(), S::splat(self.t), self.state);
    }
}

//! The loop: every lane takes its own steps through its own row and takes the next row when done.

use super::Method;
use super::controller::Controller;
use super::events::Events;
use super::extrema::Extreme;
use super::integrals::Integrands;
use super::record::{Branch, lane_numbers};
use super::replay::{Lane, Replay, Retrace};
use super::sampling::{Sampled, Waiting};
use super::seat::{Assignment, Memory, Seat};
use super::status::Status;
use super::stepper::Stepper;
use super::unseen::Unseen;
use super::watch::WatchList;
use crate::model::{Harmonics, Layout, Model, Signal};
use crate::real::{Mask, Path, Real, Scalar, Task, lanes_of};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What is asked of every row.
#[derive(Clone, Debug)]
pub struct Demand {
    /// Relative tolerance.
    pub rtol: f64,
    /// Factor on the sizes below which relative accuracy is not asked for.
    pub floor: f64,
    /// Attempts per row.
    pub max_steps: u32,
    /// Longest step [s].
    pub max_step: f64,
    /// What samples hold.
    pub sampled: Arc<Sampled>,
    /// Quadratures.
    pub integrands: Integrands,
    /// Signals whose extrema are located.
    pub watched: WatchList,
    /// Their largest values over windows.
    pub extremes: Vec<Extreme>,
    /// Whether the time outside the spring's range is counted.
    pub outside: bool,
    /// Whether steps are recorded.
    pub record: bool,
    /// Whether stiff rows are set aside.
    pub find_stiff: bool,
}

impl Demand {
    /// Has samples hold signals, among others.
    pub fn sample(&mut self, signals: &[Signal], layout: &Layout) {
        let sampled = Arc::make_mut(&mut self.sampled);
        for &signal in signals {
            sampled.include(signal, layout);
        }
    }
}

/// Where rows come from and where they go.
pub trait Rows<S: Scalar, const N: usize> {
    /// The next row to simulate.
    fn next(&mut self) -> Option<Assignment<S>>;
    /// Takes a row that is stiff and has not ended.
    fn set_aside(&mut self, seat: &Seat<S, N>);
    /// Takes a row that ended in the given state.
    fn finish(&mut self, seat: &Seat<S, N>, t: f64, state: &[S; N], status: Status, replay: &mut dyn Retrace<S, N>);
}

/// A row that has ended.
pub(super) struct Ended<S, const N: usize> {
    pub seat: Box<Seat<S, N>>,
    pub t: f64,
    pub state: [S; N],
    pub status: Status,
    /// How many closer looks it waits for.
    pub asked: usize,
}

impl<S: Scalar, const N: usize> Ended<S, N> {
    /// Asks for the closer looks that the extremes take.
    pub fn ask(&mut self, extremes: &[Extreme]) {
        if self.status == Status::Finished {
            for extreme in extremes {
                extreme.ask(&mut self.seat);
            }
            self.asked = self.seat.asked().count();
        }
    }
}

/// Numbers of a path that carry no derivative.
pub(super) type Plain<P> = <<P as Path>::Lanes as Real>::Plain;

/// All lanes of one thread.
pub struct Advance<'a, P: Path, M: Model<N>, T: Method, const N: usize> {
    pub(super) demand: &'a Demand,
    pub(super) layout: &'a Layout,
    pub(super) harmonics: &'a Harmonics<Lane<P>>,
    pub(super) cancelled: &'a AtomicBool,
    pub(super) stepper: Stepper<P::Lanes, N>,
    pub(super) controller: Controller<Plain<P>>,
    pub(super) replay: Replay<'a, P, M, T, N>,
    /// Large, and taken out at every stop.
    pub(super) seats: Vec<Option<Box<Seat<Lane<P>, N>>>>,
    pub(super) spare: Vec<Memory<Lane<P>, N>>,
    /// Rows that wait for closer looks.
    pub(super) ended: Vec<Ended<Lane<P>, N>>,
    pub(super) step: Plain<P>,
    /// The longest step of each lane [s].
    pub(super) longest: Plain<P>,
    pub(super) stop: Plain<P>,
    /// When a sample of each lane is wanted next.
    pub(super) sample: P::Lanes,
    /// Samples that have yet to be observed.
    pub(super) waiting: Waiting<P::Lanes, N>,
    pub(super) attempts: Plain<P>,
    pub(super) accepted: Plain<P>,
    /// How stiff each lane has looked of late.
    pub(super) stiffness: Plain<P>,
    /// Steps below which stiffness is looked for [s].
    pub(super) short_step: Plain<P>,
    /// What holds steps down where values show no error; only where there are derivatives.
    pub(super) unseen: Option<Box<Unseen<Plain<P>, N>>>,
    pub(super) first_share: f64,
    pub(super) events: Events<P::Lanes>,
    pub(super) occupied: u64,
    pub(super) stale: u64,
    /// Lanes in which an input bends without a jump.
    pub(super) bent: u64,
}

impl<'a, P: Path, M: Model<N>, T: Method, const N: usize> Advance<'a, P, M, T, N> {
    /// Lanes as empty as `first` lets them be; every lane starts with its constants.
    pub fn new(
        demand: &'a Demand,
        layout: &'a Layout,
        harmonics: &'a Harmonics<Lane<P>>,
        cancelled: &'a AtomicBool,
        first: &Assignment<Lane<P>>,
    ) -> Self {
        let zero = Plain::<P>::zero();
        let stepper = Stepper::new::<M, T>(layout, &first.row, harmonics, demand.integrands, demand.watched);
        let unseen = (P::Lanes::DIFFERENTIATES && !T::IS_IMPLICIT).then(|| Box::new(Unseen::new(&stepper)));
        Self {
            demand,
            layout,
            harmonics,
            cancelled,
            stepper,
            controller: Controller::new(),
            replay: Replay::new(layout, &first.row, harmonics),
            seats: (0..P::Lanes::LANES).map(|_| None).collect(),
            spare: Vec::new(),
            ended: Vec::new(),
            step: Plain::<P>::splat(1e-3),
            longest: Plain::<P>::splat(demand.max_step),
            stop: Plain::<P>::splat(f64::INFINITY),
            sample: P::Lanes::splat(f64::INFINITY),
            waiting: Waiting::new(),
            attempts: zero,
            accepted: zero,
            stiffness: zero,
            short_step: zero,
            unseen,
            first_share: 3.0 * demand.rtol.powf(1.0 / f64::from(T::ERROR_ORDER)),
            events: Events::new(),
            occupied: 0,
            stale: 0,
            bent: 0,
        }
    }

    /// Runs rows until there are no more.
    #[inline(always)]
    pub fn run(&mut self, rows: &mut impl Rows<Lane<P>, N>) {
        for lane in 0..P::Lanes::LANES {
            self.seat_next(lane, rows);
        }
        if M::STICKS {
            self.run_out::<true>(rows);
        } else if P::Lanes::DIFFERENTIATES || self.stepper.held.is_some() {
            P::Lanes::apart(RunHeld { lanes: self, rows });
        } else {
            self.run_out::<false>(rows);
        }
        self.hand_over(0, rows);
    }

    /// Attempts steps until all lanes are empty. Where nothing sticks and no law has corners, nothing is held and no
    /// event is looked for: the base models do not pay for what they do not have.
    #[inline(always)]
    fn run_out<const HELD: bool>(&mut self, rows: &mut impl Rows<Lane<P>, N>) {
        while self.occupied != 0 {
            if self.cancelled.load(Ordering::Relaxed) {
                return self.vacate_all(rows);
            }
            self.advance::<HELD>(rows);
        }
    }

    /// One attempt in every lane.
    #[inline(always)]
    fn advance<const HELD: bool>(&mut self, rows: &mut impl Rows<Lane<P>, N>) {
        self.refresh::<HELD>();
        let (step, landing) = self.next_step::<HELD>();
        let mut trial = self.stepper.attempt::<M, T, HELD>(step);
        trial.t = Plain::<P>::select(landing, self.stop, trial.t);
        let Demand { rtol, floor, .. } = *self.demand;
        let error = self.stepper.squared_error::<M, T>(step, &trial, rtol, floor);
        let occupied = <P::Lanes as Real>::Mask::from_bits(self.occupied);
        let worst = self.stepper.with_sums::<M, T>(occupied, step, error, rtol, floor);
        let verdict = self.controller.judge::<T>(worst);
        let stiff = self.find_stiff(verdict.accepted, step, &trial);
        let accepted = verdict.accepted & !self.find_events::<HELD>(verdict.accepted, landing, step, &trial);
        self.take_samples::<HELD>(accepted, step, &trial);
        self.rest(&mut trial);
        self.watch::<HELD>(accepted, step, &trial);
        self.count_outside(accepted, step, &trial);
        self.stepper.commit::<M, HELD>(accepted, step, &trial);
        self.choose_step(step, verdict.factor, accepted & landing);
        if P::Lanes::DIFFERENTIATES && !T::IS_IMPLICIT {
            self.hold_unseen(accepted, error);
        }
        self.settle_events::<HELD>(accepted, &trial);
        self.count::<HELD>(accepted, step, &trial);
        let arrived = (accepted & landing).to_bits() & self.occupied;
        self.set_aside(stiff & !arrived, rows);
        self.fail(arrived, !verdict.accepted, step, &trial, rows);
        self.arrive(arrived, &trial, rows);
    }

    /// First slopes of lanes that begin a row or whose input has jumped.
    #[inline(always)]
    fn refresh<const HELD: bool>(&mut self) {
        if P::Lanes::DIFFERENTIATES && self.bent != 0 {
            self.stepper.refresh_tangents::<M>(<P::Lanes as Real>::Mask::from_bits(self.bent));
            self.bent = 0;
        }
        if self.stale == 0 {
            return;
        }
        let stale = <P::Lanes as Real>::Mask::from_bits(self.stale);
        self.stepper.settle::<M>(stale);
        let mut rates = self.stepper.refresh::<M>(stale);
        if M::STICKS && self.release(&rates) {
            self.stepper.settle::<M>(stale);
            rates = self.stepper.refresh::<M>(stale);
        }
        if M::STICKS && P::Lanes::DIFFERENTIATES && self.carry_from_event(&rates) {
            rates = self.stepper.refresh::<M>(stale);
        }
        for lane in lanes_of(self.stale) {
            self.open_windows(lane);
        }
        if self.demand.record {
            self.remember::<HELD>(self.stale, Plain::<P>::zero(), &rates);
        }
        self.stale = 0;
    }

    #[inline(always)]
    fn choose_step(&mut self, step: Plain<P>, factor: Plain<P>, landed: <P::Lanes as Real>::Mask) {
        let next = step * factor;
        let kept = next.max(self.step);
        self.step = Plain::<P>::select(landed, kept, next).min(self.longest);
    }

    #[inline(always)]
    pub(super) fn branch(&self, lane: usize) -> Branch {
        Branch::of(lane, &self.stepper.directions, self.stepper.held.as_deref())
    }

    #[inline(always)]
    pub(super) fn lane_state(&self, lane: usize) -> [Lane<P>; N] {
        lane_numbers(&self.stepper.state, lane)
    }

    pub(super) fn set_lane_state(&mut self, lane: usize, state: &[Lane<P>; N]) {
        for (lanes, &value) in self.stepper.state.iter_mut().zip(state) {
            lanes.set(lane, value);
        }
    }
}

/// The run of a base model some of whose laws have corners.
struct RunHeld<'b, 'a, P: Path, M: Model<N>, T: Method, Q, const N: usize> {
    lanes: &'b mut Advance<'a, P, M, T, N>,
    rows: &'b mut Q,
}

impl<P: Path, M: Model<N>, T: Method, Q: Rows<Lane<P>, N>, const N: usize> Task for RunHeld<'_, '_, P, M, T, Q, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.lanes.run_out::<true>(self.rows);
    }
}

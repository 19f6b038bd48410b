//! One thread's share of a sweep: takes rows from the queue, runs them in lanes, writes what they yield.

use super::job::{Direction, Job, MethodName, StartKind};
use super::outputs::{RowOutput, Writer};
use crate::model::{Base, Harmonics, Model, Row, Signal};
use crate::output::{Reduction, probe_grid};
use crate::real::{Path, Real, Scalar, Task};
use crate::solve::{Advance, Assignment, Lane, Method, Retrace, Rows, Seat, Start, Status, Wanted};
use std::marker::PhantomData;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Of runs left: one ended in a panic.
const SPOILED: u32 = 1 << 31;

/// What all threads share.
pub struct Shared<'a> {
    pub job: &'a Job<'a>,
    pub writer: Writer<'a>,
    pub cancelled: AtomicBool,
    /// The method of this pass.
    pub method: MethodName,
    /// The runs of this pass; all where absent.
    queue: Option<Vec<usize>>,
    next: AtomicUsize,
    done: AtomicUsize,
    /// Runs set aside as stiff.
    stiff: Mutex<Vec<usize>>,
    /// Runs that are left of each row, where it has several.
    left: Vec<AtomicU32>,
}

impl<'a> Shared<'a> {
    pub fn new(job: &'a Job<'a>, writer: Writer<'a>) -> Self {
        let runs = job.runs_per_row();
        let several = if runs > 1 { job.rows } else { 0 };
        Self {
            job,
            writer,
            cancelled: AtomicBool::new(false),
            method: job.method,
            queue: longest_first(job),
            next: AtomicUsize::new(0),
            done: AtomicUsize::new(0),
            stiff: Mutex::new(Vec::new()),
            left: (0..several).map(|_| AtomicU32::new(runs as u32)).collect(),
        }
    }

    /// Puts the runs set aside into the queue for another method; false where there are none.
    pub fn begin_again(&mut self, method: MethodName) -> bool {
        let stiff = std::mem::take(self.stiff.get_mut().unwrap_or_else(PoisonError::into_inner));
        let any = !stiff.is_empty();
        (self.queue, self.method) = (Some(stiff), method);
        *self.next.get_mut() = 0;
        any
    }

    /// The next run of this pass.
    fn take_next(&self) -> Option<usize> {
        let place = self.next.fetch_add(1, Ordering::Relaxed);
        match &self.queue {
            Some(queue) => queue.get(place).copied(),
            None => Some(place).filter(|run| *run < self.job.rows * self.job.runs_per_row()),
        }
    }

    /// How many rows the runs that are done make up.
    pub fn rows_done(&self) -> usize {
        self.done.load(Ordering::Relaxed) / self.job.runs_per_row()
    }

    /// Row and direction of a run.
    fn place(&self, run: usize) -> (usize, usize) {
        (run / self.job.runs_per_row(), run % self.job.runs_per_row())
    }

    /// Gives up a run.
    fn give_up(&self, run: usize, status: Status, detail: i32) {
        let (row, direction) = self.place(run);
        if let Some(left) = self.left.get(row).filter(|_| status == Status::Internal) {
            // Other threads may be at other runs of the row: what is missing is marked when all have ended.
            left.fetch_or(SPOILED, Ordering::Relaxed);
            return;
        }
        if direction == 0 {
            // SAFETY: the thread that gives up a run has taken it from the queue; where the row has others, they are
            // given up for the same reason and write nothing.
            unsafe { self.writer.missing(row, status, detail) };
        }
        self.run_ended(row);
    }

    /// Counts a run of a row that has ended by itself.
    fn run_ended(&self, row: usize) {
        if let Some(left) = self.left.get(row) {
            left.fetch_sub(1, Ordering::Relaxed);
        }
    }

    /// Why a row is not whole, once all threads have ended: some of its derivatives are missing.
    pub fn unfinished(&self, row: usize) -> Option<Status> {
        match self.left.get(row)?.load(Ordering::Relaxed) {
            0 => None,
            left if left & SPOILED != 0 => Some(Status::Internal),
            _ => Some(Status::Cancelled),
        }
    }
}

/// All runs, those of the longest inputs first, so that none of them is begun when the others end; absent where all
/// have the same inputs.
fn longest_first(job: &Job) -> Option<Vec<usize>> {
    if job.programs.len() < 2 {
        return None;
    }
    let runs = job.runs_per_row();
    let mut rows: Vec<usize> = (0..job.rows).collect();
    rows.sort_by_cached_key(|&row| std::cmp::Reverse(job.programs[(job.program_of)(row)].segments.len()));
    Some(rows.into_iter().flat_map(|row| row * runs..(row + 1) * runs).collect())
}

/// Runs of this thread, one per row and direction: those it has taken and not finished are named, in case of a panic.
struct Queue<'a, 'b, S> {
    shared: &'a Shared<'b>,
    /// Only these runs, one after the other, instead of the shared queue.
    own: Option<std::vec::IntoIter<usize>>,
    in_flight: &'a mut Vec<usize>,
    values: Vec<f64>,
    metrics: Vec<S>,
}

impl<S: Scalar> Queue<'_, '_, S> {
    fn next_index(&mut self) -> Option<usize> {
        match &mut self.own {
            Some(runs) => runs.next(),
            None => self.shared.take_next(),
        }
    }

    /// The next run that can be simulated; others are written off with their reason.
    fn assignment(&mut self) -> Option<Assignment<S>> {
        let job = self.shared.job;
        // Bad rows could go on for seconds.
        while !self.shared.cancelled.load(Ordering::Relaxed) {
            let run = self.next_index()?;
            self.in_flight.push(run);
            (job.parameters)(self.shared.place(run).0, &mut self.values);
            let mut values: Vec<S> = self.values.iter().copied().map(S::splat).collect();
            if let Some(Direction::Parameter(index)) = self.direction(run) {
                values[index] = values[index].with_tangent(1.0);
            }
            match Row::new(&job.layout, &values, job.shared_error.is_none()) {
                Ok(row) => return Some(self.assign(run, row)),
                Err(bad) => {
                    self.shared.give_up(run, Status::BadParameters, bad.index as i32);
                    self.settle(run);
                }
            }
        }
        None
    }

    fn direction(&self, run: usize) -> Option<Direction> {
        self.shared.job.directions.get(self.shared.place(run).1).copied()
    }

    fn assign(&self, run: usize, row: Row<S>) -> Assignment<S> {
        let job = self.shared.job;
        let index = self.shared.place(run).0;
        let program = job.programs[(job.program_of)(index)].clone();
        let start = match ((job.initial_state)(index), job.start) {
            (Some(full), _) => {
                let [theta_m, omega_m, theta_l, omega_l, z] = full.map(S::splat);
                Start::Given([theta_m, omega_m, theta_m * row.constants.inverse_ratio - theta_l, omega_l, z])
            }
            (None, StartKind::Relaxed) => Start::Relaxed,
            (None, StartKind::ZeroAngle) => Start::ZeroAngle,
        };
        let mut initial_tangent = [0.0; 5];
        if let Some(Direction::Initial(state)) = self.direction(run) {
            initial_tangent[state] = 1.0;
        }
        let probes = probe_grid(&job.metrics, &job.layout, &row, &program);
        let grid = if job.signals.is_empty() { Arc::from([]) } else { job.grids[(job.grid_of)(index)].clone() };
        let wanted = Wanted { grid, probes, sampled: job.demand.sampled.clone() };
        Assignment { index: run, row, program, start, initial_tangent, wanted }
    }

    /// Writes the samples of a row.
    fn write_samples<const N: usize>(&self, seat: &Seat<S, N>) {
        let Shared { job, writer, .. } = self.shared;
        let (row, direction) = self.shared.place(seat.assignment.index);
        for (place, &signal) in job.signals.iter().enumerate() {
            let samples = seat.samples.on_grid(signal).chain(std::iter::repeat(S::splat(f64::NAN)));
            // SAFETY: this thread took the run from the queue.
            unsafe { writer.samples((place, row), direction, samples) };
        }
    }

    fn land(&mut self, run: usize) {
        self.in_flight.retain(|taken| *taken != run);
    }

    fn settle(&mut self, run: usize) {
        self.land(run);
        self.shared.done.fetch_add(1, Ordering::Relaxed);
    }
}

impl<S: Scalar, const N: usize> Rows<S, N> for Queue<'_, '_, S> {
    fn next(&mut self) -> Option<Assignment<S>> {
        self.assignment()
    }

    fn set_aside(&mut self, seat: &Seat<S, N>) {
        let run = seat.assignment.index;
        self.shared.stiff.lock().unwrap_or_else(PoisonError::into_inner).push(run);
        self.land(run);
    }

    fn finish(&mut self, seat: &Seat<S, N>, t: f64, state: &[S; N], status: Status, retrace: &mut dyn Retrace<S, N>) {
        let job = self.shared.job;
        let run = seat.assignment.index;
        let (row, direction) = self.shared.place(run);
        if status == Status::Cancelled && direction > 0 {
            return self.settle(run);
        }
        self.metrics.clear();
        self.metrics.resize(job.metrics.len(), S::splat(f64::NAN));
        if status == Status::Finished {
            Reduction::new(&job.layout, seat, retrace, t, *state).values(&job.metrics, &mut self.metrics);
        }
        self.write_samples(seat);
        let theta_l = retrace.signal(Signal::ThetaL, seat, t, state);
        let two_inertia = [state[0], state[1], theta_l, state[3], state[4 % N]];
        let one_inertia = [state[0], state[1], state[2]];
        let final_state: &[S] = if job.layout.base == Base::OneInertia { &one_inertia } else { &two_inertia };
        let output = RowOutput {
            metrics: &self.metrics,
            final_state,
            status,
            method: self.shared.method,
            steps: seat.accepted,
            rejected: seat.rejected,
            time: t,
        };
        // SAFETY: this thread took the run from the queue.
        unsafe { self.shared.writer.row(row, direction, &output) };
        if status != Status::Cancelled {
            self.shared.run_ended(row);
        }
        self.settle(run);
    }
}

struct Run<'a, 'b, P: Path, M, T, const N: usize> {
    queue: Queue<'a, 'b, Lane<P>>,
    types: PhantomData<(P, M, T)>,
}

impl<P: Path, M: Model<N>, T: Method, const N: usize> Task for Run<'_, '_, P, M, T, N> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        let shared = self.queue.shared;
        let Some(first) = self.queue.assignment() else { return };
        let common = shared.job.shared_error.as_ref().map(|error| error.map(Lane::<P>::splat));
        let harmonics: Harmonics<Lane<P>> = common.or(first.row.harmonics.clone()).expect("a kinematic error");
        let mut lanes =
            Advance::<P, M, T, N>::new(&shared.job.demand, &shared.job.layout, &harmonics, &shared.cancelled, &first);
        let mut rows = FirstThen { first: Some(first), rest: self.queue };
        lanes.run(&mut rows);
    }
}

/// Gives back the row that was taken to size the lanes.
struct FirstThen<'a, 'b, S> {
    first: Option<Assignment<S>>,
    rest: Queue<'a, 'b, S>,
}

impl<S: Scalar, const N: usize> Rows<S, N> for FirstThen<'_, '_, S> {
    fn next(&mut self) -> Option<Assignment<S>> {
        self.first.take().or_else(|| self.rest.assignment())
    }

    fn set_aside(&mut self, seat: &Seat<S, N>) {
        self.rest.set_aside(seat);
    }

    fn finish(&mut self, seat: &Seat<S, N>, t: f64, state: &[S; N], status: Status, retrace: &mut dyn Retrace<S, N>) {
        self.rest.finish(seat, t, state, status, retrace);
    }
}

/// Works until the queue is empty. A panic costs no more than the run that caused it: the runs in
/// flight are run again one by one, and only the one that panics again is given up.
pub fn work<P: Path, One: Path, M: Model<N>, T: Method, const N: usize>(shared: &Shared) {
    let mut in_flight = Vec::new();
    while !run::<P, M, T, N>(shared, None, &mut in_flight) {
        for taken in std::mem::take(&mut in_flight) {
            let mut alone = Vec::new();
            if !run::<One, M, T, N>(shared, Some(vec![taken]), &mut alone) {
                shared.give_up(taken, Status::Internal, -1);
                shared.done.fetch_add(1, Ordering::Relaxed);
            }
        }
    }
}

/// False where the work ended in a panic.
fn run<P: Path, M: Model<N>, T: Method, const N: usize>(
    shared: &Shared,
    own: Option<Vec<usize>>,
    in_flight: &mut Vec<usize>,
) -> bool {
    let queue = Queue {
        shared,
        own: own.map(Vec::into_iter),
        in_flight,
        values: vec![0.0; shared.job.layout.len()],
        metrics: Vec::new(),
    };
    let work = Run::<P, M, T, N> { queue, types: PhantomData };
    catch_unwind(AssertUnwindSafe(|| P::enter(work))).is_ok()
}

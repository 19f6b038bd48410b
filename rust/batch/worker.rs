//! One thread's share of a sweep: takes rows from the queue, runs them in lanes, writes what they yield.

use super::job::{Job, StartKind};
use super::outputs::{RowOutput, Writer};
use crate::model::{Base, Model, Row};
use crate::output::{Reduction, Signal, probe_grid};
use crate::real::{Path, Task};
use crate::solve::{Advance, Assignment, Method, Retrace, Rows, Seat, Start, Status};
use std::marker::PhantomData;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// What all threads share.
pub struct Shared<'a> {
    pub job: &'a Job<'a>,
    pub writer: Writer<'a>,
    pub next: AtomicUsize,
    pub done: AtomicUsize,
    pub cancelled: AtomicBool,
}

/// Rows of this thread: those it has taken and not finished are named, in case of a panic.
struct Queue<'a, 'b> {
    shared: &'a Shared<'b>,
    /// Only these rows, one after the other, instead of the shared queue.
    own: Option<std::vec::IntoIter<usize>>,
    in_flight: &'a mut Vec<usize>,
    values: Vec<f64>,
    metrics: Vec<f64>,
    empty: Arc<[f64]>,
}

impl Queue<'_, '_> {
    fn next_index(&mut self) -> Option<usize> {
        match &mut self.own {
            Some(rows) => rows.next(),
            None => Some(self.shared.next.fetch_add(1, Ordering::Relaxed)).filter(|row| *row < self.shared.job.rows),
        }
    }

    /// The next row that can be simulated; others are written off with their reason.
    fn assignment<const N: usize>(&mut self) -> Option<Assignment<N>> {
        let job = self.shared.job;
        loop {
            let index = self.next_index()?;
            self.in_flight.push(index);
            (job.parameters)(index, &mut self.values);
            match Row::new(&job.layout, &self.values, job.shared_error.is_none()) {
                Ok(row) => return Some(self.assign(index, row)),
                Err(bad) => {
                    // SAFETY: this thread took the row from the queue.
                    unsafe { self.shared.writer.missing(index, Status::BadParameters, bad.index as i32) };
                    self.settle(index);
                }
            }
        }
    }

    fn assign<const N: usize>(&self, index: usize, row: Row) -> Assignment<N> {
        let job = self.shared.job;
        let program = job.programs[(job.program_of)(index)].clone();
        let start = match ((job.initial_state)(index), job.start) {
            (Some([theta_m, omega_m, theta_l, omega_l, z]), _) => {
                Start::Given([theta_m, omega_m, theta_m * row.constants.inverse_ratio - theta_l, omega_l, z])
            }
            (None, StartKind::Relaxed) => Start::Relaxed,
            (None, StartKind::ZeroAngle) => Start::ZeroAngle,
        };
        let probe = if job.metrics.is_empty() {
            self.empty.clone()
        } else {
            probe_grid(&job.metrics, &job.layout, &row, &program)
        };
        let grid = if job.signals.is_empty() { self.empty.clone() } else { job.grids[(job.grid_of)(index)].clone() };
        Assignment { index, row, program, start, grids: [grid, probe] }
    }

    /// Writes the samples of a row; what the equations pass through at an instant is computed once for all signals.
    fn write_samples<const N: usize>(&self, seat: &Seat<N>, retrace: &mut dyn Retrace<N>) {
        let job = self.shared.job;
        let inverse_ratio = seat.assignment.row.constants.inverse_ratio;
        let taken = seat.assignment.grids[0].iter().zip(&seat.samples[0]);
        let mut out: Vec<&mut [f64]> = (0..job.signals.len())
            // SAFETY: this thread took the row from the queue.
            .map(|place| unsafe { self.shared.writer.samples(place, seat.assignment.index) })
            .collect();
        for values in &mut out {
            values[seat.samples[0].len()..].fill(f64::NAN);
        }
        for (moment, (&time, state)) in taken.enumerate() {
            let mut rates = None;
            for (values, signal) in out.iter_mut().zip(&job.signals) {
                values[moment] = signal.of_state(job.layout.base, state, inverse_ratio).unwrap_or_else(|| {
                    let rates = rates.get_or_insert_with(|| retrace.rates(seat, time, state));
                    signal.of_rates(rates, state, inverse_ratio)
                });
            }
        }
    }

    fn settle(&mut self, index: usize) {
        self.in_flight.retain(|row| *row != index);
        self.shared.done.fetch_add(1, Ordering::Relaxed);
    }
}

impl<const N: usize> Rows<N> for Queue<'_, '_> {
    fn next(&mut self) -> Option<Assignment<N>> {
        self.assignment()
    }

    fn finish(&mut self, seat: &Seat<N>, t: f64, state: &[f64; N], status: Status, retrace: &mut dyn Retrace<N>) {
        let job = self.shared.job;
        let index = seat.assignment.index;
        self.metrics.clear();
        self.metrics.resize(job.metrics.len(), f64::NAN);
        if status == Status::Finished {
            Reduction::new(&job.layout, seat, retrace, t, *state).values(&job.metrics, &mut self.metrics);
        }
        self.write_samples(seat, retrace);
        let theta_l = Signal::ThetaL.value(seat, retrace, t, state);
        let two_inertia = [state[0], state[1], theta_l, state[3], state[4 % N]];
        let one_inertia = [state[0], state[1], state[2]];
        let final_state: &[f64] = if job.layout.base == Base::OneInertia { &one_inertia } else { &two_inertia };
        let output = RowOutput {
            metrics: &self.metrics,
            final_state,
            status,
            steps: seat.accepted,
            rejected: seat.rejected,
            time: t,
        };
        // SAFETY: this thread took the row from the queue.
        unsafe { self.shared.writer.row(index, &output) };
        self.settle(index);
    }
}

struct Run<'a, 'b, P, M, T, const N: usize> {
    queue: Queue<'a, 'b>,
    types: PhantomData<(P, M, T)>,
}

impl<P: Path, M: Model<N>, T: Method, const N: usize> Task for Run<'_, '_, P, M, T, N> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        let shared = self.queue.shared;
        let Some(first) = self.queue.assignment::<N>() else { return };
        let own = first.row.harmonics.clone();
        let harmonics = shared.job.shared_error.as_ref().or(own.as_ref()).expect("a kinematic error");
        let mut lanes =
            Advance::<P, M, T, N>::new(&shared.job.demand, &shared.job.layout, harmonics, &shared.cancelled, &first);
        let mut rows = FirstThen { first: Some(first), rest: self.queue };
        lanes.run(&mut rows);
    }
}

/// Gives back the row that was taken to size the lanes.
struct FirstThen<'a, 'b, const N: usize> {
    first: Option<Assignment<N>>,
    rest: Queue<'a, 'b>,
}

impl<const N: usize> Rows<N> for FirstThen<'_, '_, N> {
    fn next(&mut self) -> Option<Assignment<N>> {
        self.first.take().or_else(|| self.rest.assignment())
    }

    fn finish(&mut self, seat: &Seat<N>, t: f64, state: &[f64; N], status: Status, retrace: &mut dyn Retrace<N>) {
        self.rest.finish(seat, t, state, status, retrace);
    }
}

/// Works until the queue is empty. A panic costs no more than the row that caused it: the rows in
/// flight are run again one by one, and only the one that panics again is given up.
pub fn work<P: Path, Scalar: Path, M: Model<N>, T: Method, const N: usize>(shared: &Shared) {
    let mut in_flight = Vec::new();
    while !run::<P, M, T, N>(shared, None, &mut in_flight) {
        for row in std::mem::take(&mut in_flight) {
            let mut alone = Vec::new();
            if !run::<Scalar, M, T, N>(shared, Some(vec![row]), &mut alone) {
                // SAFETY: this thread took the row from the queue.
                unsafe { shared.writer.missing(row, Status::Internal, -1) };
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
        empty: Arc::from([]),
    };
    let work = Run::<P, M, T, N> { queue, types: PhantomData };
    catch_unwind(AssertUnwindSafe(|| P::enter(work))).is_ok()
}

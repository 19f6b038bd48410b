//! The row that sits in a lane: its inputs, its stops, and what is remembered of its way.

use super::integrals::INTEGRALS;
use super::record::Record;
use super::stepper::Stepper;
use super::watch::{Candidate, Range, WATCHED};
use crate::model::{Base, Drive, Harmonics, Model, Program, Row, Segment};
use crate::real::Real;
use std::sync::Arc;

/// What counts as the very start of a motion [s].
const SETTLING: f64 = 0.5;

/// Times that separate the windows over which integrals are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// Time 0.
    Begin,
    /// Start of the motion.
    On,
    /// Half a second after it.
    Settled,
    /// Start of the steady run.
    Run,
    /// Start of the stop.
    Off,
    /// Start of the ring window.
    RingStart,
    /// End of the ring window.
    RingEnd,
    /// End of the simulation.
    End,
}

/// The state at time 0.
#[derive(Clone, Copy, Debug)]
pub enum Start {
    /// At rest, the spring carrying the load torque.
    Relaxed,
    /// Both angles zero, the spring wound by the kinematic error.
    ZeroAngle,
    /// theta_m, omega_m, te, omega_l, z.
    Given([f64; 5]),
}

/// A row about to be simulated.
pub struct Assignment<const N: usize> {
    /// Row number.
    pub index: usize,
    /// Checked parameters.
    pub row: Row,
    /// Inputs.
    pub program: Arc<Program>,
    /// State at time 0.
    pub start: Start,
    /// Times at which the state is wanted, ascending: the user's, and those that metrics look at.
    pub grids: [Arc<[f64]>; 2],
}

/// Memory that goes from row to row.
#[derive(Default)]
pub struct Memory<const N: usize> {
    records: Vec<Record<N>>,
    candidates: Vec<(usize, Candidate<N>)>,
    samples: [Vec<[f64; N]>; 2],
}

/// An occupied lane.
pub struct Seat<const N: usize> {
    /// Who sits here.
    pub assignment: Assignment<N>,
    /// Marks with their times, ascending.
    pub marks: Vec<(f64, Mark)>,
    /// Integrals over the intervals between consecutive marks, from time 0.
    pub intervals: Vec<[f64; INTEGRALS]>,
    /// Ranges of the watched signals over the same intervals.
    pub ranges: Vec<[Range; WATCHED]>,
    /// Steps that may hold an extremum, with their interval.
    pub candidates: Vec<(usize, Candidate<N>)>,
    /// Time with the windup outside the spring's range [s].
    pub outside: f64,
    /// Steps, where they are recorded.
    pub records: Vec<Record<N>>,
    /// States at the grids' times so far.
    pub samples: [Vec<[f64; N]>; 2],
    /// State at time 0.
    pub initial: [f64; N],
    /// Accepted steps.
    pub accepted: u32,
    /// Rejected attempts.
    pub rejected: u32,
    segment: usize,
    sampling: usize,
}

impl<const N: usize> Seat<N> {
    /// Seats a row.
    pub fn new(assignment: Assignment<N>, memory: Memory<N>) -> Self {
        let Memory { mut records, mut candidates, mut samples } = memory;
        records.clear();
        candidates.clear();
        samples.iter_mut().for_each(Vec::clear);
        let program = &assignment.program;
        let mut marks = vec![
            (0.0, Mark::Begin),
            (program.on, Mark::On),
            (program.on + SETTLING, Mark::Settled),
            (program.run_start(assignment.row.omega_set), Mark::Run),
            (program.off, Mark::Off),
            (program.off + program.ring_delay, Mark::RingStart),
            (program.off + program.ring_delay + program.ring_width, Mark::RingEnd),
            (program.end, Mark::End),
        ];
        for (time, _) in &mut marks {
            *time = time.clamp(0.0, program.end);
        }
        marks.sort_by(|left, right| left.0.total_cmp(&right.0));
        Self {
            assignment,
            marks,
            intervals: Vec::with_capacity(8),
            ranges: Vec::with_capacity(8),
            candidates,
            outside: 0.0,
            records,
            samples,
            initial: [0.0; N],
            accepted: 0,
            rejected: 0,
            segment: 0,
            sampling: 0,
        }
    }

    /// Gives the memory back.
    pub fn into_memory(self) -> Memory<N> {
        Memory { records: self.records, candidates: self.candidates, samples: self.samples }
    }

    /// The segment in force.
    pub fn segment(&self) -> &Segment {
        &self.assignment.program.segments[self.segment]
    }

    /// The segment in force just before a time.
    pub fn segment_before(&self, t: f64) -> &Segment {
        let segments = &self.assignment.program.segments;
        &segments[segments.partition_point(|segment| segment.start < t).saturating_sub(1)]
    }

    /// When the lane has to stop next.
    pub fn next_stop(&self) -> f64 {
        let segments = &self.assignment.program.segments;
        let mark = self.marks[self.intervals.len()].0;
        segments.get(self.segment + 1).map_or(mark, |next| next.start.min(mark))
    }

    fn sample_time(&self, grid: usize) -> f64 {
        self.assignment.grids[grid].get(self.samples[grid].len()).copied().unwrap_or(f64::INFINITY)
    }

    /// When the state is wanted next; infinity when no more.
    pub fn next_sample(&self) -> f64 {
        self.sample_time(0).min(self.sample_time(1))
    }

    /// The next time at which the state is wanted, if not after `end`.
    pub fn take_sample_time(&mut self, end: f64) -> Option<f64> {
        self.sampling = usize::from(self.sample_time(1) < self.sample_time(0));
        let time = self.sample_time(self.sampling);
        (time <= end).then_some(time)
    }

    /// Answers [`Seat::take_sample_time`].
    pub fn push_sample(&mut self, state: [f64; N]) {
        self.samples[self.sampling].push(state);
    }

    /// Position of a mark among the marks.
    pub fn position(&self, mark: Mark) -> usize {
        self.marks.iter().position(|entry| entry.1 == mark).expect("every row has every mark")
    }

    /// Time of a mark.
    pub fn time_of(&self, mark: Mark) -> f64 {
        self.marks[self.position(mark)].0
    }

    /// The intervals between two marks.
    pub fn between(&self, from: Mark, to: Mark) -> std::ops::Range<usize> {
        self.position(from) + 1..self.position(to) + 1
    }

    /// An integral between two marks; NaN where the row did not get that far.
    pub fn integral(&self, from: Mark, to: Mark, which: super::integrals::Integral) -> f64 {
        self.intervals
            .get(self.between(from, to))
            .map_or(f64::NAN, |parts| parts.iter().map(|part| part[which as usize]).sum())
    }

    /// Whether a window ends at `t`.
    pub fn is_at_mark(&self, t: f64) -> bool {
        self.marks.get(self.intervals.len()).is_some_and(|mark| mark.0 <= t)
    }

    /// Closes the windows that end at `t`, all but the first of which are empty.
    pub fn pass_marks(&mut self, t: f64, mut integrals: [f64; INTEGRALS], ranges: [Range; WATCHED]) {
        while self.is_at_mark(t) {
            self.intervals.push(integrals);
            self.ranges.push(ranges);
            integrals = [0.0; INTEGRALS];
        }
    }

    /// Notes a step of the present interval that may hold an extremum.
    pub fn propose(&mut self, candidate: Candidate<N>) {
        self.candidates.push((self.intervals.len(), candidate));
    }

    /// Whether every mark has been passed.
    pub fn is_done(&self) -> bool {
        self.intervals.len() == self.marks.len()
    }

    /// Puts the next segment in force if it starts at `t`; true where an input jumps.
    pub fn enter_segment(&mut self, t: f64) -> Option<bool> {
        let next = self.segment + 1;
        let starts = self.assignment.program.segments.get(next).is_some_and(|segment| segment.start <= t);
        starts.then(|| {
            self.segment = next;
            self.assignment.program.jumps_at(next, &self.assignment.row)
        })
    }

    /// What a new segment does to the state: imposed angles, and an integrator that takes over without a jump.
    /// True where it does anything.
    pub fn adjust_state<M: Model<N>>(&self, state: &mut [f64; N], torque: f64) -> bool {
        let row = &self.assignment.row;
        match self.segment().drive {
            Drive::Motion { angle, .. } => {
                if M::BASE == Base::TwoInertia {
                    state[2] += (angle[0] - state[0]) * row.constants.inverse_ratio;
                }
                state[0] = angle[0];
                state[1] = angle[1];
                true
            }
            Drive::Speed { bumpless: true, .. } if row.constants.k_i > 0.0 => {
                let error = self.segment().reference(row).value - state[1];
                state[M::INTEGRATOR] = (torque - row.constants.k_p * error) / row.constants.k_i;
                true
            }
            _ => false,
        }
    }

    /// Copies one lane of a step's end into the record.
    pub fn remember(&mut self, record: Record<N>) {
        self.records.push(record);
    }

    /// The row's constants put into one lane.
    pub fn load<R: Real>(&self, lane: usize, stepper: &mut Stepper<R, N>, shared: &Harmonics<f64>) {
        let row = &self.assignment.row;
        stepper.constants.set_lane(lane, &row.constants);
        stepper.terms.set_lane(lane, &row.terms);
        stepper.harmonics.set_lane(lane, row.harmonics.as_ref().unwrap_or(shared), row.te_scale);
    }
}

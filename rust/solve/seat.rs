//! The row that sits in a lane: its inputs, its stops, and what is remembered of its way.

use super::integrals::INTEGRALS;
use super::record::Record;
use super::samples::{Room, Samples, Wanted};
use super::stepper::Stepper;
use super::watch::{Candidate, Range, WATCHED};
use crate::model::{Base, Drive, Harmonics, Model, Program, Row, Segment};
use crate::real::{Real, Scalar};
use std::sync::Arc;

/// Steps, and steps that may hold an extremum, that a row may leave memory for.
const KEPT: usize = 1 << 14;

/// Steps of one phase (before the motion, up to the stop, behind it) that are remembered; of more than these the first
/// and the last quarter.
const REMEMBERED: usize = 1 << 16;

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
    /// Start of the run phase.
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
pub enum Start<S> {
    /// At rest, the spring carrying the load torque.
    Relaxed,
    /// Both angles zero, the spring wound by the kinematic error.
    ZeroAngle,
    /// theta_m, omega_m, te, omega_l, z.
    Given([S; 5]),
}

/// A row about to be simulated.
pub struct Assignment<S> {
    /// Row number, or number of the row and direction of differentiation.
    pub index: usize,
    /// Checked parameters.
    pub row: Row<S>,
    /// Inputs.
    pub program: Arc<Program>,
    /// State at time 0.
    pub start: Start<S>,
    /// Derivatives of theta_m, omega_m, theta_l, omega_l, z at time 0 beyond those of the start itself.
    pub initial_tangent: [f64; 5],
    /// When it is sampled.
    pub wanted: Wanted<S>,
}

/// Memory that goes from row to row.
pub struct Memory<S, const N: usize> {
    records: Vec<Record<S, N>>,
    candidates: Vec<(usize, Candidate<S, N>)>,
    ranked: Vec<usize>,
    room: Room<S>,
}

/// An occupied lane.
pub struct Seat<S, const N: usize> {
    /// Who sits here.
    pub assignment: Assignment<S>,
    /// Marks with their times, ascending.
    pub marks: Vec<(S, Mark)>,
    /// Integrals over the intervals between consecutive marks, from time 0.
    pub intervals: Vec<[S; INTEGRALS]>,
    /// Ranges of the watched signals over the same intervals.
    pub ranges: Vec<[Range<S>; WATCHED]>,
    /// Steps that may hold an extremum, with their interval.
    pub candidates: Vec<(usize, Candidate<S, N>)>,
    /// Places of the candidates that may decide an extreme, most promising first, once the row has ended.
    pub ranked: Vec<usize>,
    /// Time with the windup outside the spring's range [s].
    pub outside: f64,
    /// Steps, where they are recorded.
    pub records: Vec<Record<S, N>>,
    /// Place of the first record of the present phase.
    phase: usize,
    /// Samples so far.
    pub samples: Samples<S>,
    /// State at time 0.
    pub initial: [S; N],
    /// Accepted steps.
    pub accepted: u32,
    /// Rejected attempts.
    pub rejected: u32,
    segment: usize,
}

impl<S, const N: usize> Default for Memory<S, N> {
    fn default() -> Self {
        Self { records: Vec::new(), candidates: Vec::new(), ranked: Vec::new(), room: Room::default() }
    }
}

impl<S: Scalar, const N: usize> Seat<S, N> {
    /// Seats a row.
    pub fn new(assignment: Assignment<S>, memory: Memory<S, N>) -> Self {
        let Memory { mut records, mut candidates, mut ranked, room } = memory;
        records.clear();
        candidates.clear();
        ranked.clear();
        let program = &assignment.program;
        let mut marks = vec![
            (S::zero(), Mark::Begin),
            (S::splat(program.on), Mark::On),
            (S::splat(program.on + SETTLING), Mark::Settled),
            (program.run_start(assignment.row.omega_set), Mark::Run),
            (S::splat(program.off), Mark::Off),
            (S::splat(program.off + program.ring_delay), Mark::RingStart),
            (S::splat(program.off + program.ring_delay + program.ring_width), Mark::RingEnd),
            (S::splat(program.end), Mark::End),
        ];
        for (time, _) in &mut marks {
            let within = time.plain().clamp(0.0, program.end);
            *time = if within == time.plain() { *time } else { S::splat(within) };
        }
        marks.sort_by(|left, right| left.0.plain().total_cmp(&right.0.plain()));
        Self {
            samples: Samples::new(assignment.wanted.clone(), room),
            assignment,
            marks,
            intervals: Vec::with_capacity(8),
            ranges: Vec::with_capacity(8),
            candidates,
            ranked,
            outside: 0.0,
            records,
            phase: 0,
            initial: [S::zero(); N],
            accepted: 0,
            rejected: 0,
            segment: 0,
        }
    }

    /// Gives the memory back, as much of it as an ordinary row takes.
    pub fn into_memory(mut self) -> Memory<S, N> {
        leave(&mut self.records);
        leave(&mut self.candidates);
        leave(&mut self.ranked);
        Memory {
            records: self.records,
            candidates: self.candidates,
            ranked: self.ranked,
            room: self.samples.into_room(),
        }
    }

    /// The segment in force.
    pub fn segment(&self) -> &Segment {
        &self.assignment.program.segments[self.segment]
    }

    /// The segment in force just before a time.
    pub fn segment_before(&self, t: f64) -> &Segment {
        &self.assignment.program.segments[self.place_before(t)]
    }

    fn place_before(&self, t: f64) -> usize {
        self.assignment.program.segments.partition_point(|segment| segment.start < t).saturating_sub(1)
    }

    /// The load torque just before a time [N m].
    pub fn load_before(&self, t: f64) -> S {
        let segment = self.segment_before(t);
        let load = segment.load_torque(&self.assignment.row);
        load.value + load.slope * S::splat(t - segment.start)
    }

    /// When the lane has to stop next.
    pub fn next_stop(&self) -> f64 {
        let segments = &self.assignment.program.segments;
        let mark = self.marks[self.intervals.len()].0.plain();
        segments.get(self.segment + 1).map_or(mark, |next| next.start.min(mark))
    }

    /// Position of a mark among the marks.
    pub fn position(&self, mark: Mark) -> usize {
        self.marks.iter().position(|entry| entry.1 == mark).expect("every row has every mark")
    }

    /// Time of a mark.
    pub fn time_of(&self, mark: Mark) -> f64 {
        self.moment_of(mark).plain()
    }

    /// Time of a mark, with its derivative.
    pub fn moment_of(&self, mark: Mark) -> S {
        self.marks[self.position(mark)].0
    }

    /// Places of the candidates for which closer looks are asked.
    pub fn asked(&self) -> impl Iterator<Item = usize> + '_ {
        self.ranked.iter().copied().filter(|&place| self.candidates[place].1.asked)
    }

    /// The intervals between two marks.
    pub fn between(&self, from: Mark, to: Mark) -> std::ops::Range<usize> {
        self.position(from) + 1..self.position(to) + 1
    }

    /// An integral between two marks; NaN where the row did not get that far.
    pub fn integral(&self, from: Mark, to: Mark, which: super::integrals::Integral) -> S {
        let parts = self.intervals.get(self.between(from, to));
        let total = |parts: &[[S; INTEGRALS]]| parts.iter().fold(S::zero(), |sum, part| sum + part[which as usize]);
        parts.map_or(S::splat(f64::NAN), total)
    }

    /// Whether a window ends at `t`.
    pub fn is_at_mark(&self, t: f64) -> bool {
        self.marks.get(self.intervals.len()).is_some_and(|mark| mark.0.plain() <= t)
    }

    /// Closes the windows that end at `t`, all but the first of which are empty; what the next one starts with.
    pub fn pass_marks(
        &mut self,
        t: f64,
        mut integrals: [S; INTEGRALS],
        integrands: [f64; INTEGRALS],
        ranges: [Range<S>; WATCHED],
    ) -> [S; INTEGRALS] {
        while self.is_at_mark(t) {
            let moved = integrands.map(|value| value * self.lag());
            let grown = |index: usize| integrals[index].with_tangent(integrals[index].tangent() + moved[index]);
            if let Mark::On | Mark::Off = self.marks[self.intervals.len()].1 {
                self.phase = self.records.len().saturating_sub(1);
            }
            self.intervals.push(std::array::from_fn(grown));
            self.ranges.push(ranges);
            integrals = moved.map(|value| S::zero().with_tangent(-value));
        }
        integrals
    }

    /// Derivative of the time of the next mark.
    pub fn lag(&self) -> f64 {
        self.marks[self.intervals.len()].0.tangent()
    }

    /// Remembers the end of a step.
    #[inline(always)]
    pub fn remember(&mut self, record: Record<S, N>) {
        if self.records.len() - self.phase == REMEMBERED {
            self.forget();
        }
        self.records.push(record);
    }

    /// Forgets the middle half of the present phase.
    #[cold]
    fn forget(&mut self) {
        let quarter = self.phase + REMEMBERED / 4;
        self.records.drain(quarter..quarter + REMEMBERED / 2);
        self.records[quarter].step = f64::NAN;
    }

    /// Notes a step of the present interval that may hold an extremum.
    pub fn propose(&mut self, candidate: Candidate<S, N>) {
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

    /// What a new segment does to the state: imposed angles, and an integrator that takes over without a jump of the
    /// torque asked of the drive. True where it does anything.
    pub fn adjust_state<M: Model<N>>(&self, state: &mut [S; N], asked: S) -> bool {
        let row = &self.assignment.row;
        match self.segment().drive {
            Drive::Motion { angle, .. } => {
                if M::BASE == Base::TwoInertia {
                    state[2] = state[2] + (S::splat(angle[0]) - state[0]) * row.constants.inverse_ratio;
                }
                state[0] = S::splat(angle[0]);
                state[1] = S::splat(angle[1]);
                true
            }
            Drive::Speed { bumpless: true, .. } if row.constants.k_i.plain() > 0.0 => {
                let error = self.segment().reference(row).value - state[1];
                state[M::INTEGRATOR] = (asked - row.constants.k_p * error) / row.constants.k_i;
                true
            }
            _ => false,
        }
    }

    /// The row's constants put into one lane.
    pub fn load<R: Real<Lane = S>>(&self, lane: usize, stepper: &mut Stepper<R, N>, shared: &Harmonics<S>) {
        let row = &self.assignment.row;
        stepper.constants.set_lane(lane, &row.constants);
        stepper.terms.set_lane(lane, &row.terms);
        stepper.harmonics.set_lane(lane, row.harmonics.as_ref().unwrap_or(shared), row.te_scale);
    }

    /// One lane brought to an instant of the row.
    pub fn place<R: Real<Lane = S>>(
        &self,
        lane: usize,
        stepper: &mut Stepper<R, N>,
        segment: &Segment,
        (t, state): (f64, &[S; N]),
    ) {
        stepper.input.set_lane(lane, segment, &self.assignment.row);
        stepper.bring(lane, t, state);
    }
}

/// Empties a list, and keeps no more memory than an ordinary row takes.
fn leave<T>(list: &mut Vec<T>) {
    list.clear();
    list.shrink_to(KEPT);
}

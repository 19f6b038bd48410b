//! Rows take their lanes, pass their stops and leave.

use super::Method;
use super::advance::{Advance, Ended, Plain, Rows};
use super::controller::stuck;
use super::extrema;
use super::integrals::INTEGRALS;
use super::interpolant::FOLLOWED;
use super::record::lane_numbers;
use super::replay::{Lane, Retrace};
use super::seat::{Assignment, Seat};
use super::status::Status;
use super::stepper::{Stepper, Trial};
use super::stiffness::SHORT;
use crate::model::{Base, Model};
use crate::real::{Mask, Path, Real, lanes_of};

impl<P: Path, M: Model<N>, T: Method, const N: usize> Advance<'_, P, M, T, N> {
    /// The first windows of a row that begins.
    pub(super) fn open_windows(&mut self, lane: usize) {
        let Some(seat) = &mut self.seats[lane] else { return };
        if self.stepper.t.get(lane) == 0.0 {
            self.stepper.watch.close_window(lane, 0.0);
            let ranges = self.stepper.watch.close_window(lane, 0.0);
            seat.pass_marks(0.0, [Lane::<P>::zero(); INTEGRALS], [0.0; INTEGRALS], ranges);
            self.stop.set(lane, seat.next_stop());
        }
    }

    /// Ends rows that cannot go on.
    #[inline(always)]
    pub(super) fn fail(
        &mut self,
        arrived: u64,
        rejected: <P::Lanes as Real>::Mask,
        step: Plain<P>,
        trial: &Trial<P::Lanes, N>,
        rows: &mut impl Rows<Lane<P>, N>,
    ) {
        let limit = Plain::<P>::splat(f64::from(self.demand.max_steps));
        let exhausted = limit.le(self.attempts).to_bits();
        let stuck = stuck(rejected, step, self.stepper.t);
        let failed = (exhausted | stuck) & self.occupied & !arrived;
        if failed == 0 {
            return;
        }
        let broken = Stepper::<P::Lanes, N>::broken(trial);
        for lane in lanes_of(failed) {
            let status = match (stuck >> lane & 1 == 1, broken >> lane & 1 == 1) {
                (true, true) => Status::NotFinite,
                (true, false) => Status::StepTooSmall,
                _ => Status::MaxSteps,
            };
            self.vacate(lane, status, rows);
            self.seat_next(lane, rows);
        }
    }

    /// Hands stiff rows over unfinished.
    pub(super) fn set_aside(&mut self, lanes: u64, rows: &mut impl Rows<Lane<P>, N>) {
        for lane in lanes_of(lanes & self.occupied) {
            if let Some(seat) = self.clear(lane) {
                rows.set_aside(&seat);
                self.spare.push(seat.into_memory());
            }
            self.seat_next(lane, rows);
        }
    }

    /// Lanes that stand on a stop: a mark, a new segment, or the end.
    #[inline(always)]
    pub(super) fn arrive(&mut self, lanes: u64, trial: &Trial<P::Lanes, N>, rows: &mut impl Rows<Lane<P>, N>) {
        self.observe_lanes(lanes);
        for lane in lanes_of(lanes) {
            let Some(mut seat) = self.seats[lane].take() else { continue };
            let t = self.stepper.t.get(lane);
            if seat.is_at_mark(t) {
                let integrals = lane_numbers(&self.stepper.integrals, lane);
                let ranges = self.stepper.watch.close_window(lane, seat.lag());
                let rest = seat.pass_marks(t, integrals, self.stepper.integrands_in(lane), ranges);
                self.set_integrals(lane, rest);
            }
            if seat.is_done() {
                self.seats[lane] = Some(seat);
                self.vacate(lane, Status::Finished, rows);
                self.seat_next(lane, rows);
                continue;
            }
            if let Some(jumps) = seat.enter_segment(t) {
                let row = &seat.assignment.row;
                self.stepper.input.set_lane(lane, seat.segment(), row);
                let mut state = self.lane_state(lane);
                if seat.adjust_state::<M>(&mut state, trial.rates.asked_torque.get(lane)) {
                    self.set_lane_state(lane, &state);
                }
                if jumps {
                    self.step.set(lane, self.step.get(lane).min(self.first_step(&seat)));
                    self.controller.reset_lane(lane);
                    self.events.lag.set(lane, 0.0);
                    self.stale |= 1 << lane;
                } else {
                    self.bent |= 1 << lane;
                }
            }
            self.stop.set(lane, seat.next_stop());
            self.seats[lane] = Some(seat);
        }
    }

    /// A cautious first step: a fraction of the fastest motion the row can make.
    pub(super) fn first_step(&self, seat: &Seat<Lane<P>, N>) -> f64 {
        (self.first_share / seat.assignment.row.mode(self.layout)).min(self.demand.max_step)
    }

    /// The step up to which the dense output follows the mode, or the speed loop of a rigid gear.
    fn longest_step(&self, seat: &Seat<Lane<P>, N>) -> f64 {
        let Assignment { row, program, .. } = &seat.assignment;
        let rate = if M::BASE == Base::OneInertia && !program.is_controlled() { 0.0 } else { row.rate(self.layout) };
        self.demand.max_step.min(FOLLOWED * T::STABILITY / rate)
    }

    /// Seats the next row that has something to simulate.
    pub(super) fn seat_next(&mut self, lane: usize, rows: &mut impl Rows<Lane<P>, N>) {
        let Some(assignment) = rows.next() else { return };
        let mut seat = Box::new(Seat::new(assignment, self.spare.pop().unwrap_or_default()));
        seat.load(lane, &mut self.stepper, self.harmonics);
        self.replay.load(&seat);
        let (state, holding) = self.replay.start(&seat);
        seat.assignment.row.holding_torque = holding;
        self.set_lane_state(lane, &state);
        self.stepper.t.set(lane, 0.0);
        self.stepper.input.set_lane(lane, seat.segment(), &seat.assignment.row);
        self.attempts.set(lane, 0.0);
        self.accepted.set(lane, 0.0);
        self.stiffness.set(lane, 0.0);
        if let Some(unseen) = &mut self.unseen {
            unseen.forget(lane);
        }
        self.short_step.set(lane, SHORT / seat.assignment.row.mode(self.layout));
        self.longest.set(lane, self.longest_step(&seat));
        self.controller.reset_lane(lane);
        self.set_integrals(lane, [Lane::<P>::zero(); INTEGRALS]);
        self.stepper.watch.reset_lane(lane);
        self.events.forget(lane);
        self.events.lag.set(lane, 0.0);
        (0..2).for_each(|shaft| self.set_direction(lane, shaft, 0.0));
        seat.initial = state;
        let mut sample = seat.samples.due();
        if sample.plain() <= 0.0 {
            let signals = self.demand.sampled.signals().iter();
            let observed: Vec<_> = signals.map(|&one| self.replay.signal(one, &seat, 0.0, &state)).collect();
            while sample.plain() <= 0.0 {
                sample = seat.samples.pass();
                seat.samples.push(|place| observed[place]);
            }
        }
        self.step.set(lane, self.first_step(&seat));
        self.stop.set(lane, seat.next_stop());
        self.sample.set(lane, sample);
        self.occupied |= 1 << lane;
        self.stale |= 1 << lane;
        self.seats[lane] = Some(seat);
    }

    /// Ends the lane's row as it is and leaves the lane idle. Rows wait until their closer looks fill the lanes.
    fn vacate(&mut self, lane: usize, status: Status, rows: &mut impl Rows<Lane<P>, N>) {
        let state = self.lane_state(lane);
        if let Some(mut seat) = self.clear(lane) {
            seat.outside = self.stepper.watch.outside(lane);
            seat.accepted = self.accepted.get(lane) as u32;
            seat.rejected = self.attempts.get(lane) as u32 - seat.accepted;
            if status == Status::Finished {
                extrema::rank(&self.demand.extremes, &mut seat);
            } else {
                seat.records = Vec::new();
            }
            let mut ended = Ended { seat, t: self.stepper.t.get(lane), state, status, asked: 0 };
            ended.ask(&self.demand.extremes);
            self.ended.push(ended);
            self.hand_over(P::Lanes::LANES, rows);
        }
    }

    /// Hands over the rows that have ended, those that ask for closer looks once there are as many as wanted.
    pub(super) fn hand_over(&mut self, wanted: usize, rows: &mut impl Rows<Lane<P>, N>) {
        loop {
            for place in (0..self.ended.len()).rev() {
                if self.ended[place].asked != 0 {
                    continue;
                }
                let Ended { seat, t, state, status, .. } = self.ended.swap_remove(place);
                self.replay.load(&seat);
                rows.finish(&seat, t, &state, status, &mut self.replay);
                self.spare.push(seat.into_memory());
            }
            let asked: usize = self.ended.iter().map(|ended| ended.asked).sum();
            if asked < wanted.max(1) {
                return;
            }
            self.replay.look(&mut self.ended);
            self.ended.iter_mut().for_each(|ended| ended.ask(&self.demand.extremes));
        }
    }

    /// Leaves the lane idle.
    fn clear(&mut self, lane: usize) -> Option<Box<Seat<Lane<P>, N>>> {
        self.observe_lanes(1 << lane);
        self.occupied &= !(1 << lane);
        self.stale &= !(1 << lane);
        self.bent &= !(1 << lane);
        self.stop.set(lane, f64::INFINITY);
        self.sample.set(lane, Lane::<P>::splat(f64::INFINITY));
        self.seats[lane].take()
    }

    pub(super) fn vacate_all(&mut self, rows: &mut impl Rows<Lane<P>, N>) {
        for lane in lanes_of(self.occupied) {
            self.vacate(lane, Status::Cancelled, rows);
        }
    }

    fn set_integrals(&mut self, lane: usize, values: [Lane<P>; INTEGRALS]) {
        for (integral, value) in self.stepper.integrals.iter_mut().zip(values) {
            integral.set(lane, value);
        }
    }
}

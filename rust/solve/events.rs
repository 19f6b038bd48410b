//! Dry friction that really sticks, and states that jump: both are located inside the step and landed on.
//!
//! A shaft slides in a direction or is held. The step in which a sliding shaft reverses, or in which a held shaft
//! is pulled harder than its friction can hold, is repeated so that it ends exactly there; then the shaft's
//! direction changes and the next step begins with fresh slopes.

use super::Method;
use super::advance::Advance;
use super::controller::fit_to_stop;
use super::integrals::Integral;
use super::record::{Dense, lane_coefficients};
use super::root::root;
use super::stepper::Trial;
use crate::model::{Model, Rates};
use crate::real::{Mask, Path, Real, lanes_of};

/// An event is never placed at the very start of a step, so that time always moves.
const EARLIEST: f64 = 1e-9;

/// What happens at the end of a step that was shortened on purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Event {
    /// The shaft comes to rest.
    Stop(usize),
    /// The shaft breaks away.
    Release(usize),
    /// Hidden states jump.
    Jump,
}

/// Steps that are being repeated to end on an event.
pub struct Events<R> {
    step: R,
    planned: Vec<Option<Event>>,
    /// Lanes with a planned event.
    lanes: u64,
    /// Of those, the ones that are now being tried.
    tried: u64,
    /// Of those, the ones whose event falls on a stop.
    on_stop: u64,
}

impl<R: Real> Events<R> {
    pub fn new() -> Self {
        Self { step: R::zero(), planned: vec![None; R::LANES], lanes: 0, tried: 0, on_stop: 0 }
    }

    pub fn forget(&mut self, lane: usize) {
        self.planned[lane] = None;
        self.lanes &= !(1 << lane);
        self.tried &= !(1 << lane);
        self.on_stop &= !(1 << lane);
    }
}

impl<P: Path, M: Model<N>, T: Method, const N: usize> Advance<'_, P, M, T, N> {
    /// The step of every lane, and whether it ends on a stop.
    #[inline(always)]
    pub(super) fn next_step(&mut self) -> (P::Lanes, <P::Lanes as Real>::Mask) {
        let (step, landing) = fit_to_stop(self.step, self.stop - self.stepper.t);
        if !M::sticks() || self.events.lanes == 0 {
            return (step, landing);
        }
        self.events.tried = self.events.lanes;
        let planned = <P::Lanes as Real>::Mask::from_bits(self.events.lanes);
        let on_stop = <P::Lanes as Real>::Mask::from_bits(self.events.on_stop);
        (P::Lanes::select(planned & !on_stop, self.events.step, step), (landing & !planned) | (landing & on_stop))
    }

    /// Lanes whose step has to be repeated because it runs over an event.
    #[inline(always)]
    pub(super) fn find_events(
        &mut self,
        accepted: <P::Lanes as Real>::Mask,
        landing: <P::Lanes as Real>::Mask,
        step: P::Lanes,
        trial: &Trial<P::Lanes, N>,
    ) -> <P::Lanes as Real>::Mask {
        let none = <P::Lanes as Real>::Mask::from_bits(0);
        if !M::sticks() {
            return none;
        }
        let zero = P::Lanes::zero();
        let mut crossed = [0; 2];
        for shaft in 0..M::STICKING.len() {
            let state = &trial.rates.shafts[shaft];
            let direction = self.stepper.directions[shaft];
            let sticky = zero.lt(state.breakaway);
            let reversed = (direction * trial.state[M::STICKING[shaft]]).lt(zero);
            let pulled = direction.abs().le(zero) & state.breakaway.lt(state.net.abs());
            crossed[shaft] = (accepted & sticky & (reversed | pulled)).to_bits();
        }
        let jumping = (accepted & trial.rates.reserve.lt(zero)).to_bits();
        let lanes = (crossed[0] | crossed[1] | jumping) & self.occupied & !self.events.lanes;
        if lanes == 0 {
            return none;
        }
        let coefficients = self.stepper.dense::<M, T>(step);
        for lane in lanes_of(lanes) {
            let dense = Dense {
                t: self.stepper.t.get(lane),
                step: step.get(lane),
                coefficients: lane_coefficients(&coefficients, lane),
            };
            let shafts = (0..M::STICKING.len()).filter(|shaft| crossed[*shaft] >> lane & 1 == 1);
            let mut candidates: Vec<(f64, Event)> =
                shafts.map(|shaft| self.locate(lane, shaft, &dense, trial)).collect();
            if jumping >> lane & 1 == 1 {
                let at_end = trial.rates.reserve.get(lane);
                candidates.push((self.use_up(lane, &dense, at_end, |rates| rates.reserve), Event::Jump));
            }
            let Some(&(share, event)) = candidates.iter().min_by(|left, right| left.0.total_cmp(&right.0)) else {
                continue;
            };
            let share = share.clamp(EARLIEST, 1.0);
            self.events.planned[lane] = Some(event);
            self.events.lanes |= 1 << lane;
            let stop = share == 1.0 && landing.to_bits() >> lane & 1 == 1;
            self.events.on_stop |= u64::from(stop) << lane;
            self.events.step.set(lane, share * step.get(lane));
        }
        <P::Lanes as Real>::Mask::from_bits(lanes)
    }

    /// Where in the step a shaft's event lies.
    fn locate(&mut self, lane: usize, shaft: usize, dense: &Dense<N>, trial: &Trial<P::Lanes, N>) -> (f64, Event) {
        let direction = self.stepper.directions[shaft].get(lane);
        if direction != 0.0 {
            let speed = |share: f64| direction * dense.at(share)[M::STICKING[shaft]];
            let (start, end) = (direction * self.stepper.state[M::STICKING[shaft]].get(lane), speed(1.0));
            return (root(speed, start.max(0.0), end), Event::Stop(shaft));
        }
        let end = &trial.rates.shafts[shaft];
        let margin = end.breakaway.get(lane) - end.net.get(lane).abs();
        let held = |rates: &Rates<f64, N>| rates.shafts[shaft].breakaway - rates.shafts[shaft].net.abs();
        (self.use_up(lane, dense, margin, held), Event::Release(shaft))
    }

    /// Where in the step a reserve is used up.
    fn use_up(&mut self, lane: usize, dense: &Dense<N>, at_end: f64, reserve: impl Fn(&Rates<f64, N>) -> f64) -> f64 {
        let directions = self.lane_directions(lane);
        let Some(seat) = self.seats[lane].take() else { return 1.0 };
        self.replay.load(&seat, self.harmonics);
        let mut left = |share: f64| {
            reserve(&self.replay.rates_in(&seat, dense.t + share * dense.step, &dense.at(share), directions))
        };
        let start = left(0.0);
        let share = if start <= 0.0 { EARLIEST } else { root(&mut left, start, at_end) };
        self.seats[lane] = Some(seat);
        share
    }

    /// Lets hidden states jump; what mechanical energy goes with it counts as taken by terms.
    fn jump(&mut self, lane: usize) {
        let Some(seat) = self.seats[lane].take() else { return };
        self.replay.load(&seat, self.harmonics);
        let (after, lost) = self.replay.jump(&seat, self.stepper.t.get(lane), &self.lane_state(lane));
        self.set_lane_state(lane, &after);
        let taken = &mut self.stepper.integrals[Integral::TermPower as usize];
        taken.set(lane, taken.get(lane) + lost);
        self.seats[lane] = Some(seat);
    }

    /// Shafts whose event has been reached change their direction; a planned step that failed is planned no more.
    #[inline(always)]
    pub(super) fn settle_events(&mut self, accepted: <P::Lanes as Real>::Mask, trial: &Trial<P::Lanes, N>) {
        if !M::sticks() || self.events.tried == 0 {
            return;
        }
        for lane in lanes_of(self.events.tried) {
            let event = self.events.planned[lane];
            self.events.forget(lane);
            if accepted.to_bits() >> lane & 1 == 0 {
                continue;
            }
            match event {
                Some(Event::Stop(shaft)) => {
                    self.stepper.state[M::STICKING[shaft]].set(lane, 0.0);
                    self.stepper.directions[shaft].set(lane, 0.0);
                }
                Some(Event::Release(shaft)) => {
                    let net = trial.rates.shafts[shaft].net.get(lane);
                    self.stepper.directions[shaft].set(lane, net.signum());
                }
                Some(Event::Jump) => self.jump(lane),
                None => continue,
            }
            self.stale |= 1 << lane;
            if let Some(seat) = &self.seats[lane] {
                self.step.set(lane, self.first_step(seat));
            }
            self.controller.reset_lane(lane);
        }
    }

    /// Lets go of held shafts that are pulled too hard, in lanes that begin or whose input has jumped; gives
    /// shafts that turn their direction. True where anything changed.
    pub(super) fn release(&mut self, rates: &Rates<P::Lanes, N>) -> bool {
        let mut changed = false;
        for lane in lanes_of(self.stale & self.occupied) {
            for shaft in 0..M::STICKING.len() {
                let state = &rates.shafts[shaft];
                let (net, breakaway) = (state.net.get(lane), state.breakaway.get(lane));
                let speed = self.stepper.state[M::STICKING[shaft]].get(lane);
                let held = self.stepper.directions[shaft].get(lane);
                let direction = match (speed == 0.0, breakaway > 0.0) {
                    (false, _) => speed.signum(),
                    (true, true) if held != 0.0 => held,
                    (true, true) if net.abs() <= breakaway => 0.0,
                    _ => net.signum(),
                };
                changed |= direction != held;
                self.stepper.directions[shaft].set(lane, direction);
            }
        }
        changed
    }
}

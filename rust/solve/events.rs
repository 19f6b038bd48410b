//! Dry friction that really sticks, and states that jump: both are located inside the step and landed on.
//!
//! A shaft slides in a direction or is held. The step in which a sliding shaft reverses, or in which a held shaft
//! is pulled harder than its friction can hold, is repeated so that it ends exactly there; then the shaft's
//! direction changes and the next step begins with fresh slopes. Where derivatives are carried, they jump there:
//! they are carried to the moving time of the event with the slope before, and back with the slope after.

use super::Method;
use super::advance::{Advance, Plain};
use super::controller::fit_to_stop;
use super::integrals::Integral;
use super::interpolant::ALL_STATES;
use super::record::{Dense, lane_coefficients};
use super::replay::Lane;
use super::root::root;
use super::stepper::Trial;
use crate::model::{Model, Rates, Shaft};
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
pub struct Events<R: Real> {
    step: R::Plain,
    planned: Vec<Option<Event>>,
    /// Lanes with a planned event.
    lanes: u64,
    /// Of those, the ones that are now being tried.
    tried: u64,
    /// Of those, the ones whose event falls on a stop.
    on_stop: u64,
    /// Lanes whose derivatives have yet to jump.
    passed: u64,
    /// Derivative of the time of the event.
    lag: R::Plain,
}

impl<R: Real> Events<R> {
    pub fn new() -> Self {
        Self {
            step: R::Plain::zero(),
            planned: vec![None; R::LANES],
            lanes: 0,
            tried: 0,
            on_stop: 0,
            passed: 0,
            lag: R::Plain::zero(),
        }
    }

    pub fn forget(&mut self, lane: usize) {
        self.planned[lane] = None;
        self.lanes &= !(1 << lane);
        self.tried &= !(1 << lane);
        self.on_stop &= !(1 << lane);
        self.passed &= !(1 << lane);
    }
}

impl<P: Path, M: Model<N>, T: Method, const N: usize> Advance<'_, P, M, T, N> {
    /// The step of every lane, and whether it ends on a stop.
    #[inline(always)]
    pub(super) fn next_step(&mut self) -> (Plain<P>, <P::Lanes as Real>::Mask) {
        let (step, landing) = fit_to_stop(self.step, self.stop - self.stepper.t);
        if !M::sticks() || self.events.lanes == 0 {
            return (step, landing);
        }
        self.events.tried = self.events.lanes;
        let planned = <P::Lanes as Real>::Mask::from_bits(self.events.lanes);
        let on_stop = <P::Lanes as Real>::Mask::from_bits(self.events.on_stop);
        (Plain::<P>::select(planned & !on_stop, self.events.step, step), (landing & !planned) | (landing & on_stop))
    }

    /// Lanes whose step has to be repeated because it runs over an event.
    #[inline(always)]
    pub(super) fn find_events(
        &mut self,
        accepted: <P::Lanes as Real>::Mask,
        landing: <P::Lanes as Real>::Mask,
        step: Plain<P>,
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
        self.stepper.interpolate::<M, T>(step, ALL_STATES);
        for lane in lanes_of(lanes) {
            let dense = Dense {
                t: self.stepper.t.get(lane),
                step: step.get(lane),
                coefficients: lane_coefficients(&self.stepper.polynomials, lane),
            };
            let shafts = (0..M::STICKING.len()).filter(|shaft| crossed[*shaft] >> lane & 1 == 1);
            let mut candidates: Vec<(f64, Event)> =
                shafts.map(|shaft| self.locate(lane, shaft, &dense, trial)).collect();
            if jumping >> lane & 1 == 1 {
                let at_end = trial.rates.reserve.plain().get(lane);
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
    fn locate(
        &mut self,
        lane: usize,
        shaft: usize,
        dense: &Dense<Lane<P>, N>,
        trial: &Trial<P::Lanes, N>,
    ) -> (f64, Event) {
        let number = Lane::<P>::splat;
        let direction = self.lane_directions(lane)[shaft];
        if direction != 0.0 {
            let speed = |share: f64| direction * dense.at(number(share))[M::STICKING[shaft]].plain();
            let (start, end) = (direction * self.stepper.state[M::STICKING[shaft]].plain().get(lane), speed(1.0));
            return (root(speed, start.max(0.0), end), Event::Stop(shaft));
        }
        let held = |rates: &Rates<Lane<P>, N>| hold(&rates.shafts[shaft]);
        let margin = hold(&trial.rates.shafts[shaft]).plain().get(lane);
        (self.use_up(lane, dense, margin, held), Event::Release(shaft))
    }

    /// Where in the step a reserve is used up.
    fn use_up(
        &mut self,
        lane: usize,
        dense: &Dense<Lane<P>, N>,
        at_end: f64,
        reserve: impl Fn(&Rates<Lane<P>, N>) -> Lane<P>,
    ) -> f64 {
        let number = Lane::<P>::splat;
        let directions = self.lane_directions(lane);
        let Some(seat) = self.seats[lane].take() else { return 1.0 };
        self.replay.load(&seat, self.harmonics);
        let mut left = |share: f64| {
            let t = number(dense.t + share * dense.step);
            reserve(&self.replay.rates_in(&seat, t, &dense.at(number(share)), directions)).plain()
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
            let Some(event) = event else { continue };
            if P::Lanes::DIFFERENTIATES {
                self.carry_to_event(lane, event, trial);
            }
            match event {
                Event::Stop(shaft) => {
                    self.stepper.state[M::STICKING[shaft]].set(lane, Lane::<P>::zero());
                    self.set_direction(lane, shaft, 0.0);
                }
                Event::Release(shaft) => {
                    let net = trial.rates.shafts[shaft].net.plain().get(lane);
                    self.set_direction(lane, shaft, net.signum());
                }
                Event::Jump => self.jump(lane),
            }
            self.stale |= 1 << lane;
            if let Some(seat) = &self.seats[lane] {
                self.step.set(lane, self.first_step(seat));
            }
            self.controller.reset_lane(lane);
        }
    }

    /// Turns derivatives at a fixed time into those at the time of the event, which moves as well.
    fn carry_to_event(&mut self, lane: usize, event: Event, trial: &Trial<P::Lanes, N>) {
        let slope: [f64; N] = std::array::from_fn(|index| trial.rates.slope[index].plain().get(lane));
        let lag = match event {
            Event::Stop(shaft) => -trial.state[M::STICKING[shaft]].tangent().get(lane) / slope[M::STICKING[shaft]],
            Event::Release(shaft) => self.lag(lane, trial, &slope, |rates| hold(&rates.shafts[shaft])),
            Event::Jump => self.lag(lane, trial, &slope, |rates| rates.reserve),
        };
        self.events.passed |= 1 << lane;
        self.events.lag.set(lane, lag);
        self.carry(lane, &slope, lag);
    }

    /// Lets the time at which derivatives are taken move with a parameter.
    fn carry(&mut self, lane: usize, slope: &[f64; N], lag: f64) {
        let integrands = self.stepper.integrands_in(lane);
        let integrals = self.stepper.integrals.iter_mut().zip(&integrands);
        for (number, rate) in self.stepper.state.iter_mut().zip(slope).chain(integrals) {
            let value = number.get(lane);
            number.set(lane, value.with_tangent(rate.mul_add(lag, value.tangent())));
        }
    }

    /// The derivative of the time at which a reserve is used up.
    fn lag(
        &mut self,
        lane: usize,
        trial: &Trial<P::Lanes, N>,
        slope: &[f64; N],
        reserve: impl Fn(&Rates<Lane<P>, N>) -> Lane<P>,
    ) -> f64 {
        let directions = self.lane_directions(lane);
        let Some(seat) = self.seats[lane].take() else { return 0.0 };
        self.replay.load(&seat, self.harmonics);
        let state: [Lane<P>; N] = std::array::from_fn(|index| trial.state[index].get(lane));
        let (change, rate) =
            self.replay.change_and_rate(&seat, trial.t.get(lane), (&state, slope), directions, reserve);
        self.seats[lane] = Some(seat);
        -change / rate
    }

    /// The way back in lanes that have passed an event; true where there are any.
    pub(super) fn carry_from_event(&mut self, rates: &Rates<P::Lanes, N>) -> bool {
        let passed = std::mem::take(&mut self.events.passed);
        for lane in lanes_of(passed) {
            let lag = self.events.lag.get(lane);
            let slope: [f64; N] = std::array::from_fn(|index| rates.slope[index].plain().get(lane));
            self.carry(lane, &slope, -lag);
        }
        passed != 0
    }

    /// Lets go of held shafts that are pulled too hard, in lanes that begin or whose input has jumped; gives
    /// shafts that turn their direction. True where anything changed.
    pub(super) fn release(&mut self, rates: &Rates<P::Lanes, N>) -> bool {
        let mut changed = false;
        for lane in lanes_of(self.stale & self.occupied) {
            for shaft in 0..M::STICKING.len() {
                let state = &rates.shafts[shaft];
                let (net, breakaway) = (state.net.plain().get(lane), state.breakaway.plain().get(lane));
                let speed = self.stepper.state[M::STICKING[shaft]].plain().get(lane);
                let held = self.lane_directions(lane)[shaft];
                let direction = match (speed == 0.0, breakaway > 0.0) {
                    (false, _) => speed.signum(),
                    (true, true) if held != 0.0 => held,
                    (true, true) if net.abs() <= breakaway => 0.0,
                    _ => net.signum(),
                };
                changed |= direction != held;
                self.set_direction(lane, shaft, direction);
            }
        }
        changed
    }

    pub(super) fn set_direction(&mut self, lane: usize, shaft: usize, direction: f64) {
        self.stepper.directions[shaft].set(lane, Lane::<P>::splat(direction));
    }
}

/// How much more dry friction could hold.
fn hold<R: Real>(shaft: &Shaft<R>) -> R {
    shaft.breakaway - shaft.net.abs()
}

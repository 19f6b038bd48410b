//! Dry friction that really sticks, and states that jump: both are located inside the step and landed on.
//!
//! A shaft slides in a direction or is held. The step in which a sliding shaft reverses, or in which a held shaft
//! is pulled harder than its friction can hold, be it for a moment, is repeated so that it ends exactly there; then the
//! shaft's direction changes and the next step begins with fresh slopes. Steps are repeated in the same way to end at
//! the corners of laws.

use super::Method;
use super::advance::{Advance, Plain};
use super::controller::fit_to_stop;
use super::corners::Turns;
use super::integrals::Integral;
use super::interpolant::ALL_STATES;
use super::record::{Branch, Dense, lane_coefficients};
use super::replay::Lane;
use super::root::{dip, next_root, root};
use super::slack::{JUMPS, RESERVES, left};
use super::stepper::{Stepper, Trial};
use crate::model::{Model, Rates};
use crate::real::{Mask, Path, Real, lanes_of};

/// An event is never placed at the very start of a step, so that time always moves.
pub(super) const EARLIEST: f64 = 1e-9;

/// What happens at the end of a step that was shortened on purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Event {
    /// The shaft comes to rest.
    Stop(usize),
    /// The shaft breaks away.
    Release(usize),
    /// Hidden states jump.
    Jump,
    /// They jump as soon as the step begins: a start, a jump of the input or another event has left them overloaded.
    JumpAtOnce,
}

impl Event {
    /// What is left before it, unless it is a stop.
    pub(super) fn reserve<R: Real, const N: usize>(self, rates: &Rates<R, N>) -> R {
        match self {
            Self::Stop(shaft) | Self::Release(shaft) => rates.shafts[shaft].spare(),
            Self::Jump | Self::JumpAtOnce => rates.reserve,
        }
    }

    /// The same without any delay.
    fn at_once(self) -> Self {
        if self == Self::Jump { Self::JumpAtOnce } else { self }
    }
}

/// Why a step is repeated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Landing {
    /// Something happens.
    Event(Event),
    /// A law bends; what is in force behind the corner.
    Corner(Branch),
}

/// Lanes whose step may have crossed an event.
#[derive(Default)]
struct Crossed {
    /// Where a reserve is used up at the end.
    used_up: [u64; RESERVES],
    /// Where it may have been used up in between.
    dips: [u64; RESERVES],
    /// Where a piece of a law is left.
    bent: u64,
}

impl Crossed {
    fn any(&self) -> u64 {
        self.events() | self.bent
    }

    fn events(&self) -> u64 {
        self.used_up.iter().chain(&self.dips).fold(0, |lanes, own| lanes | own)
    }
}

/// Steps that are being repeated to end on an event.
pub struct Events<R: Real> {
    step: R::Plain,
    /// Steps with which lanes go on behind a corner.
    resumed: R::Plain,
    planned: Vec<Option<Landing>>,
    /// Lanes with a planned event.
    lanes: u64,
    /// Of those, the ones that are now being tried.
    tried: u64,
    /// Of those, the ones whose event falls on a stop.
    on_stop: u64,
    /// Lanes whose derivatives have yet to jump.
    pub(super) passed: u64,
    /// Derivative of the time of the last event, or of the start or jump of the input since.
    pub(super) lag: R::Plain,
}

impl<R: Real> Events<R> {
    pub fn new() -> Self {
        Self {
            step: R::Plain::zero(),
            resumed: R::Plain::zero(),
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
    pub(super) fn next_step<const HELD: bool>(&mut self) -> (Plain<P>, <P::Lanes as Real>::Mask) {
        let mut wanted = self.step;
        if M::STICKS {
            wanted = self.stepper.follow_pulses(self.stepper.follow_periods::<M>(wanted));
        }
        let (step, landing) = fit_to_stop(wanted, self.stop - self.stepper.t, self.longest);
        if !HELD || self.events.lanes == 0 {
            return (step, landing);
        }
        self.events.tried = self.events.lanes;
        let planned = <P::Lanes as Real>::Mask::from_bits(self.events.lanes);
        let on_stop = <P::Lanes as Real>::Mask::from_bits(self.events.on_stop);
        (Plain::<P>::select(planned & !on_stop, self.events.step, step), (landing & !planned) | (landing & on_stop))
    }

    /// Lanes whose step has to be repeated because it runs over an event.
    #[inline(always)]
    pub(super) fn find_events<const HELD: bool>(
        &mut self,
        accepted: <P::Lanes as Real>::Mask,
        landing: <P::Lanes as Real>::Mask,
        step: Plain<P>,
        trial: &Trial<P::Lanes, N>,
    ) -> <P::Lanes as Real>::Mask {
        let none = <P::Lanes as Real>::Mask::from_bits(0);
        if !HELD {
            return none;
        }
        let mut crossed = Crossed { bent: self.off_piece(accepted, trial), ..Crossed::default() };
        if M::STICKS {
            let Stepper { slack, directions, .. } = &self.stepper;
            let end = left::<P::Lanes, M, N>(directions, &trial.state, &trial.rates);
            for (reserve, course) in slack.iter().enumerate() {
                let (mut gone, mut size) = (end[reserve].lt(Plain::<P>::zero()), 1.0);
                if let Some(&speed) = M::STICKING.get(reserve) {
                    // A shaft whose friction is gone by the end has come to rest on the way all the same.
                    let reversed = (directions[reserve] * trial.state[speed]).lt(P::Lanes::zero());
                    gone = gone | (reversed & course.start.lt(Plain::<P>::splat(f64::INFINITY)));
                    size = self.stepper.scales[speed];
                }
                crossed.used_up[reserve] = (accepted & gone).to_bits();
                crossed.dips[reserve] = (accepted & course.dips(end[reserve], self.leeway() * size)).to_bits();
            }
        }
        let free = self.occupied & !self.events.lanes;
        if crossed.any() & free == 0 {
            return none;
        }
        self.stepper.interpolate::<M, T>(step, ALL_STATES);
        let turns = self.turns(crossed.bent & free, step, trial);
        self.plan(&crossed, free, landing.to_bits(), turns.as_ref(), &step, trial);
        <P::Lanes as Real>::Mask::from_bits(self.events.lanes & free)
    }

    /// Plans the first event in the step of each of the free lanes that may have crossed one.
    fn plan(
        &mut self,
        crossed: &Crossed,
        free: u64,
        landing: u64,
        turns: Option<&Turns<P::Lanes>>,
        step: &Plain<P>,
        trial: &Trial<P::Lanes, N>,
    ) {
        for lane in lanes_of(crossed.any() & free) {
            let event = self.first_event(lane, crossed, step, trial);
            let corner = if crossed.bent >> lane & 1 == 1 { self.first_corner(lane, turns, step) } else { None };
            let planned = event.into_iter().chain(corner).min_by(|left, right| left.0.total_cmp(&right.0));
            let Some((share, landing_on)) = planned else { continue };
            let share = share.clamp(EARLIEST, 1.0);
            self.events.planned[lane] = Some(landing_on);
            self.events.lanes |= 1 << lane;
            let stop = share == 1.0 && landing >> lane & 1 == 1;
            self.events.on_stop |= u64::from(stop) << lane;
            self.events.step.set(lane, share * step.get(lane));
            self.events.resumed.set(lane, self.step.get(lane));
        }
    }

    /// What happens first in a lane's step, and where.
    fn first_event(
        &mut self,
        lane: usize,
        crossed: &Crossed,
        step: &Plain<P>,
        trial: &Trial<P::Lanes, N>,
    ) -> Option<(f64, Landing)> {
        let dense = self.dense_in(lane, step);
        let mut events = [None; RESERVES];
        for (reserve, event) in events.iter_mut().enumerate() {
            if crossed.used_up[reserve] >> lane & 1 == 1 {
                *event = self.locate(lane, reserve, &dense, Some(trial));
            } else if crossed.dips[reserve] >> lane & 1 == 1 {
                *event = self.locate(lane, reserve, &dense, None);
            }
        }
        let first = events.into_iter().flatten().min_by(|left, right| left.0.total_cmp(&right.0));
        first.map(|(share, event)| (share, Landing::Event(event)))
    }

    /// The step last interpolated in one lane.
    pub(super) fn dense_in(&self, lane: usize, step: &Plain<P>) -> Dense<Lane<P>, N> {
        Dense {
            t: self.stepper.t.get(lane),
            step: step.get(lane),
            coefficients: lane_coefficients(&self.stepper.polynomials, lane),
        }
    }

    /// Where in the step a reserve is used up for good, as the end of the step shows, or else for a moment.
    fn locate(
        &mut self,
        lane: usize,
        reserve: usize,
        dense: &Dense<Lane<P>, N>,
        end: Option<&Trial<P::Lanes, N>>,
    ) -> Option<(f64, Event)> {
        let number = Lane::<P>::splat;
        let event = self.event_of(lane, reserve);
        if let Event::Stop(shaft) = event {
            let direction = self.stepper.directions[shaft].plain().get(lane);
            let speed = |share: f64| direction * dense.at(number(share))[M::STICKING[shaft]].plain();
            let start = direction * self.stepper.state[M::STICKING[shaft]].plain().get(lane);
            let share = match end {
                Some(_) => Some(next_root(speed, start, speed(1.0), EARLIEST)),
                None => dip(speed),
            };
            return share.map(|share| (share, event));
        }
        let branch = self.branch(lane);
        let seat = self.seats[lane].take()?;
        self.replay.load(&seat);
        let mut left = |share: f64| {
            let t = number(dense.t + share * dense.step);
            event.reserve(&self.replay.rates_in(&seat, t, &dense.at(number(share)), branch)).plain()
        };
        let found = match end {
            Some(trial) => {
                let start = left(0.0);
                let at_end = event.reserve(&trial.rates).plain().get(lane);
                Some(if start <= 0.0 { (EARLIEST, event.at_once()) } else { (root(&mut left, start, at_end), event) })
            }
            None => dip(left).map(|share| (share, event)),
        };
        self.seats[lane] = Some(seat);
        found
    }

    /// What happens in a lane where a reserve is used up.
    fn event_of(&self, lane: usize, reserve: usize) -> Event {
        match reserve {
            JUMPS => Event::Jump,
            shaft if self.stepper.directions[shaft].plain().get(lane) != 0.0 => Event::Stop(shaft),
            shaft => Event::Release(shaft),
        }
    }

    /// Lets hidden states jump; what mechanical energy goes with it counts as taken by terms.
    fn jump(&mut self, lane: usize) {
        let Some(seat) = self.seats[lane].take() else { return };
        self.replay.load(&seat);
        let (after, lost) = self.replay.jump(&seat, self.stepper.t.get(lane), &self.lane_state(lane));
        self.set_lane_state(lane, &after);
        let taken = &mut self.stepper.integrals[Integral::TermPower as usize];
        taken.set(lane, taken.get(lane) + lost);
        self.seats[lane] = Some(seat);
    }

    /// An output that lands on its stop, that of the last shaft, has no speed there: the hair by which the step misses
    /// it is none.
    #[inline(always)]
    pub(super) fn rest(&self, trial: &mut Trial<P::Lanes, N>) {
        if !M::STICKS {
            return;
        }
        for lane in lanes_of(self.events.tried) {
            if self.events.planned[lane] == Some(Landing::Event(Event::Stop(M::STICKING.len() - 1))) {
                trial.rates.omega_l.set(lane, Lane::<P>::zero());
            }
        }
    }

    /// Shafts whose event has been reached change their direction; a planned step that failed is planned no more.
    #[inline(always)]
    pub(super) fn settle_events<const HELD: bool>(
        &mut self,
        accepted: <P::Lanes as Real>::Mask,
        trial: &Trial<P::Lanes, N>,
    ) {
        if !HELD || self.events.tried == 0 {
            return;
        }
        for lane in lanes_of(self.events.tried) {
            let planned = self.events.planned[lane];
            self.events.forget(lane);
            let Some(planned) = planned.filter(|_| accepted.to_bits() >> lane & 1 == 1) else { continue };
            self.controller.reset_lane(lane);
            match planned {
                Landing::Event(event) => self.pass(lane, event, trial),
                Landing::Corner(next) => self.turn(lane, next),
            }
        }
    }

    /// Goes on behind an event.
    fn pass(&mut self, lane: usize, event: Event, trial: &Trial<P::Lanes, N>) {
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
            Event::Jump | Event::JumpAtOnce => self.jump(lane),
        }
        self.stale |= 1 << lane;
        if let Some(seat) = &self.seats[lane] {
            self.step.set(lane, self.first_step(seat));
        }
    }

    /// Goes on behind a corner.
    fn turn(&mut self, lane: usize, next: Branch) {
        if let Some(pieces) = &mut self.stepper.held {
            for (lanes, piece) in pieces.iter_mut().zip(next.pieces) {
                lanes.set(lane, f64::from(piece));
            }
        }
        self.stepper.margin.start.set(lane, 0.0);
        self.step.set(lane, self.events.resumed.get(lane));
        self.bent |= 1 << lane;
    }

    /// Lets go of held shafts that are pulled too hard, in lanes that begin or whose input has jumped; gives
    /// shafts that turn their direction. True where anything changed.
    pub(super) fn release(&mut self, rates: &Rates<P::Lanes, N>) -> bool {
        let mut changed = false;
        for lane in lanes_of(self.stale & self.occupied) {
            for shaft in 0..M::STICKING.len() {
                let speed = self.stepper.state[M::STICKING[shaft]].plain().get(lane);
                let held = self.stepper.directions[shaft].plain().get(lane);
                let direction = rates.shafts[shaft].onward(lane, speed, held);
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

//! Derivatives across an event, where they jump: they are carried to the moving time of the event with the slope before,
//! and back with the slope after.

use super::Method;
use super::advance::Advance;
use super::events::Event;
use super::record::lane_numbers;
use super::replay::Lane;
use super::stepper::Trial;
use crate::model::{Model, Rates};
use crate::real::{Path, Real, lanes_of};

impl<P: Path, M: Model<N>, T: Method, const N: usize> Advance<'_, P, M, T, N> {
    /// Turns derivatives at a fixed time into those at the time of the event, which moves as well.
    pub(super) fn carry_to_event(&mut self, lane: usize, event: Event, trial: &Trial<P::Lanes, N>) {
        let slope: [f64; N] = std::array::from_fn(|index| trial.rates.slope[index].plain().get(lane));
        let lag = match event {
            Event::Stop(shaft) => -trial.state[M::STICKING[shaft]].tangent().get(lane) / slope[M::STICKING[shaft]],
            Event::Release(_) | Event::Jump => self.lag(lane, trial, &slope, |rates| event.reserve(rates)),
            Event::JumpAtOnce => self.events.lag.get(lane),
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
        let branch = self.branch(lane);
        let Some(seat) = self.seats[lane].take() else { return 0.0 };
        self.replay.load(&seat);
        let state = lane_numbers(&trial.state, lane);
        let (change, rate) = self.replay.change_and_rate(&seat, trial.t.get(lane), (&state, slope), branch, reserve);
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
}

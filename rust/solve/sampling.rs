//! Signals at the times at which rows are sampled, by the dense output of all lanes at once.

use super::Method;
use super::advance::{Advance, Plain};
use super::stepper::{Stepper, Trial};
use crate::model::{Layout, Model, Signal};
use crate::real::{Mask, Path, Real, Task, lanes_of};
use std::marker::PhantomData;

/// A place for every signal there is.
pub(super) type Observed<R> = [R; Signal::ALL.len()];

/// What a sample holds.
#[derive(Clone, Debug, Default)]
pub struct Sampled {
    signals: Vec<Signal>,
    /// States that they are made of, as a set of bits.
    states: u64,
    /// Whether any takes the equations.
    derived: bool,
}

impl Sampled {
    /// Has samples hold a signal.
    pub fn include(&mut self, signal: Signal, layout: &Layout) {
        if !self.signals.contains(&signal) {
            self.signals.push(signal);
            self.states |= signal.states(layout);
            self.derived |= !signal.is_of_state(layout.base);
        }
    }

    /// The signals in the order in which samples hold them.
    pub fn signals(&self) -> &[Signal] {
        &self.signals
    }
}

impl<P: Path, M: Model<N>, T: Method, const N: usize> Advance<'_, P, M, T, N> {
    /// Signals at the grids' times inside the accepted steps.
    #[inline(always)]
    pub(super) fn take_samples(
        &mut self,
        accepted: <P::Lanes as Real>::Mask,
        step: Plain<P>,
        trial: &Trial<P::Lanes, N>,
    ) {
        let mut due = (accepted & self.sample.plain().le(trial.t)).to_bits() & self.occupied;
        if due == 0 {
            return;
        }
        let mut inside = due & self.sample.plain().lt(trial.t).to_bits();
        if inside != 0 {
            let wanted = self.demand.sampled.states;
            self.stepper.interpolate::<M, T>(step, wanted);
            while inside != 0 {
                let t = self.sample.min(P::Lanes::constant(trial.t));
                let share = (t - P::Lanes::constant(self.stepper.t)) / P::Lanes::constant(step);
                let state = self.stepper.inside(step, share, wanted);
                self.push_samples(inside, t.plain(), &state);
                inside &= self.sample.plain().lt(trial.t).to_bits();
            }
            due &= self.sample.plain().le(trial.t).to_bits();
        }
        while due != 0 {
            if P::Lanes::DIFFERENTIATES {
                let mut state = trial.state;
                for index in 0..N {
                    let slope = trial.rates.slope[index].plain();
                    let tangent = slope.mul_add(self.sample.tangent(), state[index].tangent());
                    state[index] = state[index].with_tangent(tangent);
                }
                self.push_samples(due, trial.t, &state);
            } else {
                self.push_samples(due, trial.t, &trial.state);
            }
            due &= self.sample.plain().le(trial.t).to_bits();
        }
    }

    /// Gives the signals of the lanes at their sample times to their rows.
    #[inline(always)]
    fn push_samples(&mut self, lanes: u64, t: Plain<P>, state: &[P::Lanes; N]) {
        let Self { stepper, demand, observed, .. } = self;
        let sampled = &*demand.sampled;
        P::Lanes::apart(Observe { stepper, sampled, t, state, observed, model: PhantomData::<M> });
        for lane in lanes_of(lanes) {
            if let Some(seat) = &mut self.seats[lane] {
                let next = seat.push_sample(|place| self.observed[place].get(lane));
                self.sample.set(lane, next);
            }
        }
    }
}

/// The signals that samples hold, of all lanes, with the equations as they are in force in the step.
struct Observe<'a, R: Real, M, const N: usize> {
    stepper: &'a Stepper<R, N>,
    sampled: &'a Sampled,
    t: R::Plain,
    state: &'a [R; N],
    observed: &'a mut Observed<R>,
    model: PhantomData<M>,
}

impl<R: Real, M: Model<N>, const N: usize> Task for Observe<'_, R, M, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { stepper, sampled, t, state, observed, .. } = self;
        let inverse_ratio = stepper.constants.inverse_ratio;
        let signals = observed.iter_mut().zip(&sampled.signals);
        if !sampled.derived {
            for (value, signal) in signals {
                *value = signal.of_state(state, inverse_ratio);
            }
            return;
        }
        let rates = stepper.rates::<M>(R::constant(t), state);
        for (value, signal) in signals {
            *value = if signal.is_of_state(M::BASE) {
                signal.of_state(state, inverse_ratio)
            } else {
                signal.of_rates(&rates, state, inverse_ratio)
            };
        }
    }
}

//! Signals at the times at which rows are sampled, by the dense output of all lanes at once.

use super::Method;
use super::advance::{Advance, Plain};
use super::stepper::{Stepper, Trial};
use crate::model::{Layout, Model, Signal};
use crate::real::{Mask, Path, Real, Task, lanes_of};
use std::marker::PhantomData;

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

/// Samples that have yet to be observed, one of a lane at most.
pub(super) struct Waiting<R: Real, const N: usize> {
    lanes: u64,
    t: R::Plain,
    state: [R; N],
    /// The signals of those observed last.
    observed: [R; Signal::ALL.len()],
}

impl<R: Real, const N: usize> Waiting<R, N> {
    pub fn new() -> Self {
        Self { lanes: 0, t: R::Plain::zero(), state: [R::zero(); N], observed: [R::zero(); Signal::ALL.len()] }
    }

    #[inline(always)]
    fn join(&mut self, lanes: u64, t: R::Plain, state: &[R; N]) {
        let joining = R::Mask::from_bits(lanes);
        self.t = R::Plain::select(joining, t, self.t);
        for (own, &new) in self.state.iter_mut().zip(state) {
            *own = R::select(joining, new, *own);
        }
        self.lanes |= lanes;
    }
}

impl<P: Path, M: Model<N>, T: Method, const N: usize> Advance<'_, P, M, T, N> {
    /// Signals at the grids' times inside the accepted steps.
    #[inline(always)]
    pub(super) fn take_samples<const HELD: bool>(
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
                self.sample_lanes::<HELD>(inside, t.plain(), &state);
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
                self.sample_lanes::<HELD>(due, trial.t, &state);
            } else {
                self.sample_lanes::<HELD>(due, trial.t, &trial.state);
            }
            due &= self.sample.plain().le(trial.t).to_bits();
        }
    }

    /// Samples lanes. The equations are asked of all lanes at once, so that samples wait until a lane has a second one;
    /// where pieces of laws are held, which any step may change, they do not.
    #[inline(always)]
    fn sample_lanes<const HELD: bool>(&mut self, lanes: u64, t: Plain<P>, state: &[P::Lanes; N]) {
        self.observe_lanes(lanes);
        self.waiting.join(lanes, t, state);
        for lane in lanes_of(lanes) {
            if let Some(seat) = &mut self.seats[lane] {
                let next = seat.samples.pass();
                self.sample.set(lane, next);
            }
        }
        if HELD || !self.demand.sampled.derived {
            self.observe();
        }
    }

    /// Has what waits observed where it holds a sample of these lanes: before one has another, or its input or row
    /// changes.
    #[inline(always)]
    pub(super) fn observe_lanes(&mut self, lanes: u64) {
        if self.waiting.lanes & lanes != 0 {
            self.observe();
        }
    }

    /// Gives the signals of the samples that wait to their rows.
    fn observe(&mut self) {
        let Self { stepper, demand, waiting, .. } = self;
        P::Lanes::apart(Observe { stepper, sampled: &demand.sampled, waiting, model: PhantomData::<M> });
        for lane in lanes_of(std::mem::take(&mut waiting.lanes)) {
            if let Some(seat) = &mut self.seats[lane] {
                seat.samples.push(|place| waiting.observed[place].get(lane));
            }
        }
    }
}

/// The signals of the samples that wait, with the equations as they are in force.
struct Observe<'a, R: Real, M, const N: usize> {
    stepper: &'a Stepper<R, N>,
    sampled: &'a Sampled,
    waiting: &'a mut Waiting<R, N>,
    model: PhantomData<M>,
}

impl<R: Real, M: Model<N>, const N: usize> Task for Observe<'_, R, M, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { stepper, sampled, waiting: Waiting { t, state, observed, .. }, .. } = self;
        let rates = if sampled.derived { Some(stepper.rates::<M>(R::constant(*t), state)) } else { None };
        for (value, signal) in observed.iter_mut().zip(&sampled.signals) {
            *value = signal.value(state, rates.as_ref(), stepper.constants.inverse_ratio);
        }
    }
}

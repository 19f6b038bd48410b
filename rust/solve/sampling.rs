//! States at the times at which rows are sampled, by the dense output of all lanes at once.

use super::Method;
use super::advance::{Advance, Plain};
use super::record::lane_numbers;
use super::stepper::Trial;
use crate::model::Model;
use crate::real::{Mask, Path, Real, lanes_of};

impl<P: Path, M: Model<N>, T: Method, const N: usize> Advance<'_, P, M, T, N> {
    /// States at the grid's times inside the accepted steps.
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
            self.stepper.interpolate::<M, T>(step, self.demand.sampled);
            while inside != 0 {
                let share = (self.sample - P::Lanes::constant(self.stepper.t)) / P::Lanes::constant(step);
                let state = self.stepper.inside(step, share, self.demand.sampled);
                self.push_samples(inside, &state);
                inside &= self.sample.plain().lt(trial.t).to_bits();
            }
            due &= self.sample.plain().le(trial.t).to_bits();
        }
        while due != 0 {
            let mut state = trial.state;
            for (number, slope) in state.iter_mut().zip(trial.rates.slope) {
                let tangent = slope.plain().mul_add(self.sample.tangent(), number.tangent());
                *number = number.with_tangent(tangent);
            }
            self.push_samples(due, &state);
            due &= self.sample.plain().le(trial.t).to_bits();
        }
    }

    /// Gives the lanes' states at their sample times to their rows.
    #[inline(always)]
    fn push_samples(&mut self, lanes: u64, state: &[P::Lanes; N]) {
        for lane in lanes_of(lanes) {
            if let Some(seat) = &mut self.seats[lane] {
                let next = seat.push_sample(lane_numbers(state, lane));
                self.sample.set(lane, next);
            }
        }
    }
}

//! The state at which a stage is evaluated.

use super::Method;
use super::stepper::Stepper;
use crate::model::Model;
use crate::real::{Real, Task};
use std::marker::PhantomData;

/// Expands `$body` for stage indices 0 to 15 as constants, so that zero weights vanish at compile time.
macro_rules! unrolled {
    ($index:ident => $body:block) => {
        unrolled!(@ $index $body 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15)
    };
    (@ $index:ident $body:block $($value:literal)*) => {
        $({ const $index: usize = $value; $body })*
    };
}
pub(super) use unrolled;

/// Adds `step` times the sum of the slopes with these weights to the model's own states. A function that takes or returns
/// states copies them: up to a quarter of the time of a step.
macro_rules! add_to_own {
    ($state:ident, $stepper:expr, $weights:expr, $step:expr) => {{
        let own = N - M::HIDDEN;
        let mut sums = [R::zero(); N];
        unrolled!(J => {
            if let Some(&weight) = $weights.get(J) && weight != 0.0 {
                for index in 0..own {
                    sums[index] = $stepper.slopes[J][index].mul_add_plain(R::Plain::splat(weight), sums[index]);
                }
            }
        });
        for index in 0..own {
            $state[index] = sums[index].mul_add_plain($step, $state[index]);
        }
    }};
}

impl<R: Real, const N: usize> Stepper<R, N> {
    /// The time of a stage.
    #[inline(always)]
    pub(super) fn stage_time<T: Method>(&self, stage: usize, step: R::Plain) -> R::Plain {
        step.mul_add(R::Plain::splat(T::NODES[stage]), self.t)
    }

    /// The state of a stage.
    #[inline(always)]
    pub(super) fn stage_state<M: Model<N>, T: Method>(&self, stage: usize, step: R::Plain) -> [R; N] {
        let mut state = self.state;
        let sum = StageState::<R, M, T, N> { stepper: self, stage, step, state: &mut state, types: PhantomData };
        if R::DIFFERENTIATES || T::IS_IMPLICIT {
            R::apart(sum);
        } else {
            sum.run();
        }
        state
    }

    /// The state plus `step` times the sum of the slopes with these weights. The states of terms, few of which are in use,
    /// are summed one after the other.
    #[inline(always)]
    fn combine<M: Model<N>>(&self, weights: &[f64], step: R::Plain) -> [R; N] {
        let mut state = self.state;
        add_to_own!(state, self, weights, step);
        for index in N - M::HIDDEN..self.used::<M>() {
            let mut sum = R::zero();
            unrolled!(J => {
                if let Some(&weight) = weights.get(J) && weight != 0.0 {
                    sum = self.slopes[J][index].mul_add_plain(R::Plain::splat(weight), sum);
                }
            });
            state[index] = sum.mul_add_plain(step, state[index]);
        }
        state
    }
}

struct StageState<'a, R: Real, M, T, const N: usize> {
    stepper: &'a Stepper<R, N>,
    stage: usize,
    step: R::Plain,
    state: &'a mut [R; N],
    types: PhantomData<(M, T)>,
}

impl<R: Real, M: Model<N>, T: Method, const N: usize> Task for StageState<'_, R, M, T, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { stepper, stage, step, state, .. } = self;
        unrolled!(S => {
            if S > 0 && S < T::COUPLING.len() && stage == S {
                if M::HIDDEN == 0 {
                    let mut moved = stepper.state;
                    add_to_own!(moved, stepper, T::COUPLING[S], step);
                    *state = moved;
                } else {
                    *state = stepper.combine::<M>(T::COUPLING[S], step);
                }
            }
        });
    }
}

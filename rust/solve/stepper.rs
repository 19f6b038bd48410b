//! One Runge-Kutta step in lanes: stages, error estimate, dense output.

use super::Method;
use super::integrals::{INTEGRALS, Integrands};
use super::record::DENSE_TERMS;
use super::watch::{Watch, WatchList};
use crate::model::terms::Terms;
use crate::model::{Constants, Drivetrain, Energies, Harmonics, Input, Layout, Model, Rates, Row, SpringLaw};
use crate::real::{Mask, Real};

/// Slopes kept of a step: the largest method has 13 stages and 3 more for its dense output.
const SLOPES: usize = 16;

/// The numbers of all lanes.
pub struct Stepper<R: Real, const N: usize> {
    pub t: R,
    pub state: [R; N],
    /// Windup at the start of the step: the size against which its error is measured.
    pub windup: R,
    pub constants: Constants<R>,
    pub harmonics: Harmonics<R>,
    pub input: Input<R>,
    pub spring: SpringLaw,
    pub terms: Terms<R>,
    /// Directions in which motor and load slide, 0 where they are held.
    pub directions: [R; 2],
    /// Sizes below which relative accuracy is not asked for.
    scales: [f64; N],
    /// How many of the states are in use.
    active: f64,
    pub integrands: Integrands,
    /// Integrals since the last mark.
    pub integrals: [R; INTEGRALS],
    pub watch: Watch<R>,
    slopes: [[R; N]; SLOPES],
    starting: [R; INTEGRALS],
    step_integrals: [R; INTEGRALS],
}

/// The end of an attempted step.
pub struct Trial<R, const N: usize> {
    pub t: R,
    pub state: [R; N],
    pub rates: Rates<R, N>,
}

/// Expands `$body` for stage indices 0 to 15 as constants, so that zero weights vanish at compile time.
macro_rules! unrolled {
    ($index:ident => $body:block) => {
        unrolled!(@ $index $body 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15)
    };
    (@ $index:ident $body:block $($value:literal)*) => {
        $({ const $index: usize = $value; $body })*
    };
}

/// `step` times the weighted sum of the slopes, added to the state.
macro_rules! combine {
    ($self:ident, $weights:expr, $step:expr) => {{
        let mut sums = [R::zero(); N];
        unrolled!(J => {
            if let Some(&weight) = $weights.get(J) && weight != 0.0 {
                for index in 0..N {
                    sums[index] = $self.slopes[J][index].mul_add(R::splat(weight), sums[index]);
                }
            }
        });
        let mut state = $self.state;
        for index in 0..N {
            state[index] = sums[index].mul_add($step, state[index]);
        }
        state
    }};
}

impl<R: Real, const N: usize> Stepper<R, N> {
    pub fn new<M: Model<N>>(
        layout: &Layout,
        row: &Row,
        harmonics: &Harmonics<f64>,
        integrands: Integrands,
        watched: WatchList,
    ) -> Self {
        let mut scales = M::SCALES;
        let hidden = layout.terms.terms().flat_map(|term| term.states).map(|state| state.scale);
        for (scale, own) in scales[N - M::HIDDEN..].iter_mut().zip(hidden) {
            *scale = own;
        }
        let unused = M::HIDDEN.saturating_sub(layout.terms.state_count);
        Self {
            t: R::zero(),
            state: [R::zero(); N],
            windup: R::zero(),
            constants: Constants::splat(&row.constants),
            harmonics: Harmonics::splat(harmonics),
            input: Input::none(),
            spring: layout.spring,
            terms: Terms::new(&layout.terms),
            directions: [R::zero(); 2],
            scales,
            active: (N - unused) as f64,
            integrands,
            integrals: [R::zero(); INTEGRALS],
            watch: Watch::new(watched),
            slopes: [[R::zero(); N]; SLOPES],
            starting: [R::zero(); INTEGRALS],
            step_integrals: [R::zero(); INTEGRALS],
        }
    }

    #[inline(always)]
    pub fn drive(&self) -> Drivetrain<'_, R> {
        Drivetrain {
            constants: &self.constants,
            harmonics: &self.harmonics,
            input: &self.input,
            spring: self.spring,
            terms: &self.terms,
            directions: &self.directions,
        }
    }

    #[inline(always)]
    pub fn rates<M: Model<N>>(&self, t: R, state: &[R; N]) -> Rates<R, N> {
        M::rates(&self.drive(), t, state)
    }

    #[inline(always)]
    pub fn energies<M: Model<N>>(&self, t: R, state: &[R; N]) -> Energies<R> {
        M::energies(&self.drive(), t, state)
    }

    /// Evaluates the first slope anew in the given lanes.
    #[inline(always)]
    pub fn refresh<M: Model<N>>(&mut self, lanes: R::Mask) -> Rates<R, N> {
        let rates = self.rates::<M>(self.t, &self.state);
        self.begin(lanes, &rates);
        rates
    }

    /// Takes rates as the first slope in the given lanes.
    #[inline(always)]
    fn begin(&mut self, lanes: R::Mask, rates: &Rates<R, N>) {
        for index in 0..N {
            self.slopes[0][index] = R::select(lanes, rates.slope[index], self.slopes[0][index]);
        }
        self.windup = R::select(lanes, rates.windup, self.windup);
        self.watch.begin(lanes, rates, &self.constants);
        if self.integrands.any() {
            let mut values = [R::zero(); INTEGRALS];
            self.integrands.add(R::splat(1.0), rates, &self.constants, &mut values);
            for index in 0..INTEGRALS {
                self.starting[index] = R::select(lanes, values[index], self.starting[index]);
            }
        }
    }

    /// Runs the stages of one step.
    #[inline(always)]
    pub fn attempt<M: Model<N>, T: Method>(&mut self, step: R) -> Trial<R, N> {
        let weights = T::COUPLING[T::STAGES - 1];
        if self.integrands.any() {
            for index in 0..INTEGRALS {
                self.step_integrals[index] = self.starting[index] * R::splat(weights[0]);
            }
        }
        let mut stage = 1;
        loop {
            let state = self.stage_state::<T>(stage, step);
            let t = step.mul_add(R::splat(T::NODES[stage]), self.t);
            let rates = self.rates::<M>(t, &state);
            self.slopes[stage] = rates.slope;
            if stage == T::STAGES - 1 {
                return Trial { t, state, rates };
            }
            if self.integrands.any() && weights[stage] != 0.0 {
                let weight = R::splat(weights[stage]);
                self.integrands.add(weight, &rates, &self.constants, &mut self.step_integrals);
            }
            stage += 1;
        }
    }

    #[inline(always)]
    fn stage_state<T: Method>(&self, stage: usize, step: R) -> [R; N] {
        let mut out = self.state;
        unrolled!(S => {
            if S > 0 && S < T::COUPLING.len() && stage == S {
                out = combine!(self, T::COUPLING[S], step);
            }
        });
        out
    }

    /// The squared error of the attempted step in units of the tolerance.
    #[inline(always)]
    pub fn squared_error<M: Model<N>, T: Method>(&self, step: R, trial: &Trial<R, N>, rtol: f64, floor: f64) -> R {
        let before = M::sizes(&self.state, self.windup);
        let after = M::sizes(&trial.state, trial.rates.windup);
        let mut scales = [R::zero(); N];
        for index in 0..N {
            let size = before[index].max(after[index]) + R::splat(floor * self.scales[index]);
            scales[index] = size;
        }
        let first = self.error_ratio(T::ERROR, &scales);
        let square = step * step * R::splat(1.0 / (self.active * rtol * rtol));
        if T::SECOND_ERROR.is_empty() {
            return first * square;
        }
        let second = self.error_ratio(T::SECOND_ERROR, &scales);
        let mixed = first * first / second.mul_add(R::splat(0.01), first);
        R::select(first.le(R::zero()), R::zero(), mixed * square)
    }

    /// Sum over the states of (weighted slopes / scale)^2, with a single division.
    #[inline(always)]
    fn error_ratio(&self, weights: &[f64], scales: &[R; N]) -> R {
        let mut errors = [R::zero(); N];
        unrolled!(J => {
            if let Some(&weight) = weights.get(J) && weight != 0.0 {
                for index in 0..N {
                    errors[index] = self.slopes[J][index].mul_add(R::splat(weight), errors[index]);
                }
            }
        });
        let mut numerator = errors[0] * errors[0];
        let mut denominator = scales[0] * scales[0];
        for index in 1..N {
            let square = scales[index] * scales[index];
            numerator = (errors[index] * errors[index]).mul_add(denominator, numerator * square);
            denominator = denominator * square;
        }
        numerator / denominator
    }

    /// The attempted step as polynomials in the elapsed share, for the lanes that ask for it.
    #[inline(always)]
    pub fn dense<M: Model<N>, T: Method>(&mut self, step: R) -> [[R; DENSE_TERMS]; N] {
        for stage in T::STAGES..T::STAGES + T::DENSE_STAGES {
            let state = self.stage_state::<T>(stage, step);
            let t = step.mul_add(R::splat(T::NODES[stage]), self.t);
            self.slopes[stage] = self.rates::<M>(t, &state).slope;
        }
        let mut coefficients = [[R::zero(); DENSE_TERMS]; N];
        for index in 0..N {
            let mut sums = [R::zero(); DENSE_TERMS];
            for (slopes, weights) in self.slopes.iter().zip(T::DENSE) {
                for (power, &weight) in weights.iter().enumerate() {
                    sums[power + 1] = slopes[index].mul_add(R::splat(weight), sums[power + 1]);
                }
            }
            for power in 1..DENSE_TERMS {
                coefficients[index][power] = sums[power] * step;
            }
            coefficients[index][0] = self.state[index];
        }
        coefficients
    }

    /// Takes the attempted step in the accepted lanes.
    #[inline(always)]
    pub fn commit(&mut self, accepted: R::Mask, step: R, trial: &Trial<R, N>) {
        self.t = R::select(accepted, trial.t, self.t);
        for index in 0..N {
            self.state[index] = R::select(accepted, trial.state[index], self.state[index]);
        }
        if self.integrands.any() {
            for index in 0..INTEGRALS {
                let grown = step.mul_add(self.step_integrals[index], self.integrals[index]);
                self.integrals[index] = R::select(accepted, grown, self.integrals[index]);
            }
        }
        self.begin(accepted, &trial.rates);
    }

    /// Lanes whose state or slope is not finite.
    #[inline(always)]
    pub fn broken(trial: &Trial<R, N>) -> u64 {
        let limit = R::splat(f64::MAX);
        let mut fine = trial.state[0].abs().le(limit);
        for index in 0..N {
            fine = fine & trial.state[index].abs().le(limit) & trial.rates.slope[index].abs().le(limit);
        }
        (!fine).to_bits() & (u64::MAX >> (64 - R::LANES))
    }
}

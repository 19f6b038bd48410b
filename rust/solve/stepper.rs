//! One step in lanes: stages, error estimate, dense output.

use super::Method;
use super::integrals::{GAUSS, INTEGRALS, Integrands};
use super::linear::Linear;
use super::record::DENSE_TERMS;
use super::tableau::Rosenbrock;
use super::watch::{Watch, WatchList};
use crate::model::terms::Terms;
use crate::model::{Constants, Drivetrain, Energies, Harmonics, Input, Layout, Model, Rates, Row, SpringLaw};
use crate::real::{Mask, Real};

/// Slopes kept of a step: the largest method has 13 stages and 3 more for its dense output.
const SLOPES: usize = 16;

/// The numbers of all lanes.
pub struct Stepper<R: Real, const N: usize> {
    pub t: R::Plain,
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
    linear: Option<Box<Linear<R::Plain, N>>>,
}

/// The end of an attempted step.
pub struct Trial<R: Real, const N: usize> {
    pub t: R::Plain,
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
                    sums[index] = $self.slopes[J][index].mul_add_plain(R::Plain::splat(weight), sums[index]);
                }
            }
        });
        let mut state = $self.state;
        for index in 0..N {
            state[index] = sums[index].mul_add_plain($step, state[index]);
        }
        state
    }};
}

impl<R: Real, const N: usize> Stepper<R, N> {
    pub fn new<M: Model<N>, T: Method>(
        layout: &Layout,
        row: &Row<R::Lane>,
        harmonics: &Harmonics<R::Lane>,
        integrands: Integrands,
        watched: WatchList,
    ) -> Self {
        let mut scales = M::SCALES;
        let hidden = layout.terms.terms().flat_map(|term| term.states).map(|state| state.scale);
        for (scale, own) in scales[N - M::HIDDEN..].iter_mut().zip(hidden) {
            *scale = own;
        }
        let unused = M::HIDDEN.saturating_sub(layout.terms.state_count);
        let harmonics = Harmonics::splat(harmonics);
        let terms = Terms::new(&layout.terms);
        let linear = T::ROSENBROCK.map(|_| Box::new(Linear::new(&harmonics, &terms, N - unused)));
        Self {
            t: R::Plain::zero(),
            state: [R::zero(); N],
            windup: R::zero(),
            constants: Constants::splat(&row.constants),
            harmonics,
            input: Input::none(),
            spring: layout.spring,
            terms,
            directions: [R::zero(); 2],
            scales,
            active: (N - unused) as f64,
            integrands,
            integrals: [R::zero(); INTEGRALS],
            watch: Watch::new(watched),
            slopes: [[R::zero(); N]; SLOPES],
            starting: [R::zero(); INTEGRALS],
            step_integrals: [R::zero(); INTEGRALS],
            linear,
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
        let rates = self.rates::<M>(R::constant(self.t), &self.state);
        self.begin(lanes, &rates);
        rates
    }

    /// Evaluates the derivatives of the first slope anew in the given lanes, where an input bends without a jump.
    pub fn refresh_tangents<M: Model<N>>(&mut self, lanes: R::Mask) {
        let rates = self.rates::<M>(R::constant(self.t), &self.state);
        let renew = |old: &mut R, new: R| *old = R::select(lanes, old.with_tangent(new.tangent()), *old);
        for (old, &new) in self.slopes[0].iter_mut().zip(&rates.slope) {
            renew(old, new);
        }
        let mut values = [R::zero(); INTEGRALS];
        self.integrands.add(R::splat(1.0), &rates, &self.constants, &mut values);
        for (old, &new) in self.starting.iter_mut().zip(&values) {
            renew(old, new);
        }
    }

    /// The integrands at the start of the step in one lane.
    pub fn integrands_in(&self, lane: usize) -> [f64; INTEGRALS] {
        std::array::from_fn(|index| self.starting[index].plain().get(lane))
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
    pub fn attempt<M: Model<N>, T: Method>(&mut self, step: R::Plain) -> Trial<R, N> {
        let weights = T::COUPLING[T::STAGES - 1];
        if let Some(method) = &T::ROSENBROCK {
            self.linearise::<M>(method, step);
        }
        if self.integrands.any() {
            for index in 0..INTEGRALS {
                self.step_integrals[index] = self.starting[index] * R::splat(weights[0]);
            }
        }
        let mut stage = 1;
        loop {
            let state = self.stage_state::<T>(stage, step);
            let t = self.stage_time::<T>(stage, step);
            let rates = self.rates::<M>(R::constant(t), &state);
            self.slopes[stage] = rates.slope;
            if stage == T::STAGES - 1 {
                if T::ROSENBROCK.is_some() && self.integrands.any() {
                    self.integrate::<M, T>(step);
                }
                return Trial { t, state, rates };
            }
            if let Some(method) = &T::ROSENBROCK {
                self.solve_stage(method, stage, step);
            } else if self.integrands.any() && weights[stage] != 0.0 {
                let weight = R::splat(weights[stage]);
                self.integrands.add(weight, &rates, &self.constants, &mut self.step_integrals);
            }
            stage += 1;
        }
    }

    /// Derivatives and matrix of a Rosenbrock step.
    #[inline(always)]
    fn linearise<M: Model<N>>(&mut self, method: &Rosenbrock, step: R::Plain) {
        if let Some(mut linear) = self.linear.take() {
            linear.differentiate::<R, M>(&self.drive(), self.t, &self.state);
            linear.factorise(step, method.gamma);
            self.linear = Some(linear);
        }
    }

    /// Squared distances between the new state and the last stage before it: of the slopes, and of the states.
    #[inline(always)]
    pub fn last_stages<T: Method>(&self, step: R::Plain, state: &[R::Plain; N]) -> (R::Plain, R::Plain) {
        let last = T::STAGES - 1;
        let before = plain(&self.stage_state::<T>(last - 1, step));
        let mut sums = [R::Plain::zero(); 2];
        for index in 0..N {
            let weight = R::Plain::splat(1.0 / self.scales[index]);
            let slopes = self.slopes[last][index].plain() - self.slopes[last - 1][index].plain();
            for (sum, difference) in sums.iter_mut().zip([slopes, state[index] - before[index]]) {
                let scaled = difference * weight;
                *sum = scaled.mul_add(scaled, *sum);
            }
        }
        (sums[0], sums[1])
    }

    /// Turns the slope of a Rosenbrock stage into what the stage contributes.
    #[inline(always)]
    fn solve_stage(&mut self, method: &Rosenbrock, stage: usize, step: R::Plain) {
        let Some(linear) = &self.linear else { return };
        let mut values = plain(&self.slopes[stage]);
        let lead = step * R::Plain::splat(method.times[stage]);
        for index in 0..N {
            for (earlier, &weight) in self.slopes.iter().zip(method.coupling[stage]) {
                values[index] = earlier[index].plain().mul_add(R::Plain::splat(weight), values[index]);
            }
            values[index] = linear.by_time()[index].mul_add(lead, values[index]);
        }
        linear.solve(&mut values);
        self.slopes[stage] = values.map(R::constant);
    }

    /// Quadratures over the step, by Gauss's rule on the dense output.
    #[inline(always)]
    fn integrate<M: Model<N>, T: Method>(&mut self, step: R::Plain) {
        self.step_integrals = [R::zero(); INTEGRALS];
        let coefficients = self.dense::<M, T>(step);
        for (share, weight) in GAUSS {
            let mut state = [R::zero(); N];
            for index in 0..N {
                for power in (0..DENSE_TERMS).rev() {
                    let term = coefficients[index][power];
                    state[index] = state[index].mul_add_plain(R::Plain::splat(share), term);
                }
            }
            let t = step.mul_add(R::Plain::splat(share), self.t);
            let rates = self.rates::<M>(R::constant(t), &state);
            self.integrands.add(R::splat(weight), &rates, &self.constants, &mut self.step_integrals);
        }
    }

    #[inline(always)]
    fn stage_time<T: Method>(&self, stage: usize, step: R::Plain) -> R::Plain {
        step.mul_add(R::Plain::splat(T::NODES[stage]), self.t)
    }

    #[inline(always)]
    fn stage_state<T: Method>(&self, stage: usize, step: R::Plain) -> [R; N] {
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
    pub fn squared_error<M: Model<N>, T: Method>(
        &self,
        step: R::Plain,
        trial: &Trial<R, N>,
        rtol: f64,
        floor: f64,
    ) -> R::Plain {
        let before = M::sizes(&plain(&self.state), self.windup.plain());
        let after = M::sizes(&plain(&trial.state), trial.rates.windup.plain());
        let mut scales = [R::Plain::zero(); N];
        for index in 0..N {
            let size = before[index].max(after[index]) + R::Plain::splat(floor * self.scales[index]);
            scales[index] = size;
        }
        let first = self.error_ratio(T::ERROR, &scales);
        let square = step * step * R::Plain::splat(1.0 / (self.active * rtol * rtol));
        if T::SECOND_ERROR.is_empty() {
            return first * square;
        }
        let second = self.error_ratio(T::SECOND_ERROR, &scales);
        let mixed = first * first / second.mul_add(R::Plain::splat(0.01), first);
        R::Plain::select(first.le(R::Plain::zero()), R::Plain::zero(), mixed * square)
    }

    /// Sum over the states of (weighted slopes / scale)^2, with a single division.
    #[inline(always)]
    fn error_ratio(&self, weights: &[f64], scales: &[R::Plain; N]) -> R::Plain {
        let mut errors = [R::Plain::zero(); N];
        unrolled!(J => {
            if let Some(&weight) = weights.get(J) && weight != 0.0 {
                for index in 0..N {
                    errors[index] = self.slopes[J][index].plain().mul_add(R::Plain::splat(weight), errors[index]);
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
    pub fn dense<M: Model<N>, T: Method>(&mut self, step: R::Plain) -> [[R; DENSE_TERMS]; N] {
        for stage in T::STAGES..T::STAGES + T::DENSE_STAGES {
            let state = self.stage_state::<T>(stage, step);
            let t = self.stage_time::<T>(stage, step);
            self.slopes[stage] = self.rates::<M>(R::constant(t), &state).slope;
        }
        let mut coefficients = [[R::zero(); DENSE_TERMS]; N];
        for index in 0..N {
            let mut sums = [R::zero(); DENSE_TERMS];
            for (slopes, weights) in self.slopes.iter().zip(T::DENSE) {
                for (power, &weight) in weights.iter().enumerate() {
                    sums[power + 1] = slopes[index].mul_add_plain(R::Plain::splat(weight), sums[power + 1]);
                }
            }
            for power in 1..DENSE_TERMS {
                coefficients[index][power] = sums[power] * R::constant(step);
            }
            coefficients[index][0] = self.state[index];
        }
        coefficients
    }

    /// Takes the attempted step in the accepted lanes.
    #[inline(always)]
    pub fn commit(&mut self, accepted: R::Mask, step: R::Plain, trial: &Trial<R, N>) {
        self.t = R::Plain::select(accepted, trial.t, self.t);
        for index in 0..N {
            self.state[index] = R::select(accepted, trial.state[index], self.state[index]);
        }
        if self.integrands.any() {
            for index in 0..INTEGRALS {
                let grown = self.step_integrals[index].mul_add_plain(step, self.integrals[index]);
                self.integrals[index] = R::select(accepted, grown, self.integrals[index]);
            }
        }
        self.begin(accepted, &trial.rates);
    }

    /// Lanes whose state or slope is not finite.
    #[inline(always)]
    pub fn broken(trial: &Trial<R, N>) -> u64 {
        let limit = R::Plain::splat(f64::MAX);
        let mut fine = trial.state[0].plain().abs().le(limit);
        for index in 0..N {
            let slope = trial.rates.slope[index].plain();
            fine = fine & trial.state[index].plain().abs().le(limit) & slope.abs().le(limit);
        }
        (!fine).to_bits() & (u64::MAX >> (64 - R::LANES))
    }
}

/// Numbers without their derivatives.
#[inline(always)]
pub fn plain<R: Real, const N: usize>(numbers: &[R; N]) -> [R::Plain; N] {
    let mut values = [R::Plain::zero(); N];
    for index in 0..N {
        values[index] = numbers[index].plain();
    }
    values
}

//! One step in lanes: its stages.
//!
//! What is rare or large stands in functions of its own: the loop around it stays small enough for the compiler.

use super::Method;
use super::integrals::{INTEGRALS, Integrands};
use super::linear::Linear;
use super::record::DENSE_TERMS;
use super::watch::{Watch, WatchList};
use crate::model::terms::Terms;
use crate::model::{
    CORNERS, Constants, Drivetrain, Energies, Harmonics, Input, Layout, Model, Pieces, Rates, Row, Spring, SpringLaw,
};
use crate::real::{Mask, Real, Task};
use std::marker::PhantomData;

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
    /// Pieces of the laws with corners on which the lanes are, where any law has corners on which steps land.
    pub held: Option<Box<Pieces<R::Plain>>>,
    /// How much was left of the pieces at the start of the step.
    pub(super) margin: R::Plain,
    /// Sizes below which relative accuracy is not asked for.
    pub(super) scales: [f64; N],
    active: usize,
    pub integrands: Integrands,
    /// Integrals since the last mark.
    pub integrals: [R; INTEGRALS],
    pub watch: Watch<R>,
    pub(super) slopes: [[R; N]; SLOPES],
    /// The step last interpolated, as polynomials in the elapsed share.
    pub(super) polynomials: [[R; DENSE_TERMS]; N],
    starting: [R; INTEGRALS],
    pub(super) step_integrals: [R; INTEGRALS],
    pub(super) linear: Option<Box<Linear<R::Plain, N>>>,
}

/// The end of an attempted step.
pub struct Trial<R: Real, const N: usize> {
    pub t: R::Plain,
    pub state: [R; N],
    pub rates: Rates<R, N>,
    /// The least and the most that any stage found left of the pieces.
    pub margins: [R::Plain; 2],
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
pub(super) use unrolled;

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
        // Alone, the torque limit of the controller costs values little and derivatives their accuracy.
        let cornered = R::DIFFERENTIATES || layout.spring == Spring::Piecewise || terms.have_corners();
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
            held: cornered.then(|| Box::new([R::Plain::zero(); CORNERS])),
            margin: R::Plain::zero(),
            scales,
            active: N - unused,
            integrands,
            integrals: [R::zero(); INTEGRALS],
            watch: Watch::new(watched),
            slopes: [[R::zero(); N]; SLOPES],
            polynomials: [[R::zero(); DENSE_TERMS]; N],
            starting: [R::zero(); INTEGRALS],
            step_integrals: [R::zero(); INTEGRALS],
            linear,
        }
    }

    #[inline(always)]
    pub fn drive(&self) -> Drivetrain<'_, R> {
        self.drive_on::<true>()
    }

    /// The drive on the pieces of its laws that are held, or with laws that take no notice of pieces.
    #[inline(always)]
    fn drive_on<const HELD: bool>(&self) -> Drivetrain<'_, R> {
        Drivetrain {
            constants: &self.constants,
            harmonics: &self.harmonics,
            input: &self.input,
            spring: self.spring,
            terms: &self.terms,
            directions: &self.directions,
            pieces: if HELD { self.held.as_deref() } else { None },
        }
    }

    /// How many of the states are in use: the model's own, then those of its terms.
    #[inline(always)]
    pub(super) fn used<M: Model<N>>(&self) -> usize {
        if M::HIDDEN == 0 { N } else { self.active.min(N) }
    }

    /// Puts the lanes on the pieces on which they lie.
    pub fn settle<M: Model<N>>(&mut self, lanes: R::Mask) {
        if self.held.is_some() {
            R::apart(Settle::<R, M, N> { stepper: self, lanes, model: PhantomData });
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
        R::apart(Refresh::<R, M, N> { stepper: self, lanes, model: PhantomData })
    }

    /// Evaluates the derivatives of the first slope anew in the given lanes, where an input bends without a jump.
    pub fn refresh_tangents<M: Model<N>>(&mut self, lanes: R::Mask) {
        R::apart(RefreshTangents::<R, M, N> { stepper: self, lanes, model: PhantomData });
    }

    /// The integrands at the start of the step in one lane.
    pub fn integrands_in(&self, lane: usize) -> [f64; INTEGRALS] {
        std::array::from_fn(|index| self.starting[index].plain().get(lane))
    }

    /// Takes rates as the first slope in the given lanes.
    #[inline(always)]
    fn begin<M: Model<N>, const HELD: bool>(&mut self, lanes: R::Mask, rates: &Rates<R, N>) {
        for index in 0..self.used::<M>() {
            self.slopes[0][index] = R::select(lanes, rates.slope[index], self.slopes[0][index]);
        }
        self.windup = R::select(lanes, rates.windup, self.windup);
        if HELD && self.held.is_some() {
            self.margin = R::Plain::select(lanes, rates.margin, self.margin);
        }
        self.watch.begin(lanes, rates, &self.constants);
        if self.integrands.any() {
            let mut values = [R::zero(); INTEGRALS];
            self.integrands.add(R::splat(1.0), rates, &self.constants, &mut values);
            for index in 0..INTEGRALS {
                self.starting[index] = R::select(lanes, values[index], self.starting[index]);
            }
        }
    }

    /// Runs the stages of one step, on the pieces of the laws that are held where there are any.
    #[inline(always)]
    pub fn attempt<M: Model<N>, T: Method, const HELD: bool>(&mut self, step: R::Plain) -> Trial<R, N> {
        let weights = T::COUPLING[T::STAGES - 1];
        if let Some(method) = &T::ROSENBROCK {
            self.linearise::<M>(method, step);
        }
        if self.integrands.any() {
            for index in 0..INTEGRALS {
                self.step_integrals[index] = self.starting[index] * R::splat(weights[0]);
            }
        }
        let mut margins = if HELD { [f64::INFINITY, f64::NEG_INFINITY] } else { [0.0; 2] }.map(R::Plain::splat);
        let mut stage = 1;
        loop {
            let state = self.stage_state::<M, T>(stage, step);
            let t = self.stage_time::<T>(stage, step);
            let rates = M::rates(&self.drive_on::<HELD>(), R::constant(t), &state);
            self.slopes[stage] = rates.slope;
            if HELD && self.held.is_some() {
                margins = [margins[0].min(rates.margin), margins[1].max(rates.margin)];
            }
            if stage == T::STAGES - 1 {
                if T::ROSENBROCK.is_some() && self.integrands.any() {
                    self.integrate::<M, T>(step);
                }
                return Trial { t, state, rates, margins };
            }
            if let Some(method) = &T::ROSENBROCK {
                self.solve_stage::<M>(method, stage, step);
            } else if self.integrands.any() && weights[stage] != 0.0 {
                let weight = R::splat(weights[stage]);
                self.integrands.add(weight, &rates, &self.constants, &mut self.step_integrals);
            }
            stage += 1;
        }
    }

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
        if R::DIFFERENTIATES || T::ROSENBROCK.is_some() {
            R::apart(sum);
        } else {
            sum.run();
        }
        state
    }

    /// `step` times the sum of the slopes with these weights, added to the state. The model's own states are summed side
    /// by side, those of terms, few of which are in use, one after the other.
    #[inline(always)]
    fn combine<M: Model<N>>(&self, weights: &[f64], step: R::Plain) -> [R; N] {
        let own = N - M::HIDDEN;
        let mut sums = [R::zero(); N];
        unrolled!(J => {
            if let Some(&weight) = weights.get(J) && weight != 0.0 {
                for index in 0..own {
                    sums[index] = self.slopes[J][index].mul_add_plain(R::Plain::splat(weight), sums[index]);
                }
            }
        });
        let mut state = self.state;
        for index in 0..own {
            state[index] = sums[index].mul_add_plain(step, state[index]);
        }
        for index in own..self.used::<M>() {
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

    /// Takes the attempted step in the accepted lanes.
    #[inline(always)]
    pub fn commit<M: Model<N>, const HELD: bool>(&mut self, accepted: R::Mask, step: R::Plain, trial: &Trial<R, N>) {
        self.t = R::Plain::select(accepted, trial.t, self.t);
        for index in 0..self.used::<M>() {
            self.state[index] = R::select(accepted, trial.state[index], self.state[index]);
        }
        if self.integrands.any() {
            for index in 0..INTEGRALS {
                let grown = self.step_integrals[index].mul_add_plain(step, self.integrals[index]);
                self.integrals[index] = R::select(accepted, grown, self.integrals[index]);
            }
        }
        self.begin::<M, HELD>(accepted, &trial.rates);
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

struct Refresh<'a, R: Real, M, const N: usize> {
    stepper: &'a mut Stepper<R, N>,
    lanes: R::Mask,
    model: PhantomData<M>,
}

impl<R: Real, M: Model<N>, const N: usize> Task for Refresh<'_, R, M, N> {
    type Output = Rates<R, N>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { stepper, lanes, .. } = self;
        let rates = stepper.rates::<M>(R::constant(stepper.t), &stepper.state);
        stepper.begin::<M, true>(lanes, &rates);
        rates
    }
}

struct Settle<'a, R: Real, M, const N: usize> {
    stepper: &'a mut Stepper<R, N>,
    lanes: R::Mask,
    model: PhantomData<M>,
}

impl<R: Real, M: Model<N>, const N: usize> Task for Settle<'_, R, M, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { stepper, lanes, .. } = self;
        let found = M::corners(&stepper.drive_on::<false>(), R::constant(stepper.t), &stepper.state);
        for (piece, own) in stepper.held.iter_mut().flat_map(|pieces| pieces.iter_mut()).zip(found) {
            *piece = R::Plain::select(lanes, own, *piece);
        }
    }
}

struct RefreshTangents<'a, R: Real, M, const N: usize> {
    stepper: &'a mut Stepper<R, N>,
    lanes: R::Mask,
    model: PhantomData<M>,
}

impl<R: Real, M: Model<N>, const N: usize> Task for RefreshTangents<'_, R, M, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { stepper, lanes, .. } = self;
        let rates = stepper.rates::<M>(R::constant(stepper.t), &stepper.state);
        for index in 0..N {
            renew(lanes, &mut stepper.slopes[0][index], rates.slope[index]);
        }
        let mut values = [R::zero(); INTEGRALS];
        stepper.integrands.add(R::splat(1.0), &rates, &stepper.constants, &mut values);
        for index in 0..INTEGRALS {
            renew(lanes, &mut stepper.starting[index], values[index]);
        }
    }
}

/// Takes over derivatives in the given lanes.
#[inline(always)]
fn renew<R: Real>(lanes: R::Mask, old: &mut R, new: R) {
    *old = R::select(lanes, old.with_tangent(new.tangent()), *old);
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
                *state = stepper.combine::<M>(T::COUPLING[S], step);
            }
        });
    }
}

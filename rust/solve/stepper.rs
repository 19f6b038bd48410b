//! One step in lanes: its stages.
//!
//! What is rare or large stands in functions of its own: the loop around it stays small enough for the compiler.

use super::Method;
use super::integrals::{INTEGRALS, Integrands};
use super::linear::Linear;
use super::record::DENSE_TERMS;
use super::slack::{Course, RESERVES, left};
use super::watch::{Watch, WatchList};
use crate::model::terms::{Terms, at_rest};
use crate::model::{
    CORNERS, Constants, Drivetrain, Energies, Harmonics, Input, Layout, Model, Pieces, Rates, Row, Spring,
};
use crate::real::{Mask, Real};

/// Slopes kept of a step: the largest method has 13 stages and 3 more for its dense output.
const SLOPES: usize = 16;
/// The longest step of a held drive as a share of the period of what acts on it by time alone.
const PERIOD_SHARE: f64 = 0.125;

/// The numbers of all lanes.
pub struct Stepper<R: Real, const N: usize> {
    pub t: R::Plain,
    pub state: [R; N],
    /// Windup at the start of the step: the size against which its error is measured.
    pub windup: R,
    pub constants: Constants<R>,
    pub harmonics: Harmonics<R>,
    pub input: Input<R>,
    pub spring: Spring,
    pub terms: Terms<R>,
    /// Directions in which motor and load slide, 0 where they are held.
    pub directions: [R; 2],
    /// Pieces of the laws with corners on which the lanes are, where any law has corners on which steps land.
    pub held: Option<Box<Pieces<R::Plain>>>,
    /// How much is left of the pieces.
    pub(super) margin: Course<R::Plain>,
    /// What is left before a shaft or a hidden state has its event.
    pub(super) slack: [Course<R::Plain>; RESERVES],
    /// Sizes below which relative accuracy is not asked for.
    pub(super) scales: [f64; N],
    active: usize,
    pub integrands: Integrands,
    /// Integrals since the last mark.
    pub integrals: [R; INTEGRALS],
    pub watch: Watch<R>,
    pub(super) slopes: [[R; N]; SLOPES],
    /// The step last interpolated, as polynomials in the elapsed share: see [`super::record::value_at`].
    pub(super) polynomials: [[R; DENSE_TERMS]; N],
    pub(super) starting: [R; INTEGRALS],
    pub(super) step_integrals: [R; INTEGRALS],
    pub(super) linear: Option<Box<Linear<R::Plain, N>>>,
}

/// The end of an attempted step.
pub struct Trial<R: Real, const N: usize> {
    pub t: R::Plain,
    pub state: [R; N],
    pub rates: Rates<R, N>,
}

impl<R: Real, const N: usize> Stepper<R, N> {
    /// Brings a lane to a time and state.
    pub fn bring(&mut self, lane: usize, t: f64, state: &[R::Lane; N]) {
        self.t.set(lane, t);
        for (lanes, &value) in self.state.iter_mut().zip(state) {
            lanes.set(lane, value);
        }
    }

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
            margin: Course::new(),
            slack: std::array::from_fn(|_| Course::new()),
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
    pub(super) fn drive_on<const HELD: bool>(&self) -> Drivetrain<'_, R> {
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

    #[inline(always)]
    pub fn rates<M: Model<N>>(&self, t: R, state: &[R; N]) -> Rates<R, N> {
        M::rates(&self.drive(), t, state)
    }

    #[inline(always)]
    pub fn energies<M: Model<N>>(&self, t: R, state: &[R; N]) -> Energies<R> {
        M::energies(&self.drive(), t, state)
    }

    /// Runs the stages of one step, on the pieces of the laws that are held where there are any.
    #[inline(always)]
    pub fn attempt<M: Model<N>, T: Method, const HELD: bool>(&mut self, step: R::Plain) -> Trial<R, N> {
        let weights = T::COUPLING[T::STAGES - 1];
        if T::IS_IMPLICIT
            && let Some(method) = &T::ROSENBROCK
        {
            self.linearise::<M>(method, step);
        }
        for index in 0..self.integrands.count() {
            self.step_integrals[index] = self.starting[index] * R::splat(weights[0]);
        }
        if HELD {
            self.margin.forget();
        }
        if M::STICKS {
            self.slack.iter_mut().for_each(Course::forget);
        }
        let mut stage = 1;
        loop {
            let state = self.stage_state::<M, T>(stage, step);
            let t = self.stage_time::<T>(stage, step);
            let rates = M::rates(&self.drive_on::<HELD>(), R::constant(t), &state);
            for index in 0..self.used::<M>() {
                self.slopes[stage][index] = rates.slope[index];
            }
            if HELD && self.held.is_some() {
                self.margin.note(rates.margin);
            }
            if M::STICKS {
                let left = left::<R, M, N>(&self.directions, &state, &rates);
                self.slack.iter_mut().zip(left).for_each(|(course, left)| course.note(left));
            }
            if stage == T::STAGES - 1 {
                if T::IS_IMPLICIT && self.integrands.count() > 0 {
                    self.integrate::<M, T>(step);
                }
                return Trial { t, state, rates };
            }
            if T::IS_IMPLICIT
                && let Some(method) = &T::ROSENBROCK
            {
                self.solve_stage::<M>(method, stage, step);
            } else if self.integrands.count() > 0 && weights[stage] != 0.0 {
                let weight = R::splat(weights[stage]);
                self.integrands.add(weight, &rates, &self.constants, &mut self.step_integrals);
            }
            stage += 1;
        }
    }

    /// Takes the attempted step in the accepted lanes.
    #[inline(always)]
    pub fn commit<M: Model<N>, const HELD: bool>(&mut self, accepted: R::Mask, step: R::Plain, trial: &Trial<R, N>) {
        self.t = R::Plain::select(accepted, trial.t, self.t);
        for index in 0..self.used::<M>() {
            self.state[index] = R::select(accepted, trial.state[index], self.state[index]);
        }
        for index in 0..self.integrands.count() {
            let grown = self.step_integrals[index].mul_add_plain(step, self.integrals[index]);
            self.integrals[index] = R::select(accepted, grown, self.integrals[index]);
        }
        if M::STICKS {
            self.turn_freely::<M>(accepted, &trial.rates);
        }
        self.begin::<M, HELD>(accepted, &trial.rates);
    }

    /// Steps no longer than a part of the period of what acts by time alone, where a shaft is held: at rest nothing else
    /// keeps steps from running over it.
    #[inline(always)]
    pub(super) fn follow_periods<M: Model<N>>(&self, step: R::Plain) -> R::Plain {
        let longest = R::Plain::splat(PERIOD_SHARE) / self.terms.frequency().plain();
        let mut held = R::Mask::from_bits(0);
        for shaft in 0..M::STICKING.len() {
            held = held | at_rest(self.directions[shaft]);
        }
        R::Plain::select(held, step.min(longest), step)
    }

    /// Steps that turn the motor no farther than what acts over a short part of a revolution lets them.
    #[inline(always)]
    pub(super) fn follow_pulses(&self, step: R::Plain) -> R::Plain {
        let Some(reach) = self.terms.reach(self.state[0]) else { return step };
        let reach = reach.plain();
        let (speed, acceleration) = (self.state[1].plain().abs(), self.slopes[0][1].plain().abs());
        let root = speed.mul_add(speed, (acceleration + acceleration) * reach).sqrt();
        ((reach + reach) / (speed + root)).min(step)
    }

    /// Shafts that nothing dry resists turn round without an event.
    #[inline(always)]
    fn turn_freely<M: Model<N>>(&mut self, accepted: R::Mask, rates: &Rates<R, N>) {
        let zero = R::zero();
        for (shaft, &speed) in M::STICKING.iter().enumerate() {
            let direction = self.directions[shaft];
            let turned = (direction * self.state[speed]).lt(zero) & rates.shafts[shaft].breakaway.le(zero);
            self.directions[shaft] = R::select(accepted & turned, -direction, direction);
        }
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

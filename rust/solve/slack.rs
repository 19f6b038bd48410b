//! How much is left before a shaft stops or breaks away, or before hidden states jump.
//!
//! What is used up at the end of a step is plain to see. What is used up and there again before the step ends shows in
//! the stages between: where they come close, the step is looked at in parts.

use crate::model::terms::at_rest;
use crate::model::{Model, Rates};
use crate::real::Real;

/// Motor, load, hidden states that jump.
pub(super) const RESERVES: usize = 3;
/// Place of the hidden states among them; shafts come first.
pub(super) const JUMPS: usize = 2;
/// Stages may straddle the moment at which nothing is left: one that comes as close to it as this share of the range is
/// looked at.
const CLOSE: f64 = 0.25;

/// What is left at one instant: of a shaft that slides its speed, of one that is held the torque that friction could
/// still hold; infinity where there is no dry friction.
#[inline(always)]
pub(super) fn left<R: Real, M: Model<N>, const N: usize>(
    directions: &[R; 2],
    state: &[R; N],
    rates: &Rates<R, N>,
) -> [R::Plain; RESERVES] {
    let mut left = [R::Plain::splat(f64::INFINITY); RESERVES];
    let zero = R::Plain::zero();
    for (shaft, &speed) in M::STICKING.iter().enumerate() {
        let (direction, state) = (directions[shaft].plain(), state[speed].plain());
        let dry = zero.lt(rates.shafts[shaft].breakaway.plain());
        let sliding = R::Plain::select(dry, direction * state, left[shaft]);
        left[shaft] = R::Plain::select(at_rest(direction), rates.shafts[shaft].spare().plain(), sliding);
    }
    left[JUMPS] = rates.reserve.plain();
    left
}

/// What is left of one thing in the course of a step.
pub(super) struct Course<V> {
    /// At its start.
    pub(super) start: V,
    /// The least and the most that any stage found.
    found: [V; 2],
}

impl<V: Real<Plain = V>> Course<V> {
    pub(super) fn new() -> Self {
        Self { start: V::zero(), found: [V::zero(); 2] }
    }

    /// Takes what is left at the start of the next step in the given lanes.
    #[inline(always)]
    pub(super) fn begin(&mut self, lanes: V::Mask, left: V) {
        self.start = V::select(lanes, left, self.start);
    }

    /// Begins another attempt.
    #[inline(always)]
    pub(super) fn forget(&mut self) {
        self.found = [f64::INFINITY, f64::NEG_INFINITY].map(V::splat);
    }

    /// Takes what is left at a stage.
    #[inline(always)]
    pub(super) fn note(&mut self, left: V) {
        let [least, most] = self.found;
        self.found = [least.min(left), most.max(left)];
    }

    /// The least that any stage found.
    #[inline(always)]
    pub(super) fn least(&self) -> V {
        self.found[0]
    }

    /// Lanes that may have used it up and regained it within the step, at whose `end` so much is left; changes within
    /// the `leeway` are none.
    #[inline(always)]
    pub(super) fn dips(&self, end: V, leeway: f64) -> V::Mask {
        let [least, most] = self.found;
        let range = most - least;
        V::splat(leeway).lt(range) & least.lt(self.start.min(end)) & least.lt(range * V::splat(CLOSE))
    }
}

//! Roots inside a step.

use crate::real::{Mask, Real, Scalar};

/// Moves of the root that no longer matter.
const RESOLUTION: f64 = 1e-15;

/// The search for roots in lanes, in each between two places at which the signs of a function differ: false position
/// with the rule of Anderson and Bjorck (BIT 13, 1973).
pub struct Search<V: Real> {
    places: [V; 2],
    values: [V; 2],
    open: V::Mask,
    enough: V,
    left: usize,
}

impl<V: Real<Plain = V>> Search<V> {
    /// Between these places, at which the function has these values; a value of the size `enough` is as good as 0.
    #[inline(always)]
    pub fn new(lanes: V::Mask, places: [V; 2], values: [V; 2], enough: f64) -> Self {
        let enough = V::splat(enough);
        Self { places, values, open: lanes & !values[1].abs().le(enough), enough, left: 60 }
    }

    /// Where the function is wanted next, while anything is open.
    #[inline(always)]
    pub fn next(&mut self) -> Option<V> {
        if self.left == 0 || !self.open.any() {
            return None;
        }
        self.left -= 1;
        let ([a, b], [at_a, at_b]) = (self.places, self.values);
        Some((a * at_b - b * at_a) / (at_b - at_a))
    }

    /// Takes the value at the place last asked for.
    #[inline(always)]
    pub fn take(&mut self, x: V, at_x: V) {
        let Self { places: [a, b], values: [at_a, at_b], open, enough, .. } = self;
        let passed = (at_x * *at_b).lt(V::zero());
        let shrunk = V::splat(1.0) - at_x / *at_b;
        let shrunk = V::select(V::zero().lt(shrunk), shrunk, V::splat(0.5));
        let settled = at_x.abs().le(*enough) | (x - *b).abs().le(V::splat(RESOLUTION));
        *at_a = V::select(*open, V::select(passed, *at_b, *at_a * shrunk), *at_a);
        *a = V::select(*open & passed, *b, *a);
        *b = V::select(*open, x, *b);
        *at_b = V::select(*open, at_x, *at_b);
        *open = *open & !settled;
    }

    /// The roots, as far as they have been found.
    #[inline(always)]
    pub fn found(&self) -> V {
        self.places[1]
    }
}

/// The root of a function on [0, 1] whose ends have opposite signs.
pub fn root(function: impl FnMut(f64) -> f64, at_zero: f64, at_one: f64) -> f64 {
    root_between(function, [0.0, 1.0], [at_zero, at_one])
}

/// The same between two places.
pub fn root_between(mut function: impl FnMut(f64) -> f64, places: [f64; 2], values: [f64; 2]) -> f64 {
    let mut search = Search::new(true, places, values, 0.0);
    while let Some(x) = search.next() {
        search.take(x, function(x));
    }
    search.found()
}

/// A root of a function, with the derivative by which it follows what the function depends on.
pub fn moving<S: Scalar>(mut function: impl FnMut(S) -> S, root: f64) -> S {
    let root = S::splat(root);
    if !S::DIFFERENTIATES {
        return root;
    }
    let (held, along) = (function(root).tangent(), function(root.with_tangent(1.0)).tangent());
    root.with_tangent(-held / (along - held))
}

//! Roots inside a step.

use crate::real::{Mask, Real, Scalar};

/// Moves of the root that no longer matter.
const RESOLUTION: f64 = 1e-15;
/// Parts of a step at whose ends a margin is looked at where it is not simply used up from start to end.
pub const PARTS: usize = 8;

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

/// The root on [0, 1] of a function that ends below zero, and starts above or at it: then the root behind that start.
/// Where it does not rise by `earliest`, that.
pub fn next_root(mut function: impl FnMut(f64) -> f64, at_zero: f64, at_one: f64, earliest: f64) -> f64 {
    if at_zero > 0.0 {
        return root(function, at_zero, at_one);
    }
    let mut place = 0.5;
    while place > earliest {
        let value = function(place);
        if value > 0.0 {
            return root_between(function, [place, 1.0], [value, at_one]);
        }
        place *= 0.5;
    }
    earliest
}

/// Where a margin that may be used up for a moment between 0 and 1 is used up first.
pub fn dip(mut left: impl FnMut(f64) -> f64) -> Option<f64> {
    let samples = std::array::from_fn(|part| left(part as f64 / PARTS as f64));
    used_up(&samples, left, 0.0)
}

/// Where a margin is used up first, from its values at the ends of equal parts of the step.
pub fn used_up(samples: &[f64; PARTS + 1], mut left: impl FnMut(f64) -> f64, enough: f64) -> Option<f64> {
    let place = |part: usize| part as f64 / PARTS as f64;
    if let Some(part) = (1..=PARTS).find(|&part| samples[part] < enough) {
        let (mut end, mut at_end) = (place(part), samples[part]);
        if samples[part - 1] > 0.0 {
            return Some(root_between(left, [place(part - 1), end], [samples[part - 1], at_end]));
        }
        // The piece has just been entered: it may be left after a moment, or at once.
        for _ in 0..20 {
            let middle = 0.5 * (place(part - 1) + end);
            let value = left(middle);
            if value > 0.0 {
                return Some(root_between(left, [middle, end], [value, at_end]));
            }
            (end, at_end) = (middle, value);
        }
        return Some(place(part - 1));
    }
    let lowest = (1..PARTS).min_by(|&one, &other| samples[one].total_cmp(&samples[other]))?;
    let (before, here, after) = (samples[lowest - 1], samples[lowest], samples[lowest + 1]);
    let shift = 0.5 * (before - after) / (before - here + (after - here));
    let inside = shift.abs() <= 1.0;
    if before <= 0.0 || !inside {
        return None;
    }
    let bottom = (lowest as f64 + shift) / PARTS as f64;
    let value = left(bottom);
    (value < enough).then(|| root_between(left, [place(lowest - 1), bottom], [before, value]))
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

#[cfg(test)]
mod tests {
    use super::{Search, next_root, root};
    use crate::real::{Mask, Pair, Real};

    const ROOTS: [f64; 4] = [1e-7, 0.2, 0.5, 0.93];

    #[test]
    fn against_logarithms_from_few_values() {
        for exact in ROOTS {
            let mut asked = 0;
            let excess = |x: f64| {
                asked += 1;
                x.exp() - exact.exp()
            };
            let found = root(excess, 1.0 - exact.exp(), 1.0_f64.exp() - exact.exp());
            assert!((found - exact).abs() < 1e-15, "{found} against {exact}");
            assert!(asked <= 9, "{asked} values for {exact}");
        }
    }

    #[test]
    fn exact_root_behind_a_start_at_zero() {
        for exact in ROOTS {
            let found = next_root(|x| x * (exact - x), 0.0, exact - 1.0, 1e-9);
            assert!((found - exact).abs() < 1e-15, "{found} against {exact}");
        }
        assert_eq!(next_root(|x| -x, 0.0, -1.0, 1e-9), 1e-9);
    }

    #[test]
    fn exact_same_bits_in_every_lane() {
        for [one, other] in [[ROOTS[0], ROOTS[1]], [ROOTS[2], ROOTS[3]]] {
            let mut squares = Pair::<f64>::zero();
            squares.set(0, one * one);
            squares.set(1, other * other);
            let ends = [Pair::splat(0.0), Pair::splat(1.0)];
            let all = <Pair<f64> as Real>::Mask::from_bits(3);
            let mut search = Search::new(all, ends, ends.map(|x| x * x - squares), 1e-14);
            while let Some(x) = search.next() {
                search.take(x, x * x - squares);
            }
            for (lane, exact) in [one, other].into_iter().enumerate() {
                let mut alone = Search::new(true, [0.0, 1.0], [0.0, 1.0].map(|x| x * x - exact * exact), 1e-14);
                while let Some(x) = alone.next() {
                    alone.take(x, x * x - exact * exact);
                }
                assert_eq!(search.found().get(lane).to_bits(), alone.found().to_bits());
            }
        }
    }
}

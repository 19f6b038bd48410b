//! Roots inside a step.

use crate::real::Scalar;

/// The root of a function on [0, 1] whose ends have opposite signs: false position with the Illinois rule.
pub fn root(mut function: impl FnMut(f64) -> f64, at_zero: f64, at_one: f64) -> f64 {
    let (mut a, mut fa) = (0.0, at_zero);
    let (mut b, mut fb) = (1.0, at_one);
    if fb == 0.0 {
        return 1.0;
    }
    for _ in 0..60 {
        let x = (a * fb - b * fa) / (fb - fa);
        let fx = function(x);
        if fx == 0.0 || (b - x).abs() < 1e-15 {
            return x;
        }
        if (fx > 0.0) == (fb > 0.0) {
            fa *= 0.5;
        } else {
            (a, fa) = (b, fb);
        }
        (b, fb) = (x, fx);
        if (b - a).abs() < 1e-14 {
            break;
        }
    }
    b
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

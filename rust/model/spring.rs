//! The gear spring: torque and stored energy over windup.

use super::Constants;
use super::corners::{Bends, KNEES};
use crate::real::{Mask, Real, Scalar};

/// Which spring law a model has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spring {
    /// Polynomial of order 5 inside +-phi_max, linear with the same tangent beyond.
    Polynomial,
    /// Slopes K1, K2, K3 that change at the torques T1 and T2.
    Piecewise,
}

/// Natural size of a windup [rad].
const SIZE: f64 = 1e-5;

/// Torque at a windup.
#[inline(always)]
pub fn torque<R: Real>(law: Spring, c: &Constants<R>, windup: R) -> R {
    match law {
        Spring::Polynomial => {
            let within = windup.abs().le(c.phi_max);
            if within.all() {
                return polynomial(c, windup);
            }
            let inside = windup.clamp_abs(c.phi_max);
            let value = polynomial(c, inside);
            R::select(within, value, (windup - inside).mul_add(polynomial_tangent(c, inside), value))
        }
        Spring::Piecewise => piecewise(c, windup, windup.clamp_abs(c.phi_1), windup.clamp_abs(c.phi_2)),
    }
}

/// Torque at a windup on the piece of the law that is held.
#[inline(always)]
pub fn held_torque<R: Real>(law: Spring, c: &Constants<R>, windup: R, corners: &mut impl Bends<R>) -> R {
    match law {
        Spring::Polynomial => torque(law, c, windup),
        Spring::Piecewise => {
            let first = corners.clamp(KNEES[0], windup, c.phi_1, SIZE);
            let second = corners.clamp(KNEES[1], windup, c.phi_2, SIZE);
            piecewise(c, windup, first, second)
        }
    }
}

/// Torque of the polynomial law inside its range.
#[inline(always)]
fn polynomial<R: Real>(c: &Constants<R>, x: R) -> R {
    let square = x * x;
    c.k5.mul_add(square, c.k4.mul_add(x, c.k3)).mul_add(square, c.k2.mul_add(x, c.k1)) * x
}

#[inline(always)]
fn piecewise<R: Real>(c: &Constants<R>, windup: R, first: R, second: R) -> R {
    c.k_3.mul_add(windup, c.k_12.mul_add(first, c.k_23 * second))
}

/// Energy stored at a windup, zero when relaxed.
#[inline(always)]
pub fn energy<R: Real>(law: Spring, c: &Constants<R>, windup: R) -> R {
    let half = R::splat(0.5);
    match law {
        Spring::Polynomial => {
            let x = windup.clamp_abs(c.phi_max);
            let beyond = windup - x;
            let over = |k: R, n: f64| k * R::splat(1.0 / n);
            let sum = over(c.k5, 6.0).mul_add(x, over(c.k4, 5.0)).mul_add(x, over(c.k3, 4.0));
            let inside = sum.mul_add(x, over(c.k2, 3.0)).mul_add(x, over(c.k1, 2.0)) * x * x;
            let edge = (half * beyond).mul_add(polynomial_tangent(c, x), torque(law, c, x));
            beyond.mul_add(edge, inside)
        }
        Spring::Piecewise => {
            let size = windup.abs();
            let (first, second) = (size.min(c.phi_1), size.min(c.phi_2));
            let steeper = c.k_12 * first * (size - half * first) + c.k_23 * second * (size - half * second);
            half * c.k_3 * windup * windup + steeper
        }
    }
}

/// Stiffness at a windup.
pub fn tangent<S: Scalar>(law: Spring, c: &Constants<S>, windup: S) -> S {
    match law {
        Spring::Polynomial => polynomial_tangent(c, windup.clamp_abs(c.phi_max)),
        Spring::Piecewise => {
            let inside = |end: S, slope: S| S::select(windup.abs().lt(end), slope, S::zero());
            c.k_3 + inside(c.phi_1, c.k_12) + inside(c.phi_2, c.k_23)
        }
    }
}

/// Whether the tangent is positive everywhere with what terms add to it [N m/rad] at a windup [rad]. That has to be even,
/// and concave and not falling over the square of the windup. Sampled where a polynomial may dip inside its range, else
/// exact.
pub fn is_stiff<S: Scalar>(law: Spring, c: &Constants<S>, added: impl Fn(f64) -> f64) -> bool {
    let stiff = |x: f64| tangent(law, c, S::splat(x)).plain() + added(x) > 0.0;
    if law == Spring::Piecewise {
        return [0.0, c.phi_1.plain(), c.phi_2.plain()].into_iter().all(stiff);
    }
    let [k2, k3, k4, k5, end] = [c.k2, c.k3, c.k4, c.k5, c.phi_max].map(S::plain);
    let odd = k2 == 0.0 && k4 == 0.0;
    if odd && (k3 >= 0.0 || k5 <= 0.0) {
        return stiff(0.0) && stiff(end);
    }
    let vertex = (-0.3 * k3 / k5).sqrt();
    let dips = odd && vertex < end && !stiff(vertex);
    !dips && (0..=256).all(|step| stiff(end * (f64::from(step) / 128.0 - 1.0)))
}

/// The windup at which the spring carries a torque: Newton's method kept inside a bracket, then its derivative.
pub fn windup_at<S: Scalar>(law: Spring, c: &Constants<S>, wanted: S) -> S {
    let mut windup = 0.0;
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for _ in 0..100 {
        let excess = (torque(law, c, S::splat(windup)) - wanted).plain();
        if excess == 0.0 {
            break;
        }
        if excess < 0.0 {
            low = windup;
        } else {
            high = windup;
        }
        let newton = windup - excess / tangent(law, c, S::splat(windup)).plain();
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if next == windup || !next.is_finite() {
            break;
        }
        windup = next;
    }
    let windup = S::splat(windup);
    let excess = torque(law, c, windup) - wanted;
    windup.with_tangent(-excess.tangent() / tangent(law, c, windup).plain())
}

#[inline(always)]
fn polynomial_tangent<R: Real>(c: &Constants<R>, x: R) -> R {
    let weighted = |k: R, n: f64| k * R::splat(n);
    weighted(c.k5, 5.0)
        .mul_add(x, weighted(c.k4, 4.0))
        .mul_add(x, weighted(c.k3, 3.0))
        .mul_add(x, weighted(c.k2, 2.0))
        .mul_add(x, c.k1)
}

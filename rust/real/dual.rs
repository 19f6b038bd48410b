//! A number with its derivative in one direction: forward differentiation of whatever is computed with it.
//!
//! Values are computed by the operations of the plain number, so they have its bits. Comparisons see values only.

use super::{Real, Task};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A value and its derivative.
#[derive(Clone, Copy, Debug)]
pub struct Dual<R> {
    value: R,
    tangent: R,
}

impl<R: Real> Add for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, tangent: self.tangent + other.tangent }
    }
}

impl<R: Real> Sub for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { value: self.value - other.value, tangent: self.tangent - other.tangent }
    }
}

impl<R: Real> Mul for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let tangent = self.value.mul_add(other.tangent, self.tangent * other.value);
        Self { value: self.value * other.value, tangent }
    }
}

impl<R: Real> Div for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self { value, tangent: (-value).mul_add(other.tangent, self.tangent) / other.value }
    }
}

impl<R: Real> Neg for Dual<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { value: -self.value, tangent: -self.tangent }
    }
}

/// Functions of the representation: constant between their jumps.
macro_rules! on_bits {
    ($($method:ident($($argument:ident)?)),*) => {$(
        #[inline(always)]
        fn $method(self $(, $argument: u64)?) -> Self {
            Self { value: self.value.$method($($argument)?), tangent: R::zero() }
        }
    )*};
}

impl<R: Real<Plain = R, Lane = f64>> Real for Dual<R> {
    type Mask = R::Mask;
    type Lane = Dual<f64>;
    type Plain = R;
    const LANES: usize = R::LANES;
    const DIFFERENTIATES: bool = true;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self::constant(R::splat(value))
    }
    #[inline(always)]
    fn get(&self, lane: usize) -> Dual<f64> {
        Dual { value: self.value.get(lane), tangent: self.tangent.get(lane) }
    }
    #[inline(always)]
    fn set(&mut self, lane: usize, value: Dual<f64>) {
        self.value.set(lane, value.value);
        self.tangent.set(lane, value.tangent);
    }
    #[inline(always)]
    fn plain(self) -> R {
        self.value
    }
    #[inline(always)]
    fn constant(values: R) -> Self {
        Self { value: values, tangent: R::zero() }
    }
    #[inline(always)]
    fn tangent(self) -> R {
        self.tangent
    }
    #[inline(always)]
    fn with_tangent(self, tangent: R) -> Self {
        Self { value: self.value, tangent }
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        let tangent = self.tangent.mul_add(factor.value, addend.tangent);
        Self {
            value: self.value.mul_add(factor.value, addend.value),
            tangent: self.value.mul_add(factor.tangent, tangent),
        }
    }
    #[inline(always)]
    fn mul_add_plain(self, factor: R, addend: Self) -> Self {
        Self { value: self.value.mul_add(factor, addend.value), tangent: self.tangent.mul_add(factor, addend.tangent) }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        Self { value, tangent: self.tangent * R::splat(0.5) / value }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        let falling = self.value.lt(R::zero());
        Self { value: self.value.abs(), tangent: R::select(falling, -self.tangent, self.tangent) }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> R::Mask {
        self.value.lt(other.value)
    }
    #[inline(always)]
    fn le(self, other: Self) -> R::Mask {
        self.value.le(other.value)
    }
    #[inline(always)]
    fn select(mask: R::Mask, yes: Self, no: Self) -> Self {
        Self { value: R::select(mask, yes.value, no.value), tangent: R::select(mask, yes.tangent, no.tangent) }
    }
    #[inline(always)]
    fn bit(self, index: u32) -> R::Mask {
        self.value.bit(index)
    }
    on_bits!(and_bits(bits), or_bits(bits), shift_left_52(), shift_right_52());

    #[inline(always)]
    fn apart<W: Task>(task: W) -> W::Output {
        R::apart(task)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sine, cosine) = self.value.sin_cos();
        let tangents = (cosine * self.tangent, -(sine * self.tangent));
        (Self { value: sine, tangent: tangents.0 }, Self { value: cosine, tangent: tangents.1 })
    }
    #[inline(always)]
    fn exp(self) -> Self {
        let value = self.value.exp();
        Self { value, tangent: value * self.tangent }
    }
    #[inline(always)]
    fn ln(self) -> Self {
        Self { value: self.value.ln(), tangent: self.tangent / self.value }
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        let value = self.value.tanh();
        Self { value, tangent: (-value).mul_add(value, R::splat(1.0)) * self.tangent }
    }
    #[inline(always)]
    fn powf(self, exponent: Self) -> Self {
        let (zero, one) = (R::zero(), R::splat(1.0));
        let value = self.value.powf(exponent.value);
        let power = exponent.value;
        let at_zero = R::select(power.le(one), R::select(power.lt(one), R::splat(f64::INFINITY), one), zero);
        let is_zero = self.value.abs().le(zero);
        let slope = R::select(is_zero, at_zero, power * value / self.value);
        let growth = R::select(is_zero, zero, value * self.value.ln());
        Self { value, tangent: slope.mul_add(self.tangent, growth * exponent.tangent) }
    }
}

#[cfg(test)]
mod tests {
    use super::Dual;
    use crate::real::{Real, Scalar};

    fn dual(value: f64, tangent: f64) -> Dual<f64> {
        Dual::splat(value).with_tangent(tangent)
    }

    /// Everything a model may call, in one formula.
    fn formula<S: Scalar>(x: S, y: S) -> S {
        let (sine, cosine) = (x * y).sin_cos();
        let wave = sine.mul_add(y, cosine / x);
        let grown = x.powf(y) + (x * y).exp().ln() * (x - y).tanh();
        let limited = wave.clamp_abs(y).max(x.abs().sqrt()) - (-x).abs().min(y);
        limited + grown.mul_add_plain(0.3, wave)
    }

    #[test]
    fn against_differences() {
        for (x, y) in [(0.7, 1.3), (2.1, 0.4), (0.2, 3.0), (1.7, 1.1)] {
            for (along_x, along_y) in [(1.0, 0.0), (0.0, 1.0), (0.6, -0.8)] {
                let found = formula(dual(x, along_x), dual(y, along_y));
                let at = |h: f64| formula(x + h * along_x, y + h * along_y);
                let h = 1e-3;
                let coarse = (at(2.0 * h) - at(-2.0 * h)) / (4.0 * h);
                let expected = (4.0 * (at(h) - at(-h)) / (2.0 * h) - coarse) / 3.0;
                assert_eq!(found.plain().to_bits(), formula(x, y).to_bits());
                let error = (found.tangent() - expected).abs() / expected.abs().max(1.0);
                assert!(error < 1e-8, "({x}, {y}): {} against {expected}", found.tangent());
            }
        }
    }

    #[test]
    fn exact_powers_at_zero() {
        assert_eq!(dual(0.0, 2.0).powf(Dual::splat(1.0)).tangent(), 2.0);
        assert_eq!(dual(0.0, 2.0).powf(Dual::splat(1.5)).tangent(), 0.0);
    }
}

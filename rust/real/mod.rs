//! The numbers a model may compute with: one `f64`, lanes of them, and either with a derivative.
//!
//! Every operation is IEEE-exact or built from such operations in one fixed order, so a lane and the
//! scalar give the same bits on every CPU.

mod dual;
mod elementary;
mod exponential;
mod mask;
mod pair;
mod path;
mod scalar;
#[cfg(target_arch = "x86_64")]
mod x86;

pub use dual::Dual;
pub use mask::{Mask, lanes_of};
pub use pair::Pair;
pub(crate) use path::compiled;
pub use path::{Path, Task};
#[cfg(target_arch = "x86_64")]
pub use x86::{F64x4, F64x8};

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number, or lanes of numbers that share one instruction stream.
pub trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// The result of a comparison, lane by lane.
    type Mask: Mask;
    /// What stands in one lane.
    type Lane: Scalar;
    /// The same lanes without derivatives: times, steps and errors are such numbers.
    type Plain: Real<Mask = Self::Mask, Lane = f64, Plain = Self::Plain>;
    /// How many independent numbers there are.
    const LANES: usize;
    /// Whether a derivative is carried along.
    const DIFFERENTIATES: bool;

    /// The same number in every lane.
    fn splat(value: f64) -> Self;
    /// The number in one lane.
    fn get(&self, lane: usize) -> Self::Lane;
    /// Replaces the number in one lane.
    fn set(&mut self, lane: usize, value: Self::Lane);
    /// The values without derivatives.
    fn plain(self) -> Self::Plain;
    /// Values whose derivative is zero.
    fn constant(values: Self::Plain) -> Self;
    /// The derivatives; zero where none is carried.
    fn tangent(self) -> Self::Plain;
    /// The same values with other derivatives, where any are carried.
    #[must_use]
    fn with_tangent(self, tangent: Self::Plain) -> Self;
    /// `self * factor + addend`, rounded once.
    fn mul_add(self, factor: Self, addend: Self) -> Self;
    /// The same with a factor that depends on nothing.
    fn mul_add_plain(self, factor: Self::Plain, addend: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// `self < other`; false where either is NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`; false where either is NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// `yes` where the mask is set, `no` elsewhere.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Whether bit `index` of the IEEE representation is set.
    fn bit(self, index: u32) -> Self::Mask;
    /// The IEEE representation and-ed with `bits`.
    fn and_bits(self, bits: u64) -> Self;
    /// The IEEE representation or-ed with `bits`.
    fn or_bits(self, bits: u64) -> Self;
    /// The IEEE representation shifted left by the 52 fraction bits.
    fn shift_left_52(self) -> Self;
    /// The IEEE representation shifted right by the 52 fraction bits.
    fn shift_right_52(self) -> Self;

    /// Runs a task in a function of its own, compiled with the features of the CPU that this number needs: keeps
    /// large code from being repeated wherever it is called.
    fn apart<W: Task>(task: W) -> W::Output;

    /// Zero in every lane.
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }
    /// One lane's number in every lane.
    fn every(one: Self::Lane) -> Self {
        let mut all = Self::zero();
        (0..Self::LANES).for_each(|lane| all.set(lane, one));
        all
    }
    /// The smaller of two numbers, `other` where either is NaN.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(self.lt(other), self, other)
    }
    /// The larger of two numbers, `other` where either is NaN.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(other.lt(self), self, other)
    }
    /// `self` limited to `[-bound, bound]`.
    #[inline(always)]
    fn clamp_abs(self, bound: Self) -> Self {
        self.min(bound).max(-bound)
    }
    /// Sine and cosine; accurate to about 1 ulp for arguments up to 1e9.
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        elementary::sin_cos(self)
    }
    /// e to the power of `self`; accurate to about 1 ulp.
    #[inline(always)]
    #[must_use]
    fn exp(self) -> Self {
        exponential::exp(self)
    }
    /// Natural logarithm; NaN below 0.
    #[inline(always)]
    #[must_use]
    fn ln(self) -> Self {
        exponential::ln(self)
    }
    /// Hyperbolic tangent; accurate to about 2 ulp.
    #[inline(always)]
    #[must_use]
    fn tanh(self) -> Self {
        exponential::tanh(self)
    }
    /// `self` to a power; NaN where `self` is below 0.
    #[inline(always)]
    #[must_use]
    fn powf(self, exponent: Self) -> Self {
        exponential::powf(self, exponent)
    }
    /// Base-2 logarithm of a positive normal number to 1e-5: for step-size control.
    #[inline(always)]
    fn rough_log2(self) -> Self {
        elementary::rough_log2(self)
    }
    /// Two to the power of `self` within ±1000, to 1e-6: for step-size control.
    #[inline(always)]
    fn rough_exp2(self) -> Self {
        elementary::rough_exp2(self)
    }
}

/// A single number.
pub trait Scalar: Real<Mask = bool, Lane = Self, Plain = f64> {}

impl<S: Real<Mask = bool, Lane = S, Plain = f64>> Scalar for S {}

/// What numbers without derivatives make of them.
macro_rules! without_derivative {
    () => {
        type Plain = Self;
        const DIFFERENTIATES: bool = false;

        #[inline(always)]
        fn plain(self) -> Self {
            self
        }
        #[inline(always)]
        fn constant(values: Self) -> Self {
            values
        }
        #[inline(always)]
        fn tangent(self) -> Self {
            Self::zero()
        }
        #[inline(always)]
        fn with_tangent(self, _tangent: Self) -> Self {
            self
        }
        #[inline(always)]
        fn mul_add_plain(self, factor: Self, addend: Self) -> Self {
            self.mul_add(factor, addend)
        }
    };
}
use without_derivative;

//! Two numbers in flight: hides the latency of one vector behind the other. A pair of pairs holds four.
//!
//! No loops: the compiler would have to unroll one for every operation of a kernel.

use super::{Mask, Real, Task, without_derivative};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Two numbers of type `V` computed side by side; `2 * V::LANES` lanes.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct Pair<V>([V; 2]);

/// The mask that belongs to a [`Pair`].
#[derive(Clone, Copy, Debug)]
pub struct PairMask<M>([M; 2]);

macro_rules! binary {
    ($type:ident, $element:ident: $bound:ident, $($operation:ident $method:ident),*) => {$(
        impl<$element: $bound> $operation for $type<$element> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self([self.0[0].$method(other.0[0]), self.0[1].$method(other.0[1])])
            }
        }
    )*};
}
binary!(Pair, V: Real, Add add, Sub sub, Mul mul, Div div);
binary!(PairMask, M: Mask, BitAnd bitand, BitOr bitor);

impl<V: Real> Neg for Pair<V> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self([-self.0[0], -self.0[1]])
    }
}

impl<M: Mask> Not for PairMask<M> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self([!self.0[0], !self.0[1]])
    }
}

impl<M: Mask> Mask for PairMask<M> {
    const WIDTH: usize = 2 * M::WIDTH;

    #[inline(always)]
    fn to_bits(self) -> u64 {
        self.0[0].to_bits() | self.0[1].to_bits() << M::WIDTH
    }
    #[inline(always)]
    fn from_bits(bits: u64) -> Self {
        Self([M::from_bits(bits), M::from_bits(bits >> M::WIDTH)])
    }
}

/// Functions of one number.
macro_rules! each {
    ($($method:ident($($argument:ident)?)),*) => {$(
        #[inline(always)]
        fn $method(self $(, $argument: u64)?) -> Self {
            Self([self.0[0].$method($($argument)?), self.0[1].$method($($argument)?)])
        }
    )*};
}

impl<V: Real<Lane = f64>> Real for Pair<V> {
    type Mask = PairMask<V::Mask>;
    type Lane = f64;
    const LANES: usize = 2 * V::LANES;

    without_derivative!();
    each!(sqrt(), abs(), and_bits(bits), or_bits(bits), shift_left_52(), shift_right_52());

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([V::splat(value); 2])
    }
    #[inline(always)]
    fn get(&self, lane: usize) -> f64 {
        self.0[lane / V::LANES].get(lane % V::LANES)
    }
    #[inline(always)]
    fn set(&mut self, lane: usize, value: f64) {
        self.0[lane / V::LANES].set(lane % V::LANES, value);
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        let ([x, y], [factor_x, factor_y], [addend_x, addend_y]) = (self.0, factor.0, addend.0);
        Self([x.mul_add(factor_x, addend_x), y.mul_add(factor_y, addend_y)])
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self([self.0[0].min(other.0[0]), self.0[1].min(other.0[1])])
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self([self.0[0].max(other.0[0]), self.0[1].max(other.0[1])])
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        PairMask([self.0[0].lt(other.0[0]), self.0[1].lt(other.0[1])])
    }
    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        PairMask([self.0[0].le(other.0[0]), self.0[1].le(other.0[1])])
    }
    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        Self([V::select(mask.0[0], yes.0[0], no.0[0]), V::select(mask.0[1], yes.0[1], no.0[1])])
    }
    #[inline(always)]
    fn bit(self, index: u32) -> Self::Mask {
        PairMask([self.0[0].bit(index), self.0[1].bit(index)])
    }
    #[inline(always)]
    fn apart<W: Task>(task: W) -> W::Output {
        V::apart(task)
    }
}

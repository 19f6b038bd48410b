//! Several vectors in flight: hides the latency of one vector behind the others.

use super::{Mask, Real, Task, without_derivative};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// `K` numbers of type `V` computed side by side; `K * V::LANES` lanes.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct Pack<V, const K: usize>([V; K]);

/// The mask that belongs to a [`Pack`].
#[derive(Clone, Copy, Debug)]
pub struct PackMask<M, const K: usize>([M; K]);

macro_rules! each {
    ($first:ident; $($x:ident = $values:expr),*; $value:expr) => {{
        let mut out = [$first; K];
        for index in 0..K {
            $(let $x = $values[index];)*
            out[index] = $value;
        }
        out
    }};
}

macro_rules! binary {
    ($operation:ident, $method:ident) => {
        impl<V: Real, const K: usize> $operation for Pack<V, K> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let first = self.0[0];
                Pack(each!(first; x = self.0, y = other.0; x.$method(y)))
            }
        }
    };
}
binary!(Add, add);
binary!(Sub, sub);
binary!(Mul, mul);
binary!(Div, div);

impl<V: Real, const K: usize> Neg for Pack<V, K> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let first = self.0[0];
        Pack(each!(first; x = self.0; -x))
    }
}

macro_rules! mask_binary {
    ($operation:ident, $method:ident) => {
        impl<M: Mask, const K: usize> $operation for PackMask<M, K> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let first = self.0[0];
                PackMask(each!(first; x = self.0, y = other.0; x.$method(y)))
            }
        }
    };
}
mask_binary!(BitAnd, bitand);
mask_binary!(BitOr, bitor);

impl<M: Mask, const K: usize> Not for PackMask<M, K> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        let first = self.0[0];
        PackMask(each!(first; x = self.0; !x))
    }
}

impl<M: Mask, const K: usize> Mask for PackMask<M, K> {
    const WIDTH: usize = K * M::WIDTH;

    #[inline(always)]
    fn to_bits(self) -> u64 {
        let mut bits = 0;
        for index in 0..K {
            bits |= self.0[index].to_bits() << (index * M::WIDTH);
        }
        bits
    }
    #[inline(always)]
    fn from_bits(bits: u64) -> Self {
        let mut out = [M::from_bits(bits); K];
        for index in 0..K {
            out[index] = M::from_bits(bits >> (index * M::WIDTH));
        }
        PackMask(out)
    }
}

impl<V: Real<Lane = f64>, const K: usize> Real for Pack<V, K> {
    type Mask = PackMask<V::Mask, K>;
    type Lane = f64;
    const LANES: usize = K * V::LANES;

    without_derivative!();

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Pack([V::splat(value); K])
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
        let first = self.0[0];
        Pack(each!(first; x = self.0, y = factor.0, z = addend.0; x.mul_add(y, z)))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let first = self.0[0];
        Pack(each!(first; x = self.0; x.sqrt()))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        let first = self.0[0];
        Pack(each!(first; x = self.0; x.abs()))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        let first = V::Mask::from_bits(0);
        PackMask(each!(first; x = self.0, y = other.0; x.lt(y)))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        let first = V::Mask::from_bits(0);
        PackMask(each!(first; x = self.0, y = other.0; x.le(y)))
    }
    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        let first = yes.0[0];
        Pack(each!(first; m = mask.0, x = yes.0, y = no.0; V::select(m, x, y)))
    }
    #[inline(always)]
    fn bit(self, index: u32) -> Self::Mask {
        let first = V::Mask::from_bits(0);
        PackMask(each!(first; x = self.0; x.bit(index)))
    }
    #[inline(always)]
    fn apart<W: Task>(task: W) -> W::Output {
        V::apart(task)
    }
    #[inline(always)]
    fn and_bits(self, bits: u64) -> Self {
        let first = self.0[0];
        Pack(each!(first; x = self.0; x.and_bits(bits)))
    }
    #[inline(always)]
    fn or_bits(self, bits: u64) -> Self {
        let first = self.0[0];
        Pack(each!(first; x = self.0; x.or_bits(bits)))
    }
    #[inline(always)]
    fn shift_left_52(self) -> Self {
        let first = self.0[0];
        Pack(each!(first; x = self.0; x.shift_left_52()))
    }
    #[inline(always)]
    fn shift_right_52(self) -> Self {
        let first = self.0[0];
        Pack(each!(first; x = self.0; x.shift_right_52()))
    }
}

//! Results of lane-wise comparisons.

use std::ops::{BitAnd, BitOr, Not};

/// One truth value per lane.
pub trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// How many truth values there are.
    const WIDTH: usize;

    /// The truth values as a bit field, lane 0 in bit 0.
    fn to_bits(self) -> u64;
    /// The inverse of [`Mask::to_bits`].
    fn from_bits(bits: u64) -> Self;

    /// Whether any lane is set.
    #[inline(always)]
    fn any(self) -> bool {
        self.to_bits() != 0
    }
    /// Whether every lane is set.
    #[inline(always)]
    fn all(self) -> bool {
        self.to_bits() == u64::MAX >> (64 - Self::WIDTH)
    }
}

impl Mask for bool {
    const WIDTH: usize = 1;

    #[inline(always)]
    fn to_bits(self) -> u64 {
        u64::from(self)
    }
    #[inline(always)]
    fn from_bits(bits: u64) -> Self {
        bits & 1 == 1
    }
}

/// The positions of the set bits, lowest first.
pub fn lanes_of(mut bits: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        if bits == 0 {
            return None;
        }
        let lane = bits.trailing_zeros() as usize;
        bits &= bits - 1;
        Some(lane)
    })
}

//! `f64` as the one-lane number.

use super::{Real, Task, compiled, without_derivative};

compiled!(plain);
#[cfg(target_arch = "x86_64")]
compiled!(fused, "fma");

impl Real for f64 {
    type Mask = bool;
    type Lane = Self;
    const LANES: usize = 1;

    without_derivative!();

    #[inline(always)]
    fn splat(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn get(&self, _lane: usize) -> f64 {
        *self
    }
    #[inline(always)]
    fn set(&mut self, _lane: usize, value: f64) {
        *self = value;
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        f64::mul_add(self, factor, addend)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn bit(self, index: u32) -> bool {
        self.to_bits() >> index & 1 == 1
    }
    #[inline(always)]
    fn and_bits(self, bits: u64) -> Self {
        f64::from_bits(self.to_bits() & bits)
    }
    #[inline(always)]
    fn or_bits(self, bits: u64) -> Self {
        f64::from_bits(self.to_bits() | bits)
    }
    #[inline(always)]
    fn shift_left_52(self) -> Self {
        f64::from_bits(self.to_bits() << 52)
    }
    #[inline(always)]
    fn shift_right_52(self) -> Self {
        f64::from_bits(self.to_bits() >> 52)
    }
    #[inline(always)]
    fn apart<W: Task>(task: W) -> W::Output {
        #[cfg(target_arch = "x86_64")]
        if std::is_x86_feature_detected!("fma") {
            // SAFETY: the feature was just checked.
            return unsafe { fused::compiled(task) };
        }
        plain::compiled(task)
    }
}

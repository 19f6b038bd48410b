//! The vector registers of x86-64: four lanes with AVX2 and FMA, eight with AVX-512.
//!
//! The intrinsics need CPU features that the surrounding function does not name. Everything here is
//! inlined into a function entered through `batch::dispatch`, which enables those features and is
//! called only where the CPU has them; that is the safety argument of every `unsafe` below.

use super::{Mask, Real, Task, compiled, without_derivative};
#[allow(clippy::wildcard_imports)] // one name per instruction
use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Four lanes in an AVX2 register.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct F64x4(__m256d);

/// Eight lanes in an AVX-512 register.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct F64x8(__m512d);

/// The mask of [`F64x4`]: all bits of a lane set or clear.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct Mask4(__m256d);

/// The mask of [`F64x8`]: one bit per lane.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct Mask8(__mmask8);

macro_rules! arithmetic {
    ($type:ident, $($operation:ident $method:ident $intrinsic:ident),*) => {$(
        impl $operation for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: see the head of this file.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    )*};
}
arithmetic!(F64x4, Add add _mm256_add_pd, Sub sub _mm256_sub_pd, Mul mul _mm256_mul_pd, Div div _mm256_div_pd);
arithmetic!(F64x8, Add add _mm512_add_pd, Sub sub _mm512_sub_pd, Mul mul _mm512_mul_pd, Div div _mm512_div_pd);
arithmetic!(Mask4, BitAnd bitand _mm256_and_pd, BitOr bitor _mm256_or_pd);

impl Neg for F64x4 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: see the head of this file.
        Self(unsafe { _mm256_xor_pd(self.0, _mm256_set1_pd(-0.0)) })
    }
}

impl Neg for F64x8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: see the head of this file.
        Self(unsafe { _mm512_xor_pd(self.0, _mm512_set1_pd(-0.0)) })
    }
}

impl Not for Mask4 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        // SAFETY: see the head of this file.
        Self(unsafe { _mm256_xor_pd(self.0, _mm256_castsi256_pd(_mm256_set1_epi64x(-1))) })
    }
}

impl Mask for Mask4 {
    const WIDTH: usize = 4;

    #[inline(always)]
    fn to_bits(self) -> u64 {
        // SAFETY: see the head of this file.
        unsafe { _mm256_movemask_pd(self.0) as u64 }
    }
    #[inline(always)]
    fn from_bits(bits: u64) -> Self {
        // SAFETY: see the head of this file.
        unsafe {
            let chosen = _mm256_and_si256(_mm256_set1_epi64x(bits as i64), _mm256_setr_epi64x(1, 2, 4, 8));
            Self(_mm256_castsi256_pd(_mm256_cmpeq_epi64(chosen, _mm256_setr_epi64x(1, 2, 4, 8))))
        }
    }
}

impl BitAnd for Mask8 {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for Mask8 {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Not for Mask8 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl Mask for Mask8 {
    const WIDTH: usize = 8;

    #[inline(always)]
    fn to_bits(self) -> u64 {
        u64::from(self.0)
    }
    #[inline(always)]
    fn from_bits(bits: u64) -> Self {
        Self(bits as u8)
    }
}

macro_rules! memory_lanes {
    () => {
        #[inline(always)]
        fn get(&self, lane: usize) -> f64 {
            assert!(lane < Self::LANES);
            // SAFETY: the register is LANES consecutive f64 in memory and the index is checked.
            unsafe { *std::ptr::from_ref(self).cast::<f64>().add(lane) }
        }
        #[inline(always)]
        fn set(&mut self, lane: usize, value: f64) {
            assert!(lane < Self::LANES);
            // SAFETY: the register is LANES consecutive f64 in memory and the index is checked.
            unsafe { *std::ptr::from_mut(self).cast::<f64>().add(lane) = value }
        }
    };
}

compiled!(avx2, "avx2", "fma");
compiled!(avx512, "avx512f", "avx512dq", "avx512vl", "avx2", "fma");

impl Real for F64x4 {
    type Mask = Mask4;
    type Lane = f64;
    const LANES: usize = 4;

    without_derivative!();
    memory_lanes!();

    #[inline(always)]
    fn apart<W: Task>(task: W) -> W::Output {
        // SAFETY: see the head of this file.
        unsafe { avx2::compiled(task) }
    }

    #[inline(always)]
    fn splat(value: f64) -> Self {
        // SAFETY: see the head of this file; likewise below.
        Self(unsafe { _mm256_set1_pd(value) })
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(unsafe { _mm256_fmadd_pd(self.0, factor.0, addend.0) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(unsafe { _mm256_sqrt_pd(self.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.and_bits(!(1 << 63))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(unsafe { _mm256_min_pd(self.0, other.0) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(unsafe { _mm256_max_pd(self.0, other.0) })
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask4 {
        Mask4(unsafe { _mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn le(self, other: Self) -> Mask4 {
        Mask4(unsafe { _mm256_cmp_pd::<_CMP_LE_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn select(mask: Mask4, yes: Self, no: Self) -> Self {
        Self(unsafe { _mm256_blendv_pd(no.0, yes.0, mask.0) })
    }
    #[inline(always)]
    fn bit(self, index: u32) -> Mask4 {
        unsafe {
            let bit = _mm256_set1_epi64x(1 << index);
            let found = _mm256_and_si256(_mm256_castpd_si256(self.0), bit);
            Mask4(_mm256_castsi256_pd(_mm256_cmpeq_epi64(found, bit)))
        }
    }
    #[inline(always)]
    fn and_bits(self, bits: u64) -> Self {
        Self(unsafe { _mm256_and_pd(self.0, _mm256_castsi256_pd(_mm256_set1_epi64x(bits as i64))) })
    }
    #[inline(always)]
    fn or_bits(self, bits: u64) -> Self {
        Self(unsafe { _mm256_or_pd(self.0, _mm256_castsi256_pd(_mm256_set1_epi64x(bits as i64))) })
    }
    #[inline(always)]
    fn shift_left_52(self) -> Self {
        Self(unsafe { _mm256_castsi256_pd(_mm256_slli_epi64::<52>(_mm256_castpd_si256(self.0))) })
    }
    #[inline(always)]
    fn shift_right_52(self) -> Self {
        Self(unsafe { _mm256_castsi256_pd(_mm256_srli_epi64::<52>(_mm256_castpd_si256(self.0))) })
    }
}

impl Real for F64x8 {
    type Mask = Mask8;
    type Lane = f64;
    const LANES: usize = 8;

    without_derivative!();
    memory_lanes!();

    #[inline(always)]
    fn apart<W: Task>(task: W) -> W::Output {
        // SAFETY: see the head of this file.
        unsafe { avx512::compiled(task) }
    }

    #[inline(always)]
    fn splat(value: f64) -> Self {
        // SAFETY: see the head of this file; likewise below.
        Self(unsafe { _mm512_set1_pd(value) })
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(unsafe { _mm512_fmadd_pd(self.0, factor.0, addend.0) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(unsafe { _mm512_sqrt_pd(self.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.and_bits(!(1 << 63))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(unsafe { _mm512_min_pd(self.0, other.0) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(unsafe { _mm512_max_pd(self.0, other.0) })
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask8 {
        Mask8(unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn le(self, other: Self) -> Mask8 {
        Mask8(unsafe { _mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn select(mask: Mask8, yes: Self, no: Self) -> Self {
        Self(unsafe { _mm512_mask_blend_pd(mask.0, no.0, yes.0) })
    }
    #[inline(always)]
    fn bit(self, index: u32) -> Mask8 {
        Mask8(unsafe { _mm512_test_epi64_mask(_mm512_castpd_si512(self.0), _mm512_set1_epi64(1 << index)) })
    }
    #[inline(always)]
    fn and_bits(self, bits: u64) -> Self {
        Self(unsafe { _mm512_and_pd(self.0, _mm512_castsi512_pd(_mm512_set1_epi64(bits as i64))) })
    }
    #[inline(always)]
    fn or_bits(self, bits: u64) -> Self {
        Self(unsafe { _mm512_or_pd(self.0, _mm512_castsi512_pd(_mm512_set1_epi64(bits as i64))) })
    }
    #[inline(always)]
    fn shift_left_52(self) -> Self {
        Self(unsafe { _mm512_castsi512_pd(_mm512_slli_epi64::<52>(_mm512_castpd_si512(self.0))) })
    }
    #[inline(always)]
    fn shift_right_52(self) -> Self {
        Self(unsafe { _mm512_castsi512_pd(_mm512_srli_epi64::<52>(_mm512_castpd_si512(self.0))) })
    }
}

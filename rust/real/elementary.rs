//! Elementary functions from exact operations only, the same bits in every lane and on every CPU.

use super::Real;

/// Adding this rounds to an integer and leaves that integer in the low bits of the representation.
pub(super) const ROUND: f64 = 6755399441055744.0; // 1.5 * 2^52
pub(super) const TWO_52: f64 = 4503599627370496.0;
pub(super) const EXPONENT_BIAS: f64 = 1023.0;
pub(super) const FRACTION_BITS: u64 = 0x000f_ffff_ffff_ffff;
pub(super) const ONE_BITS: u64 = 0x3ff0_0000_0000_0000;

/// pi/2 as a sum of two doubles: with fused multiply-add the product with the quadrant number is exact.
const HALF_PI: [f64; 2] = [std::f64::consts::FRAC_PI_2, 6.123233995736766e-17];

/// Minimax coefficients on [-pi/4, pi/4] of (sin r - r)/r^3 and (cos r - 1 + r^2/2)/r^4 in r^2 (fdlibm).
const SINE: [f64; 6] = [
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
];
const COSINE: [f64; 6] = [
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
];

/// Polynomial with ascending coefficients, two at a time: half the latency of one after the other.
#[inline(always)]
pub(super) fn polynomial<R: Real, const N: usize>(coefficients: &[f64; N], x: R) -> R {
    let square = x * x;
    let mut sum = R::splat(coefficients[N - 1]);
    if N.is_multiple_of(2) {
        sum = sum.mul_add(x, R::splat(coefficients[N - 2]));
    }
    for index in (0..(N - 1) / 2).rev() {
        let pair = R::splat(coefficients[2 * index + 1]).mul_add(x, R::splat(coefficients[2 * index]));
        sum = sum.mul_add(square, pair);
    }
    sum
}

#[inline(always)]
pub fn sin_cos<R: Real>(angle: R) -> (R, R) {
    let shifted = angle.mul_add(R::splat(std::f64::consts::FRAC_2_PI), R::splat(ROUND));
    let quadrant = shifted - R::splat(ROUND);
    let r = quadrant.mul_add(R::splat(-HALF_PI[0]), angle);
    let r = quadrant.mul_add(R::splat(-HALF_PI[1]), r);
    let square = r * r;
    let sine = polynomial(&SINE, square).mul_add(r * square, r);
    let parabola = square.mul_add(R::splat(-0.5), R::splat(1.0));
    let cosine = polynomial(&COSINE, square).mul_add(square * square, parabola);
    let odd = shifted.bit(0);
    let (sine, cosine) = (R::select(odd, cosine, sine), R::select(odd, sine, cosine));
    let next = shifted + R::splat(1.0);
    (R::select(shifted.bit(1), -sine, sine), R::select(next.bit(1), -cosine, cosine))
}

/// log2(1 + x) on [0, 1), Chebyshev fit.
const LOG2: [f64; 7] = [
    2.1237408918128864e-06,
    1.4424753148220593,
    -0.71755787242201,
    0.4555270880605603,
    -0.27462325761631207,
    0.11929823770551487,
    -0.025123203285885562,
];
/// 2^x on [-1/2, 1/2], Chebyshev fit.
const EXP2: [f64; 6] = [
    1.0000000754953497,
    0.6931472067106205,
    0.24022107355830186,
    0.055503272142078036,
    0.00967603709788144,
    0.0013400432165823137,
];

#[inline(always)]
pub fn rough_log2<R: Real>(x: R) -> R {
    let exponent = x.shift_right_52().or_bits(TWO_52.to_bits()) - R::splat(TWO_52 + EXPONENT_BIAS);
    let fraction = x.and_bits(FRACTION_BITS).or_bits(ONE_BITS) - R::splat(1.0);
    polynomial(&LOG2, fraction) + exponent
}

#[inline(always)]
pub fn rough_exp2<R: Real>(x: R) -> R {
    let shifted = x + R::splat(ROUND);
    let whole = shifted - R::splat(ROUND);
    let scale = (whole + R::splat(TWO_52 + EXPONENT_BIAS)).shift_left_52();
    polynomial(&EXP2, x - whole) * scale
}

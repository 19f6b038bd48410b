//! Exponential, logarithm, hyperbolic tangent and power, within a few units in the last place.
//!
//! Arguments are reduced by powers of two, the rest is a short series; no table, no branch on the data.

use super::elementary::{EXPONENT_BIAS, FRACTION_BITS, ONE_BITS, ROUND, TWO_52, polynomial};
use super::{Mask, Real};

const TWO_54: f64 = 18014398509481984.0;

/// ln 2 in two parts; the first has 33 significant bits, so its product with an exponent is exact (fdlibm).
const LN_2: [f64; 2] = [6.93147180369123816490e-01, 1.90821492927058770002e-10];
/// 2/3 as a sum of two doubles.
const TWO_THIRDS: [f64; 2] = [2.0 / 3.0, 3.700743415417188e-17];
/// (ln(1 + f) - 2 s - 2/3 s^3) / s^5 in s^2 with s = f / (2 + f), abs(s) <= 0.1716 (2/5, 2/7, ...).
const LOGARITHM: [f64; 10] = [
    2.0 / 5.0,
    2.0 / 7.0,
    2.0 / 9.0,
    2.0 / 11.0,
    2.0 / 13.0,
    2.0 / 15.0,
    2.0 / 17.0,
    2.0 / 19.0,
    2.0 / 21.0,
    2.0 / 23.0,
];
/// (e^r - 1 - r) / r^2 on [-ln 2 / 2, ln 2 / 2]: 1/2!, 1/3!, ...
const EXPONENTIAL: [f64; 12] = [
    1.0 / 2.0,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5040.0,
    1.0 / 40320.0,
    1.0 / 362880.0,
    1.0 / 3628800.0,
    1.0 / 39916800.0,
    1.0 / 479001600.0,
    1.0 / 6227020800.0,
];

/// Beyond these the exponential overflows, or is zero.
const LARGEST: f64 = 710.0;
const SMALLEST: f64 = -746.0;

/// `x` kept inside the bounds; NaN stays NaN.
#[inline(always)]
fn confined<R: Real>(x: R, low: f64, high: f64) -> R {
    let (low, high) = (R::splat(low), R::splat(high));
    let x = R::select(high.lt(x), high, x);
    R::select(x.lt(low), low, x)
}

/// n and e^r - 1 with `high + low = n ln 2 + r`.
#[inline(always)]
fn reduced_exponential<R: Real>(high: R, low: R) -> (R, R) {
    let n = high.mul_add(R::splat(std::f64::consts::LOG2_E), R::splat(ROUND)) - R::splat(ROUND);
    let r = n.mul_add(R::splat(-LN_2[0]), high);
    let r = n.mul_add(R::splat(-LN_2[1]), r) + low;
    (n, (r * r).mul_add(polynomial(&EXPONENTIAL, r), r))
}

/// Two to the power of a whole number that is the exponent of a normal number.
#[inline(always)]
fn power_of_two<R: Real>(n: R) -> R {
    (n + R::splat(TWO_52 + EXPONENT_BIAS)).shift_left_52()
}

/// e to the power of a sum.
#[inline(always)]
fn exp_of_sum<R: Real>(high: R, low: R) -> R {
    let (n, rest) = reduced_exponential(confined(high, SMALLEST, LARGEST), low);
    let half = n.mul_add(R::splat(0.5), R::splat(ROUND)) - R::splat(ROUND);
    (rest + R::splat(1.0)) * power_of_two(half) * power_of_two(n - half)
}

#[inline(always)]
pub fn exp<R: Real>(x: R) -> R {
    exp_of_sum(x, R::zero())
}

#[inline(always)]
pub fn tanh<R: Real>(x: R) -> R {
    let (n, rest) = reduced_exponential(confined(x.abs() * R::splat(-2.0), -44.0, 0.0), R::zero());
    let scale = power_of_two(n);
    let less_one = scale.mul_add(rest, scale - R::splat(1.0));
    let size = -less_one / (less_one + R::splat(2.0));
    R::select(x.lt(R::zero()), -size, size)
}

/// The logarithm of a positive number as a sum, to about 2^-68.
#[inline(always)]
fn ln_as_sum<R: Real>(x: R) -> (R, R) {
    let one = R::splat(1.0);
    let tiny = x.lt(R::splat(f64::MIN_POSITIVE));
    let x = R::select(tiny, x * R::splat(TWO_54), x);
    let bias = R::select(tiny, R::splat(TWO_52 + EXPONENT_BIAS + 54.0), R::splat(TWO_52 + EXPONENT_BIAS));
    let exponent = x.shift_right_52().or_bits(TWO_52.to_bits()) - bias;
    let mantissa = x.and_bits(FRACTION_BITS).or_bits(ONE_BITS);
    let upper = R::splat(std::f64::consts::SQRT_2).lt(mantissa);
    let n = R::select(upper, exponent + one, exponent);
    let f = R::select(upper, mantissa * R::splat(0.5), mantissa) - one;

    let below = f + R::splat(2.0);
    let below_low = f - (below - R::splat(2.0));
    let s = f / below;
    let s_low = ((-s).mul_add(below, f) - s * below_low) / below;
    let square = s * s;
    let square_low = s.mul_add(s, -square) + (s + s) * s_low;

    let series = square * polynomial(&LOGARITHM, square);
    let factor = series + R::splat(TWO_THIRDS[0]);
    let factor_low = series - (factor - R::splat(TWO_THIRDS[0])) + R::splat(TWO_THIRDS[1]);
    let cubic = square * factor;
    let cubic_low = square.mul_add(factor, -cubic) + square.mul_add(factor_low, square_low * factor);
    let part = s * cubic;
    let part_low = s.mul_add(cubic, -part) + s.mul_add(cubic_low, s_low * cubic);

    let twice = s + s;
    let fraction = twice + part;
    let fraction_low = part - (fraction - twice) + (part_low + (s_low + s_low));
    let whole = n * R::splat(LN_2[0]);
    let high = whole + fraction;
    let carried = high - whole;
    let low = (whole - (high - carried)) + (fraction - carried);
    let low = low + n.mul_add(R::splat(LN_2[1]), fraction_low);
    let sum = high + low;
    (sum, low - (sum - high))
}

#[inline(always)]
pub fn ln<R: Real>(x: R) -> R {
    let zero = R::zero();
    let infinity = R::splat(f64::INFINITY);
    let regular = zero.lt(x) & x.lt(infinity);
    let value = ln_as_sum(x).0;
    if regular.all() {
        return value;
    }
    let limit = R::select(x.le(zero), R::select(x.lt(zero), R::splat(f64::NAN), -infinity), x);
    R::select(regular, value, limit)
}

#[inline(always)]
pub fn powf<R: Real>(x: R, exponent: R) -> R {
    let (zero, one) = (R::zero(), R::splat(1.0));
    let infinity = R::splat(f64::INFINITY);
    let first = exponent.le(one) & one.le(exponent);
    if first.all() {
        return R::select(x.lt(zero), R::splat(f64::NAN), x);
    }
    let (high, low) = ln_as_sum(x);
    let product = exponent * high;
    let product_low = exponent.mul_add(high, -product) + exponent * low;
    let within = product.abs().lt(R::splat(2.0 * LARGEST));
    let value = R::select(first, x, exp_of_sum(product, R::select(within, product_low, zero)));
    let regular = zero.lt(x) & x.lt(infinity);
    if regular.all() {
        return value;
    }
    let end = R::select(zero.lt(exponent), x, R::select(exponent.lt(zero), one / x, one));
    R::select(regular, value, R::select(x.lt(zero), R::splat(f64::NAN), end))
}

#[cfg(test)]
mod tests {
    use crate::real::{Pair, Real};

    type Lanes = Pair<Pair<f64>>;

    /// Difference in units in the last place of the expected number.
    fn ulps(found: f64, expected: f64) -> f64 {
        if found == expected || (found.is_nan() && expected.is_nan()) {
            return 0.0;
        }
        let unit = expected.abs().next_up() - expected.abs();
        ((found - expected) / unit).abs()
    }

    fn assert_close(name: &str, argument: f64, found: f64, expected: f64) {
        let error = ulps(found, expected);
        assert!(error < 4.0, "{name}({argument:e}) = {found:e}, expected {expected:e}: {error} ulp");
    }

    #[test]
    fn against_std_exponential() {
        for step in -150_000..=142_000 {
            let x = 0.005 * f64::from(step) + 1e-4 * f64::from(step % 7);
            assert_close("exp", x, Real::exp(x), x.exp());
        }
        for x in [0.0, -0.0, 1e-300, -1e-17, 709.78, 710.5, -745.1, -746.5, f64::INFINITY, f64::NEG_INFINITY, f64::NAN]
        {
            assert_close("exp", x, Real::exp(x), x.exp());
        }
    }

    #[test]
    fn against_std_logarithm() {
        let mut x = 5e-324_f64;
        while x < 1e308 {
            assert_close("ln", x, Real::ln(x), x.ln());
            x *= 1.0173;
            x = x.next_up();
        }
        for step in 1..200_000 {
            let x = 1e-5 * f64::from(step);
            assert_close("ln", x, Real::ln(x), x.ln());
        }
        for x in [0.0, -1.0, 1.0, f64::MAX, f64::INFINITY, f64::NAN, 1.0_f64.next_up(), 1.0_f64.next_down()] {
            assert_close("ln", x, Real::ln(x), x.ln());
        }
    }

    #[test]
    fn against_std_hyperbolic_tangent() {
        for step in -200_000..=200_000 {
            let x = 1.3e-4 * f64::from(step);
            assert_close("tanh", x, Real::tanh(x), x.tanh());
        }
        for x in [0.0, 1e-300, -3e-9, 22.5, -400.0, 1e300, f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
            assert_close("tanh", x, Real::tanh(x), x.tanh());
        }
    }

    #[test]
    fn against_std_power() {
        for exponent in [-37.0, -2.5, -1.0, -1e-3, 0.0, 0.1, 0.5, 2.0 / 3.0, 1.0, 1.7, 2.0, 3.0, 10.0, 250.0] {
            for step in -4000..4000 {
                let x = (0.0713 * f64::from(step)).exp();
                assert_close(&format!("pow {exponent}"), x, Real::powf(x, exponent), x.powf(exponent));
            }
            for x in [0.0, f64::INFINITY, 1.0] {
                assert_close(&format!("pow {exponent}"), x, Real::powf(x, exponent), x.powf(exponent));
            }
        }
        for step in 1..4000 {
            let x = 0.5 + 2.5e-4 * f64::from(step);
            assert_close("pow 1000", x, Real::powf(x, 1000.0), x.powf(1000.0));
        }
        assert!(Real::powf(-1.0, 2.0).is_nan());
        assert!(Real::powf(-1.0, 1.0).is_nan());
        let lanes = Lanes::splat(0.3).powf(Lanes::splat(1.0));
        assert_eq!(lanes.get(2).to_bits(), 0.3_f64.to_bits());
    }

    #[test]
    fn exact_same_bits_in_every_lane() {
        let values = [0.37, -12.5, 3.0e-9, 41.0];
        let mut lanes = Lanes::zero();
        for (lane, &value) in values.iter().enumerate() {
            lanes.set(lane, value);
        }
        let found = [lanes.exp(), lanes.tanh(), lanes.abs().ln(), lanes.abs().powf(Lanes::splat(0.67))];
        for (lane, &value) in values.iter().enumerate() {
            let alone = [Real::exp(value), Real::tanh(value), Real::ln(value.abs()), Real::powf(value.abs(), 0.67)];
            for (together, alone) in found.iter().zip(alone) {
                assert_eq!(together.get(lane).to_bits(), alone.to_bits());
            }
        }
    }
}

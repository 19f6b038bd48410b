//! The kinematic error and its derivatives with respect to the motor angle.
//!
//! Integer orders up to [`MAX_POLYNOMIAL_ORDER`] are summed as polynomials in c = cos theta:
//! sum a_n cos n theta + b_n sin n theta = P(c) + sin theta Q(c) with P = sum a_n T_n and
//! Q = sum b_n U_(n-1) (Chebyshev polynomials). Value and slope then take four fused
//! multiply-adds per order instead of six by recurrence, in four independent chains.
//! The power basis loses a factor of about (1 + sqrt 2)^n of accuracy, 1e-9 at order 20.
//! Fractional and higher orders are evaluated one by one.

use crate::real::{Real, Scalar, Task};

/// The highest integer order that is summed as a polynomial.
pub const MAX_POLYNOMIAL_ORDER: usize = 20;
const TERMS: usize = MAX_POLYNOMIAL_ORDER + 1;
type Series<S> = [S; TERMS];

/// A kinematic error ready for evaluation.
#[derive(Clone, Debug)]
pub struct Harmonics<R> {
    /// Ascending coefficients of P, Q, P' and R = c Q - (1 - c^2) Q'; the slope is R - sin theta P'.
    value_and_slope: Vec<[R; 4]>,
    /// Ascending coefficients of R' and W = (1 - c^2) P'' - c P'; the curvature is W - sin theta R'.
    curvature: Vec<[R; 2]>,
    /// Order, cosine and sine coefficient of the orders outside the polynomial.
    singles: Vec<(f64, R, R)>,
}

impl<S: Scalar> Harmonics<S> {
    /// From orders and their coefficients [rad].
    pub fn new(orders: &[f64], cosines: &[S], sines: &[S]) -> Self {
        let polynomial = |order: f64| order.fract() == 0.0 && order <= MAX_POLYNOMIAL_ORDER as f64;
        let mut p = [S::zero(); TERMS];
        let mut q = [S::zero(); TERMS];
        let mut singles = Vec::new();
        let mut degree = 0;
        for ((&order, &a), &b) in orders.iter().zip(cosines).zip(sines) {
            if polynomial(order) {
                let n = order as usize;
                degree = degree.max(n);
                add_scaled(&mut p, &FIRST_KIND[n], a);
                add_scaled(&mut q, &SECOND_KIND[n - 1], b);
            } else {
                singles.push((order, a, b));
            }
        }
        let dp = derivative(&p);
        let r = difference(&shifted(&q, 1), &one_minus_square_times(&derivative(&q)));
        let w = difference(&one_minus_square_times(&derivative(&dp)), &shifted(&dp, 1));
        let dr = derivative(&r);
        let terms = if degree == 0 { 0 } else { degree + 1 };
        Self {
            value_and_slope: (0..terms).map(|j| [p[j], q[j], dp[j], r[j]]).collect(),
            curvature: (0..terms).map(|j| [dr[j], w[j]]).collect(),
            singles,
        }
    }
}

impl<R: Real> Harmonics<R> {
    /// The same error with every coefficient converted.
    #[must_use]
    pub fn map<Q>(&self, convert: impl Fn(R) -> Q + Copy) -> Harmonics<Q> {
        Harmonics {
            value_and_slope: self.value_and_slope.iter().map(|c| c.map(convert)).collect(),
            curvature: self.curvature.iter().map(|c| c.map(convert)).collect(),
            singles: self.singles.iter().map(|&(n, a, b)| (n, convert(a), convert(b))).collect(),
        }
    }

    /// Takes over every coefficient of an error with the same orders.
    #[inline(always)]
    pub fn copy_from<Q: Real>(&mut self, other: &Harmonics<Q>, convert: impl Fn(Q) -> R) {
        for (own, other) in self.value_and_slope.iter_mut().zip(&other.value_and_slope) {
            own.iter_mut().zip(other).for_each(|(x, &y)| *x = convert(y));
        }
        for (own, other) in self.curvature.iter_mut().zip(&other.curvature) {
            own.iter_mut().zip(other).for_each(|(x, &y)| *x = convert(y));
        }
        for (own, other) in self.singles.iter_mut().zip(&other.singles) {
            (own.1, own.2) = (convert(other.1), convert(other.2));
        }
    }

    /// The same error in every lane.
    pub fn splat(one: &Harmonics<R::Lane>) -> Self {
        one.map(R::every)
    }

    /// Replaces the error in one lane by `factor` times another with the same orders.
    pub fn set_lane(&mut self, lane: usize, one: &Harmonics<R::Lane>, factor: R::Lane) {
        for (lanes, values) in self.value_and_slope.iter_mut().zip(&one.value_and_slope) {
            for (x, value) in lanes.iter_mut().zip(values) {
                x.set(lane, *value * factor);
            }
        }
        for (lanes, values) in self.curvature.iter_mut().zip(&one.curvature) {
            for (x, value) in lanes.iter_mut().zip(values) {
                x.set(lane, *value * factor);
            }
        }
        for (lanes, values) in self.singles.iter_mut().zip(&one.singles) {
            lanes.1.set(lane, values.1 * factor);
            lanes.2.set(lane, values.2 * factor);
        }
    }

    /// theta_e and its slope at a motor angle.
    #[inline(always)]
    pub fn value_and_slope(&self, angle: R) -> (R, R) {
        let (sine, cosine) = angle.sin_cos();
        let (mut sums, lower) = match self.value_and_slope.as_slice() {
            [lower @ .., [p, q, dp, r], [highest, _, _, steepest]] => {
                ([highest.mul_add(cosine, *p), *q, *dp, steepest.mul_add(cosine, *r)], lower)
            }
            [only] => (*only, &[][..]),
            [] => ([R::zero(); 4], &[][..]),
        };
        for coefficients in lower.iter().rev() {
            for (sum, &coefficient) in sums.iter_mut().zip(coefficients) {
                *sum = sum.mul_add(cosine, coefficient);
            }
        }
        let [p, q, dp, r] = sums;
        let value = sine.mul_add(q, p);
        let slope = (-sine).mul_add(dp, r);
        if self.singles.is_empty() {
            return (value, slope);
        }
        R::apart(AddSingles { singles: &self.singles, angle, value, slope })
    }

    /// The second derivative of theta_e at a motor angle.
    #[inline(always)]
    pub fn curvature(&self, angle: R) -> R {
        let (sine, cosine) = angle.sin_cos();
        let mut sums = [R::zero(); 2];
        for coefficients in self.curvature.iter().rev() {
            for (sum, &coefficient) in sums.iter_mut().zip(coefficients) {
                *sum = sum.mul_add(cosine, coefficient);
            }
        }
        let [dr, w] = sums;
        let mut curvature = (-sine).mul_add(dr, w);
        for &(order, a, b) in &self.singles {
            let order = R::splat(order);
            let (sine, cosine) = (order * angle).sin_cos();
            curvature = curvature - order * order * (a * cosine + b * sine);
        }
        curvature
    }
}

/// Adds the orders that are evaluated one by one to the error and its slope: in the loop around the evaluation, their sines
/// would take registers from the sums of the others.
struct AddSingles<'a, R> {
    singles: &'a [(f64, R, R)],
    angle: R,
    value: R,
    slope: R,
}

impl<R: Real> Task for AddSingles<'_, R> {
    type Output = (R, R);

    #[inline(always)]
    fn run(self) -> (R, R) {
        let Self { singles, angle, mut value, mut slope } = self;
        for &(order, a, b) in singles {
            let order = R::splat(order);
            let (sine, cosine) = (order * angle).sin_cos();
            value = a.mul_add(cosine, b.mul_add(sine, value));
            slope = order.mul_add(b * cosine - a * sine, slope);
        }
        (value, slope)
    }
}

const FIRST_KIND: [Series<f64>; TERMS] = chebyshev(1.0);
const SECOND_KIND: [Series<f64>; TERMS] = chebyshev(2.0);

/// Power-basis coefficients of T_n (`slope` 1) or U_n (`slope` 2); exact integers.
const fn chebyshev(slope: f64) -> [Series<f64>; TERMS] {
    let mut table = [[0.0; TERMS]; TERMS];
    table[0][0] = 1.0;
    table[1][1] = slope;
    let mut n = 2;
    while n < TERMS {
        let mut j = 0;
        while j < TERMS {
            let raised = if j == 0 { 0.0 } else { table[n - 1][j - 1] };
            table[n][j] = 2.0 * raised - table[n - 2][j];
            j += 1;
        }
        n += 1;
    }
    table
}

fn add_scaled<S: Scalar>(sum: &mut Series<S>, series: &Series<f64>, factor: S) {
    for (x, y) in sum.iter_mut().zip(series) {
        *x = *x + S::splat(*y) * factor;
    }
}

fn difference<S: Scalar>(left: &Series<S>, right: &Series<S>) -> Series<S> {
    std::array::from_fn(|j| left[j] - right[j])
}

fn derivative<S: Scalar>(series: &Series<S>) -> Series<S> {
    std::array::from_fn(|j| series.get(j + 1).map_or(S::zero(), |x| S::splat((j + 1) as f64) * *x))
}

fn shifted<S: Scalar>(series: &Series<S>, by: usize) -> Series<S> {
    std::array::from_fn(|j| if j < by { S::zero() } else { series[j - by] })
}

fn one_minus_square_times<S: Scalar>(series: &Series<S>) -> Series<S> {
    difference(series, &shifted(series, 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_sum_of_cosines_and_sines() {
        let orders = [1.0, 2.0, 7.0, 15.0, 20.0, 120.0 / 121.0, 240.0];
        let a = [2e-5, 9e-5, -1e-6, 3e-6, 1e-6, 4e-6, 1e-6];
        let b = [-1e-5, 2e-5, 5e-6, -1e-6, 2e-6, -3e-6, 2e-6];
        let error = Harmonics::new(&orders, &a, &b);
        for step in 0..500 {
            let angle = -40.0 + 0.37 * f64::from(step);
            let (mut value, mut slope, mut curvature) = (0.0, 0.0, 0.0);
            for ((n, a), b) in orders.iter().zip(a).zip(b) {
                let (s, c) = (n * angle).sin_cos();
                value += a * c + b * s;
                slope += n * (b * c - a * s);
                curvature -= n * n * (a * c + b * s);
            }
            let (v, d) = error.value_and_slope(angle);
            assert!((v - value).abs() < 1e-14, "{v} {value}");
            assert!((d - slope).abs() < 1e-12, "{d} {slope}");
            assert!((error.curvature(angle) - curvature).abs() < 1e-10);
        }
    }
}

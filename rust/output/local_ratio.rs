//! The smallest local ratio of the rigid gear over a period of its kinematic error.

use crate::model::Layout;
use crate::real::Scalar;
use crate::solve::{Mark, Retrace, Seat};
use std::f64::consts::TAU;

/// Points per period of the highest order.
const POINTS_PER_PERIOD: f64 = 32.0;
/// Most points. A prime: where the orders ask for more, these fall on ever other phases of all of them.
const MOST_POINTS: f64 = 8191.0;
/// Most revolutions that a period is taken to have.
const MOST_TURNS: u64 = 1000;
/// Peaks of the slope that are looked at closely: the highest.
const PEAKS: usize = 16;
/// Fewer points per period of the highest order do not show the peaks.
const ENOUGH_POINTS: f64 = 6.0;
/// Moves from a point that lies beside its peak.
const MOVES: usize = 32;

/// At the set speed and under the load at the stop.
pub fn smallest<S: Scalar, const N: usize>(layout: &Layout, seat: &Seat<S, N>, retrace: &mut dyn Retrace<S, N>) -> S {
    let load_torque = seat.load_before(seat.time_of(Mark::Off));
    let highest = layout.orders.iter().copied().fold(1.0, f64::max).max(retrace.highest_order());
    let turns = revolutions(layout.orders.iter().copied().chain(retrace.repeat_at())) as f64;
    let points = (POINTS_PER_PERIOD * highest * turns).ceil().min(MOST_POINTS) as usize;
    let spacing = TAU * turns / points as f64;
    let angles: Vec<f64> = (0..points).map(|point| point as f64 * spacing).collect();
    let slopes = retrace.error_slopes(seat, &angles, load_torque);
    let shows_peaks = spacing * highest * ENOUGH_POINTS <= TAU;
    let peak = |point: usize| {
        let (before, here, after) =
            (slopes[(point + points - 1) % points], slopes[point], slopes[(point + 1) % points]);
        let bend = before - 2.0 * here + after;
        let rise = if shows_peaks && bend < 0.0 { (before - after) * (after - before) / (8.0 * bend) } else { 0.0 };
        (here >= before && here >= after).then_some((here + rise, point))
    };
    let mut peaks: Vec<(f64, usize)> = (0..points).filter_map(peak).collect();
    peaks.sort_by(|left, right| right.0.total_cmp(&left.0));
    let slope_at = |angle: S| retrace.error_slope(seat, angle, load_torque);
    let fine = TAU / (POINTS_PER_PERIOD * highest);
    let tops = peaks.iter().take(PEAKS).map(|&(_, point)| top(slope_at, angles[point], fine));
    seat.assignment.row.constants.inverse_ratio - tops.reduce(S::max).unwrap_or(S::splat(f64::NAN))
}

/// The top of the peak beside an angle, by one parabola.
fn top<S: Scalar>(slope_at: impl Fn(S) -> S, mut angle: f64, spacing: f64) -> S {
    let at = |angle: f64| slope_at(S::splat(angle));
    let [mut before, mut here, mut after] = [angle - spacing, angle, angle + spacing].map(at);
    for _ in 0..MOVES {
        if after.plain() > here.plain() {
            angle += spacing;
            [before, here, after] = [here, after, at(angle + spacing)];
        } else if before.plain() > here.plain() {
            angle -= spacing;
            [before, here, after] = [at(angle - spacing), before, here];
        } else {
            break;
        }
    }
    let bend = before - S::splat(2.0) * here + after;
    if bend.plain() >= 0.0 {
        return here;
    }
    slope_at(S::splat(angle) + S::splat(0.5 * spacing) * (before - after) / bend).max(here)
}

/// Revolutions after which all of the orders repeat.
fn revolutions(orders: impl Iterator<Item = f64>) -> u64 {
    let common = |turns: u64, order: f64| {
        let own = denominator(order);
        (turns / common_divisor(turns, own) * own).min(MOST_TURNS)
    };
    orders.fold(1, common)
}

/// The smallest number whose product with an order is whole; the largest where there is none.
fn denominator(order: f64) -> u64 {
    let is_whole = |turns: &u64| {
        let product = order * *turns as f64;
        (product - product.round()).abs() < 1e-6
    };
    (1..MOST_TURNS).find(is_whole).unwrap_or(MOST_TURNS)
}

fn common_divisor(mut left: u64, mut right: u64) -> u64 {
    while right != 0 {
        (left, right) = (right, left % right);
    }
    left
}

#[cfg(test)]
mod tests {
    use super::{revolutions, top};

    #[test]
    fn exact_revolutions_of_a_period() {
        for (orders, turns) in [
            (vec![], 1),
            (vec![1.0, 2.0, 15.0], 1),
            (vec![2.0, 0.5], 2),
            (vec![1.0 / 3.0, 0.25], 12),
            (vec![2.0 - 2.0 / 121.0, 120.0 / 121.0, 10_000.0], 121),
            (vec![2.0_f64.sqrt()], 1000),
        ] {
            assert_eq!(revolutions(orders.iter().copied()), turns, "{orders:?}");
        }
    }

    #[test]
    fn exact_top_of_a_narrow_peak_some_points_away() {
        let slope = |angle: f64| (240.0 * (angle - 0.3)).cos();
        let spacing = std::f64::consts::TAU / (32.0 * 240.0);
        assert!((top(slope, 0.3 + 9.4 * spacing, spacing) - 1.0).abs() < 1e-6);
    }
}

//! Orders of convergence of every method on the two-inertia drive, dense output included.

use super::interpolant::ALL_STATES;
use super::stepper::Stepper;
use super::watch::WATCHED;
use super::{Bs3, Dop853, Dopri5, Integrands, Method, Rodas5p, Tsit5};
use crate::model::terms::Choice;
use crate::model::{Base, Drive, Input, Layout, Line, Row, Segment, Spring, TwoInertia};

const END: f64 = 0.04;
/// Where in the last step the dense output is looked at.
const SHARE: f64 = 0.37;
/// States by number: a position, and a speed.
const TE: usize = 2;
const OMEGA_M: usize = 1;

fn layout() -> Layout {
    Layout {
        base: Base::TwoInertia,
        spring: Spring::Polynomial,
        orders: (1..=15).map(f64::from).collect(),
        terms: Choice::default(),
    }
}

/// A default drive spinning at 60 rad/s under constant torque.
fn stepper<T: Method>() -> Stepper<f64, 5> {
    let layout = layout();
    let labels: Vec<String> = layout.orders.iter().map(ToString::to_string).collect();
    let values: Vec<f64> = layout.parameters(&labels).iter().map(|parameter| parameter.default).collect();
    let row = Row::new(&layout, &values, true).expect("default parameters");
    let harmonics = row.harmonics.clone().expect("own harmonics");
    let segment = Segment {
        start: 0.0,
        drive: Drive::Torque {
            absolute: Line { value: 0.2, slope: 0.0 },
            sustaining: Line::default(),
            holding: Line::default(),
        },
        load: Line { value: 5.0, slope: 0.0 },
        load_set: Line::default(),
    };
    let mut stepper = Stepper::new::<TwoInertia, T>(&layout, &row, &harmonics, Integrands::default(), [false; WATCHED]);
    stepper.input = Input::none();
    stepper.input.set_lane(0, &segment, &row);
    stepper.state = [0.3, 60.0, 2e-4, 0.45, 0.0];
    stepper
}

/// The states at the end and inside the last step, after `steps` equal steps, and the time inside.
fn solve<T: Method>(steps: u32) -> ([f64; 5], [f64; 5], f64) {
    let mut stepper = stepper::<T>();
    let step = END / f64::from(steps);
    stepper.refresh::<TwoInertia>(true);
    for index in 0..steps {
        let trial = stepper.attempt::<TwoInertia, T, false>(step);
        if index + 1 == steps {
            stepper.interpolate::<TwoInertia, T>(step, ALL_STATES);
            let inside = stepper.inside(step, SHARE, ALL_STATES);
            return (trial.state, inside, stepper.t + SHARE * step);
        }
        stepper.commit::<TwoInertia, false>(true, step, &trial);
    }
    unreachable!("at least one step")
}

/// The states at a time, to rounding.
fn exact(t: f64) -> [f64; 5] {
    let mut stepper = stepper::<Dop853>();
    let steps = 400;
    stepper.refresh::<TwoInertia>(true);
    for _ in 0..steps {
        let step = t / f64::from(steps);
        let trial = stepper.attempt::<TwoInertia, Dop853, false>(step);
        stepper.commit::<TwoInertia, false>(true, step, &trial);
    }
    stepper.state
}

/// Least-squares slope of log error over log step.
fn slope(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(step, error)| (step.ln(), error.ln())).collect();
    let n = logs.len() as f64;
    let (mx, my) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    logs.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>() / logs.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>()
}

fn check<T: Method>(state: usize, counts: &[u32]) {
    let at_end = exact(END);
    let mut ends = Vec::new();
    let mut insides = Vec::new();
    for &count in counts {
        let (end, inside, t) = solve::<T>(count);
        let step = END / f64::from(count);
        ends.push((step, (end[state] - at_end[state]).abs()));
        insides.push((step, (inside[state] - exact(t)[state]).abs()));
    }
    let (order, dense) = (slope(&ends), slope(&insides));
    assert!((order - f64::from(T::ORDER)).abs() < 0.2, "{}: order {order}, {ends:?}", T::NAME);
    let nominal = f64::from((T::DENSE_ORDER + 1).min(T::ORDER));
    let approached = if T::DENSE_ORDER < 7 { 0.2 } else { 1.0 }; // the eighth power is still far at these steps
    assert!(dense > nominal - approached, "{}: dense {dense}, {insides:?}", T::NAME);
}

#[test]
fn exact_order_of_bs3() {
    check::<Bs3>(TE, &[400, 800, 1600, 3200]);
}

#[test]
fn exact_order_of_tsit5() {
    check::<Tsit5>(TE, &[160, 240, 320, 480]);
}

#[test]
fn exact_order_of_dopri5() {
    check::<Dopri5>(TE, &[160, 240, 320, 480]);
}

#[test]
fn exact_order_of_dop853() {
    check::<Dop853>(TE, &[28, 34, 42, 52]);
    check::<Dop853>(OMEGA_M, &[28, 34, 42, 52]);
}

#[test]
fn exact_order_of_rodas5p() {
    check::<Rodas5p>(TE, &[80, 120, 160, 240]);
}

/// The weights of the dense output add up to those of the step, and its slope at the start is the first slope.
fn check_tables<T: Method>() {
    let weights = T::COUPLING[T::STAGES - 1];
    for (slope, powers) in T::DENSE.iter().enumerate() {
        let total: f64 = powers.iter().sum();
        let expected = weights.get(slope).copied().unwrap_or(0.0);
        assert!((total - expected).abs() < 1e-12, "{} slope {slope}: {total} against {expected}", T::NAME);
        let initial = powers.first().copied().unwrap_or(0.0);
        assert!((initial - f64::from(slope == 0)).abs() < 1e-12, "{} slope {slope}: initial {initial}", T::NAME);
    }
    for (stage, row) in T::COUPLING.iter().enumerate() {
        let total: f64 = row.iter().sum();
        assert!((total - T::NODES[stage]).abs() < 1e-13, "{} stage {stage}: {total}", T::NAME);
    }
    for weights in [T::ERROR, T::SECOND_ERROR] {
        assert!(weights.iter().sum::<f64>().abs() < 1e-13, "{}: error weights", T::NAME);
    }
}

/// A rooted tree, with the weight of each stage in what the method makes of it.
struct Tree {
    order: usize,
    density: f64,
    weights: Vec<f64>,
}

/// All rooted trees of the stages of a method, by ascending order.
fn trees<T: Method>(most: usize) -> Vec<Tree> {
    let mut found: Vec<Tree> = Vec::new();
    for order in 1..=most {
        for branches in branches(&found, order - 1, found.len()) {
            let mut tree = Tree { order, density: order as f64, weights: vec![1.0; T::STAGES] };
            for branch in branches.iter().map(|&index| &found[index]) {
                tree.density *= branch.density;
                for (stage, weight) in tree.weights.iter_mut().enumerate() {
                    *weight *= T::COUPLING[stage].iter().zip(&branch.weights).map(|(a, b)| a * b).sum::<f64>();
                }
            }
            found.push(tree);
        }
    }
    found
}

/// The ways to choose among the first trees so that their orders add up.
fn branches(trees: &[Tree], order: usize, first: usize) -> Vec<Vec<usize>> {
    if order == 0 {
        return vec![Vec::new()];
    }
    let fitting = (0..first).filter(|&index| trees[index].order <= order);
    let with = |index: usize| {
        let rest = branches(trees, order - trees[index].order, index + 1);
        rest.into_iter().map(move |others| [vec![index], others].concat())
    };
    fitting.flat_map(with).collect()
}

/// Weights of accelerations at the stages meet the conditions of order 7 after every share of a step.
#[test]
fn exact_conditions_of_positions() {
    let trees = trees::<Dop853>(Dop853::DENSE_ORDER as usize - 1);
    assert_eq!(trees.len(), 37);
    for Tree { order, density, weights } in &trees {
        for power in 2..=Dop853::DENSE_ORDER as usize {
            let of = |row: &&[f64]| row.get(power - 2).copied().unwrap_or(0.0);
            let sum: f64 = Dop853::POSITION_DENSE.iter().zip(weights).map(|(row, weight)| of(row) * weight).sum();
            let expected = if power == order + 1 { 1.0 / (power as f64 * density) } else { 0.0 };
            assert!((sum - expected).abs() < 1e-12, "order {order}, power {power}: {sum} against {expected}");
        }
    }
}

/// Steps of a position join in value, slope and curvature.
#[test]
fn exact_ends_of_positions() {
    let weights = Dop853::COUPLING[Dop853::STAGES - 1];
    for (slope, powers) in Dop853::POSITION_DENSE.iter().enumerate() {
        let at_end = |factor: fn(f64) -> f64| -> f64 {
            powers.iter().enumerate().map(|(index, weight)| weight * factor(index as f64 + 2.0)).sum()
        };
        let of = |row: &[f64]| row.get(slope).copied().unwrap_or(0.0);
        let value: f64 = weights.iter().enumerate().map(|(stage, weight)| weight * of(Dop853::COUPLING[stage])).sum();
        let (first, last) = (f64::from(slope == 0), f64::from(slope == Dop853::STAGES - 1));
        assert!((at_end(|_| 1.0) - value).abs() < 1e-12, "slope {slope}: value");
        assert!((at_end(|power| power) - of(weights)).abs() < 1e-12, "slope {slope}: slope");
        assert!((at_end(|power| power * (power - 1.0)) - last).abs() < 1e-11, "slope {slope}: curvature");
        assert!((2.0 * powers.first().copied().unwrap_or(0.0) - first).abs() < 1e-15, "slope {slope}: start");
    }
}

#[test]
fn exact_consistency_of_the_tables() {
    check_tables::<Bs3>();
    check_tables::<Tsit5>();
    check_tables::<Dopri5>();
    check_tables::<Dop853>();
}

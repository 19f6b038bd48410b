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
        drive: Drive::Torque { absolute: Line { value: 0.2, slope: 0.0 }, sustaining: Line::default() },
        load: Line { value: 5.0, slope: 0.0 },
        load_set: Line::default(),
    };
    let mut stepper = Stepper::new::<TwoInertia, T>(&layout, &row, &harmonics, Integrands::default(), [false; WATCHED]);
    stepper.input = Input::none();
    stepper.input.set_lane(0, &segment, &row);
    stepper.state = [0.3, 60.0, 2e-4, 0.45, 0.0];
    stepper
}

/// Te at the end and inside the last step, after `steps` equal steps.
fn solve<T: Method>(steps: u32) -> (f64, f64, f64) {
    let mut stepper = stepper::<T>();
    let step = END / f64::from(steps);
    stepper.refresh::<TwoInertia>(true);
    for index in 0..steps {
        let trial = stepper.attempt::<TwoInertia, T, false>(step);
        if index + 1 == steps {
            stepper.interpolate::<TwoInertia, T>(step, ALL_STATES);
            let inside = stepper.inside(step, SHARE, ALL_STATES)[2];
            return (trial.state[2], inside, stepper.t + SHARE * step);
        }
        stepper.commit::<TwoInertia, false>(true, step, &trial);
    }
    unreachable!("at least one step")
}

/// Te at a time, to rounding.
fn exact(t: f64) -> f64 {
    let mut stepper = stepper::<Dop853>();
    let steps = 400;
    stepper.refresh::<TwoInertia>(true);
    for _ in 0..steps {
        let step = t / f64::from(steps);
        let trial = stepper.attempt::<TwoInertia, Dop853, false>(step);
        stepper.commit::<TwoInertia, false>(true, step, &trial);
    }
    stepper.state[2]
}

/// Least-squares slope of log error over log step.
fn slope(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(step, error)| (step.ln(), error.ln())).collect();
    let n = logs.len() as f64;
    let (mx, my) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    logs.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>() / logs.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>()
}

fn check<T: Method>(counts: &[u32]) {
    let at_end = exact(END);
    let mut ends = Vec::new();
    let mut insides = Vec::new();
    for &count in counts {
        let (end, inside, t) = solve::<T>(count);
        let step = END / f64::from(count);
        ends.push((step, (end - at_end).abs()));
        insides.push((step, (inside - exact(t)).abs()));
    }
    let (order, dense) = (slope(&ends), slope(&insides));
    assert!((order - f64::from(T::ORDER)).abs() < 0.2, "{}: order {order}, {ends:?}", T::NAME);
    let nominal = f64::from((T::DENSE_ORDER + 1).min(T::ORDER));
    let approached = if T::DENSE_ORDER < 7 { 0.2 } else { 1.0 }; // the eighth power is still far at these steps
    assert!(dense > nominal - approached, "{}: dense {dense}, {insides:?}", T::NAME);
}

#[test]
fn exact_order_of_bs3() {
    check::<Bs3>(&[400, 800, 1600, 3200]);
}

#[test]
fn exact_order_of_tsit5() {
    check::<Tsit5>(&[160, 240, 320, 480]);
}

#[test]
fn exact_order_of_dopri5() {
    check::<Dopri5>(&[160, 240, 320, 480]);
}

#[test]
fn exact_order_of_dop853() {
    check::<Dop853>(&[28, 34, 42, 52]);
}

#[test]
fn exact_order_of_rodas5p() {
    check::<Rodas5p>(&[80, 120, 160, 240]);
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

#[test]
fn exact_consistency_of_the_tables() {
    check_tables::<Bs3>();
    check_tables::<Tsit5>();
    check_tables::<Dopri5>();
    check_tables::<Dop853>();
}

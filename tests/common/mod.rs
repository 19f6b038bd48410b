//! The default drive as a sweep of random rows, with everything that may vary as a field.

use hdfast::batch::{Direction, Job, MethodName, Outputs, Progress, SimdPath, StartKind, sweep};
use hdfast::model::terms::Choice;
use hdfast::model::{Base, Drive, Harmonics, Layout, Line, Program, ScenarioColumn, Segment, Signal, Spring};
use hdfast::output::Metric;
use hdfast::solve::{Demand, Integrands, WatchList};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Everything about a sweep that a test may change.
pub struct Problem {
    pub base: Base,
    /// Terms that are on; the rows carry their parameters.
    pub terms: Choice,
    pub rows: Vec<Vec<f64>>,
    pub path: SimdPath,
    pub threads: usize,
    pub method: MethodName,
    pub rtol: f64,
    pub max_steps: u32,
    pub find_stiff: bool,
    pub own_error: bool,
    pub metrics: Vec<Metric>,
    pub signals: Vec<Signal>,
    pub directions: Vec<Direction>,
    /// Panics when this row's parameters are read.
    pub poison: Option<usize>,
}

struct Silent;

impl Progress for Silent {
    fn keep_going(&mut self, _done: usize, _rows: usize) -> bool {
        true
    }
}

/// Parameters of the default drive, with the scenario's.
pub fn layout(base: Base) -> Layout {
    Layout { base, spring: Spring::Polynomial, orders: (1..=15).map(f64::from).collect(), terms: Choice::default() }
}

/// Rows that differ in the drive's inertias, losses and stiffnesses, in error and speed; reproducible.
pub fn random_rows(layout: &Layout, count: usize) -> Vec<Vec<f64>> {
    let labels: Vec<String> = layout.orders.iter().map(ToString::to_string).collect();
    let defaults: Vec<f64> = layout.parameters(&labels).iter().map(|parameter| parameter.default).collect();
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut uniform = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..count)
        .map(|_| {
            let mut row = defaults.clone();
            for value in &mut row[1..=10] {
                *value *= 0.9 + 0.2 * uniform();
            }
            row[layout.te_scale()] = 0.9 + 0.2 * uniform();
            row[layout.scenario(ScenarioColumn::OmegaSet)] = (50.0 + 250.0 * uniform()) * TAU / 60.0;
            row
        })
        .collect()
}

impl Problem {
    pub fn new(rows: Vec<Vec<f64>>) -> Self {
        Self {
            base: Base::TwoInertia,
            terms: Choice::default(),
            rows,
            path: hdfast::batch::paths()[0],
            threads: 1,
            method: MethodName::Dop853,
            rtol: 1e-6,
            max_steps: 100_000,
            find_stiff: false,
            own_error: false,
            metrics: Metric::catalogue().iter().map(|entry| entry.metric).collect(),
            signals: vec![Signal::Te, Signal::OmegaL],
            directions: Vec::new(),
            poison: None,
        }
    }

    pub fn run(&self) -> Outputs {
        let layout = Layout { terms: self.terms.clone(), ..layout(self.base) };
        let parameters = |row: usize, out: &mut [f64]| {
            assert!(self.poison != Some(row), "poisoned row");
            out.copy_from_slice(&self.rows[row]);
        };
        let first = &self.rows[0];
        let count = layout.orders.len();
        let coefficients = &first[layout.te_cos()..];
        let shared = Harmonics::new(&layout.orders, &coefficients[..count], &coefficients[count..2 * count]);
        let mut demand = Demand {
            rtol: self.rtol,
            floor: 1.0,
            max_steps: self.max_steps,
            max_step: f64::INFINITY,
            sampled: Arc::default(),
            integrands: Integrands::default(),
            watched: WatchList::default(),
            extremes: Vec::new(),
            outside: false,
            record: false,
            find_stiff: self.find_stiff,
        };
        self.metrics.iter().for_each(|metric| metric.require(&layout, &mut demand));
        demand.sample(&self.signals, &layout);
        let grid: Arc<[f64]> = (0..=60).map(|k| 0.05 * f64::from(k)).collect();
        let job = Job {
            rows: self.rows.len(),
            parameters: &parameters,
            shared_error: (!self.own_error).then_some(shared),
            programs: vec![Arc::new(program())],
            program_of: &|_| 0,
            start: StartKind::Relaxed,
            initial_state: &|_| None,
            grids: vec![grid],
            grid_of: &|_| 0,
            signals: self.signals.clone(),
            metrics: self.metrics.clone(),
            directions: self.directions.clone(),
            method: self.method,
            demand,
            threads: self.threads,
            path: self.path,
            layout,
        };
        sweep(&job, &mut Silent).0
    }
}

/// Up in half a second, steady, down in half a second, at rest.
fn program() -> Program {
    let segment = |start: f64, value: f64, slope: f64| Segment {
        start,
        drive: Drive::Speed { absolute: Line::default(), set: Line { value, slope }, bumpless: false },
        load: Line::default(),
        load_set: Line::default(),
    };
    Program {
        segments: vec![segment(0.0, 0.0, 2.0), segment(0.5, 1.0, 0.0), segment(2.0, 1.0, -2.0), segment(2.5, 0.0, 0.0)],
        end: 3.0,
        on: 0.0,
        off: 2.0,
        run: None,
        ring_delay: 0.6,
        ring_width: 0.3,
        ring_on_load: false,
    }
}

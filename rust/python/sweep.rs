//! `sweep`: arrays in, arrays out, the interpreter free in between.

use super::program::PyProgram;
use super::refusal::{range, unknown};
use super::tables::{layout_of, method_of, path_in_force};
use hdfast::batch::{Direction, Job, MethodName, Numbers, Outputs, Progress, StartKind, sweep as run};
use hdfast::model::{Base, Harmonics, Layout, Signal};
use hdfast::output::Metric;
use hdfast::solve::{Demand, Integrands, WatchList};
use numpy::ndarray::{ArrayView1, ArrayView2};
use numpy::{IntoPyArray, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;
use std::time::Instant;

/// Asks Python whether to go on, and tells it how far the sweep is.
struct Attendant {
    callback: Option<Py<PyAny>>,
    failure: Option<PyErr>,
    interrupted: bool,
}

impl Progress for Attendant {
    fn keep_going(&mut self, done: usize, rows: usize) -> bool {
        if self.interrupted || self.failure.is_some() {
            return false;
        }
        Python::attach(|py| {
            let told = py.check_signals().and_then(|()| match &self.callback {
                Some(callback) => callback.call1(py, (done, rows)).map(drop),
                None => Ok(()),
            });
            if let Err(error) = told {
                self.interrupted = error.is_instance_of::<PyKeyboardInterrupt>(py);
                self.failure = (!self.interrupted).then_some(error);
            }
        });
        !self.interrupted && self.failure.is_none()
    }
}

/// Runs all rows of a parameter table through one model.
#[pyfunction]
#[pyo3(signature = (*, base, spring, orders, terms, defaults, columns, rows, programs, program_index, initial, initial_state,
    grids, grid_index, signals, metrics, directions, method, find_stiff, rtol, atol, max_steps, max_step, threads, progress))]
#[allow(clippy::too_many_arguments)] // the one boundary: every argument of a sweep
pub fn sweep<'py>(
    py: Python<'py>,
    base: &str,
    spring: &str,
    orders: Vec<f64>,
    terms: Vec<String>,
    defaults: PyReadonlyArray1<'py, f64>,
    columns: Vec<(usize, PyReadonlyArray1<'py, f64>)>,
    rows: usize,
    programs: Vec<PyRef<'py, PyProgram>>,
    program_index: Option<PyReadonlyArray1<'py, u32>>,
    initial: &str,
    initial_state: Option<PyReadonlyArray2<'py, f64>>,
    grids: Vec<PyReadonlyArray1<'py, f64>>,
    grid_index: Option<PyReadonlyArray1<'py, u32>>,
    signals: Vec<String>,
    metrics: Vec<String>,
    directions: Vec<(bool, usize)>,
    method: &str,
    find_stiff: bool,
    rtol: f64,
    atol: f64,
    max_steps: u32,
    max_step: f64,
    threads: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let layout = layout_of(base, spring, orders, &terms)?;
    let defaults: Vec<f64> = defaults.as_array().to_vec();
    if defaults.len() != layout.len() {
        return Err(range("defaults", format!("{} values, allowed {}", defaults.len(), layout.len())));
    }
    for (index, values) in &columns {
        if *index >= layout.len() || values.as_array().len() != rows {
            let length = values.as_array().len();
            return Err(range(
                "columns",
                format!("column {index} of length {length}, allowed 0..{} of length {rows}", layout.len()),
            ));
        }
    }
    let program_index = checked_index("program_index", program_index.as_ref(), rows, programs.len())?;
    let grid_index = checked_index("grid_index", grid_index.as_ref(), rows, grids.len().max(1))?;
    let signals = signals
        .iter()
        .map(|name| Signal::from_name(name).ok_or_else(|| unknown("signal", name)))
        .collect::<PyResult<Vec<_>>>()?;
    let metrics = metrics
        .iter()
        .map(|name| {
            Metric::from_name(name, parse_order).map(|entry| entry.metric).ok_or_else(|| unknown("metric", name))
        })
        .collect::<PyResult<Vec<_>>>()?;
    let mut demand = Demand {
        rtol,
        floor: atol,
        max_steps,
        max_step,
        sampled: Arc::default(),
        integrands: Integrands::default(),
        watched: WatchList::default(),
        extremes: Vec::new(),
        outside: false,
        record: false,
        find_stiff,
    };
    for metric in &metrics {
        metric.require(&layout, &mut demand);
    }
    demand.sample(&signals, &layout);

    let views: Vec<(usize, ArrayView1<'_, f64>)> =
        columns.iter().map(|(index, values)| (*index, values.as_array())).collect();
    let error_columns = layout.te_cos()..layout.te_sin() + layout.orders.len();
    let moved = directions.iter().filter(|(initial, _)| !initial).map(|(_, index)| index);
    let own_error = views.iter().map(|(index, _)| index).chain(moved).any(|index| error_columns.contains(index));
    let count = layout.orders.len();
    let shared_error = (!own_error).then(|| {
        let coefficients = &defaults[layout.te_cos()..];
        Harmonics::new(&layout.orders, &coefficients[..count], &coefficients[count..2 * count])
    });
    let states: Option<ArrayView2<'_, f64>> = initial_state.as_ref().map(|values| values.as_array());
    let full = if layout.base == Base::TwoInertia { 4 } else { 2 };
    if let Some(states) = &states
        && (states.nrows() != rows || !(full..=full + 1).contains(&states.ncols()))
    {
        return Err(range(
            "initial_state",
            format!("shape {:?}, allowed ({rows}, {full}) or ({rows}, {})", states.dim(), full + 1),
        ));
    }
    let ratio = |row: usize| views.iter().find(|(index, _)| *index == 0).map_or(defaults[0], |(_, values)| values[row]);
    let initial_of = |row: usize| states.as_ref().map(|states| start_state(states, row, full, ratio(row)));
    let parameters = |row: usize, out: &mut [f64]| {
        out.copy_from_slice(&defaults);
        for (index, values) in &views {
            out[*index] = values[row];
        }
    };
    let method = method_of(method, &layout)?;
    let directions = directions_of(&directions, &layout, method)?;
    let job = Job {
        layout,
        rows,
        parameters: &parameters,
        shared_error,
        programs: programs.iter().map(|program| program.0.clone()).collect(),
        program_of: &|row| program_index.map_or(0, |index| index[row] as usize),
        start: match initial {
            "relaxed" => StartKind::Relaxed,
            "zero_angle" => StartKind::ZeroAngle,
            _ => return Err(unknown("initial", initial)),
        },
        initial_state: &initial_of,
        grids: grids.iter().map(|grid| Arc::from(grid.as_array().to_vec())).collect(),
        grid_of: &|row| grid_index.map_or(0, |index| index[row] as usize),
        signals,
        metrics,
        directions,
        method,
        demand,
        threads: threads.max(1),
        path: path_in_force()?,
    };
    let mut attendant = Attendant { callback: progress, failure: None, interrupted: false };
    let started = Instant::now();
    let (outputs, _) = py.detach(|| run(&job, &mut attendant));
    if let Some(failure) = attendant.failure {
        return Err(failure);
    }
    let (path, used) = (job.path.name(), job.threads);
    let result = converted(py, outputs, &job)?;
    result.set_item("interrupted", attendant.interrupted)?;
    result.set_item("seconds", started.elapsed().as_secs_f64())?;
    result.set_item("threads", used)?;
    result.set_item("simd", path)?;
    Ok(result)
}

fn checked_index<'a>(
    what: &'static str,
    index: Option<&'a PyReadonlyArray1<'_, u32>>,
    rows: usize,
    choices: usize,
) -> PyResult<Option<ArrayView1<'a, u32>>> {
    let Some(index) = index else { return Ok(None) };
    let view = index.as_array();
    if view.len() != rows || view.iter().any(|choice| *choice as usize >= choices) {
        return Err(range(what, format!("length {}, allowed {rows} values below {choices}", view.len())));
    }
    Ok(Some(view))
}

/// A user's state as theta_m, omega_m, theta_l, omega_l, z.
fn start_state(states: &ArrayView2<'_, f64>, row: usize, full: usize, ratio: f64) -> [f64; 5] {
    let value = |index: usize| states[(row, index)];
    let z = if states.ncols() > full { value(full) } else { 0.0 };
    if full == 4 {
        [value(0), value(1), value(2), value(3), z]
    } else {
        [value(0), value(1), value(0) / ratio, value(1) / ratio, z]
    }
}

/// Positions in the layout, or (with true) in the state at time 0.
fn directions_of(given: &[(bool, usize)], layout: &Layout, method: MethodName) -> PyResult<Vec<Direction>> {
    if !given.is_empty() && !matches!(method, MethodName::Dop853 | MethodName::Rodas5p) {
        return Err(range("method", "allowed with sensitivities: dop853, rodas5p"));
    }
    let checked = |&(initial, index): &(bool, usize)| match initial {
        true if index < 5 => Ok(Direction::Initial(index)),
        false if index < layout.len() => Ok(Direction::Parameter(index)),
        _ => Err(range("directions", format!("{index}, allowed below {}", if initial { 5 } else { layout.len() }))),
    };
    given.iter().map(checked).collect()
}

/// An order as users write it: "2", "1.5" or "120/121".
fn parse_order(label: &str) -> Option<f64> {
    match label.split_once('/') {
        Some((over, under)) => Some(over.parse::<f64>().ok()? / under.parse::<f64>().ok()?),
        None => label.parse().ok(),
    }
    .filter(|order: &f64| order.is_finite())
}

fn converted<'py>(py: Python<'py>, outputs: Outputs, job: &Job) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    let rows = job.rows;
    let put = |name: &str, numbers: Numbers, shape: &[usize]| -> PyResult<()> {
        let shape_error = |error: PyErr| PyValueError::new_err(format!("internal shape: {error}"));
        let values = numbers.values.into_pyarray(py).reshape(shape.to_vec()).map_err(shape_error)?;
        result.set_item(name, values)?;
        let shape: Vec<usize> = shape.iter().copied().chain([job.directions.len()]).collect();
        let tangents = numbers.tangents.into_pyarray(py).reshape(shape).map_err(shape_error)?;
        result.set_item(format!("{name}_sensitivities"), tangents)
    };
    put("metrics", outputs.metrics, &[job.metrics.len(), rows])?;
    put("final_state", outputs.final_state, &[rows, outputs.states])?;
    put("samples", outputs.samples, &[job.signals.len(), rows, outputs.times])?;
    result.set_item("status", outputs.status.into_pyarray(py))?;
    result.set_item("method", outputs.method.into_pyarray(py))?;
    result.set_item("detail", outputs.detail.into_pyarray(py))?;
    result.set_item("steps", outputs.steps.into_pyarray(py))?;
    result.set_item("rejected", outputs.rejected.into_pyarray(py))?;
    result.set_item("time", outputs.time.into_pyarray(py))?;
    Ok(result)
}

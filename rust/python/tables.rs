//! The tables of the core as Python lists and dicts.

use super::refusal::{range, unknown};
use hdfast::batch::{MethodName, SimdPath, lanes_of_path, paths};
use hdfast::model::terms::{Choice, TERMS};
use hdfast::model::{Base, Group, Layout, Signal, Spring};
use hdfast::output::Metric;
use hdfast::solve::{Bs3, Dop853, Dopri5, Method, Rodas5p, Status, Tsit5};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Methods that are built for models with terms.
const WITH_TERMS: [&str; 3] = [Tsit5::NAME, Dop853::NAME, Rodas5p::NAME];

pub(super) fn base_of(name: &str) -> PyResult<Base> {
    Base::ALL.iter().copied().find(|base| base.name() == name).ok_or_else(|| unknown("base", name))
}

pub(super) fn layout_of(base: &str, spring: &str, orders: Vec<f64>, terms: &[String]) -> PyResult<Layout> {
    let base = base_of(base)?;
    let spring = match spring {
        "polynomial" => Spring::Polynomial,
        "piecewise" => Spring::Piecewise,
        _ => return Err(unknown("spring", spring)),
    };
    if let Some(order) = orders.iter().find(|order| !(order.is_finite() && **order > 0.0)) {
        return Err(range("orders", format!("{order} is not a positive number")));
    }
    let terms = Choice::of(terms).map_err(|detail| range("terms", detail))?;
    if let Some(term) = terms.terms().find(|term| !term.bases.contains(&base)) {
        return Err(range("terms", format!("{} with the base {}", term.id, base.name())));
    }
    Ok(Layout { base, spring, orders, terms })
}

pub(super) fn method_of(name: &str, layout: &Layout) -> PyResult<MethodName> {
    if !layout.terms.on.is_empty() && !WITH_TERMS.contains(&name) {
        let detail = format!("'{name}', allowed with terms: {}", WITH_TERMS.join(", "));
        return Err(range("method", detail));
    }
    match name {
        "bs3" => Ok(MethodName::Bs3),
        "tsit5" => Ok(MethodName::Tsit5),
        "dopri5" => Ok(MethodName::Dopri5),
        "dop853" => Ok(MethodName::Dop853),
        "rodas5p" => Ok(MethodName::Rodas5p),
        _ => Err(unknown("method", name)),
    }
}

/// The CPU path in force: `HDFAST_SIMD`, or the fastest one this CPU has.
pub(super) fn path_in_force() -> PyResult<SimdPath> {
    match std::env::var("HDFAST_SIMD") {
        Ok(name) if !name.is_empty() => SimdPath::from_name(&name).ok_or_else(|| {
            let known: Vec<_> = paths().into_iter().map(SimdPath::name).collect();
            range("HDFAST_SIMD", format!("'{name}' is not one of {}", known.join(", ")))
        }),
        _ => Ok(paths()[0]),
    }
}

/// How the core was built and which CPU path it takes.
#[pyfunction]
pub fn build_info(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let path = path_in_force()?;
    let info = PyDict::new(py);
    info.set_item("version", env!("CARGO_PKG_VERSION"))?;
    info.set_item("profile", if cfg!(debug_assertions) { "debug" } else { "release" })?;
    info.set_item("debug", cfg!(debug_assertions))?;
    info.set_item("target", format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS))?;
    info.set_item("simd", path.name())?;
    info.set_item("lanes", lanes_of_path(path))?;
    info.set_item("simd_available", paths().into_iter().map(SimdPath::name).collect::<Vec<_>>())?;
    Ok(info)
}

/// The integration methods.
#[pyfunction]
pub fn methods(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    fn entry<T: Method>(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let item = PyDict::new(py);
        item.set_item("name", T::NAME)?;
        item.set_item("order", T::ORDER)?;
        item.set_item("dense_order", T::DENSE_ORDER)?;
        item.set_item("stages", T::STAGES)?;
        item.set_item("terms", WITH_TERMS.contains(&T::NAME))?;
        Ok(item)
    }
    Ok(vec![entry::<Bs3>(py)?, entry::<Tsit5>(py)?, entry::<Dopri5>(py)?, entry::<Dop853>(py)?, entry::<Rodas5p>(py)?])
}

/// Status codes with names and remedies.
#[pyfunction]
pub fn statuses() -> Vec<(u8, &'static str, &'static str)> {
    Status::ALL.iter().map(|status| (*status as u8, status.name(), status.remedy())).collect()
}

/// The metrics with fixed names.
#[pyfunction]
pub fn metrics(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    Metric::catalogue().iter().map(|entry| named(py, &entry.name, entry.unit, &entry.meaning)).collect()
}

/// The signals that can be sampled.
#[pyfunction]
pub fn signals(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    Signal::ALL.iter().map(|(_, name, unit, meaning)| named(py, name, unit, meaning)).collect()
}

fn named<'py>(py: Python<'py>, name: &str, unit: &str, meaning: &str) -> PyResult<Bound<'py, PyDict>> {
    let item = PyDict::new(py);
    item.set_item("name", name)?;
    item.set_item("unit", unit)?;
    item.set_item("meaning", meaning)?;
    Ok(item)
}

/// The terms beyond the nominal model, in the order in which they act.
#[pyfunction]
pub fn terms(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    TERMS
        .iter()
        .map(|term| {
            let item = PyDict::new(py);
            item.set_item("id", term.id)?;
            item.set_item("place", term.place.name())?;
            item.set_item("bases", term.bases.iter().map(|base| base.name()).collect::<Vec<_>>())?;
            item.set_item("description", term.description)?;
            item.set_item("equation", term.equation)?;
            item.set_item("source", term.source)?;
            item.set_item("amplitude", term.amplitude)?;
            let states: Vec<_> = term.states.iter().map(|state| (state.name, state.unit)).collect();
            item.set_item("states", states)?;
            let parameters = term.parameters.iter().map(|parameter| {
                let entry = named(py, parameter.name, parameter.unit, parameter.meaning)?;
                entry.set_item("symbol", parameter.symbol)?;
                entry.set_item("default", parameter.default)?;
                entry.set_item("low", parameter.plausible.0)?;
                entry.set_item("high", parameter.plausible.1)?;
                entry.set_item("allowed", parameter.allowed)?;
                Ok(entry)
            });
            item.set_item("parameters", parameters.collect::<PyResult<Vec<_>>>()?)?;
            Ok(item)
        })
        .collect()
}

/// The parameters of a model in row order.
#[pyfunction]
pub fn layout<'py>(
    py: Python<'py>,
    base: &str,
    spring: &str,
    orders: Vec<f64>,
    labels: Vec<String>,
    terms: Vec<String>,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    if labels.len() != orders.len() {
        return Err(PyValueError::new_err(format!("{} labels for {} orders", labels.len(), orders.len())));
    }
    let layout = layout_of(base, spring, orders, &terms)?;
    layout
        .parameters(&labels)
        .into_iter()
        .zip(layout.allowed())
        .enumerate()
        .map(|(index, (parameter, allowed))| {
            let item = named(py, &parameter.name, parameter.unit, &parameter.meaning)?;
            item.set_item("symbol", parameter.symbol)?;
            item.set_item("default", parameter.default)?;
            item.set_item("low", parameter.low)?;
            item.set_item("high", parameter.high)?;
            item.set_item("allowed", allowed)?;
            item.set_item("may_be_infinite", layout.may_be_infinite(index))?;
            item.set_item("source", parameter.source)?;
            item.set_item("group", if parameter.group == Group::Drive { "drive" } else { "scenario" })?;
            Ok(item)
        })
        .collect()
}

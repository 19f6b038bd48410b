//! Why a sweep cannot start, as an exception of Python.

use pyo3::PyErr;
use pyo3::exceptions::PyValueError;

/// A name that is not known.
pub fn unknown(what: &str, name: &str) -> PyErr {
    PyValueError::new_err(format!("unknown {what} '{name}'"))
}

/// A value outside its range, with what is allowed.
pub fn range(what: &str, detail: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(format!("{what}: {detail}"))
}

//! The extension module: converts, releases the interpreter, calls one function, converts back.

// The signatures are Python's: arguments arrive by value.
#![allow(clippy::needless_pass_by_value)]

mod program;
mod refusal;
mod sweep;
mod tables;

use pyo3::prelude::*;

/// The compiled core of hdfast.
#[pymodule]
mod _core {
    #[pymodule_export]
    use super::program::PyProgram;
    #[pymodule_export]
    use super::sweep::sweep;
    #[pymodule_export]
    use super::tables::{build_info, layout, methods, metrics, signals, statuses, terms};
}

//! Inputs from Python: rows of 21 numbers per segment.

use super::refusal::range;
use hdfast::model::{Drive, Line, Program, Segment};
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use std::sync::Arc;

const WIDTH: usize = 21;

/// The inputs of a scenario, checked and shared between rows.
#[pyclass(frozen, name = "Program")]
pub struct PyProgram(pub(super) Arc<Program>);

#[pymethods]
impl PyProgram {
    #[new]
    #[pyo3(signature = (segments, t_end, t_on, t_off, t_run, ring_delay, ring_width, ring_on_load))]
    #[allow(clippy::too_many_arguments)] // the phase marks, one by one
    fn new(
        segments: PyReadonlyArray2<'_, f64>,
        t_end: f64,
        t_on: f64,
        t_off: f64,
        t_run: f64,
        ring_delay: f64,
        ring_width: f64,
        ring_on_load: bool,
    ) -> PyResult<Self> {
        let table = segments.as_array();
        if table.ncols() != WIDTH || table.nrows() == 0 {
            return Err(range("segments", format!("shape {:?}, allowed (n, {WIDTH}) with n >= 1", table.dim())));
        }
        let rows: Vec<[f64; WIDTH]> =
            table.rows().into_iter().map(|row| std::array::from_fn(|index| row[index])).collect();
        if let Some(row) = rows.iter().position(|row| row.iter().any(|value| !value.is_finite())) {
            return Err(range("segments", format!("row {row} has a value that is not finite")));
        }
        if rows[0][0] != 0.0 {
            return Err(range("segments", format!("the first starts at {} s, allowed 0", rows[0][0])));
        }
        if let Some(row) = (1..rows.len()).find(|&row| rows[row][0] <= rows[row - 1][0]) {
            return Err(range("segments", format!("row {row} does not start after the one before")));
        }
        if !(t_end.is_finite() && t_end > 0.0) {
            return Err(range("t_end", format!("{t_end} s, allowed above 0")));
        }
        let times = [("t_on", t_on), ("t_off", t_off), ("ring_delay", ring_delay), ("ring_width", ring_width)];
        if let Some((what, value)) = times.into_iter().find(|(_, value)| !value.is_finite() || *value < 0.0) {
            return Err(range(what, format!("{value} s, allowed 0 or more")));
        }
        let segments = rows.iter().map(segment).collect::<PyResult<_>>()?;
        let run = (!t_run.is_nan()).then_some(t_run);
        let program = Program { segments, end: t_end, on: t_on, off: t_off, run, ring_delay, ring_width, ring_on_load };
        Ok(Self(Arc::new(program)))
    }

    fn __len__(&self) -> usize {
        self.0.segments.len()
    }
}

fn segment(row: &[f64; WIDTH]) -> PyResult<Segment> {
    let line = |at: usize| Line { value: row[at], slope: row[at + 1] };
    let drive = match row[1] {
        0.0 => Drive::Torque { absolute: line(3), sustaining: line(5), holding: line(7) },
        1.0 => Drive::Speed { absolute: line(9), set: line(11), bumpless: row[2] != 0.0 },
        2.0 => Drive::Motion { angle: [row[17], row[18], row[19], row[20]], absolute: line(3), sustaining: line(5) },
        kind => return Err(range("segments", format!("kind {kind}, allowed 0, 1, 2"))),
    };
    Ok(Segment { start: row[0], drive, load: line(13), load_set: line(15) })
}

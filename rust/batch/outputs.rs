//! The arrays a sweep fills, row by row and from any thread.

use super::{Job, MethodName};
use crate::model::Base;
use crate::real::Scalar;
use crate::solve::Status;
use std::marker::PhantomData;

/// Numbers of all rows, and their derivatives: `directions` per number, NaN until known.
#[derive(Debug)]
pub struct Numbers {
    /// Values.
    pub values: Vec<f64>,
    /// Derivatives of value `k` from `k * directions` on.
    pub tangents: Vec<f64>,
}

impl Numbers {
    fn new(count: usize, directions: usize) -> Self {
        Self { values: vec![0.0; count], tangents: vec![f64::NAN; count * directions] }
    }
}

/// Results of all rows. Row `m` of metric `k` is at `k * rows + m`; of signal `k` at `(k * rows + m) * times`.
#[derive(Debug)]
pub struct Outputs {
    /// Metrics.
    pub metrics: Numbers,
    /// Last accepted states, `states` per row.
    pub final_state: Numbers,
    /// States per row.
    pub states: usize,
    /// Sampled signals.
    pub samples: Numbers,
    /// Times per signal and row.
    pub times: usize,
    /// Status codes.
    pub status: Vec<u8>,
    /// Methods that ran the rows.
    pub method: Vec<u8>,
    /// Index of the offending parameter, or -1.
    pub detail: Vec<i32>,
    /// Accepted steps.
    pub steps: Vec<u32>,
    /// Rejected attempts.
    pub rejected: Vec<u32>,
    /// Times reached.
    pub time: Vec<f64>,
}

const UNTOUCHED: u8 = u8::MAX;

impl Outputs {
    /// Room for all rows of a job.
    pub fn new(job: &Job) -> Self {
        let rows = job.rows;
        let states = if job.layout.base == Base::TwoInertia { 5 } else { 3 };
        let times = if job.signals.is_empty() { 0 } else { job.longest_grid() };
        let numbers = |count: usize| Numbers::new(count, job.directions.len());
        Self {
            metrics: numbers(job.metrics.len() * rows),
            final_state: numbers(states * rows),
            states,
            samples: numbers(job.signals.len() * rows * times),
            times,
            status: vec![UNTOUCHED; rows],
            method: vec![job.method as u8; rows],
            detail: vec![-1; rows],
            steps: vec![0; rows],
            rejected: vec![0; rows],
            time: vec![0.0; rows],
        }
    }

    /// Marks rows that were never begun or given up, and finished ones some of whose derivatives are missing, with the
    /// reason that `unfinished` gives for them.
    pub fn close(&mut self, unfinished: &[Option<Status>]) {
        let why = |(&status, &unfinished): (&u8, &Option<Status>)| match status {
            UNTOUCHED => unfinished.or(Some(Status::Cancelled)),
            status if status == Status::Finished as u8 => unfinished,
            _ => None,
        };
        let reasons = self.status.iter().zip(unfinished).map(why).enumerate();
        let missing: Vec<_> = reasons.filter_map(|(row, why)| Some((row, why?))).collect();
        let writer = Writer::new(self);
        for (row, status) in missing {
            // SAFETY: single-threaded here, and `row` is in range.
            unsafe { writer.missing(row, status, -1) };
        }
    }
}

/// Where numbers and their derivatives go.
struct Slots {
    values: *mut f64,
    tangents: *mut f64,
    count: usize,
    directions: usize,
}

impl Slots {
    fn new(numbers: &mut Numbers) -> Self {
        let count = numbers.values.len();
        Self {
            values: numbers.values.as_mut_ptr(),
            tangents: numbers.tangents.as_mut_ptr(),
            count,
            directions: numbers.tangents.len().checked_div(count).unwrap_or(0),
        }
    }

    /// Makes a number and its derivatives missing.
    ///
    /// # Safety
    /// No other thread may write the same place.
    unsafe fn clear(&self, index: usize) {
        assert!(index < self.count);
        // SAFETY: in range by the assertion.
        unsafe {
            *self.values.add(index) = f64::NAN;
            (0..self.directions)
                .for_each(|direction| *self.tangents.add(index * self.directions + direction) = f64::NAN);
        }
    }

    /// Writes a number, or of all but the first direction the derivative only.
    ///
    /// # Safety
    /// No other thread may write the same place.
    unsafe fn put<S: Scalar>(&self, index: usize, direction: usize, number: S) {
        assert!(index < self.count && direction < self.directions.max(1));
        let value = number.plain();
        // SAFETY: in range by the assertion.
        unsafe {
            if direction == 0 {
                *self.values.add(index) = value;
            }
            if S::DIFFERENTIATES {
                let tangent = if value.is_nan() { f64::NAN } else { number.tangent() };
                *self.tangents.add(index * self.directions + direction) = tangent;
            }
        }
    }
}

/// Lets several threads fill different rows at the same time.
pub struct Writer<'a> {
    metrics: Slots,
    final_state: Slots,
    states: usize,
    samples: Slots,
    times: usize,
    status: *mut u8,
    method: *mut u8,
    detail: *mut i32,
    steps: *mut u32,
    rejected: *mut u32,
    time: *mut f64,
    rows: usize,
    outputs: PhantomData<&'a mut Outputs>,
}

// SAFETY: every row and direction is written by the one thread that took it from the queue.
unsafe impl Sync for Writer<'_> {}

/// What one row adds to the arrays.
pub struct RowOutput<'a, S> {
    pub metrics: &'a [S],
    pub final_state: &'a [S],
    pub status: Status,
    pub method: MethodName,
    pub steps: u32,
    pub rejected: u32,
    pub time: f64,
}

impl<'a> Writer<'a> {
    pub fn new(outputs: &'a mut Outputs) -> Self {
        Self {
            metrics: Slots::new(&mut outputs.metrics),
            final_state: Slots::new(&mut outputs.final_state),
            states: outputs.states,
            samples: Slots::new(&mut outputs.samples),
            times: outputs.times,
            rows: outputs.status.len(),
            status: outputs.status.as_mut_ptr(),
            method: outputs.method.as_mut_ptr(),
            detail: outputs.detail.as_mut_ptr(),
            steps: outputs.steps.as_mut_ptr(),
            rejected: outputs.rejected.as_mut_ptr(),
            time: outputs.time.as_mut_ptr(),
            outputs: PhantomData,
        }
    }

    /// Writes everything but the samples of a row, as seen from one direction.
    ///
    /// # Safety
    /// No other thread may write the same row and direction.
    pub unsafe fn row<S: Scalar>(&self, row: usize, direction: usize, output: &RowOutput<S>) {
        assert!(row < self.rows);
        // SAFETY: `row` is in range, the slots check theirs.
        unsafe {
            for (index, &value) in output.metrics.iter().enumerate() {
                self.metrics.put(index * self.rows + row, direction, value);
            }
            for (index, &value) in output.final_state.iter().enumerate() {
                self.final_state.put(row * self.states + index, direction, value);
            }
            if direction == 0 {
                *self.method.add(row) = output.method as u8;
                *self.steps.add(row) = output.steps;
                *self.rejected.add(row) = output.rejected;
                *self.time.add(row) = output.time;
                *self.status.add(row) = output.status as u8;
            }
        }
    }

    /// Writes samples of a signal and row from the first place on the grid on.
    ///
    /// # Safety
    /// No other thread may write the same row and direction.
    pub unsafe fn samples<S: Scalar>(
        &self,
        (signal, row): (usize, usize),
        direction: usize,
        values: impl Iterator<Item = S>,
    ) {
        assert!(row < self.rows);
        let first = (signal * self.rows + row) * self.times;
        for (index, value) in (first..first + self.times).zip(values) {
            // SAFETY: by the caller; the slots check the index.
            unsafe { self.samples.put(index, direction, value) };
        }
    }

    /// Writes a row that has no results.
    ///
    /// # Safety
    /// No other thread may write the same row.
    pub unsafe fn missing(&self, row: usize, status: Status, detail: i32) {
        assert!(row < self.rows);
        // SAFETY: as above.
        unsafe {
            for index in (row..self.metrics.count).step_by(self.rows) {
                self.metrics.clear(index);
            }
            for index in row * self.states..(row + 1) * self.states {
                self.final_state.clear(index);
            }
            for block in (row * self.times..self.samples.count).step_by((self.rows * self.times).max(1)) {
                (block..block + self.times).for_each(|index| self.samples.clear(index));
            }
            *self.time.add(row) = f64::NAN;
            *self.detail.add(row) = detail;
            *self.status.add(row) = status as u8;
        }
    }
}

//! The arrays a sweep fills, row by row and from any thread.

use super::Job;
use crate::model::Base;
use crate::solve::Status;
use std::marker::PhantomData;

/// Results of all rows. Row `m` of metric `k` is at `k * rows + m`; of signal `k` at `(k * rows + m) * times`.
#[derive(Debug)]
pub struct Outputs {
    /// Metrics.
    pub metrics: Vec<f64>,
    /// Last accepted states, `states` per row.
    pub final_state: Vec<f64>,
    /// States per row.
    pub states: usize,
    /// Sampled signals.
    pub samples: Vec<f64>,
    /// Times per signal and row.
    pub times: usize,
    /// Status codes.
    pub status: Vec<u8>,
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
        Self {
            metrics: vec![0.0; job.metrics.len() * rows],
            final_state: vec![0.0; states * rows],
            states,
            samples: vec![0.0; job.signals.len() * rows * times],
            times,
            status: vec![UNTOUCHED; rows],
            detail: vec![-1; rows],
            steps: vec![0; rows],
            rejected: vec![0; rows],
            time: vec![0.0; rows],
        }
    }

    /// Marks rows that were never begun.
    pub fn close(&mut self) {
        let rows = self.status.len();
        let writer = Writer::new(self);
        for row in 0..rows {
            // SAFETY: single-threaded here, and `row` is in range.
            unsafe {
                if *writer.status.add(row) == UNTOUCHED {
                    writer.missing(row, Status::Cancelled, -1);
                }
            }
        }
    }
}

/// Lets several threads fill different rows at the same time.
pub struct Writer<'a> {
    metrics: *mut f64,
    metric_count: usize,
    final_state: *mut f64,
    states: usize,
    samples: *mut f64,
    signal_count: usize,
    times: usize,
    status: *mut u8,
    detail: *mut i32,
    steps: *mut u32,
    rejected: *mut u32,
    time: *mut f64,
    rows: usize,
    outputs: PhantomData<&'a mut Outputs>,
}

// SAFETY: every row is written by the one thread that took it from the queue.
unsafe impl Sync for Writer<'_> {}

/// What one row adds to the arrays.
pub struct RowOutput<'a> {
    pub metrics: &'a [f64],
    pub final_state: &'a [f64],
    pub status: Status,
    pub steps: u32,
    pub rejected: u32,
    pub time: f64,
}

impl<'a> Writer<'a> {
    pub fn new(outputs: &'a mut Outputs) -> Self {
        let rows = outputs.status.len();
        let per_row = |length: usize, width: usize| length.checked_div(rows * width).unwrap_or(0);
        Self {
            metric_count: per_row(outputs.metrics.len(), 1),
            signal_count: per_row(outputs.samples.len(), outputs.times),
            metrics: outputs.metrics.as_mut_ptr(),
            final_state: outputs.final_state.as_mut_ptr(),
            states: outputs.states,
            samples: outputs.samples.as_mut_ptr(),
            times: outputs.times,
            status: outputs.status.as_mut_ptr(),
            detail: outputs.detail.as_mut_ptr(),
            steps: outputs.steps.as_mut_ptr(),
            rejected: outputs.rejected.as_mut_ptr(),
            time: outputs.time.as_mut_ptr(),
            rows,
            outputs: PhantomData,
        }
    }

    /// Writes everything but the samples of a row.
    ///
    /// # Safety
    /// No other thread may write the same row.
    pub unsafe fn row(&self, row: usize, output: &RowOutput) {
        assert!(
            row < self.rows && output.final_state.len() == self.states && output.metrics.len() == self.metric_count
        );
        // SAFETY: indices are in range by the assertion and the layout of `Outputs`.
        unsafe {
            for (index, &value) in output.metrics.iter().enumerate() {
                *self.metrics.add(index * self.rows + row) = value;
            }
            for (index, &value) in output.final_state.iter().enumerate() {
                *self.final_state.add(row * self.states + index) = value;
            }
            *self.steps.add(row) = output.steps;
            *self.rejected.add(row) = output.rejected;
            *self.time.add(row) = output.time;
            *self.status.add(row) = output.status as u8;
        }
    }

    /// The samples of one signal of a row.
    ///
    /// # Safety
    /// No other thread may write the same row.
    #[allow(clippy::mut_from_ref)] // disjoint rows behind one shared writer
    pub unsafe fn samples(&self, signal: usize, row: usize) -> &mut [f64] {
        assert!(row < self.rows && signal < self.signal_count);
        // SAFETY: the range is inside the array by the assertion and the layout of `Outputs`.
        unsafe { std::slice::from_raw_parts_mut(self.samples.add((signal * self.rows + row) * self.times), self.times) }
    }

    /// Writes a row that has no results.
    ///
    /// # Safety
    /// No other thread may write the same row.
    pub unsafe fn missing(&self, row: usize, status: Status, detail: i32) {
        assert!(row < self.rows);
        // SAFETY: as above.
        unsafe {
            for index in 0..self.metric_count {
                *self.metrics.add(index * self.rows + row) = f64::NAN;
            }
            for index in 0..self.states {
                *self.final_state.add(row * self.states + index) = f64::NAN;
            }
            for signal in 0..self.signal_count {
                self.samples(signal, row).fill(f64::NAN);
            }
            *self.time.add(row) = f64::NAN;
            *self.detail.add(row) = detail;
            *self.status.add(row) = status as u8;
        }
    }
}

//! What a sweep is asked to do.

use crate::model::{Harmonics, Layout, Program, Signal};
use crate::output::Metric;
use crate::solve::Demand;
use std::sync::Arc;

/// A method users can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum MethodName {
    /// Bogacki-Shampine 3(2).
    Bs3,
    /// Tsitouras 5(4).
    Tsit5,
    /// Dormand-Prince 5(4).
    Dopri5,
    /// Dormand-Prince 8(5,3).
    Dop853,
    /// Rosenbrock, order 5(4), for stiff rows.
    Rodas5p,
}

/// How rows start that bring no state of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartKind {
    /// At rest, the spring carrying the load torque.
    Relaxed,
    /// Both angles zero.
    ZeroAngle,
}

/// What a derivative is taken with respect to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// A parameter, by position in the layout.
    Parameter(usize),
    /// The state at time 0: theta_m, omega_m, theta_l, omega_l, z.
    Initial(usize),
}

/// A whole sweep. The rows themselves are read through functions, so that no copy of them is needed.
pub struct Job<'a> {
    /// Parameters and their order.
    pub layout: Layout,
    /// How many rows.
    pub rows: usize,
    /// Writes the parameters of a row.
    pub parameters: &'a (dyn Fn(usize, &mut [f64]) + Sync),
    /// The kinematic error, where all rows share it up to `te_scale`.
    pub shared_error: Option<Harmonics<f64>>,
    /// Inputs.
    pub programs: Vec<Arc<Program>>,
    /// Which of them a row has.
    pub program_of: &'a (dyn Fn(usize) -> usize + Sync),
    /// How rows start that bring no state of their own.
    pub start: StartKind,
    /// A row's own state at time 0: theta_m, omega_m, theta_l, omega_l, z.
    pub initial_state: &'a (dyn Fn(usize) -> Option<[f64; 5]> + Sync),
    /// Sampling times.
    pub grids: Vec<Arc<[f64]>>,
    /// Which of them a row has.
    pub grid_of: &'a (dyn Fn(usize) -> usize + Sync),
    /// Sampled signals.
    pub signals: Vec<Signal>,
    /// Metrics.
    pub metrics: Vec<Metric>,
    /// Derivatives that are wanted of all numbers; with the methods dop853 and rodas5p.
    pub directions: Vec<Direction>,
    /// Method; rows that are set aside as stiff are run by rodas5p.
    pub method: MethodName,
    /// Tolerances, limits, and what the metrics need.
    pub demand: Demand,
    /// Threads; at least 1.
    pub threads: usize,
    /// CPU path.
    pub path: super::SimdPath,
}

impl Job<'_> {
    /// How many times a row is run: once for every direction.
    pub fn runs_per_row(&self) -> usize {
        self.directions.len().max(1)
    }

    /// Length of the longest grid.
    pub fn longest_grid(&self) -> usize {
        self.grids.iter().map(|grid| grid.len()).max().unwrap_or(0)
    }
}

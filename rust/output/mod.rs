//! What is kept of a trajectory: signals at given times, and metrics located inside the steps.

mod catalogue;
mod crossings;
mod energy;
mod least_squares;
mod local_ratio;
mod mode;
mod orders;
mod probe;
mod reduce;
mod steady;

pub use catalogue::{Metric, MetricEntry, Phase};
pub use probe::probe_grid;
pub use reduce::Reduction;

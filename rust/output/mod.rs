//! What is kept of a trajectory: metrics located inside the steps, order amplitudes, modes.

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

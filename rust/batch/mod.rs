//! Rows to lanes to threads, and the choice of the CPU path.

mod dispatch;
mod job;
mod outputs;
mod threads;
mod worker;

pub use dispatch::{SimdPath, lanes_of_path, paths};
pub use job::{Direction, Job, MethodName, StartKind};
pub use outputs::{Numbers, Outputs};
pub use threads::{Progress, sweep};

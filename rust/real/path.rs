//! How generic code gets compiled for the features of a CPU.

use super::Real;

/// Work that is to be compiled with the features of a path.
pub trait Task {
    /// What comes of it.
    type Output;
    /// Does the work; must be inlined into the caller.
    fn run(self) -> Self::Output;
}

/// One way to use the CPU: a number type, and a function that enables what it needs.
pub trait Path: 'static {
    /// The lanes.
    type Lanes: Real;
    /// Name users see.
    const NAME: &str;
    /// Whether this CPU has the features.
    fn available() -> bool;
    /// Runs a task compiled for this path; panics where the CPU lacks the features.
    fn enter<W: Task>(task: W) -> W::Output;
}

/// A function that runs tasks with features of the CPU, in a module of its own: the compiler builds modules beside each other.
macro_rules! compiled {
    ($module:ident $(, $feature:tt)*) => {
        mod $module {
            use crate::real::Task;

            #[inline(never)]
            $(#[target_feature(enable = $feature)])*
            pub fn compiled<W: Task>(task: W) -> W::Output {
                task.run()
            }
        }
    };
}
pub(crate) use compiled;

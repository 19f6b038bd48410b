//! Integration in time: one adaptive step for all lanes, and the loop around it.

mod advance;
mod again;
mod begin;
mod carry;
mod controller;
#[cfg(test)]
mod convergence;
mod corners;
mod estimate;
mod events;
mod extrema;
mod implicit;
mod integrals;
mod interpolant;
mod kinematics;
mod linear;
mod notes;
mod occupancy;
mod outside;
mod record;
mod replay;
mod rodas;
mod root;
mod samples;
mod sampling;
mod seat;
mod slack;
mod stages;
mod status;
mod stepper;
mod stiffness;
mod tableau;
mod watch;

pub use advance::{Advance, Demand, Rows};
pub use extrema::Extreme;
pub use integrals::{INTEGRALS, Integral, Integrands};
pub use record::{Dense, Record};
pub use replay::{Lane, Replay, Retrace};
pub use rodas::Rodas5p;
pub use root::{moving, root};
pub use samples::Wanted;
pub use sampling::Sampled;
pub use seat::{Assignment, Mark, Memory, Seat, Start};
pub use status::Status;
pub use tableau::{Bs3, Dop853, Dopri5, Method, Tsit5};
pub use watch::{Range, WATCHED, WatchList, Watched};

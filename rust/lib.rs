//! Batch solver for the nonlinear torsional model of harmonic (strain-wave) gear drives.
//!
//! Rooms, each seeing only those before it: [`real`] the numbers, [`model`] the physics, [`solve`] the
//! integration in time, [`output`] what is kept of a trajectory, [`batch`] rows, lanes and threads.
//! `python` (with the feature of that name) converts and calls `batch`.

pub mod batch;
pub mod model;
pub mod output;
#[cfg(feature = "python")]
mod python;
pub mod real;
pub mod solve;

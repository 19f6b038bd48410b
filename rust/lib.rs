//! Batch solver for the nonlinear torsional model of harmonic (strain-wave) gear drives.
//!
//! Rooms, each seeing only those before it: [`real`] the numbers, [`model`] the physics, [`solve`] the
//! integration in time, [`output`] what is kept of a trajectory, [`batch`] rows, lanes and threads.
//! The crate in `rust/python` converts and calls `batch`.

pub mod batch;
pub mod model;
pub mod output;
pub mod real;
pub mod solve;

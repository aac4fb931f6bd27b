//! Simulation.

pub mod dop853;

//! Simulation.

pub mod dop853;
pub mod friction;

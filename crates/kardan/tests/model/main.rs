//! Models: how their file is read, and the equations that it becomes.

#[path = "../common/mod.rs"]
mod common;

mod circuits;
mod compliance;
mod diagnostics;
mod element_laws;
mod expressions;
mod grown;
mod kinks;
mod machines;
mod messages;
mod pieces;
mod project;
mod properties;
mod reduction;
mod source_equations;
mod state_space;
mod symbolic;
mod symbolic_multipliers;
mod torque_laws;
mod translation;
mod values;

//! The design of control laws and observers.

#[path = "../common/mod.rs"]
mod common;

mod decoupling;
mod design;
mod inversion;
mod margins;
mod observers;
mod regulator;
mod written;

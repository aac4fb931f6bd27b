//! The design of control laws and observers.

#[path = "../common/mod.rs"]
mod common;

mod canonical_check;
mod contacts;
mod decoupling;
mod design;
mod inversion;
mod json_output;
mod margins;
mod margins_golden;
mod massless;
mod multiplier_rows;
mod observers;
mod operating_point;
mod random_loops;
mod regulator;
mod responses;
mod stability;
mod trials;

//! The exact analysis of linear systems: structure, modes, zeros, and how far away a loss is.

#[path = "../common/mod.rs"]
mod common;

mod analyze;
mod box_proof;
mod certificate;
mod certified;
mod constraints;
mod contraction;
mod descriptor;
mod distance;
mod float_comparison;
mod json_output;
mod linearise;
mod massless;
mod moving_point;
mod parity;
mod properties;
mod roots;
mod sensitivity;
mod structure;
mod structure_trials;
mod theorems;

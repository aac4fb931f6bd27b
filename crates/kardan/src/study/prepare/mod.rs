//! From a model file to the loops of its variants.

pub(super) mod blocks;
pub(super) mod circuit;
pub(super) mod design_models;
pub(super) mod document;
pub(super) mod equilibrium;
pub(super) mod events;
pub(super) mod faults;
pub(super) mod initial_state;
pub(super) mod loop_blocks;
pub(super) mod operating_point;
pub(super) mod prepared;
pub(super) mod project;
pub(super) mod read_values;
pub(super) mod reduced_design_model;
pub(super) mod scenario;
pub(super) mod signal_table;
pub(super) mod source_signals;
pub(super) mod start_at_rest;
pub(super) mod state_names;
pub(super) mod tolerance;
pub(super) mod variant_diagnostics;
pub(super) mod variants;

//! From a model file to its variants, ready to run: design models, starts, checks in their order.

pub(super) mod design_models;
pub(super) mod document;
pub(super) mod reduced_design_model;
pub(super) mod start_at_rest;
pub(super) mod variants;

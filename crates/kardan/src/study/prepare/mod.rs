//! From a model file to the loops of its variants.

pub(super) mod design_models;
pub(super) mod document;
pub(super) mod project;
pub(super) mod reduced_design_model;
pub(super) mod start_at_rest;
pub(super) mod variants;

//! From the text of a model file to a model.

pub mod parse;

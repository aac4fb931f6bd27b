//! From measured logs to parameters, and the bench that makes logs.

#[path = "../common/mod.rs"]
mod common;

mod bench;
mod identification;
mod identify;
mod laws;
mod logs;
mod terms;
mod unmeasured;

//! Beyond static feedback: dynamic extension, blocks, the proof that outputs depend on each other, flatness. Exact.
//!
//! The basis is the [`structure_algorithm`]: outputs are differentiated until inputs appear, `P(s) y = C̄ x + D̄ u`.
//! From it follow the normal rank of the transfer matrix, feedback that decouples [blocks](decouple_blocks) of outputs, and
//! states and inputs as [functions of the outputs](flat_parametrisation). [`dynamic_extension`] finds the fewest integrators
//! with which decoupling succeeds; where decoupling is impossible, [`obstruction`] proves why and [`reasons`] describes it.
//!
//! All functions take a system with E = I, as [`LinearSystem::explicit`](kardan_analysis::LinearSystem::explicit) gives it;
//! they ignore E.

mod blocks;
mod extension;
mod flatness;
mod notation;
mod obstruction;
mod partition;
mod planner;
mod polynomial_matrix;
mod reasons;
mod row_span;
mod silverman;

pub use blocks::{BlockDecoupling, BlockError, decouple_blocks};
pub use extension::{Extension, Integrator, dynamic_extension};
pub use flatness::{FlatParametrisation, FlatnessError, flat_parametrisation};
pub use obstruction::{Obstruction, obstruction};
pub use partition::finest_blocks;
pub use planner::{PlannerError, planner};
pub use polynomial_matrix::PolynomialMatrix;
pub use reasons::reasons;
pub use silverman::{DecouplingRow, StructureAlgorithm, structure_algorithm};

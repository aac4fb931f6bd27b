//! Equations of motion in the names of their values: explicit form, inertia, forces and constraint torques as exact sums of products.
//!
//! Terms are made of values with names ([`Exact::named`](kardan_math::units::Exact::named)); the reduction takes the steps of the one in
//! numbers ([`crate::reduce`]), whose pivots are the numbers themselves. So both are the same equations at the values of the model.

mod change;
mod collected;
mod derivation;
mod elimination;
mod laurent;
mod letters;
mod motion;
mod multiplier_constraints;
mod printed;
mod terms;
mod times;

pub use collected::{Base, Collected, collected};
pub use derivation::{Definition, FunctionSource, SymbolicMotion, SymbolicMultiplier, TimeFunction};
pub use laurent::{Laurent, Letter, Monomial};
pub use letters::{Letters, Meaning, Symbol};
pub use printed::printed;

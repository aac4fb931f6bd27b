//! Equations of motion in the names of their values: explicit form, inertia, forces and constraint torques as exact sums of products.
//!
//! Terms are made of values with names ([`Exact::named`](crate::units::Exact::named)); the reduction takes the steps of the one in
//! numbers ([`crate::reduce`]), whose pivots are the numbers themselves. So both are the same equations at the values of the model.

mod change;
mod collected;
mod elimination;
mod kept;
mod laurent;
mod letters;
mod motion;
mod printed;
mod terms;
mod times;
mod walk;

pub use collected::{Base, Collected, collected};
pub use laurent::{Laurent, Letter, Monomial};
pub use letters::{Letters, Meaning, Symbol};
pub use printed::{Form, printed};
pub use walk::{Definition, Given, SymbolicKept, SymbolicMotion, TimeFunction};

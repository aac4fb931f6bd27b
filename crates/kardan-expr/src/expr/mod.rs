//! Exact expressions: a graph in which equal subexpressions share one node.
//!
//! Constants are rationals and π, so that zeros are exact zeros. Sums have their terms with rational factors, products
//! their factors with whole powers, both in one order; only exact identities are used. The same graph is differentiated,
//! printed, evaluated over any numbers ([`Domain`]), and compiled to a list of operations ([`crate::plan`]).

mod at_once;
mod dependence;
mod derivative;
mod domains;
mod forward;
mod graph;
mod integral;
mod interval;
mod lookup;
mod lower;
mod lowering;
mod nodes;
mod of_time;
mod one_sided;
mod piecewise_polynomial;
mod print;
mod sides;
mod substitution;
mod surds;
mod traced;

pub use at_once::{AtOnce, JointBound, at_once};
pub use domains::{Domain, Floating, Rationals};
pub use forward::{WithSlopes, forward, slopes_at};
pub(crate) use graph::Distinct;
pub use graph::Graph;
pub use interval::{Interval, Intervals};
pub use lookup::{Extrapolation, Lookup};
pub use lower::lower;
pub use lowering::Named;
pub use nodes::{Expr, Function, Symbol};
pub use of_time::{OfTime, Part, Pieces, polynomial};
pub use one_sided::{Linear, Number, SidesOf, bending, kinked, linear_sides};
pub use piecewise_polynomial::PiecewisePolynomial;
pub use print::{Style, bare, parenthesised, printed, raised};
pub use sides::{Direction, Place, Side, Sided, exactly};
pub use substitution::Substitution;
pub use surds::{Surd, Surds};
pub use traced::Traced;

//! Decoupling by static state feedback after Gilbert, exact: relative degrees, decoupling matrix, canonical form,
//! compensation, transfer matrix \[diss. 6.2.2\].
//!
//! All functions work on plain [`LinearSystem`](kardan_analysis::LinearSystem)s with E = I over exact fractions, so that
//! "decouplable", "zero" and "cancelled" are decided, not estimated. The steps of a design:
//!
//! 1. [`observable_quotient`] removes the unobservable part (order 6 → 5 of the source's example),
//! 2. [`relative_degrees`] and [`decouple`] give the gains of `u = −K x + L r − M d`, or the reason why there are none,
//! 3. [`canonical_form`] gives the parts of each channel, [`zero_dynamics`] the motion that no output shows,
//! 4. [`transfer_matrix`] and [`coupled_entries`] prove what the loop does.

mod annihilator;
mod canonical;
mod compensation;
mod decouplable;
mod diagonal;
mod gains;
mod quotient;
mod relative_degree;
mod rows;
mod transfer;
mod zero_dynamics;

pub use canonical::{CanonicalForm, NotIntegratorDecoupled, canonical_form};
pub use compensation::{Compensation, CompensationError};
pub(super) use decouplable::closed;
pub use decouplable::{NotDecouplable, integrator_decoupled, inverse_decoupling_matrix};
pub use diagonal::coupled_entries;
pub use gains::{StaticDecoupling, decouple};
pub use quotient::{Quotient, observable_quotient};
pub use relative_degree::{RelativeDegrees, relative_degrees};
pub(super) use rows::{RowSpan, add, null_rows, primitive, row_times, subtract};
pub use transfer::{RationalFunction, transfer_matrix};
pub use zero_dynamics::{ZeroDynamicsMatrix, zero_dynamics};

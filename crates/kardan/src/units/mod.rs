//! Quantities with units, kept exactly: `"130 kg mm^2"`, `"2 N m/deg"`, `"30 deg"`.
//!
//! A decimal is a ratio of two integers and a turn is a multiple of π, so what the author of a model wrote reaches the
//! equations without rounding: [`Exact`] is that number, [`Dimension`] says what kind of quantity it is, and
//! [`parse_quantity`] reads both. The angle is a dimension of its own here, hence a stiffness in `N m` and a speed in
//! `Hz` are mistakes and not silent factors of 2π.

mod catalogue;
mod dimension;
mod dimension_words;
mod error;
mod exact;
mod expression;
mod header;
mod poles;
mod precise;
mod quantity;
mod reader;
mod tolerance;
mod written;

pub use dimension::Dimension;
pub use error::UnitError;
pub use exact::{Exact, InNames};
pub(crate) use expression::{Asked, Called, Kind, Node, Value};
pub use expression::{Evaluated, Expression};
pub use header::header_unit;
pub use poles::parse_poles;
pub use quantity::{parse_number, parse_quantity, parse_quantity_list, unit_as_written};
pub use tolerance::{Spread, Tolerated, parse_tolerated, tolerance_mark};
pub use written::{shown_quantity, written_quantity};

//! Quantities with units, stored exactly: `"130 kg mm^2"`, `"2 N m/deg"`, `"30 deg"`.
//!
//! A decimal is a ratio of two integers and a turn is a multiple of π, so the numbers in a model reach the
//! equations without rounding: [`Exact`] is that number, [`Dimension`] its kind of quantity, and
//! [`parse_quantity`] reads both. The angle is a dimension of its own here, so a stiffness in `N m` and a speed in
//! `Hz` are errors and not silent factors of 2π.

mod catalogue;
mod dimension;
mod dimension_hints;
mod error;
mod exact;
mod expression;
mod header;
mod poles;
mod precise;
mod quantity;
mod quantity_text;
mod reader;
mod tolerance;

pub use dimension::Dimension;
pub use error::UnitError;
pub use exact::{Exact, InNames};
pub use expression::{Called, Kind, Node, Restriction, Value};
pub use expression::{Evaluated, Expression};
pub use header::header_unit;
pub use poles::parse_poles;
pub use quantity::{parse_number, parse_quantity, parse_quantity_list, split_unit};
pub use quantity_text::{format_quantity, shown_quantity};
pub use tolerance::{Spread, Tolerated, parse_tolerated, tolerance_mark};

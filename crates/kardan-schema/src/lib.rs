//! What a model is written as: entries with places, the keys of a table, errors with a place and a hint, and the syntax of a file.
//!
//! Keys are declared once with [`keys!`]; parser, checks, manual and editor schema read the same list. Begin with [`entries::Entries`],
//! [`schema::Field`] and [`diagnostics::Diagnostic`].
//!
//! ```
//! use kardan_schema::keys;
//! use kardan_schema::schema::Keys;
//! use kardan_math::units::Dimension;
//! use kardan_schema::schema::Sign;
//!
//! keys! {
//!     /// A lamp.
//!     table Lamp {
//!         required { torque: Quantity(Dimension::TORQUE, Sign::Positive), "Torque of its switch."; }
//!         optional { lag: Quantity(Dimension::TIME, Sign::NonNegative) = "0 s", "Time constant."; }
//!     }
//! }
//!
//! let lamp = Lamp::new("1 N m").lag("5 ms");
//! assert_eq!(lamp.entries().iter().count(), 2);
//! assert_eq!(Lamp::FIELDS[0].name, "torque");
//! ```
#![deny(clippy::disallowed_methods)]

pub mod diagnostics;
pub mod entries;
pub mod file;
pub mod schema;

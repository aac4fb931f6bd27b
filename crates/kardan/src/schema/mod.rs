//! The shape of a table in a model file, as data: parser, checks, manual and `kardan elements` all read the same list.

mod choice;
mod declare;
mod field;
mod given;
mod keys;

pub use field::{ExactPole, Field, Kind, Placed, SHORTEST_PERIOD, Scalar, Sign, Table, Value};
pub use given::{Given, Lists, Named, Quantities, Quantity, Words};
pub use keys::{BlockKeys, ElementKeys, Keys, LawKeys, SignalKeys};

pub(crate) use choice::choice;
pub(crate) use declare::keys;

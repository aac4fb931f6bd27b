//! The shape of a table in a model file, as data: parser, checks, manual and `kardan elements` all read the same list.

mod choice;
mod declare;
mod entry_value;
mod field;
mod keys;
mod renamed;

pub use entry_value::{EntryValue, Lists, Named, Names, Quantities, Quantity};
pub use field::{ExactPole, Field, Kind, Placed, SHORTEST_PERIOD, Scalar, Sign, Table, Value};
pub use keys::{BlockKeys, ElementKeys, Keys, LawKeys, SignalKeys};

pub(crate) use choice::choice;
pub(crate) use declare::keys;
pub(crate) use renamed::renamed;

//! The shape of a table in a model file, as data: parser, checks, manual and `kardan elements` all read the same list.

mod choice;
mod declare;
mod entry_value;
mod field;
mod former_names;
mod keys;
pub mod values;

pub use entry_value::{EntryValue, Lists, Named, Names, Quantities, Quantity};
pub use field::{ExactPole, Field, Kind, Placed, SHORTEST_PERIOD, Scalar, Sign, Table, Value};
pub use keys::{BlockKeys, ElementKeys, Keys, LawKeys, SignalKeys};
pub use values::{Resolved, Values};

pub use crate::{choice, keys};
pub use former_names::present_name;

//! Tables of signals: CSV, Parquet, MAT (version 5) and ASAM MDF 4, read as streams of blocks and written.
//!
//! A table contains numbers, names and units, without their physical meaning.
//!
//! | part | purpose |
//! |---|---|
//! | [`read`] | logs of any size, block by block, in bounded memory; bytes are never trusted |
//! | [`write`](mod@write) | one [`Table`] (of MDF several) as bytes |
//!
//! ```
//! use kardan_tables::{Column, Table, read, write};
//!
//! let angle = Column { name: "rk.phi", unit: "rad", description: "angle of the rack", values: &[0.5, 0.6] };
//! let bytes = write::csv(&Table { time: &[0.0, 0.1], columns: vec![angle] });
//!
//! let log = read::open(read::in_memory(bytes), &read::CsvOptions::default()).unwrap();
//! assert_eq!(log.groups()[0].channels[1].name, "rk.phi");
//! ```
#![deny(clippy::disallowed_methods)]

pub mod read;
mod table;
mod text;
pub mod write;

pub use table::{Column, Table};
pub use text::is_minus;

//! Bytes from tables; every number reads back bit for bit.
//!
//! | function | reads it |
//! |---|---|
//! | [`csv()`] | anything |
//! | [`parquet()`] | pyarrow, polars, DuckDB, MATLAB |
//! | [`mat()`] | MATLAB, Octave, SciPy |
//! | [`mdf()`] | CANape, dSPACE, asammdf |
//! | [`rows()`] | as Parquet: rows without a time, with texts; [`read_rows`] reads them, if no bit of them has changed |

mod arrow_schema;
mod csv;
mod mat;
mod mdf;
mod parquet;
mod rows;

pub use crate::text::csv_cell;
pub use csv::csv;
pub use mat::{Texts, Values, mat, mat_matrices};
pub use mdf::mdf;
pub use parquet::{ParquetError, parquet};
pub use rows::{Rows, read_rows, rows};

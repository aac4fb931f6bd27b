//! Measured logs as streams of blocks: CSV, Parquet, MAT (version 5, `-v6` and `-v7`) and ASAM MDF 4.
//!
//! A log has groups of channels; the channels of a group are measured together (one raster), and no group is resampled.
//! [`open`] reads only the beginning, [`Log::choose`] selects channels, and [`Log::next`] returns the rows in blocks,
//! so that a log of any size is read in bounded memory.
//!
//! Bytes are never trusted: a damaged, truncated or foreign file gives a [`LogError`], after the rows before the damage.
//!
//! ```
//! use kardan_tables::read::{Block, CsvOptions, in_memory, open};
//!
//! let bytes = in_memory("time;speed\ns;rpm\n0,0;1,5\n0,1;2,5\n".as_bytes());
//! let mut log = open(bytes, &CsvOptions::default())?;
//! let group = &log.groups()[0];
//! assert_eq!((group.time, group.channels[1].unit.as_str()), (Some(0), "rpm"));
//!
//! let speed = group.channel("speed").unwrap();
//! log.choose(&[(0, speed)])?;
//! let (mut block, mut sum) = (Block::default(), 0.0);
//! while log.next(&mut block)? {
//!     sum += block.columns[0].iter().sum::<f64>();
//! }
//! assert_eq!(sum, 4.0);
//! # Ok::<(), kardan_tables::read::LogError>(())
//! ```

mod csv;
mod decimal;
mod error;
mod foreign;
mod log;
mod mat;
pub mod mat5;
mod mdf;
mod names;
mod parquet;
mod source;

pub use error::LogError;
pub use log::{BLOCK_ROWS, Block, Bytes, Channel, CsvOptions, Group, Log, ReadSeek, in_memory};
pub use names::unit_in_name;

use std::io::Read;
use std::sync::Arc;

use foreign::foreign;
use log::chosen;
use names::{find_time, make_unique, named_time};

/// The error of the log if the third-party code that decodes it on this thread panics now; `None`: no such code runs.
///
/// Such a panic is caught and reported as an error. A program that is built to abort on a panic cannot catch it: its panic hook
/// may print this text and end the program.
pub fn decoding() -> Option<LogError> {
    parquet::decoding()
}

/// Opens a log. Its first bytes define its format; a file that is not MDF, MAT or Parquet is read as text.
///
/// # Errors
/// [`LogError::Empty`]; [`LogError::Unsupported`] for formats that are known but not read (MDF 3, HDF5 and with it MAT
/// v7.3, Excel, archives, web pages); [`LogError::NoChannels`]; damage in what describes the channels.
pub fn open(bytes: Arc<dyn Bytes>, options: &CsvOptions) -> Result<Box<dyn Log>, LogError> {
    let mut head = Vec::new();
    bytes.open()?.take(512).read_to_end(&mut head)?;
    if head.is_empty() {
        return Err(LogError::Empty);
    }
    if head.starts_with(b"MDF ") || head.starts_with(b"UnFinMF ") {
        return Ok(Box::new(mdf::MdfLog::open(bytes)?));
    }
    if head.starts_with(b"PAR1") {
        return Ok(Box::new(parquet::ParquetLog::open(bytes)?));
    }
    if let Some(error) = foreign(&head) {
        return Err(error);
    }
    if head.starts_with(b"MATLAB 5.0 MAT-file") || matches!(head.get(124..128), Some(b"\0\x01IM" | b"\x01\0MI")) {
        return Ok(Box::new(mat::MatLog::open(bytes)?));
    }
    Ok(Box::new(csv::CsvLog::open(bytes, options)?))
}

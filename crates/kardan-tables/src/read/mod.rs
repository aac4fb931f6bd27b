//! Measured logs as streams of blocks: CSV, Parquet, MAT (version 5, `-v6` and `-v7`) and ASAM MDF 4.
//!
//! A log has groups of channels; the channels of a group are measured together (one raster), and no group is resampled.
//! [`open`] looks at the beginning only, [`Log::choose`] says what is wanted, and [`Log::next`] gives the rows in blocks,
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
mod mat;
pub mod mat5;
mod mdf;
mod parquet;
mod source;

use std::collections::HashSet;
use std::io::{self, Cursor, Read, Seek};
use std::sync::Arc;

use thiserror::Error;

/// The most rows of a [`Block`].
pub const BLOCK_ROWS: usize = 65536;

/// What can be read from any place.
pub trait ReadSeek: Read + Seek + Send {}

impl<T: Read + Seek + Send> ReadSeek for T {}

/// The bytes of a log. They are opened more than once, each time at the start, because formats that store one channel
/// behind the other are read at several places at once.
pub trait Bytes: Send + Sync {
    /// Opens the bytes at their start.
    ///
    /// # Errors
    /// Those of the system.
    fn open(&self) -> io::Result<Box<dyn ReadSeek>>;
}

impl Bytes for Arc<[u8]> {
    fn open(&self) -> io::Result<Box<dyn ReadSeek>> {
        Ok(Box::new(Cursor::new(self.clone())))
    }
}

/// The bytes of a log that are in memory already.
pub fn in_memory(bytes: impl Into<Arc<[u8]>>) -> Arc<dyn Bytes> {
    Arc::new(bytes.into())
}

/// One measured quantity.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Channel {
    /// Unique in its group: where the file repeats a name, the second is `name (2)`.
    pub name: String,
    /// As the file writes it; empty if it does not tell.
    pub unit: String,
}

/// Channels that are read row by row together (one raster).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Group {
    /// Empty if the file does not tell.
    pub name: String,
    /// The channels, in the order of the file.
    pub channels: Vec<Channel>,
    /// Which channel is the time, if the file tells: the master of an MDF group, or else the first channel that is
    /// called `time`, `t`, `timestamp` or the like or that holds times of day.
    pub time: Option<usize>,
    /// How many rows there are, if the file tells.
    pub rows: Option<u64>,
}

impl Group {
    /// Finds a channel by its name. Where a CSV file has two rows of names, the name is `upper: lower`, and either part
    /// will do as long as no other channel has it.
    pub fn channel(&self, name: &str) -> Option<usize> {
        let whole = self.channels.iter().position(|channel| channel.name == name);
        whole.or_else(|| {
            let part = |channel: &Channel| {
                channel.name.split_once(": ").is_some_and(|(upper, lower)| upper == name || lower == name)
            };
            let mut matching = self.channels.iter().enumerate().filter(|(_, channel)| part(channel));
            let (index, _) = matching.next()?;
            matching.next().is_none().then_some(index)
        })
    }
}

/// How a CSV file is written; what is `None` is found out. Rows are counted from 1, blank lines included.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CsvOptions {
    /// What stands between two cells: `b','`, `b';'`, `b'\t'`, `b'|'` or `b' '` (any number of blanks).
    pub delimiter: Option<u8>,
    /// Whether numbers are written like `1,5`.
    pub decimal_comma: Option<bool>,
    /// The row with the names.
    pub names_row: Option<usize>,
    /// The row with the units.
    pub units_row: Option<usize>,
    /// The first row with numbers.
    pub first_row: Option<usize>,
}

/// Some rows of one group.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Block {
    /// Which group the rows belong to.
    pub group: usize,
    /// The chosen channels of this group in the order of [`Log::choose`], `rows` values each; what is missing or no
    /// number is NaN. Values are in the unit of the channel.
    pub columns: Vec<Vec<f64>>,
    /// How many rows there are, at most [`BLOCK_ROWS`].
    pub rows: usize,
}

impl Block {
    /// Empties the block for some columns of a group; memory stays.
    fn reset(&mut self, group: usize, columns: usize) {
        self.group = group;
        self.rows = 0;
        self.columns.resize_with(columns, Vec::new);
        self.columns.iter_mut().for_each(Vec::clear);
    }
}

/// A log that is read block by block.
pub trait Log: Send {
    /// The groups of channels. There is at least one, with at least one channel.
    fn groups(&self) -> &[Group];

    /// Chooses what is read, as pairs of group and channel, and goes back to the start. Everything else is skipped as
    /// cheaply as the format allows. Until something is chosen, nothing is read.
    ///
    /// # Errors
    /// [`LogError::UnknownChannel`] for a pair that does not exist; those of reading.
    fn choose(&mut self, wanted: &[(usize, usize)]) -> Result<(), LogError>;

    /// Gives the next rows of some group; `false` at the end. Groups take turns so that they advance through the file
    /// together, as far as the format allows: by the share of their rows in MDF files and MAT files.
    ///
    /// # Errors
    /// Damage, after the rows before it. The next call goes on with what is not damaged, such as other groups, and gives
    /// `false` if there is nothing.
    fn next(&mut self, block: &mut Block) -> Result<bool, LogError>;

    /// What a reader must be told although it is no error: rows that were skipped, a file that ends in the middle of a
    /// row, channels that are left out. Complete when [`Log::next`] has come to its end.
    fn notes(&self) -> Vec<String>;

    /// What of the notes means that numbers are lost: rows that could not be read, an end in the middle of a row; a few words for
    /// each, such as `3 rows are left out`. Complete when [`Log::next`] has come to its end.
    fn damage(&self) -> Vec<String> {
        Vec::new()
    }

    /// Single numbers that stand beside the channels (in MAT files).
    fn constants(&self) -> &[(String, f64)] {
        &[]
    }
}

/// What is wrong with the log, should the foreign code panic that decodes it on this thread at this moment; `None`: none runs.
///
/// Such a panic is caught and told as an error. In a program that is built to abort on a panic nothing can be caught: its panic hook
/// may say this and end it.
pub fn decoding() -> Option<LogError> {
    parquet::decoding()
}

/// Why a log cannot be read, or not any further.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum LogError {
    /// There are no bytes.
    #[error("the file is empty (0 bytes): the recording or the copy was stopped before anything was written")]
    Empty,
    /// The bytes end too early.
    #[error(
        "the {format} file is truncated: {what} (the file ends at byte {end}); \
         copy it again or repair it with the tool that wrote it"
    )]
    Truncated {
        /// `CSV`, `MAT`, `MDF` or `Parquet`.
        format: &'static str,
        /// What is missing.
        what: String,
        /// The size of the file in bytes.
        end: u64,
    },
    /// The bytes are not what the format says.
    #[error("the {format} file is damaged {place}: {what}; copy it again or repair it with the tool that wrote it")]
    Damaged {
        /// `CSV`, `MAT`, `MDF` or `Parquet`.
        format: &'static str,
        /// Where: byte, or row and column.
        place: String,
        /// What is wrong there.
        what: String,
    },
    /// The bytes are sound but not for this reader.
    #[error("{what}; {help}")]
    Unsupported {
        /// What is there.
        what: String,
        /// What to do.
        help: String,
    },
    /// Nothing in the file can be read as a series of numbers.
    #[error("the {format} file has no channel: {why}")]
    NoChannels {
        /// `CSV`, `MAT`, `MDF` or `Parquet`.
        format: &'static str,
        /// What was looked for and what to do.
        why: String,
    },
    /// [`Log::choose`] was asked for what is not there.
    #[error("there is no channel {channel} in group {group} (both counted from 0); choose from the listed groups")]
    UnknownChannel {
        /// The group asked for.
        group: usize,
        /// The channel asked for.
        channel: usize,
    },
    /// The system could not read.
    #[error("the file cannot be read: {0}")]
    Read(String),
}

impl LogError {
    fn damaged(format: &'static str, place: impl Into<String>, what: impl Into<String>) -> Self {
        Self::Damaged { format, place: place.into(), what: what.into() }
    }

    fn unsupported(what: impl Into<String>, help: impl Into<String>) -> Self {
        Self::Unsupported { what: what.into(), help: help.into() }
    }
}

impl From<io::Error> for LogError {
    fn from(error: io::Error) -> Self {
        Self::Read(error.to_string())
    }
}

/// Opens a log. Its format is known by its first bytes; what is no MDF, MAT or Parquet file is taken for text.
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

/// Formats that are known but not read.
fn foreign(head: &[u8]) -> Option<LogError> {
    let text = String::from_utf8_lossy(head).trim_start_matches(['\u{feff}', ' ', '\n', '\r', '\t']).to_lowercase();
    let (what, help) = if head.starts_with(b"\x89HDF\r\n\x1a\n") || head.starts_with(b"MATLAB 7.3 MAT-file") {
        ("the file is HDF5 (MAT v7.3)", "save it as `save -v7 FILE ...` in MATLAB or as Parquet, MDF or CSV")
    } else if head.starts_with(b"PARE") {
        ("the Parquet file is encrypted", "write it without encryption")
    } else if head.starts_with(b"PK\x03\x04") {
        ("the file is a ZIP archive (or Excel)", "unpack it, or save the sheet as CSV")
    } else if head.starts_with(b"\xd0\xcf\x11\xe0") {
        ("the file is an old Excel file", "save the sheet as CSV")
    } else if head.starts_with(b"\x1f\x8b") {
        ("the file is compressed with gzip", "unpack it first (`gunzip FILE`)")
    } else if head.starts_with(b"\x28\xb5\x2f\xfd") {
        ("the file is compressed with Zstandard", "unpack it first (`unzstd FILE`)")
    } else if head.starts_with(b"BZh") {
        ("the file is compressed with bzip2", "unpack it first (`bunzip2 FILE`)")
    } else if head.starts_with(b"\xfd7zXZ\0") {
        ("the file is compressed with xz", "unpack it first (`unxz FILE`)")
    } else if head.starts_with(b"7z\xbc\xaf\x27\x1c") {
        ("the file is a 7-Zip archive", "unpack it first")
    } else if head.starts_with(b"ARROW1") || head.starts_with(b"FEA1") {
        ("the file is an Arrow (Feather) file", "write it as Parquet")
    } else if head.starts_with(b"TDSm") {
        ("the file is a TDMS file", "export it as CSV or MDF 4")
    } else if head.starts_with(b"%PDF") {
        ("the file is a PDF document", "give the log itself")
    } else if text.starts_with("<!doctype html") || text.starts_with("<html") {
        ("the file is a web page", "download the log itself; a login or error page was saved in its place")
    } else if text.starts_with("<?xml") {
        ("the file is XML", "export the log as CSV, Parquet, MAT or MDF 4")
    } else if text.starts_with("{\\rtf") || text.starts_with("%!ps") {
        ("the file is a document", "give the log itself")
    } else if text.starts_with("{\"") || text.starts_with("{\n") || text.starts_with("[{") {
        ("the file is JSON", "export the log as CSV, Parquet, MAT or MDF 4")
    } else if text.starts_with("version https://git-lfs") {
        ("the file is a pointer of Git LFS", "fetch the log itself (`git lfs pull`)")
    } else {
        return None;
    };
    Some(LogError::unsupported(what, help))
}

/// The chosen channels of each group, in the order of choice.
fn chosen(groups: &[Group], wanted: &[(usize, usize)]) -> Result<Vec<Vec<usize>>, LogError> {
    let mut out = vec![Vec::new(); groups.len()];
    for &(group, channel) in wanted {
        if groups.get(group).is_none_or(|group| channel >= group.channels.len()) {
            return Err(LogError::UnknownChannel { group, channel });
        }
        out[group].push(channel);
    }
    Ok(out)
}

/// Makes names unique: `x`, `x (2)`, `x (3)`.
fn make_unique(channels: &mut [Channel]) {
    let mut seen = HashSet::new();
    let mut counts = std::collections::HashMap::new();
    for channel in channels {
        if seen.contains(&channel.name) {
            let count = counts.entry(channel.name.clone()).or_insert(1usize);
            loop {
                *count += 1;
                let name = format!("{} ({count})", channel.name);
                if !seen.contains(&name) {
                    channel.name = name;
                    break;
                }
            }
        }
        seen.insert(channel.name.clone());
    }
}

/// Whether a channel is called like the time.
fn named_time(name: &str) -> bool {
    let name = name.rsplit(['.', '/', '\\']).next().unwrap_or(name).trim().to_lowercase();
    let name =
        name.split(['[', '(']).next().unwrap_or("").trim().trim_end_matches(|c: char| c.is_ascii_digit() || c == '_');
    matches!(
        name,
        "time"
            | "t"
            | "tout"
            | "timestamp"
            | "timestamps"
            | "time stamp"
            | "times"
            | "zeit"
            | "datetime"
            | "date time"
            | "date_time"
            | "time_s"
            | "time_ms"
            | "time_us"
            | "time_ns"
            | "timestamp_s"
            | "timestamp_ms"
            | "timestamp_us"
            | "timestamp_ns"
            | "t_s"
            | "t_ms"
            | "t_us"
            | "t_ns"
    )
}

/// The unit that the name of a time ends with: `ms` of `time_ms`.
pub fn unit_in_name(name: &str) -> Option<&'static str> {
    let end = name.trim().rsplit_once('_')?.1.to_ascii_lowercase();
    ["s", "ms", "us", "ns"].into_iter().find(|unit| *unit == end)
}

fn find_time(channels: &[Channel]) -> Option<usize> {
    channels.iter().position(|channel| named_time(&channel.name))
}

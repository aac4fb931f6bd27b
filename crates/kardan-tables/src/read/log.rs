//! Common to all formats: groups of channels, read block by block.

use std::io::{self, Cursor, Read, Seek};
use std::sync::Arc;

use rayon::prelude::*;

use super::LogError;

/// Largest number of rows of a [`Block`].
pub const BLOCK_ROWS: usize = 65536;

/// A source with random access.
pub trait ReadSeek: Read + Seek + Send {}

impl<T: Read + Seek + Send> ReadSeek for T {}

/// The bytes of a log. They are opened more than once, each time at the start, because formats that store one channel
/// after the other are read at several positions at once.
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

/// The bytes of a log in memory.
pub fn in_memory(bytes: impl Into<Arc<[u8]>>) -> Arc<dyn Bytes> {
    Arc::new(bytes.into())
}

/// One measured quantity.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Channel {
    /// Unique in its group: if the file repeats a name, the second is `name (2)`.
    pub name: String,
    /// As in the file; empty if the file does not contain it.
    pub unit: String,
}

/// Channels that are read row by row together (one raster).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Group {
    /// Empty if the file does not contain it.
    pub name: String,
    /// The channels, in the order of the file.
    pub channels: Vec<Channel>,
    /// The time channel, if the file marks it: the master of an MDF group, or else the first channel that is
    /// named `time`, `t`, `timestamp` or similar or that contains times of day.
    pub time: Option<usize>,
    /// Number of rows, if the file contains it.
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

/// The layout of a CSV file; kardan detects what is `None`. Rows are counted from 1, blank lines included.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CsvOptions {
    /// The delimiter of cells: `b','`, `b';'`, `b'\t'`, `b'|'` or `b' '` (any number of blanks).
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
    /// The chosen channels of this group in the order of [`Log::choose`], `rows` values each; missing values and
    /// cells without a number are NaN. Values are in the unit of the channel.
    pub columns: Vec<Vec<f64>>,
    /// Number of rows, at most [`BLOCK_ROWS`].
    pub rows: usize,
}

impl Block {
    /// Empties the block for some columns of a group; its memory is reused.
    pub(super) fn reset(&mut self, group: usize, columns: usize) {
        self.group = group;
        self.rows = 0;
        self.columns.resize_with(columns, Vec::new);
        self.columns.iter_mut().for_each(Vec::clear);
    }

    /// Reads each column at its cursor, in parallel, and retains the rows that all columns have, at most `count`; the first error.
    pub(super) fn fill<C: Send>(
        &mut self,
        group: usize,
        cursors: &mut [C],
        count: usize,
        read: impl Fn(&mut C, &mut Vec<f64>) -> Result<(), LogError> + Sync,
    ) -> Option<LogError> {
        self.reset(group, cursors.len());
        let each = cursors.par_iter_mut().zip(&mut self.columns);
        let errors: Vec<Option<LogError>> = each.map(|(cursor, column)| read(cursor, column).err()).collect();
        self.rows = self.columns.iter().map(Vec::len).min().unwrap_or(0).min(count);
        self.columns.iter_mut().for_each(|column| column.truncate(self.rows));
        errors.into_iter().flatten().next()
    }
}

/// A log that is read block by block.
pub trait Log: Send {
    /// The groups of channels. There is at least one, with at least one channel.
    fn groups(&self) -> &[Group];

    /// Chooses the channels to read, as pairs of group and channel, and returns to the start. All other data are skipped as
    /// cheaply as the format allows. Without a choice, no channel is read.
    ///
    /// # Errors
    /// [`LogError::UnknownChannel`] for a pair that does not exist; those of reading.
    fn choose(&mut self, selection: &[(usize, usize)]) -> Result<(), LogError>;

    /// Gives the next rows of some group; `false` at the end. Groups take turns so that they advance through the file
    /// together, as far as the format allows: by the share of their rows in MDF files and MAT files.
    ///
    /// # Errors
    /// Damage, after the rows before it. The next call continues with undamaged data, such as other groups, and returns
    /// `false` if there are none.
    fn next(&mut self, block: &mut Block) -> Result<bool, LogError>;

    /// Notes that are not errors: rows that were skipped, a file that ends in the middle of a
    /// row, channels that are left out. Complete when [`Log::next`] has reached the end.
    fn notes(&self) -> Vec<String>;

    /// The notes on lost numbers: rows that could not be read, an end in the middle of a row; a few words for
    /// each, such as `3 rows are left out`. Complete when [`Log::next`] has reached the end.
    fn damage(&self) -> Vec<String> {
        Vec::new()
    }

    /// Single numbers besides the channels (in MAT files).
    fn constants(&self) -> &[(String, f64)] {
        &[]
    }
}

/// The chosen channels of each group, in the order of choice.
pub(super) fn chosen(groups: &[Group], selection: &[(usize, usize)]) -> Result<Vec<Vec<usize>>, LogError> {
    let mut out = vec![Vec::new(); groups.len()];
    for &(group, channel) in selection {
        if groups.get(group).is_none_or(|group| channel >= group.channels.len()) {
            return Err(LogError::UnknownChannel { group, channel });
        }
        out[group].push(channel);
    }
    Ok(out)
}

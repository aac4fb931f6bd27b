//! Apache Parquet: row groups in sequence, the chosen columns in parallel.

mod pages;
mod units;

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::{Arc, Once};

use ::parquet::basic::{Compression, ConvertedType, LogicalType, TimeUnit, Type as Physical};
use ::parquet::column::reader::{ColumnReader, ColumnReaderImpl, get_column_reader};
use ::parquet::data_type::DataType;
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::{ParquetMetaData, ParquetMetaDataReader};
use ::parquet::file::reader::SerializedPageReader;
use ::parquet::schema::types::ColumnDescriptor;
use kardan_rt::functions::powi;

use super::source::{Source, unsigned};
use super::{BLOCK_ROWS, Block, Bytes, Channel, Group, Log, LogError, chosen, find_time, make_unique};
use pages::{Inflated, LIMIT};

const PARQUET: &str = "Parquet";

/// The meaning of the whole numbers of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Meaning {
    Plain,
    Unsigned,
    /// Divided by this.
    Scaled(f64),
    /// A duration or a time of day: divided by this.
    Elapsed(f64),
    /// The same minus the first value.
    Since(f64),
}

struct Column {
    leaf: usize,
    meaning: Meaning,
}

pub(super) struct ParquetLog {
    file: Source,
    metadata: ParquetMetaData,
    groups: [Group; 1],
    columns: Vec<Column>,
    notes: Vec<String>,
    reading: Option<Reading>,
}

struct Reading {
    row_group: usize,
    /// Unread rows of the row group.
    remaining: usize,
    cursors: Vec<Cursor>,
    failed: Option<LogError>,
}

struct Cursor {
    column: usize,
    /// The first value of a column of stamps.
    start: Option<i64>,
    reader: Option<ColumnReader>,
    levels: Vec<i16>,
}

thread_local! {
    /// The position in the file, while this thread runs the crate `parquet`.
    static DECODING: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// See [`super::decoding`].
pub(super) fn decoding() -> Option<LogError> {
    DECODING.with_borrow(|place| place.as_ref().map(|place| contradiction(place)))
}

fn contradiction(place: &str) -> LogError {
    LogError::damaged(PARQUET, place, "its numbers contradict each other")
}

/// Suppresses the printing of caught panics of the crate `parquet`; all others are reported as before.
fn silence_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let usual = take_hook();
        set_hook(Box::new(move |panic| {
            // A build that aborts catches no panic: then the program must report the text of `decoding`.
            if DECODING.with_borrow(Option::is_none) || cfg!(not(panic = "unwind")) {
                usual(panic);
            }
        }));
    });
}

/// Runs the crate `parquet` on untrusted bytes. Its known assertions are checked before, so that it works in builds that
/// abort on a panic too; other assertions are caught here, without output on the terminal.
fn guarded<T>(place: &str, work: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, LogError> {
    silence_panics();
    DECODING.set(Some(place.to_owned()));
    let done = catch_unwind(AssertUnwindSafe(work));
    DECODING.set(None);
    match done {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(error)) => Err(LogError::damaged(PARQUET, place, error.to_string())),
        Err(_) => Err(contradiction(place)),
    }
}

impl ParquetLog {
    pub(super) fn open(bytes: Arc<dyn Bytes>) -> Result<Self, LogError> {
        let file = Source::open(&*bytes, PARQUET)?;
        let end = file.size;
        let tail = if end < 12 { Vec::new() } else { file.bytes(end - 8, 8)? };
        if tail.get(4..) != Some(b"PAR1") {
            let what = "the description of its columns (at the end of the file) is missing, and kardan needs it to read any row";
            return Err(LogError::Truncated { format: PARQUET, what: what.into(), end });
        }
        let length = unsigned(&tail[..4]);
        if length > (end - 12).min(LIMIT as u64) {
            let what = format!("the declared length of the description of its columns is {length} bytes");
            return Err(LogError::damaged(PARQUET, format!("at byte {}", end - 8), what));
        }
        let place = format!("in the description of its columns, at byte {}", end - 8 - length);
        let metadata = guarded(&place, || ParquetMetaDataReader::new().parse_and_finish(&file))?;
        let mut log =
            Self { file, metadata, groups: [Group::default()], columns: Vec::new(), notes: Vec::new(), reading: None };
        log.find_columns()?;
        Ok(log)
    }

    fn find_columns(&mut self) -> Result<(), LogError> {
        let schema = self.metadata.file_metadata().schema_descr_ptr();
        let pairs = self.metadata.file_metadata().key_value_metadata();
        let pair = |key: &str| pairs?.iter().find(|pair| pair.key == key)?.value.as_deref();
        let fields = pair("ARROW:schema").map(units::fields).unwrap_or_default();
        let mut unread = None;
        for (leaf, descriptor) in schema.columns().iter().enumerate() {
            let name = descriptor.path().string();
            let field = fields.iter().find(|field| field.name == name);
            let Some(meaning) = meaning(descriptor, field.and_then(|field| field.per_second)) else {
                self.notes.push(format!(
                    "`{name}` contains no plain numbers ({}) and is left out",
                    descriptor.physical_type()
                ));
                continue;
            };
            let compression = self
                .metadata
                .row_groups()
                .iter()
                .filter_map(|group| group.columns().get(leaf))
                .map(|column| column.compression());
            if let Some(compression) = compression.into_iter().find(|compression| !pages::is_read(*compression)) {
                self.notes.push(format!("`{name}` is compressed with {compression} and is left out"));
                unread = Some(compression);
                continue;
            }
            let own_unit = matches!(meaning, Meaning::Elapsed(_) | Meaning::Since(_)).then_some("s");
            let unit = field.and_then(|field| field.unit.as_deref());
            let unit = own_unit.or(unit).or_else(|| pair(&format!("unit:{name}"))).unwrap_or("").to_owned();
            self.groups[0].channels.push(Channel { name, unit });
            self.columns.push(Column { leaf, meaning });
        }
        let group = &mut self.groups[0];
        if let (true, Some(compression)) = (group.channels.is_empty(), unread) {
            return Err(LogError::unsupported(
                format!("the columns of the Parquet file are compressed with {compression}"),
                "write it with Snappy, Zstandard, gzip or no compression (pyarrow: `compression=\"snappy\"`)",
            ));
        }
        if group.channels.is_empty() {
            let why = "none of its columns contains plain numbers".into();
            return Err(LogError::NoChannels { format: PARQUET, why });
        }
        make_unique(&mut group.channels);
        let of_stamps = || self.columns.iter().position(|column| matches!(column.meaning, Meaning::Since(_)));
        let elapsed = || self.columns.iter().position(|column| matches!(column.meaning, Meaning::Elapsed(_)));
        group.time = find_time(&group.channels).or_else(of_stamps).or_else(elapsed);
        group.rows = u64::try_from(self.metadata.file_metadata().num_rows()).ok();
        Ok(())
    }
}

/// The meaning of the numbers of a column, if they are numbers; `durations` is their number per second if they are durations.
fn meaning(descriptor: &ColumnDescriptor, durations: Option<f64>) -> Option<Meaning> {
    let per_second = |unit: &TimeUnit| match unit {
        TimeUnit::MILLIS => 1e3,
        TimeUnit::MICROS => 1e6,
        TimeUnit::NANOS => 1e9,
    };
    if descriptor.max_rep_level() > 0 {
        return None;
    }
    let whole = match descriptor.physical_type() {
        Physical::BOOLEAN | Physical::FLOAT | Physical::DOUBLE => return Some(Meaning::Plain),
        Physical::INT96 => return Some(Meaning::Since(1e9)),
        Physical::INT32 | Physical::INT64 => (descriptor.logical_type_ref(), descriptor.converted_type()),
        _ => return None,
    };
    Some(match whole {
        (Some(LogicalType::Timestamp(kind)), _) => Meaning::Since(per_second(&kind.unit)),
        (Some(LogicalType::Time(kind)), _) => Meaning::Elapsed(per_second(&kind.unit)),
        (Some(LogicalType::Integer(kind)), _) if !kind.is_signed => Meaning::Unsigned,
        (Some(LogicalType::Decimal(kind)), _) => Meaning::Scaled(powi(10.0, kind.scale)),
        (_, ConvertedType::TIMESTAMP_MILLIS) => Meaning::Since(1e3),
        (_, ConvertedType::TIMESTAMP_MICROS) => Meaning::Since(1e6),
        (_, ConvertedType::TIME_MILLIS) => Meaning::Elapsed(1e3),
        (_, ConvertedType::TIME_MICROS) => Meaning::Elapsed(1e6),
        (_, ConvertedType::UINT_8 | ConvertedType::UINT_16 | ConvertedType::UINT_32 | ConvertedType::UINT_64) => {
            Meaning::Unsigned
        }
        (_, ConvertedType::DECIMAL) => Meaning::Scaled(powi(10.0, descriptor.type_scale())),
        _ => durations.map_or(Meaning::Plain, Meaning::Elapsed),
    })
}

impl Cursor {
    /// Seeks the start of a row group.
    fn open(&mut self, log: &ParquetLog, row_group: usize) -> Result<(), LogError> {
        let leaf = log.columns[self.column].leaf;
        let place = place(&log.groups[0], row_group, self.column);
        let chunk = log.metadata.row_group(row_group).columns().get(leaf);
        let chunk = chunk.ok_or_else(|| LogError::damaged(PARQUET, &place, "the column is missing there"))?;
        let begin = chunk.dictionary_page_offset().unwrap_or(chunk.data_page_offset());
        if begin < 0 || chunk.data_page_offset() < 0 || chunk.compressed_size() < 0 {
            let what = format!("its declared length is {} bytes from byte {begin}", chunk.compressed_size());
            return Err(LogError::damaged(PARQUET, &place, what));
        }
        self.reader = Some(guarded(&place, || {
            let compression = chunk.compression();
            let plain = chunk.clone().into_builder().set_compression(Compression::UNCOMPRESSED).build()?;
            let rows = usize::try_from(log.metadata.row_group(row_group).num_rows())?;
            let pages = SerializedPageReader::new(Arc::new(log.file.clone()), &plain, rows, None)?;
            let column = chunk.column_descr_ptr();
            let pages = Inflated::new(pages, compression, &column);
            Ok(get_column_reader(column, Box::new(pages)))
        })?);
        Ok(())
    }

    /// Appends values; those before an error remain.
    fn read(&mut self, meaning: Meaning, depth: i16, count: usize, out: &mut Vec<f64>) -> Result<(), ParquetError> {
        let (levels, start) = (&mut self.levels, &mut self.start);
        let mut whole = |value: i64, unsigned: u64| match meaning {
            Meaning::Plain => value as f64,
            Meaning::Unsigned => unsigned as f64,
            Meaning::Scaled(scale) | Meaning::Elapsed(scale) => value as f64 / scale,
            Meaning::Since(scale) => (i128::from(value) - i128::from(*start.get_or_insert(value))) as f64 / scale,
        };
        match &mut self.reader {
            Some(ColumnReader::BoolColumnReader(reader)) => {
                records(reader, levels, depth, count, out, |x| f64::from(u8::from(*x)))
            }
            Some(ColumnReader::Int32ColumnReader(reader)) => {
                records(reader, levels, depth, count, out, |x| whole(i64::from(*x), u64::from(*x as u32)))
            }
            Some(ColumnReader::Int64ColumnReader(reader)) => {
                records(reader, levels, depth, count, out, |x| whole(*x, *x as u64))
            }
            Some(ColumnReader::Int96ColumnReader(reader)) => {
                records(reader, levels, depth, count, out, |x| whole(x.to_nanos(), 0))
            }
            Some(ColumnReader::FloatColumnReader(reader)) => {
                records(reader, levels, depth, count, out, |x| f64::from(*x))
            }
            Some(ColumnReader::DoubleColumnReader(reader)) => records(reader, levels, depth, count, out, |x| *x),
            _ => Err(ParquetError::General("the type of the column differs from its description".into())),
        }
    }
}

/// Appends the values of some rows; NaN for missing ones.
fn records<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    levels: &mut Vec<i16>,
    depth: i16,
    count: usize,
    out: &mut Vec<f64>,
    mut value: impl FnMut(&T::T) -> f64,
) -> Result<(), ParquetError> {
    let end = out.len() + count;
    let mut values = Vec::new();
    while out.len() < end {
        levels.clear();
        values.clear();
        let (rows, ..) =
            reader.read_records(end - out.len(), (depth > 0).then_some(&mut *levels), None, &mut values)?;
        if rows == 0 {
            return Err(ParquetError::General(format!("{} rows are missing", end - out.len())));
        }
        if depth == 0 {
            out.extend(values.iter().take(end - out.len()).map(&mut value));
        } else {
            let mut present = values.iter();
            let of = |level: &i16| if *level == depth { present.next().map_or(f64::NAN, &mut value) } else { f64::NAN };
            out.extend(levels.iter().take(end - out.len()).map(of));
        }
    }
    Ok(())
}

fn place(group: &Group, row_group: usize, column: usize) -> String {
    format!("in row group {}, column `{}`", row_group + 1, group.channels[column].name)
}

impl ParquetLog {
    fn rows(&self, row_group: usize) -> Result<usize, LogError> {
        let rows = self.metadata.row_group(row_group).num_rows();
        usize::try_from(rows).map_err(|_| {
            LogError::damaged(
                PARQUET,
                format!("in row group {}", row_group + 1),
                format!("its declared number of rows is {rows}"),
            )
        })
    }

    fn advance(&self, reading: &mut Reading, block: &mut Block) -> Result<bool, LogError> {
        if let Some(error) = reading.failed.take() {
            return Err(error);
        }
        while reading.remaining == 0 {
            if reading.row_group == self.metadata.num_row_groups() {
                return Ok(false);
            }
            reading.remaining = self.rows(reading.row_group)?;
            for cursor in &mut reading.cursors {
                cursor.open(self, reading.row_group)?;
            }
            reading.row_group += 1;
        }
        let row_group = reading.row_group - 1;
        let count = reading.remaining.min(BLOCK_ROWS);
        let schema = self.metadata.file_metadata().schema_descr();
        let (columns, group) = (&self.columns, &self.groups[0]);
        let error = block.fill(0, &mut reading.cursors, count, |cursor, column| {
            let Column { leaf, meaning } = columns[cursor.column];
            let depth = schema.column(leaf).max_def_level();
            guarded(&place(group, row_group, cursor.column), || cursor.read(meaning, depth, count, column))
        });
        reading.remaining -= block.rows;
        match error {
            Some(error) if block.rows == 0 => Err(error),
            error => {
                reading.failed = error;
                Ok(true)
            }
        }
    }
}

impl Log for ParquetLog {
    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn choose(&mut self, selection: &[(usize, usize)]) -> Result<(), LogError> {
        let channels = chosen(&self.groups, selection)?.remove(0);
        let cursor = |column| Cursor { column, start: None, reader: None, levels: Vec::new() };
        let cursors: Vec<Cursor> = channels.into_iter().map(cursor).collect();
        self.reading = (!cursors.is_empty()).then_some(Reading { row_group: 0, remaining: 0, cursors, failed: None });
        Ok(())
    }

    fn next(&mut self, block: &mut Block) -> Result<bool, LogError> {
        let Some(mut reading) = self.reading.take() else { return Ok(false) };
        let more = self.advance(&mut reading, block)?;
        if more {
            self.reading = Some(reading);
        }
        Ok(more)
    }

    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }
}

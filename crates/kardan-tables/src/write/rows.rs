//! Rows of numbers and texts as Apache Parquet files, written and read again.
//!
//! The last pair of the metadata is a checksum of the whole file: FNV-1a of all its bytes, with zeros in place of the digits of the checksum itself.
//! kardan verifies it first, so that damaged bytes reach no decoder. For other readers it is a pair of the metadata.

use std::ops::Range;

use ::parquet::column::reader::ColumnReader;
use ::parquet::data_type::ByteArray;
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::reader::{FileReader, SerializedFileReader};

use super::parquet::{file, key_values};
use crate::Column;

/// The key of the checksum, and the text before its digits.
const CHECKSUM: &str = "checksum";
const ALGORITHM: &[u8] = b"fnv-1a-64:";
/// Hexadecimal digits of the checksum.
const DIGITS: usize = 16;

/// Rows that were read: names, columns, pairs of the metadata.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Rows {
    /// Columns of numbers.
    pub numbers: Vec<(String, Vec<f64>)>,
    /// Columns of texts.
    pub texts: Vec<(String, Vec<String>)>,
    /// Pairs of the metadata.
    pub metadata: Vec<(String, String)>,
}

/// Columns of numbers, bit for bit, then columns of texts, as a Parquet file of one row group, compressed with Snappy; the metadata contain the pairs
/// given and `unit:<column>` of each column of numbers.
///
/// ```
/// use kardan_tables::{Column, write};
///
/// let inertia = Column { name: "inertia", unit: "kg m^2", description: "", values: &[0.1, f64::NAN] };
/// let reasons = vec![String::new(), "too stiff".to_string()];
/// let bytes = write::rows(&[inertia], &[("reason", &reasons)], &[("seed", "1")]).unwrap();
/// let read = write::read_rows(bytes).unwrap();
/// assert!(read.numbers[0].1[0] == 0.1 && read.numbers[0].1[1].is_nan());
/// assert_eq!(read.texts, [("reason".to_string(), reasons)]);
/// assert!(read.metadata.contains(&("unit:inertia".into(), "kg m^2".into())));
/// ```
///
/// # Errors
/// Those of the encoder; none is known for writing to memory.
///
/// # Panics
/// If columns have different lengths.
pub fn rows(
    numbers: &[Column<'_>],
    texts: &[(&str, &[String])],
    metadata: &[(&str, &str)],
) -> Result<Vec<u8>, ParquetError> {
    let lengths = numbers.iter().map(|column| column.values.len()).chain(texts.iter().map(|(_, texts)| texts.len()));
    let lengths: Vec<usize> = lengths.collect();
    assert!(lengths.iter().all(|length| *length == lengths[0]), "columns have {lengths:?} rows");
    let mut pairs = key_values(metadata);
    let unit = |column: &Column<'_>| KeyValue::new(format!("unit:{}", column.name), column.unit.to_owned());
    pairs.extend(numbers.iter().map(unit));
    let blank = String::from_utf8_lossy(ALGORITHM) + "0000000000000000";
    pairs.push(KeyValue::new(CHECKSUM.into(), blank.into_owned()));
    let mut bytes = file("rows", (numbers, texts), pairs, WriterProperties::builder())?;
    let digits = digits_of(&bytes).expect("the checksum is the last pair of the metadata");
    let sum = format!("{:016x}", checksum(&bytes, &digits));
    bytes[digits].copy_from_slice(sum.as_bytes());
    Ok(bytes)
}

/// Where the digits of the checksum are.
fn digits_of(bytes: &[u8]) -> Option<Range<usize>> {
    let start = bytes.windows(ALGORITHM.len()).rposition(|window| window == ALGORITHM)? + ALGORITHM.len();
    (start + DIGITS <= bytes.len()).then_some(start..start + DIGITS)
}

/// FNV-1a of the bytes, with zeros in place of these digits.
fn checksum(bytes: &[u8], digits: &Range<usize>) -> u64 {
    let add = |sum: u64, byte: &u8| (sum ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
    let before = bytes[..digits.start].iter().chain(&[b'0'; DIGITS]).fold(0xcbf2_9ce4_8422_2325, add);
    bytes[digits.end..].iter().fold(before, add)
}

/// Whether the bytes are unchanged.
fn verify(bytes: &[u8]) -> Result<(), ParquetError> {
    let wrong = |what: &str| Err(ParquetError::General(what.into()));
    let Some(digits) = digits_of(bytes) else {
        return wrong("it has no checksum: it is damaged, or kardan did not write it");
    };
    match format!("{:016x}", checksum(bytes, &digits)).as_bytes() == &bytes[digits] {
        true => Ok(()),
        false => wrong("its checksum does not match: it was damaged or altered"),
    }
}

/// Reads such rows; columns of other types are left out.
///
/// # Errors
/// The bytes are not those that [`rows`] has written: their checksum is missing or different.
pub fn read_rows(bytes: Vec<u8>) -> Result<Rows, ParquetError> {
    verify(&bytes)?;
    let reader = SerializedFileReader::new(bytes::Bytes::from(bytes))?;
    let described = reader.metadata().file_metadata();
    let pairs = described.key_value_metadata().cloned().unwrap_or_default();
    let metadata = pairs.into_iter().map(|pair| (pair.key, pair.value.unwrap_or_default())).collect();
    let mut out = Rows { metadata, ..Rows::default() };
    for (k, column) in described.schema_descr().columns().iter().enumerate() {
        let name = column.name().to_string();
        let (mut numbers, mut texts, mut is_text) = (Vec::new(), Vec::new(), false);
        for number in 0..reader.num_row_groups() {
            let group = reader.get_row_group(number)?;
            let count = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
            match group.get_column_reader(k)? {
                ColumnReader::DoubleColumnReader(mut column) => {
                    column.read_records(count, None, None, &mut numbers)?;
                }
                ColumnReader::ByteArrayColumnReader(mut column) => {
                    let mut found: Vec<ByteArray> = Vec::new();
                    column.read_records(count, None, None, &mut found)?;
                    is_text = true;
                    texts.extend(found.iter().map(|text| String::from_utf8_lossy(text.data()).into_owned()));
                }
                _ => {}
            }
        }
        if is_text { out.texts.push((name, texts)) } else { out.numbers.push((name, numbers)) }
    }
    Ok(out)
}

#[cfg(test)]
#[path = "../../tests/unit/write/rows.rs"]
mod tests;

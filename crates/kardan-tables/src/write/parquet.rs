//! Apache Parquet files.

use std::sync::Arc;

use ::parquet::basic::{Compression, Encoding, LogicalType, Repetition, Type as Physical};
use ::parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
pub use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::{WriterProperties, WriterPropertiesBuilder};
use ::parquet::file::writer::SerializedFileWriter;
use ::parquet::schema::types::Type;

use super::arrow_schema::{self, arrow_schema};
use crate::{Column, Table};

/// Gives the table as a Parquet file: one row group, the column `t` (s) and one required `DOUBLE` column for each signal,
/// bit for bit, byte-stream split and compressed with Snappy.
///
/// The key-value metadata of the file contain the given pairs and, for each column, `unit:<column>` and
/// `description:<column>`. Readers with metadata of columns, such as pyarrow, find `unit` and `description` there.
///
/// # Errors
/// Those of the encoder; none is known for writing to memory.
///
/// # Panics
/// If the length of a column differs from that of the time.
pub fn parquet(table: &Table<'_>, metadata: &[(&str, &str)]) -> Result<Vec<u8>, ParquetError> {
    let columns = table.with_time("t");
    let mut pairs = key_values(metadata);
    for column in &columns {
        pairs.push(KeyValue::new(format!("unit:{}", column.name), column.unit.to_owned()));
        pairs.push(KeyValue::new(format!("description:{}", column.name), column.description.to_owned()));
    }
    pairs.push(KeyValue::new(arrow_schema::KEY.to_owned(), arrow_schema(&columns, metadata)));
    let settings = WriterProperties::builder().set_dictionary_enabled(false).set_encoding(Encoding::BYTE_STREAM_SPLIT);
    file("run", (&columns, &[]), pairs, settings)
}

/// Pairs of the metadata.
pub(super) fn key_values(metadata: &[(&str, &str)]) -> Vec<KeyValue> {
    metadata.iter().map(|&(key, value)| KeyValue::new(key.into(), value.to_owned())).collect()
}

/// A file of one row group of required columns, numbers and texts, compressed with Snappy.
pub(super) fn file(
    name: &str,
    (numbers, texts): (&[Column<'_>], &[(&str, &[String])]),
    pairs: Vec<KeyValue>,
    settings: WriterPropertiesBuilder,
) -> Result<Vec<u8>, ParquetError> {
    let field = |name: &str, physical, logical| {
        let builder = Type::primitive_type_builder(name, physical).with_logical_type(logical);
        builder.with_repetition(Repetition::REQUIRED).build().map(Arc::new)
    };
    let number = |column: &Column<'_>| field(column.name, Physical::DOUBLE, None);
    let text = |(name, _): &(&str, &[String])| field(name, Physical::BYTE_ARRAY, Some(LogicalType::String));
    let fields = numbers.iter().map(number).chain(texts.iter().map(text)).collect::<Result<Vec<_>, _>>()?;
    let schema = Type::group_type_builder(name).with_fields(fields).build()?;
    let properties = settings.set_compression(Compression::SNAPPY).set_key_value_metadata(Some(pairs)).build();
    let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for column in numbers {
        let mut chunk = group.next_column()?.expect("the schema has all columns");
        chunk.typed::<DoubleType>().write_batch(column.values, None, None)?;
        chunk.close()?;
    }
    for (_, texts) in texts {
        let bytes: Vec<ByteArray> = texts.iter().map(|text| ByteArray::from(text.as_str())).collect();
        let mut chunk = group.next_column()?.expect("the schema has all columns");
        chunk.typed::<ByteArrayType>().write_batch(&bytes, None, None)?;
        chunk.close()?;
    }
    group.close()?;
    writer.into_inner()
}

#[cfg(test)]
#[path = "../../tests/unit/write/parquet.rs"]
mod tests;

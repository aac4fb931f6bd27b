//! Apache Parquet files.

use std::sync::Arc;

use ::parquet::basic::{Compression, Encoding, Repetition, Type as Physical};
use ::parquet::data_type::DoubleType;
pub use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
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
    table.check();
    let columns = columns(table);
    let properties = WriterProperties::builder()
        .set_dictionary_enabled(false)
        .set_encoding(Encoding::BYTE_STREAM_SPLIT)
        .set_compression(Compression::SNAPPY)
        .set_key_value_metadata(Some(pairs(metadata, &columns)))
        .build();
    let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema(&columns)?), Arc::new(properties))?;
    let mut rows = writer.next_row_group()?;
    for column in &columns {
        let mut chunk = rows.next_column()?.expect("the schema has all columns");
        chunk.typed::<DoubleType>().write_batch(column.values, None, None)?;
        chunk.close()?;
    }
    rows.close()?;
    writer.into_inner()
}

/// The columns of the file, time first.
fn columns<'a>(table: &Table<'a>) -> Vec<Column<'a>> {
    let time = Column { name: "t", unit: "s", description: "time", values: table.time };
    std::iter::once(time).chain(table.columns.iter().copied()).collect()
}

fn schema(columns: &[Column]) -> Result<Type, ParquetError> {
    let columns = columns.iter().map(|column| {
        let column = Type::primitive_type_builder(column.name, Physical::DOUBLE);
        column.with_repetition(Repetition::REQUIRED).build().map(Arc::new)
    });
    Type::group_type_builder("run").with_fields(columns.collect::<Result<_, _>>()?).build()
}

fn pairs(metadata: &[(&str, &str)], columns: &[Column]) -> Vec<KeyValue> {
    let mut pairs: Vec<KeyValue> =
        metadata.iter().map(|&(key, value)| KeyValue::new(key.into(), value.to_owned())).collect();
    for column in columns {
        pairs.push(KeyValue::new(format!("unit:{}", column.name), column.unit.to_owned()));
        pairs.push(KeyValue::new(format!("description:{}", column.name), column.description.to_owned()));
    }
    pairs.push(KeyValue::new(arrow_schema::KEY.to_owned(), arrow_schema(columns, metadata)));
    pairs
}

#[cfg(test)]
#[path = "../../tests/unit/write/parquet.rs"]
mod tests;

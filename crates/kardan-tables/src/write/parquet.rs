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
mod tests {
    use ::parquet::file::reader::{FileReader, SerializedFileReader};
    use ::parquet::record::RowAccessor;

    use super::*;

    #[test]
    fn the_reader_gives_back_every_bit_and_the_units() {
        let time: Vec<f64> = (0..1000).map(|i| f64::from(i) * 1e-3).collect();
        let mut phi: Vec<f64> = time.iter().map(|t| kardan_rt::functions::sin(9.0 * t)).collect();
        phi[..4].copy_from_slice(&[f64::NAN, -0.0, f64::INFINITY, 1e-300]);
        let angle = Column { name: "rk.phi", unit: "rad", description: "angle of rk.phi", values: &phi };
        let table = Table { time: &time, columns: vec![angle] };
        let metadata = [("model", "gear"), ("variant", "beta-1"), ("parameter:beta", "0.5 rad")];
        let bytes = parquet(&table, &metadata).unwrap();

        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).unwrap();
        assert_eq!(reader.num_row_groups(), 1);
        let pairs = reader.metadata().file_metadata().key_value_metadata().unwrap();
        let value = |key: &str| pairs.iter().find(|pair| pair.key == key).unwrap().value.as_deref().unwrap();
        assert_eq!((value("model"), value("variant")), ("gear", "beta-1"));
        assert_eq!((value("unit:t"), value("unit:rk.phi")), ("s", "rad"));
        assert_eq!((value("description:rk.phi"), value("parameter:beta")), ("angle of rk.phi", "0.5 rad"));
        assert_eq!(value("ARROW:schema"), arrow_schema(&columns(&table), &metadata));

        let rows: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
        assert_eq!(rows.len(), time.len());
        let names: Vec<_> = rows[0].get_column_iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["t", "rk.phi"]);
        for (i, row) in rows.iter().enumerate() {
            assert_eq!(row.get_double(0).unwrap().to_bits(), time[i].to_bits());
            assert_eq!(row.get_double(1).unwrap().to_bits(), phi[i].to_bits());
        }
    }

    #[test]
    fn a_table_without_rows_is_still_a_file() {
        let empty = Column { name: "x", unit: "", description: "", values: &[] };
        let bytes = parquet(&Table { time: &[], columns: vec![empty] }, &[]).unwrap();
        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).unwrap();
        assert_eq!(reader.metadata().file_metadata().num_rows(), 0);
    }
}

//! A run as an Apache Parquet file.

use std::sync::Arc;

use ::parquet::basic::{Compression, Encoding, Repetition, Type as Physical};
use ::parquet::data_type::DoubleType;
pub use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::SerializedFileWriter;
use ::parquet::schema::types::Type;

use super::arrow_schema::{self, arrow_schema};
use crate::results::Run;

/// Gives the run as a Parquet file: one row group, the column `t` (s) and one required `DOUBLE` column for each signal,
/// bit for bit and in SI, byte-stream split and compressed with Snappy.
///
/// The key-value metadata of the file hold `model`, `variant`, `parameter:<name>` (as written in the model file) and, for
/// each column, `unit:<column>` and `description:<column>`. Readers with metadata of columns, such as pyarrow, find
/// `unit` and `description` there.
///
/// # Errors
/// Those of the encoder; writing to memory has given none so far.
///
/// # Panics
/// If a signal has not as many values as there are times.
pub fn parquet(model: &str, run: &Run) -> Result<Vec<u8>, ParquetError> {
    let columns = columns(run);
    let properties = WriterProperties::builder()
        .set_dictionary_enabled(false)
        .set_encoding(Encoding::BYTE_STREAM_SPLIT)
        .set_compression(Compression::SNAPPY)
        .set_key_value_metadata(Some(metadata(model, run, &columns)))
        .build();
    let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema(&columns)?), Arc::new(properties))?;
    let mut rows = writer.next_row_group()?;
    for column in &columns {
        assert_eq!(column.values.len(), run.series.time.len(), "`{}` has another length than time", column.name);
        let mut chunk = rows.next_column()?.expect("the schema has all columns");
        chunk.typed::<DoubleType>().write_batch(column.values, None, None)?;
        chunk.close()?;
    }
    rows.close()?;
    writer.into_inner()
}

/// A column of the file.
pub struct Column<'a> {
    pub name: &'a str,
    pub unit: &'a str,
    pub description: &'a str,
    pub values: &'a [f64],
}

fn columns(run: &Run) -> Vec<Column<'_>> {
    let time = Column { name: "t", unit: "s", description: "time", values: &run.series.time };
    let signals = run.series.signals.iter().map(|signal| Column {
        name: &signal.name,
        unit: signal.physical.unit(),
        description: &signal.description,
        values: &signal.values,
    });
    std::iter::once(time).chain(signals).collect()
}

fn schema(columns: &[Column]) -> Result<Type, ParquetError> {
    let columns = columns.iter().map(|column| {
        let column = Type::primitive_type_builder(column.name, Physical::DOUBLE);
        column.with_repetition(Repetition::REQUIRED).build().map(Arc::new)
    });
    Type::group_type_builder("run").with_fields(columns.collect::<Result<_, _>>()?).build()
}

fn metadata(model: &str, run: &Run, columns: &[Column]) -> Vec<KeyValue> {
    let mut pairs = vec![("model".to_owned(), model), ("variant".to_owned(), &run.name)];
    for parameter in &run.parameters {
        pairs.push((format!("parameter:{}", parameter.name), &parameter.text));
    }
    let table: Vec<_> = pairs.iter().map(|(key, value)| (key.as_str(), *value)).collect();
    let schema = arrow_schema(columns, &table);
    for column in columns {
        pairs.push((format!("unit:{}", column.name), column.unit));
        pairs.push((format!("description:{}", column.name), column.description));
    }
    pairs.push((arrow_schema::KEY.to_owned(), &schema));
    pairs.into_iter().map(|(key, value)| KeyValue::new(key, value.to_owned())).collect()
}

#[cfg(test)]
mod tests {
    use ::parquet::file::reader::{FileReader, SerializedFileReader};
    use ::parquet::record::RowAccessor;

    use super::super::example::run;
    use super::*;

    #[test]
    fn the_reader_gives_back_every_bit_and_the_units() {
        let time: Vec<f64> = (0..1000).map(|i| f64::from(i) * 1e-3).collect();
        let mut phi: Vec<f64> = time.iter().map(|t| (9.0 * t).sin()).collect();
        phi[..4].copy_from_slice(&[f64::NAN, -0.0, f64::INFINITY, 1e-300]);
        let run = run("beta-1", time.clone(), vec![("rk.phi", phi.clone())]);
        let bytes = parquet("gear", &run).unwrap();

        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).unwrap();
        assert_eq!(reader.num_row_groups(), 1);
        let pairs = reader.metadata().file_metadata().key_value_metadata().unwrap();
        let value = |key: &str| pairs.iter().find(|pair| pair.key == key).unwrap().value.as_deref().unwrap();
        assert_eq!((value("model"), value("variant")), ("gear", "beta-1"));
        assert_eq!((value("unit:t"), value("unit:rk.phi")), ("s", "rad"));
        assert_eq!((value("description:rk.phi"), value("parameter:beta")), ("angle of rk.phi", "0.5 rad"));
        assert_eq!(
            value("ARROW:schema"),
            arrow_schema(&columns(&run), &[("model", "gear"), ("variant", "beta-1"), ("parameter:beta", "0.5 rad")])
        );

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
    fn a_run_without_rows_is_still_a_file() {
        let bytes = parquet("gear", &run("a", vec![], vec![("x", vec![])])).unwrap();
        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).unwrap();
        assert_eq!(reader.metadata().file_metadata().num_rows(), 0);
    }
}

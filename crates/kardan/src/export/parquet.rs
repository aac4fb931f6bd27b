//! A run as an Apache Parquet file.

use std::sync::Arc;

use ::parquet::basic::{Compression, Encoding, Repetition, Type as Physical};
use ::parquet::data_type::DoubleType;
pub use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::SerializedFileWriter;
use ::parquet::schema::types::Type;

use crate::results::Run;

/// Gives the run as a Parquet file: one row group, the column `t` (s) and one required `DOUBLE` column for each signal,
/// bit for bit and in SI, byte-stream split and compressed with Snappy.
///
/// The key-value metadata of the file hold `model`, `variant`, `parameter:<name>` (as written in the model file) and,
/// for each column, `unit:<column>` and `description:<column>`.
///
/// # Errors
/// Those of the encoder; writing to memory has given none so far.
///
/// # Panics
/// If a signal has not as many values as there are times.
pub fn parquet(model: &str, run: &Run) -> Result<Vec<u8>, ParquetError> {
    let series = &run.series;
    for signal in &series.signals {
        assert_eq!(signal.values.len(), series.time.len(), "signal `{}` has another length than time", signal.name);
    }
    let schema = schema(run)?;
    let properties = WriterProperties::builder()
        .set_dictionary_enabled(false)
        .set_encoding(Encoding::BYTE_STREAM_SPLIT)
        .set_compression(Compression::SNAPPY)
        .set_key_value_metadata(Some(metadata(model, run)))
        .build();
    let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties))?;
    let mut rows = writer.next_row_group()?;
    for values in std::iter::once(&series.time).chain(series.signals.iter().map(|signal| &signal.values)) {
        let mut column = rows.next_column()?.expect("the schema has a column for time and for each signal");
        column.typed::<DoubleType>().write_batch(values, None, None)?;
        column.close()?;
    }
    rows.close()?;
    writer.into_inner()
}

fn schema(run: &Run) -> Result<Type, ParquetError> {
    let names = std::iter::once("t").chain(run.series.signals.iter().map(|signal| signal.name.as_str()));
    let columns = names
        .map(|name| {
            let column = Type::primitive_type_builder(name, Physical::DOUBLE);
            column.with_repetition(Repetition::REQUIRED).build().map(Arc::new)
        })
        .collect::<Result<_, _>>()?;
    Type::group_type_builder("run").with_fields(columns).build()
}

fn metadata(model: &str, run: &Run) -> Vec<KeyValue> {
    let mut pairs = vec![
        ("model".to_owned(), model),
        ("variant".to_owned(), run.name.as_str()),
        ("unit:t".to_owned(), "s"),
        ("description:t".to_owned(), "time"),
    ];
    for parameter in &run.parameters {
        pairs.push((format!("parameter:{}", parameter.name), &parameter.text));
    }
    for signal in &run.series.signals {
        pairs.push((format!("unit:{}", signal.name), signal.physical.unit()));
        pairs.push((format!("description:{}", signal.name), &signal.description));
    }
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
        let bytes = parquet("gear", &run("beta-1", time.clone(), vec![("rk.phi", phi.clone())])).unwrap();

        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).unwrap();
        assert_eq!(reader.num_row_groups(), 1);
        let pairs = reader.metadata().file_metadata().key_value_metadata().unwrap();
        let value = |key: &str| pairs.iter().find(|pair| pair.key == key).unwrap().value.as_deref().unwrap();
        assert_eq!((value("model"), value("variant")), ("gear", "beta-1"));
        assert_eq!((value("unit:t"), value("unit:rk.phi")), ("s", "rad"));
        assert_eq!((value("description:rk.phi"), value("parameter:beta")), ("angle of rk.phi", "0.5 rad"));

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

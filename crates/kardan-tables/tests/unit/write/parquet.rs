//! Tests of `src/write/parquet.rs`.

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
    assert_eq!(value("ARROW:schema"), arrow_schema(&table.with_time("t"), &metadata));

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
fn an_empty_table_is_still_a_file() {
    let empty = Column { name: "x", unit: "", description: "", values: &[] };
    let bytes = parquet(&Table { time: &[], columns: vec![empty] }, &[]).unwrap();
    let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).unwrap();
    assert_eq!(reader.metadata().file_metadata().num_rows(), 0);
}

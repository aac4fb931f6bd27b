//! Tests of `src/write/csv.rs`.

use proptest::prelude::*;

use super::*;
use crate::Column;

fn text(time: &[f64], columns: &[(&str, &[f64])]) -> String {
    let column = |&(name, values)| Column { name, unit: "rad", description: "", values };
    String::from_utf8(csv(&Table { time, columns: columns.iter().map(column).collect() })).unwrap()
}

#[test]
fn numbers_are_short_and_names_quoted_only_if_needed() {
    let values = [-0.0, 1.0, 0.1, 1e-300, 1.5e300, f64::NAN, f64::NEG_INFINITY, -120.0];
    let time: Vec<f64> = (0..8).map(f64::from).collect();
    let expected = "t,rk.phi\n0,0\n1,1\n2,0.1\n3,1e-300\n4,1.5e+300\n5,NaN\n6,-inf\n7,-120\n";
    assert_eq!(text(&time, &[("rk.phi", &values)]), expected);
    assert_eq!(text(&[], &[("a,b", &[]), ("say \"x\"", &[])]), "t,\"a,b\",\"say \"\"x\"\"\"\n");
}

proptest! {
    #[test]
    fn every_number_reads_back_bit_for_bit(values in prop::collection::vec(any::<f64>(), 1..40)) {
        let time: Vec<f64> = (0..values.len()).map(|i| i as f64 * 1e-3).collect();
        let table = text(&time, &[("x", &values)]);
        let mut rows = 0;
        for (line, (t, x)) in table.lines().skip(1).zip(time.iter().zip(&values)) {
            let (read_t, read_x) = line.split_once(',').unwrap();
            prop_assert_eq!(read_t.parse::<f64>().unwrap().to_bits(), t.to_bits());
            let read_x: f64 = read_x.parse().unwrap();
            if x.is_nan() {
                prop_assert!(read_x.is_nan());
            } else {
                prop_assert_eq!(read_x.to_bits(), (x + 0.0).to_bits()); // x + 0: no minus zero
            }
            rows += 1;
        }
        prop_assert_eq!(rows, values.len());
    }
}

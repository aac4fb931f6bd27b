//! Tests of `src/element/harmonic_drive.rs`.

use super::*;
use kardan_schema::schema::Resolved;

/// Source (6.2): n = (1, −(i+1), i).
#[test]
fn direction_6_2() {
    let mut values = Values::default();
    for (key, shaft) in [("wave_generator", "wg"), ("circular_spline", "cs"), ("flexspline", "fs")] {
        values.insert(key, Resolved::Word(shaft.into()));
    }
    values.insert("ratio", Resolved::Exact(Exact::from_integer(50)));
    let terms = terms("hd", &values);
    let [Term::Constraint { direction, offset }] = terms.as_slice() else { panic!("one constraint expected") };
    let row: Vec<(&str, f64)> = direction.entries.iter().map(|(name, x)| (name.as_str(), x.to_f64())).collect();
    assert_eq!(row, [("wg", 1.0), ("cs", -51.0), ("fs", 50.0)]);
    assert!(offset.is_zero());
}

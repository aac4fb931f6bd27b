//! Tests of `src/phrases/design.rs`.

use super::*;

#[test]
fn transfer_functions_read_as_written_by_hand() {
    let rendered = |numerator: &[&str], denominator: &[&str]| {
        let texts = |coefficients: &[&str]| coefficients.iter().map(|&word| word.into()).collect();
        let entry =
            TransferEntry { numerator: texts(numerator), denominator: texts(denominator), ..Default::default() };
        transfer(&entry)
    };
    assert_eq!(rendered(&[], &["1"]), "0 (exact)");
    assert_eq!(rendered(&["400"], &["400", "28", "1"]), "400/(s^2 + 28 s + 400)");
    assert_eq!(rendered(&["0", "-3/2"], &["0", "0", "1"]), "(-3/2 s)/s^2");
    assert_eq!(rendered(&["1", "1"], &["1"]), "s + 1");
}

#[test]
fn shares_may_be_tiny() {
    assert_eq!([0.0, 0.0002304, 0.123].map(|value| share(value, 5)), ["0 %", "0.02304 %", "12 %"]);
}

//! Tests of `src/read/mdf/field.rs`.

use super::*;

#[test]
fn half_precision_has_the_values_of_the_standard() {
    for (bits, value) in
        [(0x3c00, 1.0), (0xc000, -2.0), (0x7bff, 65504.0), (1, powi(2.0, -24)), (0x7c00, f64::INFINITY)]
    {
        assert_eq!(half(bits), value);
    }
}

#[test]
fn bits_are_found_in_both_orders() {
    let field = |big_endian, bit, bits, kind| Field {
        kind,
        big_endian,
        byte: 1,
        bit,
        bits,
        invalid: None,
        conversion: Conversion::None,
    };
    let value = |field: Field| {
        let mut out = Vec::new();
        field.decode(&[0xff, 0x34, 0x92, 0xff], 4, 4, 0, &mut out);
        out[0]
    };
    assert_eq!(value(field(false, 4, 12, Kind::Unsigned)), f64::from(0x923));
    assert_eq!(value(field(false, 4, 12, Kind::Signed)), f64::from(0x923 - 0x1000));
    assert_eq!(value(field(true, 4, 12, Kind::Unsigned)), f64::from(0x349));
    assert_eq!(value(field(true, 0, 16, Kind::Unsigned)), f64::from(0x3492));
}

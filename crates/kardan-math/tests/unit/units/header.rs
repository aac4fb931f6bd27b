//! Tests of `src/units/header.rs`.

use super::*;

#[test]
fn units_of_headers_are_those_of_models() {
    for (header, model) in [
        ("U/min", "rpm"),
        ("u/min", "rpm"),
        ("r/min", "rpm"),
        ("Upm", "rpm"),
        ("RPM", "rpm"),
        ("U/s", "rev/s"),
        ("rps", "rev/s"),
        ("1/min", "min^-1"),
        ("(1/min)", "min^-1"),
        ("min-1", "min^-1"),
        ("min\u{2212}1", "min^-1"),
        ("min\u{207b}\u{b9}", "min^-1"),
        ("min^-1", "min^-1"),
        ("dps", "deg/s"),
        ("\u{b0}/s", "deg/s"),
        ("rad/s2", "rad/s^2"),
        ("Ncm", "N cm"),
        ("Nmm", "N mm"),
        ("mNm", "mN m"),
        ("kNm", "kN m"),
        ("kN", "kN"),
        ("N-m", "N m"),
        ("N\u{b7}m", "N m"),
        ("NM", "N m"),
        ("Nm/\u{b0}", "N m/deg"),
        ("[msec]", "ms"),
        ("\u{b5}sec", "us"),
    ] {
        assert_eq!(header_unit(header), parse_quantity(&format!("1 {model}")), "{header}");
    }
    for unit in ["", "-", "\u{2013}", "1", " [1] "] {
        assert_eq!(header_unit(unit), Ok((Exact::one(), Dimension::NONE)), "{unit}");
    }
    for unit in ["dog", "m^", "-1", "s--1", "N-", "]["] {
        assert!(header_unit(unit).is_err(), "{unit}");
    }
}

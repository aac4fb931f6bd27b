//! Tests of `src/units/quantity.rs`.

use std::f64::consts::{PI, TAU};

use proptest::prelude::*;

use dashu_int::UBig;
use dashu_ratio::RBig;

use super::super::catalogue::UNITS;
use super::super::dimension::NAMED_DIMENSIONS;
use super::*;

fn quantity(text: &str) -> (Exact, Dimension) {
    parse_quantity(text).unwrap_or_else(|e| panic!("{text}: {e} {:?}", e.help))
}

fn value(text: &str) -> f64 {
    quantity(text).0.to_f64()
}

/// The message, the text it points at, and the help.
fn error_text(text: &str) -> String {
    let e = parse_quantity(text).expect_err(text);
    format!("{} @ `{}` ({})", e.message, &text[e.span], e.help.unwrap_or_default())
}

#[test]
fn units_convert_exactly() {
    let ratio = |a, b, pi| Exact::new(Exact::from_ratio(a, b).rational, pi);
    for (text, number, dimension) in [
        ("130 kg mm^2", ratio(130, 1_000_000, 0), Dimension::INERTIA),
        ("130 kg*mm**2", ratio(130, 1_000_000, 0), Dimension::INERTIA),
        ("1.3e2kg·mm²", ratio(130, 1_000_000, 0), Dimension::INERTIA),
        ("2 N m/deg", ratio(360, 1, -1), Dimension::STIFFNESS),
        ("30 deg", ratio(1, 6, 1), Dimension::ANGLE),
        ("30°", ratio(1, 6, 1), Dimension::ANGLE),
        ("180/pi deg", ratio(1, 1, 0), Dimension::ANGLE),
        ("-pi rad", ratio(-1, 1, 1), Dimension::ANGLE),
        ("2pi/3 rad", ratio(2, 3, 1), Dimension::ANGLE),
        ("3 arcmin", ratio(3, 60 * 180, 1), Dimension::ANGLE),
        ("3 deg/s", ratio(1, 60, 1), Dimension::ANGULAR_VELOCITY),
        ("60 rpm", ratio(2, 1, 1), Dimension::ANGULAR_VELOCITY),
        ("1 rev/min", ratio(1, 30, 1), Dimension::ANGULAR_VELOCITY),
        ("5 rad s^-2", ratio(5, 1, 0), Dimension::ANGULAR_ACCELERATION),
        ("5 rad s⁻²", ratio(5, 1, 0), Dimension::ANGULAR_ACCELERATION),
        ("1.5 mNm", ratio(15, 10_000, 0), Dimension::TORQUE),
        ("1.5 kJ", ratio(1500, 1, 0), Dimension::TORQUE),
        ("100 W", ratio(100, 1, 0), Dimension::TORQUE_RATE),
        ("0.0081 N m s/rad", ratio(81, 10_000, 0), Dimension::DAMPING),
        ("0.0081 N m/(rad/s)", ratio(81, 10_000, 0), Dimension::DAMPING),
        ("0.0081 Nms/rad", ratio(81, 10_000, 0), Dimension::DAMPING),
        ("5 N m/rad/s", ratio(5, 1, 0), Dimension::mechanical(1, 2, -3, -1)),
        ("2 min", ratio(120, 1, 0), Dimension::TIME),
        ("2 µs", ratio(2, 1_000_000, 0), Dimension::TIME),
        ("1/2 s", ratio(1, 2, 0), Dimension::TIME),
        ("5 1/s", ratio(5, 1, 0), Dimension::mechanical(0, 0, -1, 0)),
        ("5/s", ratio(5, 1, 0), Dimension::mechanical(0, 0, -1, 0)),
        ("1 in", ratio(254, 10_000, 0), Dimension::mechanical(0, 1, 0, 0)),
        ("10 lbf", ratio(44_482_216_152_605, 1_000_000_000_000, 0), Dimension::mechanical(1, 1, -2, 0)),
        ("2 t", ratio(2000, 1, 0), Dimension::mechanical(1, 0, 0, 0)),
        ("3 mΩ", ratio(3, 1000, 0), quantity("1 V/A").1),
        ("4.7 kohm", ratio(4700, 1, 0), quantity("1 H/s").1),
        ("2 mH", ratio(2, 1000, 0), Dimension::INDUCTANCE),
        ("3 V s/A", ratio(3, 1, 0), Dimension::INDUCTANCE),
        ("22 µF", ratio(22, 1_000_000, 0), Dimension::CAPACITANCE),
        ("3 pF", ratio(3, 1_000_000_000_000, 0), quantity("1 C/V").1),
        ("5 mA s", ratio(5, 1000, 0), Dimension::CHARGE),
        ("6 nC", ratio(6, 1_000_000_000, 0), Dimension::CHARGE),
        ("20 mV", ratio(20, 1000, 0), quantity("1 W/A").1),
        ("2 C V", ratio(2, 1, 0), quantity("1 J").1),
        ("1_000", ratio(1000, 1, 0), Dimension::NONE),
        ("−51/50", ratio(-51, 50, 0), Dimension::NONE),
        ("–3 N m", ratio(-3, 1, 0), Dimension::TORQUE),
        ("‐2e−3 rad s^–1", ratio(-2, 1000, 0), Dimension::ANGULAR_VELOCITY),
        ("3000 U/min", ratio(100, 1, 1), Dimension::ANGULAR_VELOCITY),
        ("3 U/s", ratio(6, 1, 1), Dimension::ANGULAR_VELOCITY),
        ("50 Ncm", ratio(1, 2, 0), Dimension::TORQUE),
        ("50 Nmm", ratio(5, 100, 0), Dimension::TORQUE),
        ("30 1/min", ratio(1, 2, 0), Dimension::FREQUENCY),
        ("30 min^-1", ratio(1, 2, 0), Dimension::FREQUENCY),
        ("0 deg", Exact::zero(), Dimension::ANGLE),
    ] {
        assert_eq!(quantity(text), (number, dimension), "{text}");
    }
}

#[test]
fn the_nearest_double_is_found() {
    assert_eq!(value("180 deg"), PI);
    assert_eq!(value("60 rpm"), TAU);
    assert_eq!(value("0.1"), 0.1);
    assert_eq!(value("1e-3 s"), 0.001);
    assert_eq!(value("1.7976931348623157e308"), f64::MAX);
    assert_eq!(value("5e-324"), 5e-324);
    assert_eq!(value("2.2250738585072011e-308"), 2.225_073_858_507_201e-308);
    assert_eq!(value("30 deg"), std::f64::consts::FRAC_PI_6);
    assert_eq!(value("1 rad") / value("1 deg"), 180.0 / PI);
    assert_eq!(Exact::new(RBig::ONE, -2).to_f64(), 0.101_321_183_642_337_78);
    assert_eq!(quantity("30 deg").0.to_string(), "0.5235987755982989");
    assert_eq!(quantity("1e300").0.to_string(), "1e300");
    assert_eq!(quantity("0").0.to_string(), "0");
    assert_eq!(quantity("-2.50").0.to_string(), "-2.5");
}

#[test]
fn a_rational_represents_the_nearest_double_of_a_multiple_of_pi() {
    let half_turn = quantity("pi rad").0.to_rational();
    assert_eq!(half_turn.to_f64().value(), PI);
    assert_eq!(quantity("1/3").0.to_rational() * RBig::from(3), RBig::ONE);
}

#[test]
fn errors_have_a_place_and_a_hint() {
    for (text, expected) in [
        ("130 kq mm^2", "unknown unit `kq` @ `kq` (did you mean `kg`?)"),
        ("5 sec", "unknown unit `sec` @ `sec` (did you mean `s`?)"),
        ("5 lb", "unknown unit `lb` @ `lb` (write a mass in `kg` (1 lb = 0.45359237 kg), a force in `lbf`)"),
        ("sin(1) N m", "expected a number, found `s` @ `sin(1) N m` (no expression is allowed here: write its value)"),
        ("5 kgmm", "unknown unit `kgmm` @ `kgmm` (put a space between two units: `kg mm`)"),
        ("5 Grad", "unknown unit `Grad` @ `Grad` (did you mean `deg` or `rad`?)"),
        ("5 kOhms", "unknown unit `kOhms` @ `kOhms` (did you mean `kOhm`?)"),
        ("5 uf", "unknown unit `uf` @ `uf` (did you mean `uF`?)"),
        ("5 mh", "unknown unit `mh` @ `mh` (did you mean `mH`?)"),
        ("5 RPM", "unknown unit `RPM` @ `RPM` (did you mean `rpm`?)"),
        ("5 kg m2", "unexpected `2` in a unit @ `m2` (write a power as `m^2`)"),
        ("0,05 kg", "unexpected `,` in a number @ `,` (write \"0.05 kg\", with a decimal point)"),
        ("−1.234,5 N m", "unexpected `,` in a number @ `,` (write \"−1234.5 N m\", with a decimal point)"),
        ("1,234.5 N", "unexpected `,` in a number @ `,` (write \"1234.5 N\", with a decimal point)"),
        (
            "12,345 s",
            "unexpected `,` in a number @ `,` (write \"12.345 s\" if it is a decimal comma, \"12345 s\" if it separates thousands)",
        ),
        ("1,234,567 N", "unexpected `,` in a number @ `,` (write \"1234567 N\", without separators)"),
        ("5, kg", "unexpected `,` in a number @ `,` (write one decimal point and no separators: \"1234.5\")"),
        (
            "1 000 s",
            "unexpected number `000` in a unit @ `000` (write one number (products worked out, digits without spaces), then its unit, powers with `^`: \"1000 kg m^2\")",
        ),
        ("1/0 s", "division by zero @ `/0` (write a fraction with a denominator other than zero)"),
        ("-inf s", "`inf` is not a finite number @ `inf` (write a decimal number)"),
        ("NaN", "`NaN` is not a finite number @ `NaN` (write a decimal number)"),
        (
            "1e999999999999999999999",
            "the exponent `e999999999999999999999` is out of range @ `e999999999999999999999` (exponents of ten go from -400 to 400)",
        ),
        (
            "1e400",
            "`1e400` is too large: a number must be below 1.8e308 in SI units @ `1e400` (check the exponent and the unit)",
        ),
        (
            "1e-330 m",
            "`1e-330 m` is too small: a number other than zero must be above 5e-324 in SI units @ `1e-330 m` (check the exponent and the unit)",
        ),
        ("5 N m/rad s", "it is not clear whether `/` also divides by `s` @ `s` (write `N m/rad * s` or `N m/(rad s)`)"),
        ("5 N m/(rad", "a `(` without its `)` @ `(rad` (close it)"),
        ("5 N m)", "a `)` without its `(` @ `)` (remove it)"),
        (
            "5 N m/",
            "expected a unit, found the end of the text @ `` (write units like `N m s/rad`, `kg m^2` or `rad/s`)",
        ),
        ("5 m^", "expected a power between -9 and 9 @ `^` (write powers like `m^2`, `m**2`, `m²` or `s^-1`)"),
        ("5 m^10", "expected a power between -9 and 9 @ `^10` (write powers like `m^2`, `m**2`, `m²` or `s^-1`)"),
        (
            "",
            "expected a number, found the end of the text @ `` (start with a number: \"0.05\", \"-1e-3\", \"51/50\" or \"pi/4\")",
        ),
        ("_1", "expected a number, found `_` @ `_1` (start with a number: \"0.05\", \"-1e-3\", \"51/50\" or \"pi/4\")"),
    ] {
        assert_eq!(error_text(text), expected, "{text}");
    }
    let unit_on_a_number = parse_number("5 kg").unwrap_err();
    assert_eq!((unit_on_a_number.code, unit_on_a_number.span), ("unit::dimension", 2..4));
    assert_eq!(unit_on_a_number.help.as_deref(), Some("write \"5\""));
}

#[test]
fn a_wrong_dimension_gets_the_nearest_right_text() {
    for (dimension, text, expected) in [
        (Dimension::STIFFNESS, "100 N m", "did you mean \"100 N m/rad\"?"),
        (Dimension::DAMPING, "0.0081 N m s", "did you mean \"0.0081 N m s/rad\"?"),
        (Dimension::INERTIA, "0.05", "write the unit too: \"0.05 kg m^2\""),
        (Dimension::ANGLE, "30", "write the unit too: \"30 deg\" or \"30 rad\""),
        (Dimension::ANGULAR_VELOCITY, "5 Hz", "write it as \"5 rev/s\": a turn is 2 pi rad"),
        (Dimension::ANGULAR_VELOCITY, "3000 1/min", "write it as \"3000 rpm\": a turn is 2 pi rad"),
        (Dimension::FREQUENCY, "90 rpm", "write it as \"90 1/min\": a turn is 2 pi rad"),
        (Dimension::TORQUE, "5 kg", "write it like \"1.3 N m\""),
        (Dimension::NONE, "5 kg", "write the number without a unit"),
    ] {
        assert_eq!(dimension.hint(text), expected, "{text}");
    }
}

#[test]
fn named_dimensions_read_their_own_si_unit_and_example() {
    for named in &NAMED_DIMENSIONS {
        assert_eq!(quantity(&format!("1 {}", named.si)), (Exact::one(), named.dimension), "{}", named.word);
        assert_eq!(quantity(named.example).1, named.dimension, "{}", named.word);
    }
}

#[test]
fn lists_share_their_unit() {
    let list = parse_quantity_list("[0, 10, -20.5, 1/3,] deg").unwrap();
    let texts: Vec<_> = list.iter().map(|entry| entry.2.as_str()).collect();
    assert_eq!(texts, ["0 deg", "10 deg", "-20.5 deg", "1/3 deg"]);
    for (number, dimension, text) in &list {
        assert_eq!((number.clone(), *dimension), quantity(text));
    }
    assert_eq!(parse_quantity_list("[1, 2]").unwrap()[1].2, "2");
    for (text, message) in [
        ("10 deg", "expected a list of numbers in brackets"),
        ("[] deg", "the list is empty"),
        ("[1 2] deg", "expected `,` or `]` after a number of the list"),
        ("[1, 2 deg", "expected `,` or `]` after a number of the list"),
        ("[1, 2", "expected `,` or `]` after a number of the list"),
        ("[1, 2,", "expected a number, found the end of the text"),
        ("[1, 2] dog", "unknown unit `dog`"),
    ] {
        assert_eq!(parse_quantity_list(text).unwrap_err().message, message, "{text}");
    }
}

#[test]
fn hostile_texts_come_to_an_end() {
    for text in [
        "9".repeat(1_000_000),
        "(".repeat(256),
        "1 ".to_string() + &"(".repeat(250),
        "1 ".to_string() + &"(".repeat(60) + "mm/m" + &")^9".repeat(60),
        "1 ".to_string() + &"Gs ".repeat(80),
        "1 ".to_string() + &"Gm/m/".repeat(50) + "m",
        "1e400/1e-400/1e-400/1e-400/1e-400/1e-400/1e-400 m".to_string(),
        "1".to_string() + &"/pi".repeat(84),
    ] {
        let _ = parse_quantity(&text);
        let _ = parse_number(&text);
    }
    let _ = parse_quantity_list(&format!("[{}] rpm", "9,".repeat(8000)));
}

proptest! {
    #[test]
    fn a_decimal_is_an_integer_over_a_power_of_ten(integer in any::<i64>(), places in 0_usize..30) {
        let digits = format!("{:0>width$}", integer.unsigned_abs(), width = places + 1);
        let (whole, fraction) = digits.split_at(digits.len() - places);
        let text = format!("{}{whole}.{fraction}", if integer < 0 { "-" } else { "" });
        let expected = RBig::from_parts(integer.into(), UBig::from(10u8).pow(places));
        prop_assert_eq!(parse_number(&text).unwrap(), Exact::new(expected, 0));
        prop_assert_eq!(parse_number(&text).unwrap().to_f64(), text.parse::<f64>().unwrap());
    }

    #[test]
    fn every_double_is_read_back(bits in any::<u64>()) {
        let number = f64::from_bits(bits);
        prop_assume!(number.is_finite());
        prop_assert_eq!(parse_number(&format!("{number:e}")).unwrap().to_f64(), number);
    }

    #[test]
    fn the_si_unit_of_any_dimension_is_read_back(exponents in proptest::array::uniform7(-9_i8..=9), angle in -9_i8..=9) {
        let dimension = Dimension { exponents, angle };
        prop_assert_eq!(quantity(&format!("1 {}", dimension.si())), (Exact::one(), dimension));
        prop_assert_eq!(quantity(dimension.example().trim_matches('"')).1, dimension);
    }

    #[test]
    fn units_multiply_and_divide(a in 0_usize..UNITS.len(), b in 0_usize..UNITS.len()) {
        let (a, b) = (UNITS[a].name, UNITS[b].name);
        let (one, two) = (quantity(&format!("3 {a}")), quantity(&format!("7 {b}")));
        let product = (&one.0 * &two.0, one.1.times(&two.1, 1).unwrap());
        let quotient = (one.0.div(&two.0).unwrap(), one.1.times(&two.1, -1).unwrap());
        prop_assert_eq!(quantity(&format!("21 {a} {b}")), product);
        prop_assert_eq!(quantity(&format!("3/7 {a}/{b}")), quotient.clone());
        prop_assert_eq!(quantity(&format!("3/7 {a} ({b})^-1")), quotient);
    }

    #[test]
    fn any_text_is_read_or_refused(text in any::<String>(), near in "[-+0-9eE./pi *^()\\[\\],²°NmsradkgHz%_]{0,40}") {
        for text in [text, near] {
            for error in [
                parse_quantity(&text).err(),
                parse_number(&text).err(),
                parse_quantity_list(&text).err(),
                parse_quantity_list(&format!("[{text}")).err(),
            ] {
                prop_assert!(error.is_none_or(|e| e.span.start <= e.span.end && e.span.end <= text.len() + 1));
            }
            for dimension in [Dimension::STIFFNESS, Dimension::ANGLE, Dimension::NONE] {
                prop_assert!(!dimension.hint(&text).is_empty());
            }
        }
    }
}

//! Tests of `src/units/tolerance.rs`.

use proptest::prelude::*;

use super::*;

fn ends(text: &str) -> (Exact, Exact, Exact) {
    let read = parse_tolerated(text).unwrap_or_else(|error| panic!("{text}: {error}"));
    let (lower, upper) = read.spread.limits_at(&read.value);
    (lower, read.value, upper)
}

fn ratios(lower: (i64, i64), value: (i64, i64), upper: (i64, i64)) -> (Exact, Exact, Exact) {
    let exact = |(a, b)| Exact::from_ratio(a, b);
    (exact(lower), exact(value), exact(upper))
}

#[test]
fn all_forms_give_exact_ends() {
    let expected = ratios((729, 100_000), (81, 10_000), (891, 100_000));
    for text in [
        "0.0081 N m s/rad ± 10 %",
        "0.0081 N m s/rad ±10%",
        "  0.0081 N m s/rad  +-  1e1 %  ",
        "0.0081 N m s/rad+/-10%",
        "0.0081 N m s/rad ± +10 %",
        "0.0081 N m s/rad ± 0.00081 N m s/rad",
        "0.0081 N m s/rad ± 0.81 mN m s/rad",
        "(0.0081 ± 0.00081) N m s/rad",
        " ( 0.0081 +- 10 % ) N m s/rad",
        "8.1 mN m s/rad ± 81/100 mN m s/rad",
        "0.0081 N m s/rad [0.00729, 0.00891]",
        "8.1 mN m s/rad[7.29,8.91]",
        "8.1 mN m s/rad [7.29, 8.91] 95 %",
    ] {
        assert_eq!(ends(text), expected, "{text}");
        assert_eq!(parse_tolerated(text).unwrap().dimension, Dimension::DAMPING, "{text}");
    }
    assert_eq!(ends("-2 N m ± 10 %"), ratios((-11, 5), (-2, 1), (-9, 5)));
    assert_eq!(ends("0 ± 1/3"), ratios((-1, 3), (0, 1), (1, 3)));
    assert_eq!(ends("50 ± 150 %"), ratios((-25, 1), (50, 1), (125, 1)));
    assert_eq!(ends("2 [2, 3]"), ratios((2, 1), (2, 1), (3, 1)));
    assert_eq!(ends("-2 [-5, 0]"), ratios((-5, 1), (-2, 1), (0, 1)));
}

#[test]
fn angles_retain_their_pi() {
    let degrees = |x| Exact::new(Exact::from_ratio(x, 180).rational, 1);
    assert_eq!(ends("30 deg ± 10 %"), (degrees(27), degrees(30), degrees(33)));
    assert_eq!(ends("30 deg [20, 35]"), (degrees(20), degrees(30), degrees(35)));
    assert_eq!(ends("(30 ± 3)°"), (degrees(27), degrees(30), degrees(33)));
    // Of two powers of π each is rounded once.
    let (lower, _, upper) = ends("180 deg ± 1 rad");
    assert_eq!((lower.to_f64(), upper.to_f64()), (std::f64::consts::PI - 1.0, std::f64::consts::PI + 1.0));
}

#[test]
fn the_nominal_value_keeps_its_text_and_the_interval_its_confidence() {
    for (text, nominal, confidence) in [
        ("1 N m ± 10 %", "1 N m", None),
        ("(1 ± 0.1) N m", "1 N m", None),
        (" 51/50 +- 1 %", "51/50", None),
        ("1 N m [0.9, 1.2]", "1 N m", None),
        ("1 N m [0.9, 1.2] 95 %", "1 N m", Some(Exact::from_ratio(19, 20))),
        ("1 N m [0.9, 1.2] 99.7%", "1 N m", Some(Exact::from_ratio(997, 1000))),
    ] {
        let read = parse_tolerated(text).unwrap();
        assert_eq!((read.text.as_str(), read.spread.confidence()), (nominal, confidence.as_ref()), "{text}");
    }
}

#[test]
fn errors_are_explained() {
    for (text, code, message) in [
        ("1 N m ± -10 %", "tolerance::bounds", "a tolerance must not be negative, found -10 %"),
        ("1 N m ± -0.1 N m", "tolerance::bounds", "a tolerance must not be negative, found -0.1 N m"),
        ("1 N m ± 0 %", "tolerance::bounds", "the tolerance is zero"),
        ("1 N m ± 1e-30 N m", "tolerance::bounds", "the tolerance is zero"),
        ("0 N m ± 10 %", "tolerance::bounds", "a percentage of zero is zero"),
        ("1 N m ± 10 mm", "unit::dimension", "the tolerance must be a torque as the value, found a length"),
        (
            "1 N m ± 0.1",
            "unit::dimension",
            "the tolerance must be a torque as the value, found a number without a unit",
        ),
        (
            "1 ± 0.1 N m",
            "unit::dimension",
            "the tolerance must be a number without a unit as the value, found a torque",
        ),
        ("1 N m ± nan %", "number::not-finite", "`nan` is not a finite number"),
        ("1 N m [nan, 2]", "number::not-finite", "`nan` is not a finite number"),
        ("1 N m ±", "number::syntax", "expected a number, found the end of the text"),
        ("1 N m ± %", "number::syntax", "expected a number, found `%`"),
        ("± 10 %", "tolerance::syntax", "there is no value before the tolerance"),
        ("1 N m ± 10 % N m", "tolerance::syntax", "unexpected text after the `%`"),
        ("1 N m ± 10 %%", "tolerance::syntax", "unexpected text after the `%`"),
        ("1 N m ± 1 N m ± 2 N m", "unit::syntax", "expected a unit, found `±`"),
        ("1 N m [0.9 1.2]", "tolerance::syntax", "expected `,` after a bound, found `1`"),
        ("1 N m [0.9, 1.2", "tolerance::syntax", "expected `]` after a bound, found the end of the text"),
        ("1 N m [0.9, 1.2, 3]", "tolerance::syntax", "expected `]` after a bound, found `,`"),
        ("1 N m [0.9 N m, 1.2 N m]", "tolerance::syntax", "expected `,` after a bound, found `N`"),
        ("1 [0.9, 1.2] N m", "tolerance::syntax", "unexpected text after the interval"),
        ("1 N m [0.9, 1.2] 95", "tolerance::syntax", "unexpected text after the interval"),
        ("1 N m [0.9, 1.2] 100 %", "tolerance::bounds", "a confidence lies between 0 % and 100 %, found 100 %"),
        ("1 N m [1.2, 0.9]", "tolerance::bounds", "the lower bound of [1.2, 0.9] lies above the upper one"),
        ("1 N m [2, 3]", "tolerance::bounds", "the value 1 N m lies outside [2, 3]"),
        ("1 N m [1, 1]", "tolerance::bounds", "the tolerance is zero"),
        ("(1 N m ± 1)", "tolerance::syntax", "expected `±` after the number, found `N`"),
        ("(1 ± 1 N m)", "tolerance::syntax", "expected `)` after the tolerance, found `N`"),
        ("(1 ± 1", "tolerance::syntax", "expected `)` after the tolerance, found the end of the text"),
        (
            "1e308 N m ± 150 %",
            "number::range",
            "`1e308 N m ± 150 %` is too large: a number must be below 1.8e308 in SI units",
        ),
    ] {
        let error = parse_tolerated(text).unwrap_err();
        assert_eq!((error.code, error.message.as_str()), (code, message), "{text}");
        assert!(error.help.is_some(), "{text}");
    }
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused(text in "[-+0-9eE./pi ^()\\[\\],²±%Nmsradkg]{0,40}", more in any::<String>()) {
        for text in [text.clone(), more.clone(), format!("1 N m ± {text}"), format!("1 N m [{more}"), format!("({text} ± {more}")] {
            if let Err(error) = parse_tolerated(&text) {
                prop_assert!(text.get(error.span).is_some(), "{text}");
            }
        }
    }

    #[test]
    fn the_value_lies_between_the_ends(value in any::<i32>(), width in 1_i64..1_000_000, unit in "(N m|deg|%)") {
        let (number, unit) = if unit == "%" { (format!("{value}"), "") } else { (format!("{value} {unit}"), unit.as_str()) };
        let tolerance = if unit.is_empty() { format!("{width} %") } else { format!("{width} {unit}") };
        prop_assume!(value != 0);
        let (lower, value, upper) = ends(&format!("{number} ± {tolerance}"));
        prop_assert!(lower.is_below(&value) && value.is_below(&upper));
        prop_assert_eq!(value.plus(&-&lower), upper.plus(&-&value));
    }
}

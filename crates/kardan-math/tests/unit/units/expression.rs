use dashu_ratio::RBig;
use proptest::prelude::*;

use super::super::parse_quantity;
use super::*;

/// Parameters of the tests.
fn parameter(name: &str) -> Option<(Exact, Dimension)> {
    let text = match name {
        "m_rack" => "2 kg",
        "r_pinion" => "7 mm",
        "c" => "200 N m/rad",
        "J" => "0.02 kg m^2",
        "v" => "3 m/s",
        "zero" => "0",
        "beta" => "30 deg",
        // Also a unit.
        "m" => "5",
        _ => return None,
    };
    parse_quantity(text).ok()
}

fn evaluate(text: &str) -> Result<Evaluated, UnitError> {
    Expression::parse(text)?.evaluate(&parameter)
}

fn like(text: &str, quantity: &str) {
    let found = evaluate(text).unwrap_or_else(|error| panic!("{text}: {error} {:?}", error.help));
    let (value, dimension) = parse_quantity(quantity).unwrap();
    assert!(found.exact, "{text}");
    assert_eq!(found.value, value, "{text}");
    assert!(found.dimension.is_like(&dimension), "{text}: {}", found.dimension.si());
}

#[test]
fn fractions_and_powers_of_pi_stay_exact() {
    for (text, quantity) in [
        ("m_rack * r_pinion^2", "98 kg mm^2"),
        ("200 N * 7.5 mm", "1.5 N m"),
        ("2 pi / 60 s * 3000", "100 pi rad/s"),
        ("m_rack*(r_pinion + 3 mm)**2", "200 kg mm^2"),
        ("-(1/3 + 1/6) * 2 kg", "-1 kg"),
        ("1/2 s + 500 ms", "1 s"),
        ("100 N m/rad + c", "300 N m/rad"),
        ("3 kg m^2/s + 1 N m s", "4 N m s"),
        ("2^3^2", "512"),
        ("2^-1 * 8", "4"),
        ("-2^2", "-4"),
        ("10 N/m*2 m", "20 N"),
        ("10 N/m * m", "50 N/m"),
        ("sqrt(c / J)", "100 rad/s"),
        ("sqrt(9/4) + sin(beta) + cos(60 deg) - tan(45 deg)", "1.5"),
        ("asin(1/2) + acos(1/2) + atan(1)", "135 deg"),
        ("atan2(-1 m, -1 m)", "-135 deg"),
        ("abs(-3 N) - max(1 N, 2 N, -5 N) + min(1 N, 4 N) * sign(-2 kg)", "0 N"),
        ("if(beta < 0.6 rad, 1 kg, 2 kg) + if(2 >= 2, 1 kg, 1/zero * 1 kg)", "2 kg"),
        ("exp(0) + ln(1)", "1"),
        ("1 kHz^-1", "1 ms"),
        // Powers bind before the product with π, fractions and units.
        ("-4 pi^2 / (pi*pi)", "-4"),
        ("2 pi^2 rad/s / pi^2", "2 rad/s"),
        ("10^3 kg", "1000 kg"),
        ("3/2^2 m", "0.75 m"),
        ("pi/2^2 / pi", "1/4"),
        ("1/4 pi^-1 * pi", "1/4"),
        ("(4 pi)^2 / pi^2", "16"),
        ("m^1/2", "2.5"),
        ("m^2 * 3", "75"),
        ("2^-1/2 s", "0.25 s"),
        ("3 kg ^ 2 / (1 kg)", "3 kg"),
        ("3 kg ** 2 / (3 kg)^2", "1/3"),
        // From left to right.
        ("m/2/5", "0.5"),
        ("J*2/5", "0.008 kg m^2"),
        ("1 m/2/5", "0.1 m"),
        ("1/2/5", "0.1"),
        ("m/2^2/5", "0.25"),
    ] {
        like(text, quantity);
    }
}

/// Rounded once: the floating-point number nearest to the result of a longer calculation.
#[test]
fn other_values_are_rounded_once() {
    for (text, value) in [
        ("sqrt(2)", std::f64::consts::SQRT_2),
        ("exp(1)", std::f64::consts::E),
        ("ln(2)", std::f64::consts::LN_2),
        ("1 + pi - 1", std::f64::consts::PI),
        ("4 * atan(1) + 0 * exp(1)", std::f64::consts::PI),
        ("sin(1)", 0.841_470_984_807_896_5),
        ("2^0.5", std::f64::consts::SQRT_2),
        // Cancels to the last digits.
        ("sqrt(2) * sqrt(2) - 2 + 1e-60", 1e-60),
        ("(1 + 1e-40) * exp(1) / exp(1) - 1", 1e-40),
    ] {
        let found = evaluate(text).unwrap();
        assert!(!found.exact && found.value.to_f64() == value, "{text}: {}", found.value);
    }
}

#[test]
fn conditions_are_one_or_zero() {
    for (text, value) in [
        ("1 < 2", 1),
        ("2 <= 1", 0),
        ("1 < 2 and 2 < 1", 0),
        ("1 < 2 or 2 < 1", 1),
        ("2 < 1 or 1 < 2 and 2 < 1", 0),
        ("not 2 < 1 and 1 < 2", 1),
        ("not (2 < 1 or 1 < 2)", 0),
        ("(1 < 2) + (3 < 4)", 2),
        ("not 0.6", 0),
        ("0.6 and 0.4 or 0", 0),
        ("if(0.6, 7, 8)", 7),
        ("if(not 0.6 or 3 kg > 2 kg and m_rack == 2 kg, 7, 8)", 7),
        ("if(3 > 2 and 3 > 4, 7, 8)", 8),
    ] {
        let Ok(found) = evaluate(text) else {
            assert!(text.ends_with("and1"), "{text}");
            continue;
        };
        assert!(found.exact && found.value == Exact::from_integer(value), "{text}: {}", found.value);
        assert!(found.dimension.is_like(&Dimension::NONE), "{text}");
    }
}

/// `m.s` is the position of a mass, whatever stands before it; `m` alone behind a number is a metre.
#[test]
fn names_with_a_point_are_no_units() {
    let read = Expression::parse_law("5 N/m*m.s + 2 N/m*m.s").unwrap();
    assert_eq!(read.names(), ["m.s"]);
}

#[test]
fn errors_are_reported_at_their_place() {
    for (text, message, place) in [
        ("m_rack + r_pinion", "expected a mass, found a length", "r_pinion"),
        ("2 * nothing", "there is no parameter `nothing`", "nothing"),
        ("2 * kg", "there is no parameter `kg`, and a unit must follow a number", "kg"),
        ("1 kg / (zero * 2)", "division by zero: this part is 0", "(zero * 2)"),
        ("zero^-1", "division by zero: this part is 0", "zero"),
        ("sqrt(-4)", "the square root of a negative number", "-4"),
        ("sqrt(3 kg)", "a mass has no square root", "3 kg"),
        ("ln(zero)", "the logarithm of a number that is not above zero", "zero"),
        ("asin(2)", "the arc of a number outside of -1 to 1", "2"),
        ("tan(90 deg)", "the tangent has no value here", "90 deg"),
        ("sin(3 kg)", "expected an angle, found a mass", "3 kg"),
        ("2^(1 kg)", "expected a number without a unit, found a mass", "(1 kg)"),
        ("exp(1000)", "this part is too large", "exp(1000)"),
        ("sine(1)", "unknown function `sine`", "sine"),
        ("2 * (3 + 4", "a `(` without its `)`: found the end of the text", "(3 + 4"),
        ("atan2(1)", "`atan2` takes 2 values, not 1", "atan2(1)"),
        ("if(1 kg, 2, 3)", "expected a number without a unit, found a mass", "1 kg"),
        ("if(1 < 2 < 3, 2, 3)", "a comparison of a comparison", "<"),
        ("m_rack > r_pinion", "expected a mass, found a length", "r_pinion"),
        ("1 and m_rack", "expected a number without a unit, found a mass", "m_rack"),
        ("1 < 2 and", "expected a number, a name or `(`, found the end of the text", ""),
        ("1 < 2 and or 3", "expected a number, a name or `(`, found `or`", "or"),
        ("not", "expected a number, a name or `(`, found the end of the text", ""),
        ("1 = 2", "unexpected `=` in an expression", "="),
        ("1 < 2 && 3 < 4", "unexpected `&` in an expression", "&"),
        ("2 kg 3", "unexpected `3` in an expression", "3"),
        ("3 foo * 2", "unknown unit `foo`", "foo"),
        ("2 * ", "expected a number, a name or `(`, found the end of the text", ""),
        ("2 kg^2^3", "it is not clear what this is a power of", "^"),
        ("m / 2/5", "it is not clear whether the first `/` divides by `2` or by `2/5`", "2/5"),
        ("1 / pi/5", "it is not clear whether the first `/` divides by `pi` or by `pi/5`", "pi/5"),
        ("m^2 kg", "unexpected `k` in an expression", "k"),
        ("2 pi^(1 kg)", "expected a number without a unit, found a mass", "(1 kg)"),
        ("1 N/m s + v", "it is not clear whether `/` also divides by `s`", "s"),
    ] {
        let error = evaluate(text).expect_err(text);
        assert_eq!((error.message.as_str(), &text[error.span.clone()]), (message, place), "{text}");
        assert!(error.help.is_some(), "{text}");
    }
}

#[test]
fn hostile_expressions_come_to_an_end() {
    for text in [
        "(".repeat(1000),
        "-".repeat(1000),
        "2^".repeat(500) + "2",
        "1+".repeat(511) + "1",
        format!("{}2{}", "(".repeat(60), ")^64".repeat(60)),
        format!("{}sqrt(2){}", "(".repeat(60), ")^64".repeat(60)),
        format!("{}pi{}", "(".repeat(60), ")^64".repeat(60)),
        format!("{}pi{}", "(".repeat(60), ")^-9".repeat(60)),
        "sin(1e300)".into(),
        "exp(".repeat(60) + "1" + &")".repeat(60),
        "if(1<2,".repeat(60),
        "not ".repeat(250),
        "(1<2 or 3<2) and ".repeat(50) + "1<2",
        "9".repeat(5000),
    ] {
        let _ = evaluate(&text);
    }
}

proptest! {
    /// Of whole numbers, against fractions.
    #[test]
    fn sums_products_and_quotients_are_those_of_fractions(a in -50i64..50, b in -50i64..50, c in 1i64..50, d in -50i64..50) {
        let found = evaluate(&format!("({a} - {b}) / {c} + {d} * ({b} + 1/{c})")).unwrap();
        let [a, b, c, d] = [a, b, c, d].map(RBig::from);
        prop_assert_eq!(found.value.rational, (&a - &b) / &c + &d * (&b + RBig::ONE / &c));
    }

    #[test]
    fn any_text_is_read_or_refused(text in any::<String>(), near in "[-+*/^(), <>=0-9eE.a-z_ ]{0,60}") {
        for text in [text, near] {
            if let Err(error) = evaluate(&text) {
                prop_assert!(error.span.start <= error.span.end && error.span.end <= text.len() + 1, "{}", text);
            }
        }
    }
}

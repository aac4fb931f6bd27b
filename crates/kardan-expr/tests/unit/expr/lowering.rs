//! Tests of `src/expr/lowering.rs`.

use proptest::prelude::*;

use super::*;
use crate::expr::{Floating, lower};
use kardan_math::num::rational_from_f64;

/// With x, y and z as constants, and as symbols.
fn both(text: &str, values: [f64; 3]) -> Option<[f64; 2]> {
    let law = Expression::parse_law(text).unwrap();
    let place = |name: &str| ["x", "y", "z"].iter().position(|resolved| *resolved == name);
    let constant = |name: &str| Some((Exact::new(rational_from_f64(values[place(name)?])?, 0), Dimension::NONE));
    let expected = law.evaluate(&constant).ok()?.value.to_f64();
    let mut graph = Graph::default();
    let mut names = |graph: &mut Graph, name: &str| {
        place(name)?;
        Some(Named::Varying(graph.symbol(name, Dimension::NONE), Dimension::NONE))
    };
    let (expr, dimension) = graph.lowered(&law, &mut names).unwrap();
    assert!(dimension.is_like(&Dimension::NONE), "{text}");
    let value = |symbol| values[place(graph.name(symbol).0).unwrap()];
    let found = lower(&graph, &[expr], &mut Floating::<f64>::default(), value);
    Some([found[0], expected])
}

proptest! {
    /// The graph has the values of the expression.
    #[test]
    fn graphs_compute_what_is_written(x in 0.1f64..3.0, y in 0.1f64..3.0, z in -3.0f64..3.0) {
        for text in [
            "x + y*z - 2/x", "x^3 - y^-2 + x^y", "sin(x) + cos(y*z) + tan(x/4)", "asin(x/4) + acos(z/4) - atan(z)",
            "atan2(z, x) * exp(z) + ln(y)", "abs(z) + min(x, y, z) - max(x, z) + sign(z)", "sqrt(x + y) / (1 + z^2)",
            "if(x < y, z, 2*z) + if(x >= y, 1, x) + if(x == x, x, y) + if(z != z, x, y) + if(x <= y, 3, x) + if(y > z, x, y)",
            "-z * 2 pi x", "sqrt(2) * x + sin(1) * (z - 1/3)",
        ] {
            // `2 pi x` is no product of a law without `t`.
            let text = text.replace("2 pi x", "2 pi * x");
            let Some([found, expected]) = both(&text, [x, y, z]) else { continue };
            prop_assert!((found - expected).abs() <= 1e-13 * (1.0 + expected.abs()), "{}: {} {}", text, found, expected);
        }
    }
}

#[test]
fn errors_of_laws_are_reported_at_their_place() {
    let mut graph = Graph::default();
    let mut names = |graph: &mut Graph, name: &str| {
        let dimension = match name {
            "t" => Dimension::TIME,
            "arm.phi" | "big-arm.phi" => Dimension::ANGLE,
            "arm.w" => Dimension::ANGULAR_VELOCITY,
            _ => return None,
        };
        Some(Named::Varying(graph.symbol(name, dimension), dimension))
    };
    for (text, message, place) in [
        ("2 N m * sin(arm.w)", "expected an angle, found an angular velocity", "arm.w"),
        ("arm.phi + arm.w", "expected an angle, found an angular velocity", "arm.w"),
        ("2 * arm.fi", "there is no parameter `arm.fi`", "arm.fi"),
        (
            "arm.w^0.5",
            "only a number without a unit has a power that is not whole; this is an angular velocity",
            "arm.w",
        ),
        ("arm.phi / (1 - 1)", "division by zero: this part is 0", "(1 - 1)"),
        ("arm.phi * sqrt(-1)", "the square root of a negative number", "-1"),
        ("1 / 2 t", "it is not clear whether `/` also divides by `t`", "t"),
        ("'arm.phi", "a name within `'` needs its second `'`", "'arm.phi"),
    ] {
        let read = Expression::parse_law(text).and_then(|law| graph.lowered(&law, &mut names));
        let error = read.expect_err(text);
        assert_eq!((error.message.as_str(), &text[error.span.clone()]), (message, place), "{text}");
    }
    for (text, dimension) in [
        ("10 deg * sin(2 pi t / 1 s)", Dimension::ANGLE),
        ("3 t", Dimension::TIME),
        ("'big-arm.phi' * 2 N m/rad", Dimension::TORQUE),
        ("1/2 t^2 * 2 N m/s^2", Dimension::TORQUE),
    ] {
        let law = Expression::parse_law(text).unwrap();
        let (_, found) = graph.lowered(&law, &mut names).unwrap();
        assert!(found.is_like(&dimension), "{text}: {}", found.si());
    }
}

//! Tests of `src/expr/integral.rs`.

use super::*;
use crate::expr::Named;
use kardan_math::units::Expression;

fn of(text: &str, parts: Vec<(Expr, Arc<Part>)>, mut graph: Graph) -> OfTime {
    let time = graph.symbol("t", Dimension::NONE);
    let mut names =
        |graph: &mut Graph, name: &str| Some(Named::Varying(graph.symbol(name, Dimension::NONE), Dimension::NONE));
    let (value, _) = graph.lowered(&Expression::parse_law(text).unwrap(), &mut names).unwrap();
    OfTime::new(graph, time, parts, value, Dimension::NONE).unwrap()
}

/// The derivative of the integral is the function, which is zero at the start; an integral without a closed form is reported.
#[test]
fn the_derivative_of_an_integral_is_the_function() {
    for text in ["3", "2 * t + t^3 / 4", "5 * sin(2 * pi * t + 1) - cos(3 * t)", "exp(-t / 2) * 4 + 1"] {
        let function = of(text, Vec::new(), Graph::default());
        let integral = function.integral().unwrap();
        assert_eq!(integral.value(0.0), 0.0, "{text}");
        for time in [0.0, 0.3, 2.0] {
            assert!((integral.rate().value(time) - function.value(time)).abs() < 1e-14, "{text}");
        }
    }
    for text in ["t * sin(t)", "sin(t)^2", "sin(t^2)", "1 / (1 + t)"] {
        assert!(of(text, Vec::new(), Graph::default()).integral().is_none(), "{text}");
    }
}

/// A triangle of height 2 over 1 s to 3 s, and 1 more from 4 s on: 2, and with the time past 4 s.
#[test]
fn pieces_are_summed_up() {
    let rise = (1.0, [0.0, 2.0, 0.0, 0.0]);
    let pieces = Pieces::new([rise, (2.0, [2.0, -2.0, 0.0, 0.0]), (3.0, [0.0; 4]), (4.0, [1.0, 0.0, 0.0, 0.0])]);
    let part = Arc::new(Part { name: "p".into(), dimension: Dimension::NONE, pieces, reported: false });
    let mut graph = Graph::default();
    let symbol = graph.symbol("p", Dimension::NONE);
    let integral = of("3 * p", vec![(symbol, part)], graph).integral().unwrap();
    for (time, value) in [(0.5, 0.0), (1.5, 0.75), (2.0, 3.0), (3.5, 6.0), (6.0, 12.0)] {
        assert_eq!(integral.value(time), value, "{time} s");
    }
}

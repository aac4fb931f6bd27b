//! Derivatives where expressions bend: one-sided ones of the whole expression.

use kardan::expr::{Expr, Floating, Graph, Interval, Named, Place, Rationals, Surd, Symbol, linear_sides, lower};
use kardan::num::{Rational, rational_from_f64};
use kardan::units::{Dimension, Expression};
use proptest::prelude::*;

/// A place at zero, left along each symbol.
struct AtZero(Vec<Symbol>);

impl Place for AtZero {
    fn place(&self, symbol: Symbol) -> Option<usize> {
        self.0.iter().position(|own| *own == symbol)
    }

    fn exact(&self, _: Symbol) -> Option<Surd> {
        Some(Surd::rational(Rational::ZERO))
    }

    fn value(&self, _: Symbol) -> f64 {
        0.0
    }

    fn enclosure(&self, _: Symbol) -> Interval {
        Interval::point(0.0)
    }

    fn moves(&self, symbol: Symbol) -> Vec<(usize, Rational)> {
        self.place(symbol).map(|place| (place, Rational::ONE)).into_iter().collect()
    }
}

fn lowered(text: &str) -> (Graph, Expr, AtZero) {
    let law = Expression::parse_law(text).unwrap();
    let mut graph = Graph::default();
    let symbols = ["x", "y"].map(|name| {
        let symbol = graph.symbol(name, Dimension::NONE);
        graph.symbol_of(symbol).unwrap()
    });
    let mut names = |graph: &mut Graph, name: &str| {
        ["x", "y"].contains(&name).then(|| Named::Varying(graph.symbol(name, Dimension::NONE), Dimension::NONE))
    };
    let (expr, _) = graph.lowered(&law, &mut names).unwrap_or_else(|error| panic!("{text}: {}", error.message));
    (graph, expr, AtZero(symbols.to_vec()))
}

/// The derivatives by x and y on each side, exact.
fn slopes(text: &str) -> Vec<[Rational; 2]> {
    let (mut graph, expr, place) = lowered(text);
    let sides = linear_sides(&mut graph, &[expr], &place).expect("few sides");
    let of = |side: &kardan::expr::Linear| {
        assert_eq!(side.values[0].exact, Some(side_value(&graph, expr)), "{text}");
        [0, 1].map(|place| {
            let slope = side.slopes[0].iter().find(|(own, _)| *own == place);
            slope.map_or(Rational::ZERO, |(_, slope)| slope.exact.clone().expect("a fraction"))
        })
    };
    let mut out: Vec<[Rational; 2]> = sides.iter().map(of).collect();
    out.sort();
    out.dedup();
    out
}

fn side_value(graph: &Graph, expr: Expr) -> Rational {
    lower(graph, &[expr], &mut Rationals, |_| Some(Rational::ZERO)).remove(0).expect("a fraction")
}

fn whole(rows: &[[i64; 2]]) -> Vec<[Rational; 2]> {
    let mut rows: Vec<[Rational; 2]> = rows.iter().map(|row| row.map(Rational::from)).collect();
    rows.sort();
    rows
}

/// What equals a smooth function has exactly its derivative; what bends has the derivatives of all its sides and of no others.
#[test]
fn all_parts_are_on_the_same_side() {
    for (text, expected) in [
        ("sign(x) * 6 * abs(x)", &[[6, 0]][..]),
        ("if(x > 0, 1, -1) * abs(x)", &[[1, 0]]),
        ("if(0 < x, 1, -1) * abs(-2 * x)", &[[2, 0]]),
        ("if(x >= 0, 1, -1) * abs(x) * cos(y)", &[[1, 0]]),
        ("sign(-x) * abs(x)", &[[-1, 0]]),
        ("max(x, 0) + min(x, 0)", &[[1, 0]]),
        ("max(0, -x) * sign(x) + max(x, 0)", &[[1, 0]]),
        ("if(x > 0, x, if(x < 0, 3 * x - 2 * x, 5 * x))", &[[1, 0]]),
        ("abs(abs(x)) * sign(3 * x)", &[[1, 0]]),
        ("abs(x - y) * sign(2 * y - 2 * x)", &[[-1, 1]]),
        ("min(abs(x), abs(y)) * sign(x) * sign(y) * 0", &[[0, 0]]),
        ("max(x, y) + min(x, y)", &[[1, 1]]),
        ("sqrt(4) * sign(x^3) * abs(x)", &[[2, 0]]),
        ("abs(x + abs(x)) - abs(x) - x", &[[0, 0]]),
        ("if(x^2 + y^2 > 0, 3 * x, 7 * x)", &[[3, 0]]),
        ("sign(sign(x) * abs(x)) * abs(x)", &[[1, 0]]),
        // These bend.
        ("abs(x)", &[[-1, 0], [1, 0]]),
        ("max(x, 0)", &[[0, 0], [1, 0]]),
        ("sign(x) * min(2 * abs(x), 5) + max(y, 0)", &[[2, 0], [2, 1]]),
        ("abs(x) + 3 * abs(y)", &[[-1, -3], [-1, 3], [1, -3], [1, 3]]),
        // x < y, and between both: never x > 0 > y with x < y.
        ("max(max(x, 0), max(y, 0))", &[[0, 0], [0, 1], [1, 0]]),
        ("if(x > y, max(x - y, 0), 0)", &[[0, 0], [1, -1]]),
        ("abs(x + abs(x))", &[[0, 0], [2, 0]]),
    ] {
        assert_eq!(slopes(text), whole(expected), "{text}");
    }
}

/// A smooth function written in pieces, and what it is: x times a power of its size that an even factor makes.
fn pieces() -> impl Strategy<Value = (String, String)> {
    let leaf = prop_oneof![
        Just(("sign(#) * abs(#)", "#")),
        Just(("if(# > 0, 1, -1) * abs(#)", "#")),
        Just(("if(# <= 0, -1, 1) * abs(-2 * #) / 2", "#")),
        Just(("max(#, 0) + min(#, 0)", "#")),
        Just(("max(abs(#), -#) * sign(#)", "#")),
        Just(("if(# < 0, if(# < 0, #, 7), if(# > 0, #, 0))", "#")),
        Just(("abs(#) * abs(#)", "#^2")),
        Just(("sign(#) * sin(abs(#))", "sin(#)")),
        Just(("cos(abs(#))", "cos(#)")),
        Just(("sign(#) * (exp(abs(#)) - exp(-abs(#)))", "exp(#) - exp(-#)")),
        Just(("max(#, -#) * # * sign(#)", "#^2")),
    ];
    let guard = prop_oneof![Just("x"), Just("y"), Just("(x - y)"), Just("(2 * x + 3 * y)"), Just("(x - x^2)")];
    let one = (leaf, guard)
        .prop_map(|((pieces, smooth), guard)| (pieces.replace('#', guard), smooth.replace('#', guard)))
        .prop_map(|(pieces, smooth)| (format!("({pieces})"), format!("({smooth})")));
    one.prop_recursive(3, 8, 2, |inner| {
        prop_oneof![
            (inner.clone(), inner.clone())
                .prop_map(|(a, b)| (format!("({} + 3 * {})", a.0, b.0), format!("({} + 3 * {})", a.1, b.1))),
            (inner.clone(), inner.clone())
                .prop_map(|(a, b)| (format!("{} * {}", a.0, b.0), format!("{} * {}", a.1, b.1))),
            inner.prop_map(|(a, b)| (format!("(sign({a}) * abs({a}))"), b)),
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    /// However it is cut in pieces, a smooth function has its derivative.
    #[test]
    fn smooth_functions_in_pieces_have_their_derivative((pieces, smooth) in pieces()) {
        // Of many guards the sides are too many, which is said.
        let (mut graph, expr, place) = lowered(&pieces);
        prop_assume!(linear_sides(&mut graph, &[expr], &place).is_some_and(|sides| sides.len() < 40));
        prop_assert_eq!(slopes(&pieces), slopes(&smooth), "{} against {}", pieces, smooth);
    }

    /// On each side the derivative along a direction into it is the limit of difference quotients.
    #[test]
    fn sides_have_the_limits_of_difference_quotients(
        direction in [-1.0f64..1.0, -1.0f64..1.0],
        which in 0usize..6,
    ) {
        let text = [
            "abs(x) * exp(y) + 2 * max(x - y, 0)",
            "max(sin(x), 2 * y) - min(x, y * cos(x))",
            "if(x > 2 * y, 3 * x - 6 * y, x - 2 * y) * (1 + y)",
            "sign(x) * min(abs(x), 2 * abs(y))",
            "abs(x + abs(y)) - abs(x - y)",
            "max(0, min(x, y)) + abs(abs(x) - abs(y))",
        ][which];
        prop_assume!(direction.iter().all(|x| x.abs() > 0.05) && (direction[0].abs() - direction[1].abs()).abs() > 0.05);
        prop_assume!((direction[0].abs() - 2.0 * direction[1].abs()).abs() > 0.05);
        let (mut graph, expr, place) = lowered(text);
        let sides = linear_sides(&mut graph, &[expr], &place).expect("few sides");
        let names = ["x", "y"];
        let at = |graph: &Graph, step: f64| lower(graph, &[expr], &mut Floating::<f64>::default(), |symbol| {
            step * direction[names.iter().position(|name| *name == graph.name(symbol).0).unwrap()]
        })[0];
        let step = 1e-7;
        let quotient = (at(&graph, step) - at(&graph, 0.0)) / step;
        let slope_in_direction = |side: &kardan::expr::Linear| -> f64 {
            side.slopes[0].iter().map(|(place, slope)| slope.value * direction[*place]).sum()
        };
        prop_assert!(sides.iter().any(|side| (slope_in_direction(side) - quotient).abs() < 1e-5), "{}: {} {:?}", text, quotient, direction);
        prop_assert!(rational_from_f64(quotient).is_some());
    }
}

//! Expressions and plans: exact identities, and that each way to evaluate agrees with each other one.

use kardan::expr::{
    Expr, Floating, Function, Graph, Interval, Intervals, PiecewisePolynomial, Rationals, Style, Symbol, forward,
    lower, printed, slopes_at,
};
use kardan::num::{Rational, rational_from_f64, rational_to_f64};
use kardan::plan::{Plan, Series, compile, parse};
use kardan::units::Dimension;
use kardan_native::Value;
use kardan_rt::Lanes;
use proptest::prelude::*;

/// Squares of squares have powers and numbers of any size: at a half and at one, and of twice that.
#[test]
fn repeated_squares_have_their_values() {
    for (factor, at, expected) in [(1, 0.5, 0.0), (1, 1.0, 1.0), (2, 0.5, 1.0), (2, 0.25, 0.0), (3, 1.0, f64::INFINITY)]
    {
        let mut graph = Graph::default();
        let x = graph.symbol("x", Dimension::NONE);
        let mut squared = graph.scale(factor.into(), x);
        for _ in 0..70 {
            squared = graph.multiply(squared, squared);
        }
        assert_eq!(lower(&graph, &[squared], &mut Floating::<f64>::default(), |_| at), [expected], "{factor} {at}");
        let inverse = graph.power(squared, -1);
        assert_eq!(
            lower(&graph, &[inverse], &mut Floating::<f64>::default(), |_| at),
            [1.0 / expected],
            "{factor} {at}"
        );
    }
}

/// A number of a sequence that follows from its seed.
struct Draw(u64);

impl Draw {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % count
    }

    fn number(&mut self) -> Rational {
        Rational::from_parts((self.below(41) as i64 - 20).into(), (self.below(9) as u64 + 1).into())
    }
}

fn table() -> PiecewisePolynomial {
    let points = [(-2, 1), (0, 0), (1, 3), (4, 2)].map(|(x, y)| (Rational::from(x), Rational::from(y)));
    PiecewisePolynomial::through(&points).unwrap()
}

/// Operations of a random graph: rational, any, or those that have series.
#[derive(Clone, Copy, PartialEq)]
enum Kinds {
    Rational,
    Any,
    Smooth,
}

impl Kinds {
    fn draw(self, draw: &mut Draw) -> usize {
        match self {
            Self::Rational => draw.below(6),
            Self::Any => draw.below(14),
            Self::Smooth => [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 14, 14, 14][draw.below(13)],
        }
    }
}

/// A graph with three symbols and an expression of some operations.
fn random(seed: u64, operations: usize, kinds: Kinds) -> (Graph, [Symbol; 3], Expr) {
    let (mut graph, mut draw) = (Graph::default(), Draw(seed));
    let symbols = ["x", "y", "z"].map(|name| graph.symbol(name, Dimension::NONE));
    let mut pool: Vec<Expr> = symbols.to_vec();
    pool.push(graph.pi());
    if kinds == Kinds::Rational {
        pool.pop();
    }
    for _ in 0..operations {
        let [a, b, c, d] = [(); 4].map(|()| pool[draw.below(pool.len())]);
        let new = match kinds.draw(&mut draw) {
            0 => graph.add(a, b),
            1 => graph.subtract(a, b),
            2 => graph.multiply(a, b),
            3 => {
                // A quotient that never divides by zero.
                let square = graph.power(b, 2);
                let below = graph.sum(Rational::ONE, &[(square, Rational::ONE)]);
                graph.divide(a, below)
            }
            4 => {
                let terms = [(a, draw.number()), (b, draw.number()), (c, draw.number())];
                graph.sum(draw.number(), &terms)
            }
            5 => graph.power(a, 2),
            6 => graph.apply(Function::Sin, a),
            7 => graph.apply(Function::Cos, a),
            8 => graph.apply(Function::Atan, a),
            9 => graph.atan2(a, b),
            10 => graph.min(a, b),
            11 => graph.select(a, b, c, d),
            12 => graph.table(table(), a),
            14 => {
                let square = graph.power(a, 2);
                let above = graph.sum(Rational::ONE, &[(square, Rational::ONE)]);
                let bounded = graph.divide(a, above);
                let (function, of) = [
                    (Function::Sqrt, above),
                    (Function::Ln, above),
                    (Function::Exp, a),
                    (Function::Tan, a),
                    (Function::Asin, bounded),
                    (Function::Acos, bounded),
                ][draw.below(6)];
                graph.apply(function, of)
            }
            _ => {
                let square = graph.power(a, 2);
                let sum = graph.sum(Rational::ONE, &[(square, Rational::ONE)]);
                let function = [Function::Sqrt, Function::Ln, Function::Abs][draw.below(3)];
                graph.apply(function, sum)
            }
        };
        pool.push(new);
    }
    let symbols = symbols.map(|symbol| graph.symbol_of(symbol).unwrap());
    (graph, symbols, *pool.last().unwrap())
}

fn at(symbols: [Symbol; 3], values: [f64; 3]) -> impl Fn(Symbol) -> f64 {
    move |symbol| values[symbols.iter().position(|other| *other == symbol).unwrap()]
}

fn evaluated(plan: &Plan, inputs: &[f64]) -> f64 {
    let mut storage = plan.memory();
    storage[..inputs.len()].copy_from_slice(inputs);
    let _ = plan.block().evaluate(&mut storage);
    plan.block().output(0, &storage).unwrap_or(f64::NAN)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// A plan, one lane or many, has the bits of the graph evaluated directly; its text is the plan.
    #[test]
    fn a_plan_is_its_graph_bit_for_bit(seed in any::<u64>(), x in prop::array::uniform3(-3.0f64..3.0)) {
        let (graph, symbols, target) = random(seed, 30, Kinds::Any);
        let plan = compile(&graph, &symbols, &[("f".into(), target)]).unwrap();
        let direct = lower(&graph, &[target], &mut Floating::<f64>::default(), at(symbols, x))[0];
        let found = evaluated(&plan, &x);
        prop_assert!(found.to_bits() == direct.to_bits() || !direct.is_finite(), "{found} {direct}");
        prop_assert_eq!(&parse(&plan.to_string()).unwrap(), &plan);
        let again = compile(&graph, &symbols, &[("f".into(), target)]).unwrap();
        prop_assert_eq!(again, plan.clone());
        // Four lanes: each another point.
        let points: [[f64; 3]; 4] = std::array::from_fn(|lane| x.map(|x| x * (1.0 + 0.125 * lane as f64)));
        let mut storage: Vec<Lanes<f64, 4>> = vec![Lanes([0.0; 4]); plan.memory().len()];
        let block = plan.block();
        block.begin(&mut storage);
        for (k, input) in storage[..3].iter_mut().enumerate() {
            *input = Lanes(points.map(|point| point[k]));
        }
        let _ = block.evaluate(&mut storage);
        if let Some(lanes) = block.output(0, &storage) {
            for (point, lane) in points.iter().zip(lanes.0) {
                prop_assert_eq!(evaluated(&plan, point).to_bits(), lane.to_bits());
            }
        }
    }

    /// Intervals hold the values at all points in them: 300 times 350 points.
    #[test]
    fn intervals_hold_every_value(seed in any::<u64>(), x in prop::array::uniform3(-3.0f64..3.0), width in 0.0f64..1.0) {
        let (graph, symbols, target) = random(seed, 14, Kinds::Any);
        let range = |symbol| { let low = at(symbols, x)(symbol); Interval { low, high: low + width } };
        let found = lower(&graph, &[target], &mut Intervals, range)[0];
        let plan = compile(&graph, &symbols, &[("f".into(), target)]).unwrap();
        let mut draw = Draw(seed ^ 5);
        for _ in 0..350 {
            let point = x.map(|x| (x + width * draw.below(1001) as f64 / 1000.0).min(x + width));
            let value = evaluated(&plan, &point);
            prop_assert!(!value.is_finite() || found.contains(value), "{value} is not in {found:?}");
        }
    }

    /// Over the rationals the derivative is what difference quotients tend to: with a tenth of the step a hundredth of the error.
    #[test]
    fn derivatives_are_limits_of_exact_quotients(seed in any::<u64>(), x in prop::array::uniform3(-2.0f64..2.0)) {
        let (mut graph, symbols, target) = random(seed, 8, Kinds::Rational);
        let x = x.map(|x| rational_from_f64((x * 64.0).round() / 64.0).unwrap());
        for by in 0..3 {
            let slope = graph.derivative(target, symbols[by]);
            let value = |expr: Expr, step: &Rational| {
                let at = |symbol| {
                    let k = symbols.iter().position(|other| *other == symbol).unwrap();
                    Some(if k == by { &x[k] + step } else { x[k].clone() })
                };
                lower(&graph, &[expr], &mut Rationals, at)[0].clone().unwrap()
            };
            let slope = value(slope, &Rational::ZERO);
            let error = |power: usize| {
                let step = Rational::ONE / Rational::from(10u8).pow(power as isize);
                let quotient = (value(target, &step) - value(target, &-step.clone())) / (step * Rational::from(2));
                rational_to_f64(&(quotient - &slope)).abs()
            };
            let (coarse, fine) = (error(12), error(13));
            prop_assert!(fine <= 0.0101 * coarse, "{coarse:e} {fine:e}");
        }
    }

    /// Slopes in one pass are those of the derivatives: exactly over the rationals, and with one number in both of two intervals over smooth functions.
    #[test]
    fn slopes_in_one_pass_are_derivatives(seed in any::<u64>(), x in prop::array::uniform3(-2.0f64..2.0)) {
        let place = |symbols: &[Symbol], symbol| symbols.iter().position(|other| *other == symbol).unwrap();
        let (mut graph, symbols, target) = random(seed, 8, Kinds::Rational);
        let at = |k: usize| rational_from_f64((x[k] * 64.0).round() / 64.0);
        let argument = |symbol| (at(place(&symbols, symbol)), Some(place(&symbols, symbol)));
        let found = forward(&graph, &[target], Rationals, argument).swap_remove(0).slopes;
        for by in 0..3 {
            let derivative = graph.derivative(target, symbols[by]);
            let slope = lower(&graph, &[derivative], &mut Rationals, |symbol| argument(symbol).0)[0].clone().unwrap();
            let own = found.iter().find(|(place, _)| *place == by);
            prop_assert_eq!(own.map_or(Rational::ZERO, |(_, slope)| slope.clone().unwrap()), slope);
        }
        let (mut graph, symbols, target) = random(seed, 8, Kinds::Smooth);
        let argument = |symbol| (Interval::point(x[place(&symbols, symbol)]), Some(place(&symbols, symbol)));
        let found = forward(&graph, &[target], Intervals, argument).swap_remove(0).slopes;
        for by in 0..3 {
            let derivative = graph.derivative(target, symbols[by]);
            let slope = lower(&graph, &[derivative], &mut Intervals, |symbol| argument(symbol).0)[0];
            let own = found.iter().find(|(place, _)| *place == by).map_or(Interval::point(0.0), |(_, slope)| *slope);
            prop_assert!(!(own.low > slope.high || own.high < slope.low), "{own:?} {slope:?}");
        }
    }

    /// What is substituted by itself is the same node, and the value of one with numbers put in is that of the other.
    #[test]
    fn substitution_is_evaluation(seed in any::<u64>(), x in prop::array::uniform3(-2i64..3)) {
        let (mut graph, symbols, target) = random(seed, 10, Kinds::Rational);
        let own: Vec<_> = ["x", "y", "z"].map(|name| graph.symbol(name, Dimension::NONE)).to_vec();
        let itself: Vec<_> = symbols.into_iter().zip(own).collect();
        prop_assert_eq!(graph.substitute(&[target], &itself), vec![target]);
        let numbers: Vec<_> = symbols.into_iter().zip(x.map(|x| graph.integer(x))).collect();
        let put = graph.substitute(&[target], &numbers)[0];
        let at = |symbol| Some(Rational::from(x[symbols.iter().position(|other| *other == symbol).unwrap()]));
        let value = lower(&graph, &[target], &mut Rationals, at)[0].clone().unwrap();
        prop_assert_eq!(graph.number_of(put), Some(&value));
    }
}

#[test]
fn derivatives_of_functions() {
    let mut graph = Graph::default();
    let x = graph.symbol("x", Dimension::NONE);
    let by = graph.symbol_of(x).unwrap();
    // f, f′ at 0.3 from the definition by hand.
    let at = 0.3_f64;
    let expected = [
        (Function::Sqrt, 0.5 / at.sqrt()),
        (Function::Sin, at.cos()),
        (Function::Cos, -at.sin()),
        (Function::Tan, 1.0 + at.tan().powi(2)),
        (Function::Asin, 1.0 / (1.0 - at * at).sqrt()),
        (Function::Acos, -1.0 / (1.0 - at * at).sqrt()),
        (Function::Atan, 1.0 / (1.0 + at * at)),
        (Function::Exp, at.exp()),
        (Function::Ln, 1.0 / at),
        (Function::Abs, 1.0),
    ];
    for (function, slope) in expected {
        let value = graph.apply(function, x);
        let derivative = graph.derivative(value, by);
        let found = lower(&graph, &[derivative], &mut Floating::<f64>::default(), |_| at)[0];
        assert!((found - slope).abs() < 1e-15 * (1.0 + slope.abs()), "{function:?}: {found} {slope}");
        let at_once = slopes_at(&graph, &[value], (&[by], &[at]))[0][0].1;
        assert!((at_once - slope).abs() < 1e-15 * (1.0 + slope.abs()), "{function:?}: {at_once} {slope}");
        let single = lower(&graph, &[derivative], &mut Floating::<f32>::default(), |_| at as f32)[0];
        assert!((f64::from(single) - slope).abs() < 1e-6 * (1.0 + slope.abs()), "{function:?}: {single} {slope}");
    }
}

/// Where exponentials overflow and a quotient does not, neither does its derivative: those of `a/(c + d exp(k x))`, and of a sum of two exponentials, which
/// is 1/(2 cosh x), are the closed forms for small x, and what these tend to for large ones.
#[test]
fn derivatives_of_quotients_do_not_overflow() {
    let mut graph = Graph::default();
    let x = graph.symbol("x", Dimension::NONE);
    let by = graph.symbol_of(x).unwrap();
    let mut exponential = |k: i64| {
        let u = graph.scale(k.into(), x);
        graph.apply(Function::Exp, u)
    };
    let (up, down, fast) = (exponential(1), exponential(-1), exponential(3));
    let logistic = graph.sum(5.into(), &[(fast, 2.into())]);
    let cosh = graph.add(up, down);
    let scaled = graph.multiply(x, logistic);
    let check = |graph: &mut Graph, value: Expr, slope: &dyn Fn(f64) -> f64, limits: [f64; 2]| {
        let derivative = graph.derivative(value, by);
        let at = |x: f64| lower(graph, &[derivative], &mut Floating::<f64>::default(), |_| x)[0];
        for x in [-3.0, -0.5, 0.25, 1.0, 4.0] {
            assert!((at(x) - slope(x)).abs() <= 1e-14 * slope(x).abs(), "{x}: {} {}", at(x), slope(x));
            let at_once = slopes_at(graph, &[value], (&[by], &[x]))[0][0].1;
            assert!((at_once - slope(x)).abs() <= 1e-13 * slope(x).abs(), "{x}: {at_once} {}", slope(x));
        }
        for (x, limit) in [-4000.0, 4000.0].into_iter().zip(limits) {
            assert_eq!(at(x), limit, "{x}");
            assert_eq!(slopes_at(graph, &[value], (&[by], &[x]))[0][0].1, limit, "{x}");
        }
    };
    let inverse = graph.power(logistic, -1);
    let slope = |x: f64| -6.0 * (3.0 * x).exp() / (5.0 + 2.0 * (3.0 * x).exp()).powi(2);
    check(&mut graph, inverse, &slope, [0.0, 0.0]);
    let square = graph.power(logistic, -2);
    check(&mut graph, square, &|x| 2.0 * slope(x) / (5.0 + 2.0 * (3.0 * x).exp()), [0.0, 0.0]);
    let inverse = graph.power(cosh, -1);
    check(&mut graph, inverse, &|x| -x.sinh() / (2.0 * x.cosh().powi(2)), [0.0, 0.0]);
    // Of x/(5 + 2 exp(3 x)) the value tends to x/5 on one side.
    let over = graph.product(&[(x, 2), (scaled, -1)]);
    check(&mut graph, over, &|x| 1.0 / (5.0 + 2.0 * (3.0 * x).exp()) + x * slope(x), [0.2, 0.0]);
}

#[test]
fn kinks_are_named() {
    let mut graph = Graph::default();
    let (x, y) = (graph.symbol("x", Dimension::NONE), graph.symbol("y", Dimension::NONE));
    let size = graph.apply(Function::Abs, x);
    let least = graph.min(size, y);
    let bent = graph.table(table(), y);
    let all = graph.add(least, bent);
    let formula = |graph: &Graph, expr| printed(graph, expr, Style::Text, &str::to_owned);
    let kinks = graph.kinks(all);
    let texts: Vec<String> = kinks.iter().map(|kink| formula(&graph, *kink)).collect();
    for expected in ["x", "abs(x) - y", "y", "2 + y", "-1 + y", "-4 + y"] {
        let reordered = if expected == "abs(x) - y" { "-y + abs(x)" } else { expected };
        assert!(texts.iter().any(|word| word == expected || word == reordered), "{expected} is not in {texts:?}");
    }
    assert_eq!(texts.len(), 6, "{texts:?}");
    // Where it is smooth nothing is named.
    let smooth = graph.apply(Function::Sin, x);
    assert!(graph.kinks(smooth).is_empty());
}

#[test]
fn what_vanishes_vanishes_exactly() {
    let mut graph = Graph::default();
    let x = graph.symbol("x", Dimension::ANGLE);
    let (negated, pi) = (graph.negate(x), graph.pi());
    let zero = graph.integer(0);
    let pair = |graph: &mut Graph, function, a, b, sign| {
        let (a, b) = (graph.apply(function, a), graph.apply(function, b));
        graph.sum(Rational::ZERO, &[(a, Rational::ONE), (b, Rational::from(sign))])
    };
    assert_eq!(pair(&mut graph, Function::Sin, x, negated, 1), zero);
    assert_eq!(pair(&mut graph, Function::Cos, x, negated, -1), zero);
    let (multiplied, divided) = (graph.multiply(pi, x), graph.divide(x, pi));
    let square = graph.power(x, 2);
    let product = graph.multiply(multiplied, divided);
    assert_eq!(graph.subtract(product, square), zero);
    let four = graph.number(Rational::from_parts(9.into(), 4u8.into()));
    let root = graph.apply(Function::Sqrt, four);
    assert_eq!(graph.number_of(root).unwrap().to_string(), "3/2");
}

#[test]
fn constants_are_folded_exactly_and_rounded_once() {
    let mut graph = Graph::default();
    let (x, pi) = (graph.symbol("x", Dimension::NONE), graph.pi());
    let by = graph.symbol_of(x).unwrap();
    // x·π/180 is one product with the double nearest to π/180.
    let radians = graph.product(&[(x, 1), (pi, 1)]);
    let radians = graph.scale(Rational::from_parts(1.into(), 180u8.into()), radians);
    let plan = compile(&graph, &[by], &[("rad".into(), radians)]).unwrap();
    assert_eq!(plan.to_string(), "input x\nv1 = multiply x 0.017453292519943295\noutput rad = v1\n");
    // What nobody gives is named.
    assert_eq!(compile(&graph, &[], &[("rad".into(), radians)]), Err("x".into()));
}

#[test]
fn texts_that_are_no_plans_are_refused_with_their_line() {
    for (text, line, word) in [
        ("input x\nv1 = add x", 2, "operands"),
        ("input x\nv1 = hug x x", 2, "hug"),
        ("input x\nv1 = add x y", 2, "`y`"),
        ("input x\nv1 = add x v2\nv2 = add x x", 2, "later"),
        ("input x\nv2 = add x x", 2, "v1"),
        ("table 2 | 1 | 2 | 3", 1, "inconsistent"),
        ("nonsense", 1, "not a line"),
    ] {
        let error = parse(text).unwrap_err();
        assert!(error.line == line && error.what.contains(word), "{text}: {error}");
    }
}

/// Sums of symbols times constants are affine; products of symbols, powers and functions of them are not.
#[test]
fn affine_is_distinguished_from_nonlinear() {
    let mut g = Graph::default();
    let (x, y, pi) = (g.symbol("x", Dimension::NONE), g.symbol("y", Dimension::NONE), g.pi());
    let scaled = g.multiply(pi, y);
    let sum = g.add(x, scaled);
    let twist = g.group(sum);
    let (product, square, ratio) = (g.multiply(x, y), g.power(x, 2), g.divide(x, y));
    let bent = g.apply(Function::Sin, sum);
    let mixed = g.add(sum, square);
    let affine = g.affine();
    assert!([x, pi, scaled, sum, twist].into_iter().all(&affine));
    assert!(![product, square, ratio, bent, mixed].into_iter().any(affine));
}

/// `c_0 + c_1 t + … ` at t.
fn polynomial(coefficients: &[f64], t: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c)
}

/// Along a polynomial path of the inputs, the series of an expression is its value: every rule, alone and in combination.
#[test]
fn series_equal_the_values_on_a_path() {
    const ORDER: usize = 12;
    let (mut graph, names) = (Graph::default(), ["x", "y", "s"]);
    let [x, y, s] = names.map(|name| graph.symbol(name, Dimension::NONE));
    let one = Rational::ONE;
    let third = graph.scale(Rational::from_parts(1.into(), 3_u32.into()), x);
    let above = graph.sum(Rational::from(2), &[(x, one.clone())]);
    let quotient = graph.divide(y, above);
    let functions = [Function::Sin, Function::Cos, Function::Tan, Function::Asin, Function::Acos, Function::Atan];
    let mut targets: Vec<Expr> = functions.map(|function| graph.apply(function, third)).to_vec();
    targets.extend([Function::Sqrt, Function::Exp, Function::Ln].map(|function| graph.apply(function, above)));
    targets.push(graph.atan2(y, above));
    targets.push(quotient);
    let products = [graph.multiply(x, y), graph.multiply(s, y), graph.power(x, 3), graph.divide(x, s)];
    let all = [targets.clone(), products.to_vec()].concat();
    let terms: Vec<(Expr, Rational)> = all.iter().map(|expr| (*expr, Rational::from(2))).collect();
    let sum = graph.sum(Rational::from(1), &terms);
    let bent = graph.apply(Function::Sin, sum);
    targets.extend(products);
    targets.extend([sum, bent]);
    let outputs: Vec<(String, Expr)> = targets.iter().enumerate().map(|(k, expr)| (k.to_string(), *expr)).collect();
    let symbols = [x, y, s].map(|symbol| graph.symbol_of(symbol).unwrap());
    let plan = compile(&graph, &symbols, &outputs).unwrap();
    let path = [vec![0.4, 0.7, -0.3, 0.1], vec![-0.8, 0.5, 0.2], vec![1.7]];
    let places: Vec<usize> = (0..targets.len()).map(|k| plan.place(k)).collect();
    let mut series = Series::new(&plan, ORDER, &places, |input| input == 2).unwrap();
    let mut storage = plan.memory();
    let evaluate = |storage: &mut [f64], t: f64| {
        path.iter().enumerate().for_each(|(input, coefficients)| storage[input] = polynomial(coefficients, t));
        assert!(plan.block().evaluate(storage));
    };
    evaluate(&mut storage, 0.0);
    series.begin(&storage);
    for order in 1..=ORDER {
        for (input, coefficients) in path.iter().enumerate() {
            series.set(input, order, &[coefficients.get(order).copied().unwrap_or(0.0)]);
        }
        series.advance(order);
    }
    for t in [0.01, -0.02, 0.05] {
        evaluate(&mut storage, t);
        for (name, place) in outputs.iter().zip(&places) {
            let coefficients: Vec<f64> = series.of(*place).collect();
            // What the series leaves out: its last terms go down by the distance of the nearest pole, here more than 0.3.
            let truncation = coefficients[ORDER].abs() * f64::abs(t).powi(ORDER as i32) * (t / 0.3).abs();
            let error = (polynomial(&coefficients, t) - storage[*place]).abs();
            assert!(error <= 4e-15 * (1.0 + storage[*place].abs()) + truncation, "{} at {t}: {error:e}", name.0);
        }
    }
}

/// The series of a plan up to order 12 along a path of its three inputs, of which the last does not change.
fn coefficients<N: Value>(plan: &Plan, path: &[[N; 3]; 3], interpreted: bool) -> Vec<N> {
    const ORDER: usize = 12;
    let mut series = Series::<N>::new(plan, ORDER, &[plan.place(0)], |input| input == 2).expect("no kinks");
    if interpreted {
        series = series.interpreted();
    }
    let mut storage = vec![N::all(0.0); plan.memory().len()];
    plan.block().begin(&mut storage);
    storage[..3].copy_from_slice(&path[0]);
    let _ = plan.block().evaluate(&mut storage);
    series.begin(&storage);
    for order in 1..=ORDER {
        let [x, y, _] = path.get(order).copied().unwrap_or([N::all(0.0); 3]);
        series.set(0, order, &[x, y]);
        series.advance(order);
    }
    let places = 0..storage.len();
    places.flat_map(|place| series.of(place).collect::<Vec<N>>()).collect()
}

/// Whether both are the same number, or none.
fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

/// The series of some paths side by side, by code and by rules: in each lane those of one alone.
fn lanes_have_the_bits<const N: usize>(plan: &Plan, draw: &mut Draw)
where
    Lanes<f64, N>: Value,
{
    let mut path = [[Lanes([0.0; N]); 3]; 3];
    let broken = draw.below(2 * N);
    for (k, place) in path.iter_mut().flatten().enumerate() {
        *place = Lanes(std::array::from_fn(|lane| match draw.below(6) {
            0 if lane == broken => [f64::NAN, f64::INFINITY, 0.0, -0.0][draw.below(4)],
            _ if k == 8 => 0.0,
            _ => draw.below(4001) as f64 / 1000.0 - 2.0,
        }));
    }
    let combined = [false, true].map(|interpreted| coefficients(plan, &path, interpreted));
    for lane in 0..N {
        let single = path.map(|row| row.map(|x| x.0[lane]));
        let interpreted = coefficients(plan, &single, true);
        let native = coefficients(plan, &single, false);
        assert!(native.iter().zip(&interpreted).all(|(a, b)| same(*a, *b)), "alone: {plan}");
        for combined in &combined {
            let different = combined.iter().zip(&interpreted).position(|(a, b)| !same(a.0[lane], *b));
            assert_eq!(different, None, "lane {lane} of {N}: {plan}");
        }
    }
}

/// Series in lanes have the bits of one after the other by the rules, whatever another lane holds.
#[test]
fn series_in_lanes_have_the_bits_of_each() {
    let mut draw = Draw(7);
    for seed in 0..200 {
        let (graph, symbols, target) = random(seed, 24, Kinds::Smooth);
        let plan = compile(&graph, &symbols, &[("f".into(), target)]).unwrap();
        lanes_have_the_bits::<4>(&plan, &mut draw);
        lanes_have_the_bits::<8>(&plan, &mut draw);
    }
}

/// What has kinks has no series; what does not need it has.
#[test]
fn kinks_have_no_series() {
    let mut graph = Graph::default();
    let x = graph.symbol("x", Dimension::NONE);
    let kinks = [graph.apply(Function::Abs, x), graph.table(table(), x)];
    let square = graph.power(x, 2);
    for (k, kink) in kinks.into_iter().enumerate() {
        let outputs = [("kink".to_string(), kink), ("square".to_string(), square)];
        let plan = compile(&graph, &[graph.symbol_of(x).unwrap()], &outputs).unwrap();
        assert!(Series::<f64>::new(&plan, 5, &[plan.place(0)], |_| false).is_none(), "{k}");
        assert!(Series::<f64>::new(&plan, 5, &[plan.place(0)], |_| true).is_some(), "{k}");
        assert!(Series::<f64>::new(&plan, 5, &[plan.place(1)], |_| false).is_some(), "{k}");
    }
}

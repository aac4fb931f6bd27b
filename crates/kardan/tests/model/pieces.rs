//! Series of what has kinks: one smooth piece, until what tells the pieces vanishes.

use kardan::expr::{Expr, Function, Graph, PiecewisePolynomial, Symbol};
use kardan::num::Rational;
use kardan::plan::{PiecedSeries, compile};
use kardan::units::Dimension;

struct Draw(u64);

impl Draw {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % count
    }
}

/// Straight, and cubic, over knots at whole numbers; and one that jumps.
fn tables() -> [PiecewisePolynomial; 3] {
    let points = [(-2, 1), (0, 0), (1, 3), (4, 2)].map(|(x, y)| (Rational::from(x), Rational::from(y)));
    let slopes = [1, -2, 0, 1].map(Rational::from);
    let piece =
        |origin: i32, terms: &[i32]| (Rational::from(origin), terms.iter().copied().map(Rational::from).collect());
    let jumps = PiecewisePolynomial {
        knots: [-1, 1].map(Rational::from).to_vec(),
        pieces: vec![piece(0, &[1]), piece(2, &[1, 1, -1, 2]), piece(1, &[0, 3])],
    };
    [
        PiecewisePolynomial::through(&points).unwrap(),
        PiecewisePolynomial::smooth(&points, &slopes, true).unwrap(),
        jumps,
    ]
}

/// An expression of two symbols with some operations, most of them with kinks.
fn expression(draw: &mut Draw) -> (Graph, Vec<Symbol>, Expr) {
    let mut graph = Graph::default();
    let mut pool: Vec<Expr> = ["x", "y"].map(|name| graph.symbol(name, Dimension::NONE)).to_vec();
    let symbols = pool.iter().map(|x| graph.symbol_of(*x).unwrap()).collect();
    for _ in 0..2 + draw.below(6) {
        let mut any = || pool[draw.below(pool.len())];
        let [a, b, c, d] = [any(), any(), any(), any()];
        let new = match draw.below(9) {
            0 => graph.apply(Function::Abs, a),
            1 => graph.min(a, b),
            2 => graph.max(a, b),
            3 => graph.select(a, b, c, d),
            4 => graph.table(tables()[0].clone(), a),
            5 => graph.table(tables()[1].clone(), a),
            6 => graph.table(tables()[2].clone(), a),
            7 => graph.add(a, b),
            _ => graph.multiply(a, b),
        };
        pool.push(new);
    }
    (graph, symbols, pool[pool.len() - 1])
}

/// The series are what the expressions are, of inputs `a + b t + c t²` with small whole numbers, so that they often begin where pieces meet, and
/// cross into others soon: until a margin vanishes, or where they tell that they begin with a jump.
#[test]
fn series_are_the_values_until_a_margin_vanishes() {
    let mut draw = Draw(7);
    let (order, mut reported, mut visible) = (12, [0usize; 3], 0);
    for case in 0..6000 {
        let (graph, symbols, value) = expression(&mut draw);
        let plan = compile(&graph, &symbols, &[("z".into(), value)]).unwrap();
        let mut series = PiecedSeries::new(&plan, order, &[plan.place(0)], |_| false);
        let mut inputs: [[f64; 3]; 2] = [(); 2].map(|()| [(); 3].map(|()| draw.below(5) as f64 - 2.0));
        inputs.iter_mut().for_each(|[begin, ..]| *begin += (draw.below(5) as f64 - 2.0) / 1024.0);
        let at = |t: f64| inputs.map(|[a, b, c]| a + t * (b + t * c));
        let evaluated = |t: f64| {
            let mut storage = plan.memory();
            storage[..2].copy_from_slice(&at(t));
            assert!(plan.block().evaluate(&mut storage));
            (storage[plan.place(0)], storage)
        };
        let (begin, storage) = evaluated(0.0);
        series.begin(&storage);
        for k in 1..=order {
            let now = |input: [f64; 3]| input.get(k).copied().unwrap_or(0.0);
            series.set(0, k, &inputs.map(now));
            series.advance(k);
        }
        let sum = |x: &mut dyn DoubleEndedIterator<Item = f64>, t: f64| x.rev().fold(0.0, |sum, x| sum * t + x);
        let own = |t: f64| sum(&mut series.of(plan.place(0)), t);
        if series.jump() {
            reported[0] += 1;
            // It may be of what the value does not feel.
            visible += usize::from((evaluated(1e-12).0 - begin).abs() > 1e-6);
            continue;
        }
        // Beyond, the terms that are left out count.
        for t in [1e-6, 1e-4, 1e-3, 5e-3] {
            let margins: Vec<(Vec<f64>, f64, f64)> =
                series.margins().map(|(x, sign, more)| (x.collect(), sign, more)).collect();
            let least = |t: f64| {
                let own = margins.iter().map(|(x, sign, more)| sign * sum(&mut x.iter().copied(), t) + more);
                own.fold(f64::INFINITY, f64::min)
            };
            if (1..=200).any(|k| least(t * f64::from(k) / 200.0) < 0.0) {
                reported[1] += 1;
                break;
            }
            let value = evaluated(t).0;
            let size = 1.0 + begin.abs() + value.abs();
            assert!((own(t) - value).abs() <= 1e-9 * size, "{case}: {} at {t} in place of {value}\n{plan}", own(t));
            reported[2] += 1;
        }
    }
    assert!(
        reported[0] > 30 && 2 * visible > reported[0] && reported[1] > 200 && reported[2] > 10_000,
        "{reported:?}, {visible}"
    );
}

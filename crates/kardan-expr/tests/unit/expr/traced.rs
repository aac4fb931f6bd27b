//! Tests of `src/expr/traced.rs`.

use kardan_rt::{Integrator, Pid, TransferFunction};

use super::*;
use crate::expr::{Style, printed};
use kardan_math::units::Dimension;

fn text(graph: &RefCell<Graph>, traced: Traced<'_>) -> String {
    let expr = traced.expr(graph);
    printed(&graph.borrow(), expr, Style::Text, &|name| name.into())
}

/// A block of `kardan-rt` run on expressions gives its formula, without its tests of numbers.
#[test]
fn blocks_write_themselves_down() {
    let graph = RefCell::new(Graph::default());
    let symbol = |name: &str| {
        let expr = graph.borrow_mut().symbol(name, Dimension::NONE);
        Traced::new(&graph, expr)
    };
    let [u, x, y, h] = ["u", "x", "y", "h"].map(symbol);
    let mut state = [y, x];
    let zero = Traced::Fraction(0, 1);
    let (numerator, denominator) = ([Traced::Fraction(1, 2), Traced::Fraction(1, 3)], [Traced::Fraction(-1, 4)]);
    assert!(TransferFunction { numerator: &numerator, denominator: &denominator }.step(u, &mut state));
    // x⁺ = u/3 + (u/2 + x)/4
    assert_eq!([text(&graph, state[0]), text(&graph, state[1])], ["1/2*u + x", "11/24*u + 1/4*x"]);
    let mut state = [y, x];
    let high = Some(symbol("high"));
    assert!(Integrator { sample_time: h, low: None, high }.step(u, zero, zero, &mut state));
    assert!(text(&graph, state[0]).contains("x") && !text(&graph, state[0]).contains('u'));
    let pid = Pid {
        proportional: Traced::Fraction(2, 1),
        integral: Some(zero),
        derivative: zero,
        filter: zero,
        weights: [Traced::Fraction(1, 1), zero],
        bounds: [None, high],
        tracking: h,
        sample_time: h,
    };
    let mut state = [y, zero, zero, zero, Traced::Fraction(1, 1)];
    let manual = kardan_rt::Manual { on: Traced::Fraction(1, 1), value: zero };
    assert!(pid.step(u, x, manual, &mut state));
    let output = text(&graph, state[0]);
    assert!(output.contains("2*u - 2*x") && !output.contains("0*"), "{output}");
}

//! Tests of `src/expr/of_time.rs`.

use super::*;
use crate::expr::Function;

/// An expression copied into another graph prints the same, and has the same value.
#[test]
fn a_function_is_the_same_in_another_graph() {
    let mut graph = Graph::default();
    let [time, gate] = ["t", "gate"].map(|name| graph.symbol(name, Dimension::NONE));
    let sine_of_time = graph.apply(Function::Sin, time);
    let pi = graph.pi();
    let least = graph.min(sine_of_time, gate);
    let product = graph.product(&[(pi, 1), (least, 2), (sine_of_time, -1)]);
    let value = graph.sum(Rational::ONE, &[(product, Rational::from(3)), (gate, Rational::ONE)]);
    let pieces = Pieces::new([(0.0, [0.5, 0.0, 0.0, 0.0])]);
    let part = Arc::new(Part { name: "gate".into(), dimension: Dimension::NONE, pieces, reported: false });
    let text = printed(&graph, value, Style::Text, &|name| name.into());
    let function = OfTime::new(graph, time, vec![(gate, part)], value, Dimension::NONE).unwrap();
    let mut other = Graph::default();
    let other_gate = other.symbol("gate", Dimension::NONE);
    let copy = function.write_into(&mut other, &mut |graph| graph.symbol("t", Dimension::NONE), &mut |_, _| other_gate);
    assert_eq!(printed(&other, copy, Style::Text, &|name| name.into()), text);
    let sine: f64 = kardan_rt::functions::sin(0.3);
    let expected = 1.0 + 3.0 * std::f64::consts::PI * kardan_rt::functions::powi(sine.min(0.5), 2) / sine + 0.5;
    assert!((function.value(0.3) - expected).abs() < 1e-15 * expected);
    assert!(!function.is_affine());
}

//! Conditions: 1 where they are true, else 0.

use std::ops::Range;

use super::super::{Dimension, Exact};
use super::tree::{Kind, Node};

/// A number at a place.
fn number(span: &Range<usize>, numerator: i64, denominator: i64) -> Node {
    Node { span: span.clone(), kind: Kind::Literal(Exact::from_ratio(numerator, denominator), Dimension::NONE) }
}

/// A comparison.
pub(super) fn compared(comparison: &'static str, left: Node, right: Node) -> Node {
    let span = left.span.start..right.span.end;
    let [yes, no] = [number(&span, 1, 1), number(&span, 0, 1)];
    Node { span, kind: Kind::If(comparison, Box::new([left, right, yes, no])) }
}

/// The condition of a number: a comparison itself, or whether another number is above a half.
fn comparison(condition: Node) -> (&'static str, [Node; 2]) {
    let is =
        |node: &Node, value: i64| matches!(&node.kind, Kind::Literal(found, _) if *found == Exact::from_integer(value));
    match condition.kind {
        Kind::If(comparison, parts) if is(&parts[2], 1) && is(&parts[3], 0) => {
            let [left, right, ..] = *parts;
            (comparison, [left, right])
        }
        kind => {
            let node = Node { span: condition.span, kind };
            ("<", [number(&node.span, 1, 2), node])
        }
    }
}

/// One of two values.
pub(super) fn chosen(span: Range<usize>, condition: Node, yes: Node, no: Node) -> Node {
    let (comparison, [left, right]) = comparison(condition);
    Node { span, kind: Kind::If(comparison, Box::new([left, right, yes, no])) }
}

/// Where both are true.
pub(super) fn both(left: Node, right: Node) -> Node {
    let span = left.span.start..right.span.end;
    let (right, no) = (truth(right), number(&span, 0, 1));
    chosen(span, left, right, no)
}

/// Where one of both is true.
pub(super) fn either(left: Node, right: Node) -> Node {
    let span = left.span.start..right.span.end;
    let (yes, right) = (number(&span, 1, 1), truth(right));
    chosen(span, left, yes, right)
}

/// Where it is false.
pub(super) fn not(span: Range<usize>, of: Node) -> Node {
    let [yes, no] = [number(&span, 0, 1), number(&span, 1, 1)];
    chosen(span, of, yes, no)
}

/// 1 where a number is above a half, else 0.
fn truth(of: Node) -> Node {
    let span = of.span.clone();
    let [yes, no] = [number(&span, 1, 1), number(&span, 0, 1)];
    chosen(span, of, yes, no)
}

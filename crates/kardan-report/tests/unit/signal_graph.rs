//! Tests of `src/signal_graph.rs`.

use super::*;
use kardan::results::SignalOutput;

fn node(name: &str, kind: &str, reads: &[&str]) -> SignalNode {
    SignalNode {
        name: name.into(),
        kind: kind.into(),
        outputs: vec![SignalOutput { name: name.into(), unit: String::new() }],
        reads: reads.iter().map(|name| name.to_string()).collect(),
        ..SignalNode::default()
    }
}

/// A reader is right of its input, or the line is feedback; each line appears once.
#[test]
fn lines_lead_from_left_to_right() {
    let nodes = [
        node("late", "delay", &["sum"]),
        node("sum", "gain", &["late", "encoder"]),
        node("end", "low_pass", &["sum", "encoder"]),
        node("m", "program", &["end"]),
    ];
    let places = places(&nodes);
    let x = |k: usize| places[&Place::Node(k)][0];
    assert!(places[&Place::Outside("encoder")][0] < x(1) && x(1) < x(2) && x(2) < x(3) && x(1) < x(0));
    let drawn = picture(&nodes).unwrap().drawing;
    assert_eq!((drawn.matches("<path d=").count(), drawn.matches("class=\"back\"").count()), (5, 1), "{drawn}");
    assert_eq!(drawn.matches("class=\"tip\"").count(), 6);
    assert!(picture(&[]).is_none());
}

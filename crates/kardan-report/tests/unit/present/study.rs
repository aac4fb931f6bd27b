//! Tests of `src/present/study.rs`.

use super::*;
use kardan::results::{Physical, Series};

#[test]
fn only_signals_plotted_for_the_variant_are_listed() {
    let signal = |name: &str| Signal {
        name: name.into(),
        physical: Physical::Angle,
        description: String::new(),
        values: vec![1.0],
    };
    let plot = |signal: &str, variants: &[&str]| Plot {
        signals: vec![signal.into()],
        variants: variants.iter().map(|&name| name.into()).collect(),
        ..Plot::default()
    };
    let run = Run {
        name: "b".into(),
        parameters: vec![],
        series: Series { time: vec![0.0], signals: vec![signal("x"), signal("y"), signal("z")] },
        energy: Default::default(),
        events: vec![],
        outcome: Outcome::Completed,
        requirements: vec![],
        figures: vec![],
        notes: vec![],
        warnings: vec![],
        motor_loads: vec![],
        effort: Default::default(),
        accuracy: None,
    };
    let plots = vec![plot("x", &["a"]), plot("y", &[])];
    let mut study = Study { plots, runs: vec![run], ..Study::default() };
    let names = |study: &Study| match &key_figures(study).0[..] {
        [Block::Table(table)] => table.rows.iter().map(|row| row[0].clone()).collect::<Vec<_>>(),
        other => panic!("{other:?}"),
    };
    let spans = |names: &[&str]| names.iter().map(|name| Cell::Span(format!("{name} [rad]"), 1)).collect::<Vec<_>>();
    assert_eq!(names(&study), spans(&["y"]));
    study.plots.clear();
    assert_eq!(names(&study), spans(&["x", "y", "z"]));
}

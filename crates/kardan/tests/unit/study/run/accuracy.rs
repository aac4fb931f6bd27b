//! Tests of `src/study/run/accuracy.rs`.

use super::*;

#[test]
fn rows_between_corresponding_events_are_excluded() {
    let series = |time: &[f64]| Series { time: time.to_vec(), signals: Vec::new() };
    let (own, other) = (series(&[0.0, 1.0, 2.0, 3.0, 4.0]), series(&[0.0, 1.0, 1.5, 2.0, 3.0, 4.0]));
    let event = |time: f64| Event { time, description: "a slips forward".into() };
    let gaps = gaps(&[event(1.0), event(1.0), event(3.5)], &[event(1.0), event(2.0), event(3.6)]).expect("alike");
    // An event that both runs have at 1 s, one that comes at 1 s in one run and at 2 s in the other, one between two rows.
    assert_eq!(gaps, [(1.0, 1.0), (1.0, 2.0), (3.5, 3.6)]);
    assert_eq!(common_rows(&own, &other, &gaps), [(0, 0), (3, 4), (4, 5)]);
    assert_eq!(common_rows(&own, &other, &[(1.0, 1.0)]).len(), 5);
    assert!(super::gaps(&[event(1.0)], &[]).is_none());
}

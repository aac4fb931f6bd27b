//! Tests of `src/scenario.rs`.

use super::*;

#[test]
fn steps_and_ramps() {
    let event = |at, to, over| SignalEvent { source: 0, at, to, over };
    let events = [event(3.0, 5.0, 0.0), event(1.0, 2.0, 1.0), event(4.0, 1.0, 4.0), event(6.0, 7.0, 0.0)];
    let profile = Profile::new(events.iter());
    for (time, expected) in
        [(0.5, 0.0), (1.0, 0.0), (1.5, 1.0), (2.0, 2.0), (2.9, 2.0), (3.0, 5.0), (5.0, 4.0), (6.0, 7.0), (9.0, 7.0)]
    {
        assert_eq!(profile.value(time), expected, "at {time} s");
    }
}

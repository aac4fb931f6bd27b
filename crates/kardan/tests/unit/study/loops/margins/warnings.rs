//! Tests of `src/study/loops/margins/warnings.rs`.

use super::*;
use kardan_results::WrongTorque;

/// A channel with large margins.
fn good(name: &str) -> ChannelMargin {
    ChannelMargin {
        name: name.into(),
        gain: [0.2, 5.0],
        phase: 1.0,
        delay: Some(0.1),
        disk: 1.0,
        disk_gain: [1.0 / 3.0, 3.0],
        disk_phase: 0.9,
        own_time: Some(0.01),
        ..ChannelMargin::default()
    }
}

/// Motors with large margins alone and none at once lead to a warning; also with a channel that has a warning of its own.
#[test]
fn all_at_once_are_not_overlooked() {
    let multiloop_margin = MultiloopMargin {
        disk: [0.05, 0.0501],
        frequency: 3.0,
        worst_perturbation: vec![WrongTorque { motor: "a".into(), factor: 1.05, phase: 0.0 }],
    };
    let found = Margins {
        channels: vec![good("a"), good("b")],
        multiloop: Some(multiloop_margin.clone()),
        ..Margins::default()
    };
    let texts = warnings(&found);
    assert!(
        matches!(&texts[..], [one] if one.contains("errors of all its motors at once") && one.contains("3.0000 rad/s"))
    );
    let beside = Margins {
        channels: vec![ChannelMargin { disk: 0.3, ..good("a") }, good("b")],
        multiloop: Some(multiloop_margin.clone()),
        ..Margins::default()
    };
    assert_eq!(warnings(&beside).len(), 2);
    // Warnings that follow from one channel alone are not repeated.
    let same = Margins {
        channels: vec![ChannelMargin { disk: 0.055, ..good("a") }, good("b")],
        multiloop: Some(multiloop_margin),
        ..Margins::default()
    };
    assert_eq!(warnings(&same).len(), 1);
    assert!(warnings(&Margins { channels: vec![good("a")], ..Margins::default() }).is_empty());
}

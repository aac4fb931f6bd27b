//! Faults of motors, sensors and control units at any time of a run, each against its closed form.

use crate::common::{at, run_by, signal};
use kardan::diagnostics::plain;
use kardan::results::Run;
use kardan::simulate::Method;
use kardan::study;

/// A wheel of 2 kg m² that a motor pushes with 4 N m from the start, limited as said, with these faults.
fn wheel(limit: &str, faults: &[&str]) -> String {
    let faults: String = faults.iter().map(|keys| format!("[[scenario.fault]]\nmotor = \"m\"\n{keys}\n")).collect();
    format!(
        "[shaft.a]\ninertia = \"2 kg m^2\"\n[motor.m]\nshaft = \"a\"\n{limit}\n\
         [scenario]\nduration = \"3 s\"\noutput_step = \"10 ms\"\n\
         [[scenario.event]]\nsignal = \"m.tau\"\nat = \"0 s\"\nto = \"4 N m\"\n{faults}"
    )
}

fn every_method(source: &str, check: impl Fn(&Run)) {
    for method in [Method::Taylor, Method::Dop853, Method::Radau, Method::Automatic] {
        check(&run_by(source, method, Some(1e-11)));
    }
}

/// Where a fault is there the wheel gains as much less, or more, speed: w = ∫ τ/J.
#[test]
fn a_motor_that_gives_a_part_of_its_torque() {
    for (kind, part) in [("", 0.0), ("kind = \"reduced\"\nby = 0.25", 0.25), ("kind = \"reversed\"", -1.0)] {
        let source = wheel("", &[&format!("{kind}\nat = \"1 s\"\nuntil = \"2 s\"")]);
        every_method(&source, |run| {
            assert!((at(run, "a.w", 3.0) - 2.0 * (2.0 + part)).abs() < 1e-12, "{kind}");
            assert!((at(run, "a.w", 1.5) - 2.0 * (1.0 + 0.5 * part)).abs() < 1e-12, "{kind}");
            for (time, torque) in run.series.time.iter().zip(signal(run, "m.tau")) {
                let expected = if (1.0..2.0).contains(time) { 4.0 * part } else { 4.0 };
                assert_eq!(*torque, expected, "{kind} at {time} s");
            }
            // Work of the motor is the energy of the wheel.
            assert!(run.energy.residual.abs() < 1e-10, "{kind}: {:?}", run.energy);
            let times: Vec<f64> =
                run.events.iter().filter(|event| event.what.starts_with("m ")).map(|event| event.time).collect();
            assert_eq!(times, [1.0, 2.0]);
        });
    }
}

/// Short-circuited windings brake: w decays as exp(−d t/J), and two faults that touch go on from each other.
#[test]
fn a_motor_that_brakes() {
    let braking = "kind = \"braking\"\nby = \"3 N m s/rad\"\nat = \"1 s\"\nuntil = \"2 s\"";
    let source = wheel("", &["at = \"2 s\"", braking]);
    every_method(&source, |run| {
        for time in [1.1f64, 1.5, 2.0, 2.5] {
            let expected = 2.0 * f64::exp(-1.5 * (time.min(2.0) - 1.0));
            assert!((at(run, "a.w", time) - expected).abs() < 1e-9, "at {time} s");
            let torque = if time < 2.0 { -3.0 * expected } else { 0.0 };
            assert!((at(run, "m.tau", time) - torque).abs() < 1e-8, "at {time} s");
        }
    });
}

/// A low supply lowers the limit, and no more.
#[test]
fn a_motor_whose_supply_is_low() {
    let low = "kind = \"undervoltage\"\nby = 0.5\nat = \"1 s\"\nuntil = \"2 s\"";
    for (limit, [before, within]) in [(3.0, [3.0, 1.5]), (6.0, [4.0, 3.0]), (10.0, [4.0, 4.0])] {
        let source = wheel(&format!("torque_limit = \"{limit} N m\""), &[low]);
        every_method(&source, |run| {
            for (time, expected) in [(0.5, before), (1.5, within), (1.0, within), (2.0, before), (2.5, before)] {
                assert!((at(run, "m.tau", time) - expected).abs() < 1e-12, "{limit} N m at {time} s");
            }
            assert!((at(run, "a.w", 3.0) - 0.5 * (2.0 * before + within)).abs() < 1e-11, "{limit} N m");
        });
    }
}

/// A wheel that turns evenly at 1 rad/s, read each 10 ms by a block, with a fault from 0.5 to 0.7 s.
fn read(kind: &str) -> Run {
    let source = format!(
        "[shaft.a]\ninertia = \"2 kg m^2\"\n[sensor.enc]\nmeasures = \"angle\"\nshaft = \"a\"\n\
         [block.seen]\nkind = \"gain\"\ninput = \"enc\"\ngain = 1\nsample_time = \"10 ms\"\n\
         [scenario]\nduration = \"1 s\"\noutput_step = \"10 ms\"\ninitial = {{ \"a.w\" = \"1 rad/s\" }}\n\
         [[scenario.fault]]\nsensor = \"enc\"\n{kind}\nat = \"0.5 s\"\nuntil = \"0.7 s\"\n"
    );
    run_by(&source, Method::Taylor, Some(1e-11))
}

#[test]
fn sensors_that_read_something_else() {
    type Case = (&'static str, fn(f64) -> f64);
    let cases: [Case; 4] = [
        ("kind = \"offset\"\nby = \"3 rad\"", |t| t + 3.0),
        ("kind = \"drift\"\nby = \"-2 rad/s\"", |t| t - 2.0 * (t - 0.5)),
        ("kind = \"reversed\"", |t| -t),
        ("kind = \"stuck\"", |_| 0.49),
    ];
    for (kind, expected) in cases {
        let run = read(kind);
        for k in 0..100 {
            let time = f64::from(k) / 100.0;
            let expected = if (0.5..0.7).contains(&time) { expected(time) } else { time };
            assert!((at(&run, "seen", time) - expected).abs() < 1e-9, "{kind} at {time} s");
        }
    }
    // Of 20 samples of noise the sum of squares is χ² of 20: between 5.9 and 45.3 but for one in a thousand at each end.
    let run = read("kind = \"noise\"\nby = \"0.1 rad\"");
    let error = |k: i32| (at(&run, "seen", f64::from(k) / 100.0) - f64::from(k) / 100.0) / 0.1;
    let squares: f64 = (50..70).map(|k| error(k) * error(k)).sum();
    assert!((5.9..45.3).contains(&squares), "{squares}");
    assert!((0..50).chain(70..100).all(|k| error(k).abs() < 1e-8));
}

/// A unit that commands 1 N m/s times the time, and as much as it has counted since its start, at 100 Hz.
fn unit(kind: &str) -> Run {
    let source = format!(
        "[shaft.a]\ninertia = \"2 kg m^2\"\ndamping = \"5 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n[motor.n]\nshaft = \"a\"\n[motor.o]\nshaft = \"a\"\n\
         [sensor.enc]\nmeasures = \"angle\"\nshaft = \"a\"\n\
         [block.count]\nkind = \"integrator\"\ninput = \"1 N m/s\"\nsample_time = \"10 ms\"\n\
         [control.c]\nlaw = \"program\"\nsample_time = \"10 ms\"\n\
         commands = {{ m = \"1 N m/s * t\", n = \"count\", o = \"-1 N m/rad * enc\" }}\n\
         [scenario]\nduration = \"1 s\"\noutput_step = \"2 ms\"\ninitial = {{ \"a.w\" = \"1 rad/s\" }}\n\
         [[scenario.fault]]\ncontrol = \"c\"\n{kind}\nat = \"0.5 s\"\nuntil = \"0.7 s\"\n"
    );
    run_by(&source, Method::Taylor, Some(1e-11))
}

#[test]
fn control_units_that_stop_or_come_late() {
    let sampled = |time: f64| (time * 100.0 + 1e-9).floor() / 100.0;
    let within = |time: f64| (0.5..0.7 - 1e-12).contains(&time);
    let reset = unit("kind = \"reset\"");
    let missed = unit("kind = \"missed\"");
    let stale = unit("kind = \"stale\"");
    let jitter = unit("kind = \"jitter\"\nby = \"6 ms\"");
    let (mut early, mut late) = (0, 0);
    for k in 0..500 {
        let time = f64::from(k) / 500.0;
        let near = |run: &Run, name: &str, expected: f64| {
            assert!((at(run, name, time) - expected).abs() < 1e-9, "{name} at {time} s: {expected}");
        };
        near(&reset, "m.tau", if within(time) { 0.0 } else { sampled(time) });
        near(&missed, "m.tau", if within(time) { 0.49 } else { sampled(time) });
        near(&stale, "m.tau", sampled(time));
        // The counter starts anew behind the reset; where samples are missed it stands still.
        let counted = |run: &Run| at(run, "n.tau", time);
        if time >= 0.7 {
            assert!((counted(&reset) - (sampled(time) - 0.7)).abs() < 1e-9, "at {time} s: {}", counted(&reset));
            assert!((counted(&missed) - (sampled(time) - 0.2)).abs() < 1e-9, "at {time} s: {}", counted(&missed));
        }
        if within(time) {
            assert_eq!(at(&stale, "o.tau", time), at(&stale, "o.tau", 0.49), "at {time} s");
            assert!(time < 0.51 || at(&missed, "a.phi", time) != at(&missed, "a.phi", 0.49), "it moves");
            // Late by up to 6 ms, each sample by its own time.
            let torque = at(&jitter, "m.tau", time);
            let since = time - sampled(time);
            let fresh = (torque - sampled(time)).abs() < 1e-9;
            assert!(fresh || (torque - (sampled(time) - 0.01)).abs() < 1e-9, "at {time} s: {torque}");
            assert!(fresh || since < 6e-3 + 1e-9, "at {time} s");
            if since > 1e-3 && since < 5e-3 {
                (early, late) = (early + u32::from(fresh), late + u32::from(!fresh));
            }
        } else if !(0.5..=0.706).contains(&time) {
            near(&jitter, "m.tau", sampled(time));
        }
    }
    assert!(early > 5 && late > 5, "{early} in time, {late} late");
    assert!((at(&reset, "m.tau", 0.7) - 0.7).abs() < 1e-9);
}

/// Two faults of two parts at once, and each of them alone: the wheel with both has what the closed form says.
#[test]
fn two_faults_at_once() {
    let source = wheel("", &["kind = \"reduced\"\nby = 0.5\nat = \"1 s\""])
        .replace("[scenario]", "[motor.n]\nshaft = \"a\"\n[scenario]")
        + "[[scenario.event]]\nsignal = \"n.tau\"\nat = \"0 s\"\nto = \"2 N m\"\n[[scenario.fault]]\nmotor = \"n\"\nat = \"2 s\"\n";
    every_method(&source, |run| {
        assert!((at(run, "a.w", 3.0) - 0.5 * (6.0 + 4.0 + 2.0)).abs() < 1e-12);
    });
}

/// A fault of a part that is not there, of a kind that the part does not have, without or with a useless amount, and two at once: each is told
/// with its place and what to do.
#[test]
fn faults_that_cannot_be() {
    let cases = [
        ("motor = \"n\"\nat = \"1 s\"", "there is no motor `n`", "there are `m`"),
        ("control = \"c\"\nat = \"1 s\"", "there is no controller `c`", "the model has no controller"),
        ("sensor = \"m\"\nat = \"1 s\"", "no controller reads a sensor `m`", "sensors are read by"),
        ("motor = \"m\"\nkind = \"lost\"\nat = \"1 s\"", "a motor cannot be `lost`", "choose one of"),
        ("motor = \"m\"\nsensor = \"s\"\nat = \"1 s\"", "it names `sensor`, `motor`", "for each"),
        ("at = \"1 s\"", "nothing is named that fails", "motor"),
        ("motor = \"m\"\nkind = \"reduced\"\nat = \"1 s\"", "`reduced` needs the key `by`", "by = "),
        ("motor = \"m\"\nkind = \"reduced\"\nby = 1.5\nat = \"1 s\"", "leaves all of it", "below one"),
        ("motor = \"m\"\nkind = \"braking\"\nby = \"1 N m\"\nat = \"1 s\"", "expected", "unit"),
        ("motor = \"m\"\nby = 2\nat = \"1 s\"", "`by` says nothing for `dead`", "remove"),
        ("motor = \"m\"\nkind = \"undervoltage\"\nby = 0.5\nat = \"1 s\"", "no limit", "torque_limit"),
        ("motor = \"m\"\nat = \"2 s\"\nuntil = \"1 s\"", "before it begins", "until"),
    ];
    for (keys, message, help) in cases {
        let source = wheel("", &[]) + "[[scenario.fault]]\n" + keys + "\n";
        let told = study::prepare(&source).1;
        let found = told.iter().find(|one| one.message.contains(message));
        let found = found.unwrap_or_else(|| panic!("{keys}: {}", plain(&source, &told)));
        assert!(found.help.as_ref().is_some_and(|text| text.contains(help)), "{keys}: {found:?}");
        assert!(!found.labels.is_empty(), "{keys}: {found:?}");
    }
    let twice = wheel("", &["at = \"1 s\"", "kind = \"reversed\"\nat = \"2 s\""]);
    let told = study::prepare(&twice).1;
    assert!(
        told.iter().any(|one| one.code == "fault::window" && one.message.contains("another fault then")),
        "{told:?}"
    );
}

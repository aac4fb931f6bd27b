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
    for (kind, part) in [("", 0.0), ("kind = \"reduced\"\nvalue = 0.25", 0.25), ("kind = \"reversed\"", -1.0)] {
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
                run.events.iter().filter(|event| event.description.starts_with("m ")).map(|event| event.time).collect();
            assert_eq!(times, [1.0, 2.0]);
        });
    }
}

/// Short-circuited windings brake: w decays as exp(−d t/J), and two faults that touch go on from each other.
#[test]
fn a_motor_that_brakes() {
    let braking = "kind = \"braking\"\nvalue = \"3 N m s/rad\"\nat = \"1 s\"\nuntil = \"2 s\"";
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
    let low = "kind = \"undervoltage\"\nvalue = 0.5\nat = \"1 s\"\nuntil = \"2 s\"";
    for (limit, [before, during]) in [(3.0, [3.0, 1.5]), (6.0, [4.0, 3.0]), (10.0, [4.0, 4.0])] {
        let source = wheel(&format!("torque_limit = \"{limit} N m\""), &[low]);
        every_method(&source, |run| {
            for (time, expected) in [(0.5, before), (1.5, during), (1.0, during), (2.0, before), (2.5, before)] {
                assert!((at(run, "m.tau", time) - expected).abs() < 1e-12, "{limit} N m at {time} s");
            }
            assert!((at(run, "a.w", 3.0) - 0.5 * (2.0 * before + during)).abs() < 1e-11, "{limit} N m");
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
        ("kind = \"offset\"\nvalue = \"3 rad\"", |t| t + 3.0),
        ("kind = \"drift\"\nvalue = \"-2 rad/s\"", |t| t - 2.0 * (t - 0.5)),
        ("kind = \"reversed\"", |t| -t),
        ("kind = \"stuck\"", |_| 0.5),
    ];
    for (kind, expected) in cases {
        let run = read(kind);
        for k in 0..100 {
            let time = f64::from(k) / 100.0;
            let expected = if (0.5..0.7).contains(&time) { expected(time) } else { time };
            assert!((at(&run, "seen", time) - expected).abs() < 1e-9, "{kind} at {time} s");
            // The results have what the sensor gives, not what would be true.
            assert!((at(&run, "enc.phi", time) - expected).abs() < 1e-9, "{kind} at {time} s");
        }
    }
    // Of 20 samples of noise the sum of squares is χ² of 20: between 5.9 and 45.3 but for one in a thousand at each end.
    let run = read("kind = \"noise\"\nvalue = \"0.1 rad\"");
    let error = |k: i32| (at(&run, "seen", f64::from(k) / 100.0) - f64::from(k) / 100.0) / 0.1;
    let squares: f64 = (50..70).map(|k| error(k) * error(k)).sum();
    assert!((5.9..45.3).contains(&squares), "{squares}");
    assert!((0..50).chain(70..100).all(|k| error(k).abs() < 1e-8));
}

/// A lost sensor is one that is stuck, for blocks that bound what they read and for a law, but for a monitor, which sees that there is no number.
#[test]
fn all_but_monitors_use_the_last_value_of_a_lost_sensor() {
    let run = |kind: &str, law: &str| {
        let source = format!(
            "[shaft.a]\ninertia = \"0.01 kg m^2\"\ndamping = \"0.1 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n\
             [sensor.enc]\nmeasures = \"angle\"\nshaft = \"a\"\nlines = 1000\n\
             [block.sat]\nkind = \"saturation\"\ninput = \"10 N m/rad * (0.1 rad - enc)\"\nhigh = \"2 N m\"\nsample_time = \"1 ms\"\n\
             [block.alarm]\nkind = \"monitor\"\nresidual = \"enc - 0.1 rad\"\nthreshold = \"1 rad\"\ndebounce = \"3 ms\"\nsample_time = \"1 ms\"\n\
             [block.mode]\nkind = \"state_machine\"\nstates = [\"on\", \"off\"]\nsample_time = \"1 ms\"\n\
             transitions = [{{ from = \"on\", to = \"off\", when = \"enc > 0.2 rad or enc < -1 rad\" }}]\n\
             [control.c]\nlaw = \"program\"\ncommands = {{ m = \"{law}\" }}\nsample_time = \"1 ms\"\n\
             [scenario]\nduration = \"0.6 s\"\n\
             [[scenario.fault]]\nsensor = \"enc\"\nkind = \"{kind}\"\nat = \"{at} s\"\n",
            // The last good reading is that of the sample before; where a sensor is stuck is what it gives then.
            at = if kind == "stuck" { 0.049 } else { 0.05 }
        );
        run_by(&source, Method::Taylor, Some(1e-9))
    };
    for law in ["sat", "max(-2 N m, min(2 N m, 10 N m/rad * (0.1 rad - enc)))", "if(enc < 0.05 rad, 0.4 N m, -0.1 N m)"]
    {
        let (lost, stuck) = (run("lost", law), run("stuck", law));
        for name in ["a.phi", "m.tau", "enc.phi", "sat", "mode.off"] {
            let of = |run: &Run| run.series.signal(name).expect("a signal").values.clone();
            assert_eq!(of(&lost), of(&stuck), "{law}: {name}");
        }
        let alarms =
            |run: &Run| run.series.signal("alarm").expect("a signal").values.iter().filter(|x| **x > 0.5).count();
        assert!(alarms(&lost) > 500 && alarms(&stuck) == 0, "{law}");
        assert!(
            (at(&lost, "alarm", 0.051) - 0.0).abs() < 1e-12 && (at(&lost, "alarm", 0.054) - 1.0).abs() < 1e-12,
            "{law}"
        );
        assert!(
            lost.notes.iter().any(|note| note.contains("the controller used the last valid one")),
            "{:?}",
            lost.notes
        );
    }
}

/// Whoever reads a sensor that fails, and at whatever times, reads the same at the same instant, and the column too: stuck, noisy, drifting, with a sample time of its own or
/// read whenever somebody looks.
#[test]
fn all_who_read_a_failing_sensor_read_the_same() {
    let fault = |kind: &str, own: &str, speed: f64| {
        let readers: String = [1, 5, 20]
            .iter()
            .map(|ms| format!("[block.r{ms}]\nkind = \"gain\"\ngain = 1\ninput = \"enc\"\nsample_time = \"{ms} ms\"\n"))
            .collect();
        let source = format!(
            "[shaft.a]\ninertia = \"1 kg m^2\"\n[sensor.enc]\nmeasures = \"angle\"\nshaft = \"a\"\n{own}\n{readers}\
             [scenario]\nduration = \"0.8 s\"\noutput_step = \"1 ms\"\ninitial = {{ \"a.w\" = \"{speed} rad/s\" }}\n\
             [[scenario.fault]]\nsensor = \"enc\"\nkind = \"{kind}\"\nat = \"0.312 s\"\nuntil = \"0.612 s\"\n"
        );
        run_by(&source, Method::Taylor, Some(1e-9))
    };
    for own in ["", "sample_time = \"2 ms\"", "sample_time = \"2 ms\"\nnoise = \"1 mrad\"\nresolution = \"1 mrad\""] {
        for kind in [
            "stuck",
            "noise\"\nvalue = \"0.1 rad",
            "drift\"\nvalue = \"2 rad/s",
            "offset\"\nvalue = \"1 rad",
            "reversed",
        ] {
            let run = fault(kind, own, 3.0);
            let rows =
                run.series.time.iter().enumerate().filter(|(_, t)| ((*t * 50.0).round() - *t * 50.0).abs() < 1e-9);
            for (row, t) in rows {
                let [one, five, twenty, column] = ["r1", "r5", "r20", "enc.phi"].map(|name| signal(&run, name)[row]);
                assert!(
                    (five - one).abs() < 1e-9 && (twenty - one).abs() < 1e-9,
                    "{kind} {own} at {t} s: {one} {five} {twenty}"
                );
                assert!((column - one).abs() < 1e-9, "{kind} {own} at {t} s: {column} for {one}");
            }
            let (before, during) = (at(&run, "r1", 0.311), at(&run, "r20", 0.5));
            if kind == "stuck" {
                assert!((during - 3.0 * 0.312).abs() < if own.is_empty() { 1e-9 } else { 4e-3 }, "{own}: {during}");
            }
            assert!((before - 3.0 * 0.311).abs() < 8e-3 && (at(&run, "r20", 0.7) - 2.1).abs() < 8e-3, "{kind} {own}");
        }
    }
    // Noise is drawn anew at each reading, also of what stands still.
    let still = fault("noise\"\nvalue = \"0.1 rad", "sample_time = \"2 ms\"", 0.0);
    let drawn: Vec<f64> = (160..300).map(|k| at(&still, "enc.phi", f64::from(k) * 0.002)).collect();
    assert!(drawn.windows(2).all(|pair| pair[0] != pair[1]), "{drawn:?}");
}

/// A program has no estimate: what it cannot compute is told as that, with a delay of its commands too.
#[test]
fn a_program_that_computes_nan_is_reported() {
    for delay in ["", "delay = \"1 ms\"\n"] {
        let source = format!(
            "[shaft.a]\ninertia = \"0.01 kg m^2\"\ndamping = \"0.5 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n[control.c]\nlaw = \"program\"\n\
             commands = {{ m = \"1 N m * ln(a.phi / (1 rad) - 0.1)\" }}\nsample_time = \"1 ms\"\n{delay}[scenario]\nduration = \"0.02 s\"\n"
        );
        let run = run_by(&source, Method::Taylor, Some(1e-9));
        assert!(run.notes.iter().any(|note| note.contains("an output or a state was not a number")), "{:?}", run.notes);
        assert!(run.notes.iter().all(|note| !note.contains("estimate")), "{:?}", run.notes);
    }
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
    let failing = |time: f64| (0.5..0.7 - 1e-12).contains(&time);
    let reset = unit("kind = \"reset\"");
    let missed = unit("kind = \"missed\"");
    let stale = unit("kind = \"stale\"");
    let jitter = unit("kind = \"jitter\"\nvalue = \"6 ms\"");
    let (mut early, mut late) = (0, 0);
    for k in 0..500 {
        let time = f64::from(k) / 500.0;
        let near = |run: &Run, name: &str, expected: f64| {
            assert!((at(run, name, time) - expected).abs() < 1e-9, "{name} at {time} s: {expected}");
        };
        near(&reset, "m.tau", if failing(time) { 0.0 } else { sampled(time) });
        near(&missed, "m.tau", if failing(time) { 0.49 } else { sampled(time) });
        near(&stale, "m.tau", sampled(time));
        // The counter starts anew behind the reset; where samples are missed it stands still.
        let counted = |run: &Run| at(run, "n.tau", time);
        if time >= 0.7 {
            assert!((counted(&reset) - (sampled(time) - 0.7)).abs() < 1e-9, "at {time} s: {}", counted(&reset));
            assert!((counted(&missed) - (sampled(time) - 0.2)).abs() < 1e-9, "at {time} s: {}", counted(&missed));
        }
        if failing(time) {
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
    let source = wheel("", &["kind = \"reduced\"\nvalue = 0.5\nat = \"1 s\""])
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
        ("at = \"1 s\"", "it names no failing part", "motor"),
        ("motor = \"m\"\nkind = \"reduced\"\nat = \"1 s\"", "`reduced` needs the key `value`", "value = "),
        ("motor = \"m\"\nkind = \"reduced\"\nvalue = 1.5\nat = \"1 s\"", "leaves all of it", "below one"),
        ("motor = \"m\"\nkind = \"braking\"\nat = \"1 s\"", "`braking` needs the key `value`", "`value = \""),
        ("motor = \"m\"\nkind = \"reduced\"\nvalue = -1\nat = \"1 s\"", "must not be negative, found -1", "above zero"),
        ("motor = \"m\"\nkind = \"undervoltage\"\nvalue = -1\nat = \"1 s\"", "no limit", "torque_limit"),
        (
            "motor = \"m\"\nkind = \"braking\"\nvalue = \"-1 N m s/rad\"\nat = \"1 s\"",
            "`value` of `braking` must be more than zero, found -1 N m s/rad",
            "above zero",
        ),
        (
            "sensor = \"enc\"\nkind = \"noise\"\nvalue = \"-1 rad\"\nat = \"1 s\"",
            "must be more than zero",
            "above zero",
        ),
        ("motor = \"m\"\nkind = \"braking\"\nvalue = \"1 N m\"\nat = \"1 s\"", "expected", "unit"),
        ("motor = \"m\"\nvalue = 2\nat = \"1 s\"", "`value` has no meaning for `dead`", "remove"),
        ("motor = \"m\"\nkind = \"undervoltage\"\nvalue = 0.5\nat = \"1 s\"", "no limit", "torque_limit"),
        ("motor = \"m\"\nat = \"2 s\"\nuntil = \"1 s\"", "before it begins", "until"),
    ];
    let encoder = "[sensor.enc]\nmeasures = \"angle\"\nshaft = \"a\"\n\
                   [block.seen]\nkind = \"hold\"\ninput = \"enc\"\nsample_time = \"10 ms\"\n";
    for (keys, message, help) in cases {
        let extra = if keys.contains("enc") { encoder } else { "" };
        let source = wheel(extra, &[]) + "[[scenario.fault]]\n" + keys + "\n";
        let reported = study::prepare(&source).1;
        let found = reported.iter().find(|one| one.message.contains(message));
        let found = found.unwrap_or_else(|| panic!("{keys}: {}", plain(&source, &reported)));
        let helps = |text: &String| text.contains(help) && !text.contains("\"\"");
        assert!(found.help.as_ref().is_some_and(helps), "{keys}: {found:?}");
        assert!(!found.labels.is_empty(), "{keys}: {found:?}");
    }
    let overlapping = wheel("", &["at = \"1 s\"", "kind = \"reversed\"\nat = \"2 s\""]);
    let reported = study::prepare(&overlapping).1;
    assert!(
        reported.iter().any(|one| one.code == "fault::overlap" && one.message.contains("another fault then")),
        "{reported:?}"
    );
}

/// The torque that a motor has reached when it sticks stays to the last bit, until the end of the fault.
#[test]
fn a_torque_that_sticks() {
    let limits = ["", "lag = \"50 ms\"", "torque_limit = \"2.5 N m\"", "rate_limit = \"3 N m/s\""];
    for limit in limits {
        let source = wheel(limit, &["kind = \"stuck\"\nat = \"1 s\"\nuntil = \"2 s\""])
            .replace("to = \"4 N m\"", "to = \"4 N m\"\nover = \"2.5 s\"");
        every_method(&source, |run| {
            let stuck = at(run, "m.tau", 1.0);
            assert!((at(run, "m.tau", 0.99) - stuck).abs() < 0.04 && stuck > 1.0, "{limit}: {stuck}");
            for (time, torque) in run.series.time.iter().zip(signal(run, "m.tau")) {
                assert!(!(1.0..2.0).contains(time) || *torque == stuck, "{limit} at {time} s: {torque}");
            }
            assert!((at(run, "a.w", 2.0) - at(run, "a.w", 1.0) - 0.5 * stuck).abs() < 1e-11, "{limit}");
            assert!(at(run, "m.tau", 2.01) != stuck && run.energy.residual.abs() < 1e-9, "{limit}: {:?}", run.energy);
        });
    }
}

/// Two wheels of 1 and 2 kg m² on a bar of 30 N m/rad, the first turned at 1 rad/s at the start, with a sensor on the bar.
fn two_wheels(faults: &str) -> String {
    format!(
        "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"2 kg m^2\"\n\
         [spring_damper.bar]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"30 N m/rad\"\ndamping = \"D\"\n\
         [sensor.felt]\nmeasures = \"torque\"\nelement = \"bar\"\n\
         [block.seen]\nkind = \"gain\"\ninput = \"felt\"\ngain = 1\nsample_time = \"10 ms\"\n\
         [scenario]\nduration = \"2 s\"\noutput_step = \"10 ms\"\ninitial = {{ \"a.w\" = \"1 rad/s\" }}\n{faults}"
    )
}

/// From the break on the bar gives exactly nothing and both wheels turn evenly at the speeds of the closed form; what the bar held is lost, and
/// the balance of energy closes.
#[test]
fn a_bar_that_breaks() {
    let broken = "[[scenario.fault]]\nelement = \"bar\"\nat = \"0.77 s\"\n";
    let source = two_wheels(broken).replace("damping = \"D\"\n", "");
    every_method(&source, |run| {
        let rate = f64::sqrt(45.0);
        let twist = f64::sin(rate * 0.77) / rate;
        let [mean, apart] = [1.0 / 3.0, f64::cos(rate * 0.77)];
        assert!((at(run, "bar.tau", 0.76) - 30.0 * f64::sin(rate * 0.76) / rate).abs() < 1e-8);
        for (row, time) in run.series.time.iter().enumerate().filter(|(_, time)| **time >= 0.77) {
            assert_eq!(signal(run, "bar.tau")[row], 0.0, "at {time} s");
            assert!((signal(run, "a.w")[row] - (mean + 2.0 / 3.0 * apart)).abs() < 1e-9, "at {time} s");
            assert!((signal(run, "b.w")[row] - (mean - 1.0 / 3.0 * apart)).abs() < 1e-9, "at {time} s");
            assert!(*time < 0.78 || signal(run, "seen")[row] == 0.0, "the sensor reads nothing at {time} s");
        }
        assert!((run.energy.dissipated - 15.0 * twist * twist).abs() < 1e-9, "{:?}", run.energy);
        assert!(run.energy.residual.abs() < 1e-10, "{:?}", run.energy);
        let reported = run.events.iter().find(|event| event.description.starts_with("bar breaks")).expect("an event");
        assert!(
            reported.time == 0.77 && reported.description.contains(&format!("{:.6} J", 15.0 * twist * twist)),
            "{reported:?}"
        );
    });
    // With a damper its loss ends there too.
    every_method(&two_wheels(broken).replace("\"D\"", "\"3 N m s/rad\""), |run| {
        assert!(run.energy.residual.abs() < 1e-10, "{:?}", run.energy);
        assert!(at(run, "bar.tau", 0.77) == 0.0 && at(run, "a.w", 0.78) == at(run, "a.w", 2.0));
    });
}

/// A hub that slips by 0.1 rad goes on from there: speeds stay, the spring holds ½ s (x − 0.1)² in place of ½ s x².
#[test]
fn a_spring_that_jumps() {
    let jump = "[[scenario.fault]]\nelement = \"bar\"\nkind = \"jump\"\nvalue = \"0.1 rad\"\nat = \"0.77 s\"\n";
    every_method(&two_wheels(jump).replace("damping = \"D\"\n", ""), |run| {
        let rate = f64::sqrt(45.0);
        let (twist, speed) = (f64::sin(rate * 0.77) / rate, f64::cos(rate * 0.77));
        for time in [0.77, 0.8, 1.3, 2.0] {
            let later = rate * (time - 0.77);
            let expected = (twist - 0.1) * later.cos() + speed / rate * later.sin();
            assert!((at(run, "bar.tau", time) - 30.0 * expected).abs() < 1e-7, "at {time} s");
        }
        let gained = 15.0 * ((twist - 0.1) * (twist - 0.1) - twist * twist);
        let energy = &run.energy;
        assert!((energy.input - energy.dissipated - gained).abs() < 1e-9, "{energy:?} {gained}");
        assert!(energy.residual.abs() < 1e-9, "{energy:?}");
        assert!((at(run, "seen", 0.78) - at(run, "bar.tau", 0.78)).abs() < 1e-9);
    });
}

/// A unit takes the blocks of its own sample time with it, not those of another one, nor those that another unit of the same rate computes too.
#[test]
fn blocks_fail_with_their_unit() {
    let source = |kind: &str, more: &str| {
        format!(
            "[shaft.a]\ninertia = \"2 kg m^2\"\n[motor.m]\nshaft = \"a\"\n[motor.n]\nshaft = \"a\"\n\
             [block.count]\nkind = \"integrator\"\ninput = \"1 N m/s\"\nsample_time = \"10 ms\"\n\
             [block.slow]\nkind = \"integrator\"\ninput = \"1 N m/s\"\nsample_time = \"20 ms\"\n\
             [control.c]\nlaw = \"program\"\nsample_time = \"10 ms\"\ncommands = {{ m = \"0.1 * count\" }}\n{more}\
             [scenario]\nduration = \"1 s\"\noutput_step = \"2 ms\"\n\
             [[scenario.fault]]\ncontrol = \"c\"\n{kind}\nat = \"0.5 s\"\nuntil = \"0.7 s\"\n"
        )
    };
    let other = "[control.d]\nlaw = \"program\"\nsample_time = \"10 ms\"\ncommands = { n = \"0 N m\" }\n";
    let run = |kind, more| run_by(&source(kind, more), Method::Taylor, Some(1e-11));
    let near = |run: &Run, name, time, expected: f64| {
        let found = at(run, name, time);
        assert!((found - expected).abs() < 1e-9, "{name} at {time} s: {found}, not {expected}");
    };
    let reset = run("kind = \"reset\"", "");
    near(&reset, "count", 0.49, 0.49);
    near(&reset, "count", 0.6, 0.0);
    near(&reset, "count", 0.9, 0.2);
    near(&reset, "m.tau", 0.9, 0.02);
    near(&reset, "slow", 0.9, 0.9);
    let missed = run("kind = \"missed\"", "");
    near(&missed, "count", 0.6, 0.49);
    near(&missed, "count", 0.9, 0.7);
    let shared = run("kind = \"reset\"", other);
    near(&shared, "count", 0.9, 0.9);
}

/// What cannot break or jump says why.
#[test]
fn what_cannot_break() {
    let bare = two_wheels("").replace("damping = \"D\"\n", "");
    let gear =
        bare.clone() + "[shaft.c]\ninertia = \"1 kg m^2\"\n[gear.g]\nshaft_1 = \"b\"\nshaft_2 = \"c\"\nratio = 2\n";
    let backlash = bare
        .replace("[sensor.felt]\nmeasures = \"torque\"\nelement = \"bar\"\n", "")
        .replace("\"felt\"", "\"a.phi\"")
        .replace("stiffness =", "backlash = \"0.1 rad\"\nstiffness =");
    let rubs = bare.replace("stiffness =", "friction = \"1 N m\"\nstiffness =");
    let cases = [
        (&bare, "element = \"bat\"\nat = \"1 s\"", "there is no element `bat`", "did you mean `bar`?"),
        (&bare, "element = \"a\"\nat = \"1 s\"", "has no spring", "spring_damper"),
        (
            &gear,
            "element = \"g\"\nkind = \"jump\"\nvalue = \"0.1 rad\"\nat = \"1 s\"",
            "the gear `g` has no spring",
            "spring_damper",
        ),
        (&bare, "element = \"bar\"\nkind = \"jump\"\nat = \"1 s\"", "`jump` needs the key `value`", "value = "),
        (&bare, "element = \"bar\"\nkind = \"jump\"\nvalue = \"1 N m\"\nat = \"1 s\"", "expected an angle", "deg"),
        (&bare, "element = \"bar\"\nat = \"1 s\"\nuntil = \"1.5 s\"", "stays broken", "remove `until`"),
        (&bare, "element = \"bar\"\nkind = \"dead\"\nat = \"1 s\"", "an element cannot be `dead`", "broken"),
        (&backlash, "element = \"bar\"\nat = \"1 s\"", "has backlash", "backlash"),
        (&rubs, "element = \"bar\"\nat = \"1 s\"", "Coulomb friction", "of its own"),
    ];
    for (source, keys, message, help) in cases {
        let source = source.to_string() + "[[scenario.fault]]\n" + keys + "\n";
        let reported = study::prepare(&source).1;
        let found = reported.iter().find(|one| one.message.contains(message));
        let found = found.unwrap_or_else(|| panic!("{keys}: {}", plain(&source, &reported)));
        assert!(found.help.as_ref().is_some_and(|text| text.contains(help)), "{keys}: {found:?}");
    }
}

/// A fault with a name happens where a variant names it, or where it is asked for; the rows are the same with and without it.
#[test]
fn faults_with_a_name() {
    let source = wheel("", &[])
        + "[fault.dead]\nmotor = \"m\"\nat = \"1 s\"\n[fault.back]\nmotor = \"m\"\nkind = \"reversed\"\nat = \"2 s\"\n\
           [[variant]]\nname = \"sound\"\n[[variant]]\nname = \"ill\"\nfaults = [\"dead\"]\n";
    let run = |faults: &[&str]| {
        let faults = faults.iter().map(ToString::to_string).collect();
        let settings = study::Settings { faults, variants: vec!["sound".into()], ..crate::common::runs_only() };
        study::run(&source, &settings, &study::Silent)
    };
    let both = study::run(&source, &crate::common::runs_only(), &study::Silent).expect("no mistakes").runs;
    let requested = run(&["dead"]).expect("no mistakes").runs;
    assert_eq!(both[1].series.signals, requested[0].series.signals);
    assert!(both[0].series.time == requested[0].series.time && (at(&both[0], "a.w", 3.0) - 6.0).abs() < 1e-12);
    assert!((at(&requested[0], "a.w", 3.0) - 2.0).abs() < 1e-12);
    let reported = |faults: &[&str]| run(faults).expect_err("refused").remove(0);
    assert!(reported(&["ded"]).help.is_some_and(|help| help.contains("dead")));
    assert!(reported(&["dead", "back"]).message.contains("two ways at once"));
    let unknown = source.replace("faults = [\"dead\"]", "faults = [\"ded\"]");
    let found = study::prepare(&unknown).1;
    assert!(found.iter().any(|one| one.message.contains("variant `ill`: there is no fault `ded`")), "{found:?}");
}

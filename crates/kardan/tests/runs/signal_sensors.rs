//! Sensors of signals: what a vehicle tells, a block, a function of time, with the resolution, the noise and the faults that others have.

use crate::common::{at, run_by, signal};
use kardan::diagnostics::plain;
use kardan::results::Run;
use kardan::simulate::Method;
use kardan::study;

/// A wheel that a motor swings, with what is measured of its motion by way of a signal, and a program that may read that.
fn wheel(sensor: &str, more: &str) -> String {
    format!(
        "[shaft.a]\ninertia = \"2 kg m^2\"\ndamping = \"0.3 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n\
         [signal.push]\nkind = \"sine\"\namplitude = \"4 N m\"\nfrequency = \"0.7 Hz\"\n\
         [block.power]\nkind = \"gain\"\ninput = \"a.w * 3 N m\"\ngain = 1\n\
         [sensor.meter]\nmeasures = \"signal\"\nsignal = \"power\"\n{sensor}\n{more}\n\
         [scenario]\nduration = \"1 s\"\noutput_step = \"1 ms\"\n[scenario.signals]\n"
    )
    .replace("[scenario.signals]\n", "")
}

fn run(source: &str) -> Run {
    run_by(source, Method::Taylor, Some(1e-10))
}

const PROGRAM: &str =
    "[control.c]\nlaw = \"program\"\nsample_time = \"1 ms\"\ncommands = { m = \"push - 0.1 s * READ\" }\n";

/// A sensor without errors reads its signal at its samples and holds it: as the block `hold` does, bit for bit, also where a program of another sample
/// time reads it and the loop closes through it.
#[test]
fn a_sensor_is_a_zero_order_hold_of_its_signal() {
    for period in ["1 ms", "5 ms", "8 ms"] {
        let measured = wheel(&format!("sample_time = \"{period}\""), &PROGRAM.replace("READ", "meter"));
        let hold_block = format!("[block.held]\nkind = \"hold\"\ninput = \"power\"\nsample_time = \"{period}\"\n");
        let again = match period {
            "1 ms" => String::new(),
            _ => "[block.held_1]\nkind = \"hold\"\ninput = \"held\"\nsample_time = \"1 ms\"\n".into(),
        };
        let read = if period == "1 ms" { "held" } else { "held_1" };
        let blocks = wheel(
            &format!("sample_time = \"{period}\""),
            &format!("{hold_block}{again}{}", PROGRAM.replace("READ", read)),
        );
        let [measured, blocks] = [measured, blocks].map(|source| run(&source));
        assert!(at(&measured, "a.phi", 1.0).abs() > 0.1);
        // What runs at 1 kHz reads a slower block as it was before this instant, and a slower sensor as it is.
        if period == "1 ms" {
            for name in ["a.phi", "a.w", "m.tau"] {
                assert_eq!(signal(&measured, name), signal(&blocks, name), "{name}");
            }
        }
        let every = (period[..1].parse::<usize>().expect("a number"), signal(&measured, "power"));
        for (k, reading) in signal(&measured, "meter").iter().enumerate() {
            assert_eq!(*reading, every.1[k / every.0 * every.0], "row {k} at {period}");
        }
    }
}

/// The command at a sample is that of the reading at that sample: resolution by the formula of the manual.
#[test]
fn a_sensor_rounds_its_signal() {
    let source =
        wheel("resolution = \"0.25 W\"\nphase = 0.5\nsample_time = \"1 ms\"", &PROGRAM.replace("READ", "meter"));
    let found = run(&source);
    let (time, push) = (&found.series.time, |t: f64| 4.0 * (2.0 * std::f64::consts::PI * 0.7 * t).sin());
    let mut steps = 0;
    for (k, (power, reading)) in signal(&found, "power").iter().zip(signal(&found, "meter")).enumerate() {
        assert_eq!(*reading, 0.25 * (power / 0.25 + 0.5).floor(), "row {k}");
        let reported = push(time[k]) - 0.1 * reading;
        assert!((signal(&found, "m.tau")[k] - reported).abs() < 1e-12, "row {k}");
        steps += usize::from(k > 0 && *reading != signal(&found, "meter")[k - 1]);
    }
    assert!(steps > 10);
}

/// Noise has the deviation that is stated, does not depend on who reads, and is another one for another seed.
#[test]
fn a_sensor_is_noisy() {
    let sensor = "noise = \"0.2 W\"\nsample_time = \"1 ms\"";
    let noise = |run: &Run| -> Vec<f64> {
        signal(run, "meter").iter().zip(signal(run, "power")).map(|(reading, power)| reading - power).collect()
    };
    let baseline = noise(&run(&wheel(sensor, "")));
    let (mean, n) = (baseline.iter().sum::<f64>() / baseline.len() as f64, baseline.len() as f64);
    let deviation = (baseline.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt();
    // Four deviations of mean and deviation of 1000 draws.
    assert!(
        mean.abs() < 4.0 * 0.2 / n.sqrt() && (deviation - 0.2).abs() < 4.0 * 0.2 / (2.0 * n).sqrt(),
        "{mean} {deviation}"
    );
    let read = run(&wheel(sensor, &PROGRAM.replace("READ", "meter")));
    for (k, (one, other)) in baseline.iter().zip(noise(&read)).enumerate() {
        assert!((one - other).abs() < 1e-12, "row {k}");
    }
    // The program commands what its own reading says: the same draw.
    let (time, tau) = (&read.series.time, signal(&read, "m.tau"));
    for (k, reading) in signal(&read, "meter").iter().enumerate() {
        let reported = 4.0 * (2.0 * std::f64::consts::PI * 0.7 * time[k]).sin() - 0.1 * reading;
        assert!((tau[k] - reported).abs() < 1e-12, "row {k}");
    }
    let other = noise(&run(&wheel(sensor, "").replace("[scenario]\n", "[scenario]\nseed = 7\n")));
    assert!(baseline.iter().zip(other).filter(|(a, b)| *a != b).count() > 990);
}

/// Its faults are those of other sensors, in units of the signal; a lost one is held by all but monitors.
#[test]
fn a_sensor_of_a_signal_fails() {
    let more = "[block.alarm]\nkind = \"monitor\"\nresidual = \"meter - 1 W\"\nthreshold = \"1000 W\"\nsample_time = \"1 ms\"\n";
    let more = format!("{more}{}", PROGRAM.replace("READ", "meter"));
    let failing = |keys: &str, at: f64| {
        let fault = format!("[[scenario.fault]]\nsensor = \"meter\"\nat = \"{at} s\"\nuntil = \"0.6 s\"\n{keys}\n");
        run(&format!("{}{fault}", wheel("sample_time = \"1 ms\"", &more)))
    };
    let apart = |run: &Run, expected: &dyn Fn(f64, f64, [f64; 2]) -> f64, keys: &str| {
        let last = [at(run, "meter", 0.399), at(run, "power", 0.4)];
        for (k, t) in run.series.time.iter().enumerate().filter(|(k, _)| k % 7 == 0) {
            let (power, reading) = (signal(run, "power")[k], signal(run, "meter")[k]);
            let expected = if (0.4 - 1e-9..0.6 - 1e-9).contains(t) { expected(power, *t, last) } else { power };
            // Rows between samples have what was read there.
            if ((t * 1e3).round() - t * 1e3).abs() < 1e-9 {
                assert!((reading - expected).abs() < 1e-9, "{keys} at {t} s: {reading} for {expected}");
            }
        }
    };
    for (keys, expected) in [
        ("kind = \"offset\"\nvalue = \"2 W\"", &(|power, _, _| power + 2.0) as &dyn Fn(f64, f64, [f64; 2]) -> f64),
        ("kind = \"drift\"\nvalue = \"3 W/s\"", &|power, t, _| power + 3.0 * (t - 0.4)),
        ("kind = \"reversed\"", &|power, _, _| -power),
        ("kind = \"stuck\"", &|_, _, [_, current]| current),
        ("kind = \"lost\"", &|_, _, [before, _]| before),
    ] {
        let found = failing(keys, 0.4);
        apart(&found, expected, keys);
        let alarms = signal(&found, "alarm").iter().filter(|x| **x > 0.5).count();
        assert_eq!(alarms > 0, keys.contains("lost"), "{keys}");
    }
    let (lost, stuck) = (failing("kind = \"lost\"", 0.4), failing("kind = \"stuck\"", 0.399));
    assert_eq!(signal(&lost, "a.phi"), signal(&stuck, "a.phi"));
}

/// Functions of time, references, what a car tells and its wheel speeds are signals.
#[test]
fn all_that_a_run_has_can_be_measured() {
    let source = "[vehicle.car]\nmass = \"1500 kg\"\nyaw_inertia = \"2500 kg m^2\"\nfront_axle = \"1.2 m\"\nrear_axle = \"1.5 m\"\n\
         front_stiffness = \"90 kN/rad\"\nrear_stiffness = \"110 kN/rad\"\nsteered_by = \"column\"\nsteering_ratio = 15\n\
         caster_trail = \"25 mm\"\npneumatic_trail = \"35 mm\"\ntrack = \"1.5 m\"\nspeed = \"v\"\nrelaxation_length = \"0.5 m\"\n\
         [signal.v]\nkind = \"ramp\"\nto = \"20 m/s\"\nover = \"0.5 s\"\n\
         [shaft.column]\ninertia = \"0.04 kg m^2\"\ndamping = \"0.5 N m s/rad\"\n[motor.m]\nshaft = \"column\"\n\
         [disturbance.hand]\nshaft = \"column\"\n\
         [signal.both]\nkind = \"expression\"\nvalue = \"car.v_fl - car.v_fr\"\n\
         [scenario]\nduration = \"1 s\"\noutput_step = \"5 ms\"\n\
         [[scenario.event]]\nsignal = \"hand\"\nat = \"0.2 s\"\nto = \"1 N m\"\n";
    let names = ["car.a_y", "car.v_fl", "car.yaw_rate", "v", "hand", "both"];
    let sensors: String = names
        .iter()
        .enumerate()
        .map(|(k, name)| format!("[sensor.s{k}]\nmeasures = \"signal\"\nsignal = \"{name}\"\nsample_time = \"5 ms\"\n"))
        .collect();
    let found = run(&format!("{sensors}{source}"));
    for (k, name) in names.iter().enumerate() {
        let rows =
            found.series.time.iter().enumerate().filter(|(_, t)| ((*t * 200.0).round() - *t * 200.0).abs() < 1e-9);
        for (row, t) in rows {
            assert_eq!(signal(&found, &format!("s{k}"))[row], signal(&found, name)[row], "{name} at {t} s");
        }
        assert!(signal(&found, name).iter().any(|x| *x != 0.0), "{name}");
    }
}

/// What cannot be measured is refused with what to do.
#[test]
fn what_is_no_signal_is_refused() {
    for (signal, reported) in [
        ("signal = \"powr\"", "did you mean `power`?"),
        ("signal = \"a.phi\"", "measures = \"angle\""),
        ("signal = \"t\"", "measures = \"angle\""),
        ("signal = \"power * 2\"", "[signal.NAME]"),
        ("signal = \"meter\"", "measures no other sensor"),
        ("signal = \"power\"\nresolution = \"1 rad\"", "found an angle"),
        ("signal = \"power\"\nnoise = \"1 rad\"", "found an angle"),
        ("signal = \"power\"\nresolution = \"0 W\"", "must be more than zero"),
        ("signal = \"power\"\nlines = 4", "lines are counted in a turn"),
        ("signal = \"power\"\nshaft = \"a\"", "measures no shaft"),
        ("", "needs its name"),
    ] {
        let source = wheel("sample_time = \"1 ms\"", "").replace("signal = \"power\"", signal);
        let (_, found) = study::prepare(&source);
        assert!(plain(&source, &found).contains(reported), "{signal}: {}", plain(&source, &found));
    }
    for (more, signal, reported) in [
        (
            "[block.late]\nkind = \"delay\"\ninput = \"power\"\nsample_time = \"1 ms\"\n",
            "late",
            "so no sensor can measure it",
        ),
        (
            "[block.own]\nkind = \"delay\"\nunit = \"W\"\ninput = \"meter\"\nsample_time = \"1 ms\"\n",
            "own",
            "so no sensor can measure it",
        ),
        (
            "[sensor.my-own]\nmeasures = \"signal\"\nsignal = \"power\"\n[block.b]\nkind = \"gain\"\ngain = 1\ninput = \"my-own\"\nsample_time = \"1 ms\"\n",
            "power",
            "`'my-own'`",
        ),
        ("[sensor.pi]\nmeasures = \"signal\"\nsignal = \"power\"\n", "power", "it means a number"),
    ] {
        let source =
            wheel("sample_time = \"1 ms\"", more).replacen("signal = \"power\"", &format!("signal = \"{signal}\""), 1);
        let (_, found) = study::prepare(&source);
        assert!(plain(&source, &found).contains(reported), "{signal}: {}", plain(&source, &found));
    }
    let source = wheel("", "[block.now]\nkind = \"gain\"\ninput = \"meter\"\ngain = 2\n");
    let (_, found) = study::prepare(&source);
    assert!(plain(&source, &found).contains("let them read the signal itself: `power`"), "{}", plain(&source, &found));
}

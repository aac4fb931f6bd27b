//! Sampled controllers: the exact loop map, its limits against golden data, runs against the map.

use crate::common::{self, golden};
use kardan::model::builtin;
use kardan::study::{self, PreparedVariant};
use kardan::synthesis::{Clock, LoopBlocks, LoopPlant, SampledLoop, SampledPart, Survey, sampled};
use serde_json::Value;

fn steering() -> std::sync::Arc<PreparedVariant> {
    study::prepare(builtin("sia-steering").expect("built in").source).0.variants.remove(0)
}

/// The linear design model of the first controller, with its motors.
fn plant(variant: &PreparedVariant) -> LoopPlant {
    let model = &variant.design_models[0];
    LoopPlant::new(&model.linear, &model.lags())
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// The steering system's column at that clock, the driver in continuous time.
fn column(variant: &PreparedVariant, clock: Clock) -> SampledLoop {
    let plant = plant(variant);
    let mut laws = variant.designed.clone();
    let driver = laws.remove(1);
    let laws = [sampled(laws.remove(0), clock).expect("finite"), driver];
    let parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, &plant)).collect();
    SampledLoop::new(&plant, &parts).expect("a loop")
}

/// Golden `discrete.rho`: spectral radii of the sampled loop.
#[test]
fn spectral_radii() {
    let golden = golden();
    let table = golden["discrete"]["rho"].as_object().expect("a table");
    let variant = steering();
    let mut checked = 0;
    for (rate, row) in table {
        let period = 1.0 / rate.parse::<f64>().expect("a rate");
        for (key, delay) in [("no_delay", 0.0), ("half_delay", 0.5), ("one_delay", 1.0)] {
            let found = column(&variant, Clock { period, delay: delay * period, single: false }).spectral_radius();
            let (found, expected) = (found.expect("eigenvalues"), number(&row[key]));
            assert!((found - expected).abs() < 1e-11, "{rate} Hz, {key}: {found} {expected}");
            checked += 1;
        }
    }
    assert!(checked >= 39, "{checked}");
}

/// Golden `discrete.limits`: the longest stable sample times.
#[test]
fn rate_limits() {
    let golden = golden();
    let variant = steering();
    let laws = &variant.designed;
    let clocks = [None, None];
    let plant = plant(&variant);
    let survey = Survey { plant: &plant, laws, clocks: &clocks, number: 0, blocks: &LoopBlocks::default() };
    for (key, delay) in [("no_delay", 0.0), ("half", 0.5), ("one_delay", 1.0)] {
        let found = survey.longest_period(delay).expect("stable when fast").value;
        let expected = number(&golden["discrete"]["limits"][key]["T_max"]);
        assert!((found / expected - 1.0).abs() < 1e-6, "{key}: {found} {expected}");
    }
}

/// The steering system without Coulomb friction, its column at a clock, from initial angles.
fn frictionless(clock: &str, motor: &str) -> String {
    let source = builtin("sia-steering").expect("built in").source;
    let lines = source.lines().filter(|line| !line.starts_with("friction ="));
    let text = lines.collect::<Vec<_>>().join("\n");
    let (head, _) = text.split_once("# ---- the run").expect("a scenario");
    let head = head
        .replace("[control.column]\n", &format!("[control.column]\n{clock}\n"))
        .replace("shaft = \"wg\"\n", &format!("shaft = \"wg\"\n{motor}\n"));
    head.replace("[variants]\nbeta = \"[0, 10, 20, 30] deg\"\n", "")
        + "[scenario]\nduration = \"20 ms\"\noutput_step = \"50 us\"\ninitial = { \"rk.phi\" = \"0.1 rad\", \"fs.phi\" = \"-0.2 rad\", \"cj.phi\" = \"0.11 rad\" }\n"
}

/// A run of the linear plant equals the powers of the exact map, at every sample, for any delay and lag.
#[test]
fn runs_equal_the_exact_map() {
    let cases = [
        ("sample_time = \"100 us\"", ""),
        ("sample_time = \"100 us\"\ndelay = \"50 us\"", ""),
        ("sample_time = \"100 us\"\ndelay = \"100 us\"", "lag = \"20 us\""),
        ("sample_time = \"100 us\"\ndelay = \"120 us\"", "lag = \"10 us\""),
        (
            "sample_time = \"100 us\"\ndelay = \"30 us\"\nobserver = { sensors = [\"rk.phi\", \"cs.phi\", \"wg.phi\"], \
             disturbances = [\"rk\", \"fs\"], method = \"kalman\" }",
            "",
        ),
    ];
    for (clock, motor) in cases {
        let source = frictionless(clock, motor);
        let variant = common::first(&source);
        let coordinates = variant.design_models[0].linear.coordinates.clone();
        let plant = plant(&variant);
        let laws = &variant.implemented;
        let parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, &plant)).collect();
        let found = SampledLoop::new(&plant, &parts).expect("a loop");
        let run = common::run(&source);
        let mut z = vec![0.0; found.map.rows()];
        let start: Vec<f64> = coordinates.iter().map(|name| common::at(&run, &format!("{name}.phi"), 0.0)).collect();
        z[..3].copy_from_slice(&start);
        // The observer starts at the true angles.
        let first = found.map.rows() - laws[0].states().len();
        for (k, state) in laws[0].states().iter().enumerate() {
            let coordinate = coordinates.iter().position(|name| *state == format!("estimate of {name}.phi"));
            z[first + k] = coordinate.map_or(0.0, |k| start[k]);
        }
        let mut largest: f64 = 0.0;
        for sample in 0..200 {
            let time = f64::from(sample) * 1e-4;
            for (k, name) in coordinates.iter().enumerate() {
                let (angle, speed) =
                    (common::at(&run, &format!("{name}.phi"), time), common::at(&run, &format!("{name}.w"), time));
                assert!((angle - z[k]).abs() < 1e-9, "{clock} {motor}: {name}.phi at {time}: {angle} {}", z[k]);
                assert!((speed - z[3 + k]).abs() < 1e-6, "{clock} {motor}: {name}.w at {time}: {speed} {}", z[3 + k]);
                largest = largest.max(speed.abs());
            }
            z = (0..z.len()).map(|i| (0..z.len()).map(|j| found.map[(i, j)] * z[j]).sum()).collect();
        }
        assert!(largest > 1.0, "something moves");
    }
}

/// The same beside coordinates without inertia, whose rates are no states: a motor without inductance, and a node between a spring and a damper.
#[test]
fn massless_runs_equal_the_exact_map() {
    let drive = "[model]\nname = \"drive\"\n[shaft.a]\ninertia = \"0.02 kg m^2\"\ndamping = \"0.01 N m s/rad\"\n[shaft.b]\n\
                 inertia = \"0.05 kg m^2\"\n[shaft.m]\n[voltage_source.u]\nfrom = \"ground\"\nto = \"in\"\n[dc_motor.motor]\n\
                 from = \"in\"\nto = \"ground\"\nshaft = \"a\"\ntorque_constant = \"0.5 N m/A\"\nresistance = \"2 Ohm\"\n\
                 [spring_damper.k]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"20 N m/rad\"\n\
                 [spring_damper.s]\nshaft_1 = \"a\"\nshaft_2 = \"m\"\nstiffness = \"10 N m/rad\"\n\
                 [spring_damper.d]\nshaft_1 = \"m\"\nshaft_2 = \"b\"\ndamping = \"0.4 N m s/rad\"\n\
                 [scenario]\nduration = \"0.4 s\"\noutput_step = \"1 ms\"\n\
                 initial = { \"a.phi\" = \"0.1 rad\", \"b.phi\" = \"-0.2 rad\", \"m.phi\" = \"0.3 rad\", \"a.w\" = \"2 rad/s\" }\n\
                 [control.c]\nlaw = \"lqr\"\ninputs = [\"u\"]\nmax_acceptable = { u = \"10 V\" }\n";
    let channel = "[[control.c.channels]]\noutput = \"b.phi\"\nreference = \"ref\"\n";
    let observer = "observer = { sensors = [\"a.phi\", \"b.phi\"], disturbances = [\"b\"], method = \"kalman\" }\n";
    for keys in ["".to_string(), "delay = \"1.3 ms\"\n".into(), format!("delay = \"0.4 ms\"\n{observer}")] {
        let source = format!("{drive}sample_time = \"1 ms\"\n{keys}{channel}");
        let variant = common::first(&source);
        let plant = plant(&variant);
        let (laws, coordinates) = (&variant.implemented, &variant.design_models[0].linear.coordinates);
        assert_eq!((plant.states(), plant.moving.len(), coordinates.len()), (6, 2, 4));
        let parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, &plant)).collect();
        let found = SampledLoop::new(&plant, &parts).expect("a loop");
        let run = common::run(&source);
        let positions = coordinates.iter().map(|name| if name == "u" { "u.q".into() } else { format!("{name}.phi") });
        let speeds = plant.moving.iter().map(|k| format!("{}.w", coordinates[*k]));
        let names: Vec<String> = positions.chain(speeds).collect();
        let mut z = vec![0.0; found.map.rows()];
        for (z, name) in z.iter_mut().zip(&names) {
            *z = common::at(&run, name, 0.0);
        }
        // The observer starts at the true positions.
        let first = found.map.rows() - laws[0].states().len();
        for (k, state) in laws[0].states().iter().enumerate() {
            let place = names[..4].iter().position(|name| *state == format!("estimate of {name}"));
            z[first + k] = place.map_or(0.0, |place| z[place]);
        }
        let mut largest: f64 = 0.0;
        for sample in 0..400 {
            for (z, name) in z.iter().zip(&names) {
                let value = common::at(&run, name, f64::from(sample) * 1e-3);
                assert!((value - z).abs() < 1e-8, "{keys} {sample}: {name} {value} {z}");
                largest = largest.max(value.abs());
            }
            z = (0..z.len()).map(|i| (0..z.len()).map(|j| found.map[(i, j)] * z[j]).sum()).collect();
        }
        assert!(largest > 1.0, "something moves");
    }
}

/// Golden `discrete.hds`: the decoupling of the harmonic drive with a spring.
#[test]
fn harmonic_drive_with_a_spring() {
    let golden = golden();
    let variant = common::first(builtin("harmonic-drive-spring").expect("built in").source);
    let laws = &variant.designed;
    let plant = plant(&variant);
    let survey = Survey { plant: &plant, laws, clocks: &[None], number: 0, blocks: &LoopBlocks::default() };
    let mut checked = 0;
    for (key, delay) in [("delay0", 0.0), ("delay1", 1.0)] {
        let expected = &golden["discrete"]["hds"][key];
        let found = survey.longest_period(delay).expect("stable when fast").value;
        let limit = number(&expected["T_max"]);
        assert!((found / limit - 1.0).abs() < 1e-6, "{key}: {found} {limit}");
        for (rate, rho) in expected["rho"].as_object().expect("a table") {
            let period = 1.0 / rate.parse::<f64>().expect("a rate");
            let clock = Clock { period, delay: delay * period, single: false };
            let law = sampled(variant.designed[0].clone(), clock).expect("finite");
            let found = SampledLoop::new(&plant, &[SampledPart::of(&*law, &plant)]).expect("a loop");
            // The flexspline under a torque channel is free: two multipliers at one, which the golden numbers leave out.
            let all = found.multipliers().expect("eigenvalues");
            let not_at_one = all.iter().filter(|(re, im)| (re - 1.0).hypot(*im) > 1e-6);
            let radius = not_at_one.map(|(re, im)| re.hypot(*im)).fold(0.0, f64::max);
            assert!((radius / number(rho) - 1.0).abs() < 1e-6, "{key} at {rate} Hz: {radius} {rho}");
            checked += 1;
        }
    }
    assert!(checked >= 12, "{checked}");
}

/// A lag of both motors that the continuous loop tolerates: 207.6 us.
#[test]
fn longest_lag() {
    let variant = steering();
    let laws = &variant.designed;
    let plant = plant(&variant);
    let survey = Survey { plant: &plant, laws, clocks: &[None, None], number: 0, blocks: &LoopBlocks::default() };
    let found = survey.longest_lag().expect("stable without a lag");
    assert!((found.value - 207.6e-6).abs() < 0.05e-6, "{}", found.value);
    // The zero dynamics, 953 rad/s, give way.
    assert!((found.frequency / 953.46 - 1.0).abs() < 0.1, "{}", found.frequency);
}

/// A body turned by hand: its encoder shows what a count by hand gives, with and without phase, at once or every 4 ms.
#[test]
fn quantised_encoder() {
    let source = "\
[model]
name = \"turned\"
[shaft.a]
inertia = \"1 kg m^2\"
[motor.hand]
shaft = \"a\"
[sensor.coarse]
measures = \"angle\"
shaft = \"a\"
lines = 25
[sensor.shifted]
measures = \"angle\"
shaft = \"a\"
lines = 25
phase = 0.5
[sensor.slow]
measures = \"angle\"
shaft = \"a\"
resolution = \"0.05 rad\"
phase = 0.25
sample_time = \"4 ms\"
[scenario]
duration = \"20 ms\"
output_step = \"1 ms\"
initial = { \"a.phi\" = \"-0.1 rad\", \"a.w\" = \"12 rad/s\" }
";
    let run = common::run(source);
    // 25 lines count 100 edges a turn. By hand: angle −0.1 + 12 t; counts of 2π/100 rad, rounded down.
    let step = std::f64::consts::TAU / 100.0;
    let counts = [-2, -2, -2, -2, -1, -1, -1, -1, -1, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 2, 2];
    let shifted = [-2, -1, -1, -1, -1, -1, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2];
    // −0.1, −0.052, −0.004, 0.044, 0.092, 0.14 over 0.05, plus 0.25, rounded down, held for four rows.
    let slow = [-2, -1, 0, 1, 2, 3];
    for (k, time) in run.series.time.iter().enumerate().filter(|(_, time)| (*time * 1e3).fract().abs() < 1e-9) {
        let row = (time * 1e3).round() as usize;
        for (name, expected) in [("coarse.phi", counts[row]), ("shifted.phi", shifted[row])] {
            let found = common::signal(&run, name)[k];
            assert!((found - f64::from(expected) * step).abs() < 1e-12, "{name} at {row} ms: {}", found / step);
        }
        let found = common::signal(&run, "slow.phi")[k];
        assert!((found - 0.05 * f64::from(slow[row / 4])).abs() < 1e-12, "slow at {row} ms: {found}");
    }
}

/// A controller at 2 ms whose sensor reads every 3 ms sees the last reading, counted by hand: u = −reading.
#[test]
fn a_sensor_with_its_own_sample_time_is_read_late() {
    let source = "\
[model]
name = \"late\"
[shaft.a]
inertia = \"1000 kg m^2\"
[motor.m]
shaft = \"a\"
[sensor.s]
measures = \"angle\"
shaft = \"a\"
sample_time = \"3 ms\"
[control.c]
law = \"sampled_noninteracting\"
sample_time = \"2 ms\"
[[control.c.channels]]
output = \"a.phi\"
input = \"m\"
reference = \"r\"
[control.c.observer]
sensors = [\"s.phi\"]
[scenario]
duration = \"13 ms\"
output_step = \"1 ms\"
[[scenario.event]]
at = \"0 s\"
signal = \"r\"
to = \"1 rad\"
";
    let run = common::run(source);
    // The reading moves at multiples of 3 ms only, the torque at multiples of 2 ms only.
    let (reading, torque) = (common::signal(&run, "s.phi"), common::signal(&run, "m.tau"));
    let time = &run.series.time;
    let mut changes = [0, 0];
    for k in 1..time.len() {
        let on = |period: f64| ((time[k] / period).round() * period - time[k]).abs() < 1e-9;
        let moved = |values: &[f64]| values[k] != values[k - 1];
        assert!(!moved(reading) || on(3e-3), "reading at {}", time[k]);
        assert!(!moved(torque) || on(2e-3), "torque at {}", time[k]);
        changes[0] += usize::from(moved(reading));
        changes[1] += usize::from(moved(torque));
    }
    assert!(changes[0] >= 3 && changes[1] >= 5, "{changes:?}");
}

/// Loops that are unstable at their sample time are no designs; forced, they run and diverge.
#[test]
fn unstable_loops_are_refused() {
    let source = builtin("sia-steering").expect("built in").source;
    let text = source.replace("[control.column]\n", "[control.column]\nsample_time = \"1 ms\"\ndelay = \"1 ms\"\n");
    let diagnostics = study::run(&text, &study::Settings::default(), &study::Silent).expect_err("it is unstable");
    let found = diagnostics.iter().find(|diagnostic| diagnostic.code == "control::unstable").expect("told");
    assert!(found.message.contains("1.38403") && found.help.as_deref().is_some_and(|help| help.contains("--force")));
    assert!(study::design(&text, &study::DesignSettings::default(), &study::Silent).is_err());
    let settings = study::DesignSettings { force: true, ..study::DesignSettings::default() };
    let design = study::design(&text, &settings, &study::Silent).expect("forced");
    let margins = design.margins.expect("told");
    assert!(margins.stable == Some(false) && margins.verdict.contains("UNSTABLE"), "{}", margins.verdict);
    assert!(design.warnings.iter().any(|warning| warning.contains("not a design")));
    let settings = study::Settings { variants: vec!["beta-0deg".into()], force: true, ..common::runs_only() };
    let run = study::run(&text, &settings, &study::Silent).expect("forced").runs.remove(0);
    assert_ne!(run.outcome, kardan::results::Outcome::Completed);
}

/// The Riccati equation of a sampled system, Stein's equation, and what the gain says of the loop.
#[test]
fn riccati_and_stein() {
    use kardan::num::Matrix;
    use kardan::synthesis::regulator::{SampledCost, sampled_lqr, stein};
    let mut dice = common::Dice(3);
    for (n, m) in [(1, 1), (2, 1), (4, 2), (7, 3), (12, 2)] {
        let float = |m: Matrix<kardan::num::Rational>| m.to_f64().scale(&0.3);
        let (a, b) = (float(dice.matrix(n, n, 3)), float(dice.matrix(n, m, 3)));
        let (c, d) = (float(dice.matrix(n, n, 4)), float(dice.matrix(n, m, 4)));
        // [C D]ᵀ[C D] with a definite R.
        let state = c.transpose().multiply(&c).plus(&Matrix::identity(n).scale(&0.01));
        let cross = c.transpose().multiply(&d);
        let input = d.transpose().multiply(&d).plus(&Matrix::identity(m));
        let cost = SampledCost { state: state.clone(), input: input.clone(), cross: cross.clone() };
        let found = sampled_lqr(&a, &b, &cost).expect("a solution");
        let x = &found.solution;
        let weight = input.plus(&b.transpose().multiply(x).multiply(&b));
        let right = b.transpose().multiply(x).multiply(&a).plus(&cross.transpose());
        let k = weight.solve(&right).expect("definite");
        let left = a.transpose().multiply(x).multiply(&a).plus(&state).minus(&k.transpose().multiply(&right));
        let size = x.as_slice().iter().fold(1.0f64, |max, x| max.max(x.abs()));
        for (p, q) in [(&left, x), (&k, &found.gain)] {
            let error = p.as_slice().iter().zip(q.as_slice()).fold(0.0f64, |max, (p, q)| max.max((p - q).abs()));
            assert!(error < 1e-10 * size, "{n} states: {error}");
        }
        assert!(found.residual < 1e-12 && found.multipliers.iter().all(|pole| pole.abs() < 1.0));
        let closed = a.minus(&b.multiply(&found.gain));
        let q = c.transpose().multiply(&c);
        let sum = stein(&closed, &closed, &q).expect("stable");
        let again = closed.transpose().multiply(&sum).multiply(&closed).plus(&q);
        let size = sum.as_slice().iter().fold(1.0f64, |max, x| max.max(x.abs()));
        let error = again.as_slice().iter().zip(sum.as_slice()).fold(0.0f64, |max, (p, q)| max.max((p - q).abs()));
        assert!(error < 1e-11 * size, "{error}");
    }
    // Nothing stabilises a growing state that no input reaches.
    let one = |x: f64| Matrix::from_fn(1, 1, |_, _| x);
    let cost = SampledCost { state: one(1.0), input: one(1.0), cross: one(0.0) };
    assert_eq!(sampled_lqr(&one(2.0), &one(0.0), &cost), None);
    assert_eq!(sampled_lqr(&one(2.0), &one(1.0), &SampledCost { input: one(-1.0), ..cost }), None);
    assert_eq!(stein(&one(2.0), &one(1.0), &one(1.0)), None);
}

/// With a second sampled controller in the loop the slowest rate is that of the loop, not of a clash of clocks; without a common
/// period nothing is claimed.
#[test]
fn two_clocks() {
    let source = builtin("sia-steering").expect("built in").source;
    let driver = |time: &str| {
        source
            .replace("[control.column]\n", "[control.column]\nsample_time = \"100 us\"\n")
            .replace("[control.driver_model]", "[control.driver_model]\n@")
            .replace("\n@", &format!("\nsample_time = \"{time}\""))
    };
    let quick = study::DesignSettings { variant: Some("beta-0deg".into()), ..study::DesignSettings::default() };
    for time in ["100 us", "1 ms"] {
        let design = study::design(&driver(time), &quick, &study::Silent).expect("stable");
        let margins = design.margins.expect("told");
        let rate = margins.rates[0].rate.expect("stable when fast");
        assert!((rate / 2412.7 - 1.0).abs() < 0.02, "driver at {time}: {rate} Hz");
    }
    let found = study::check(&driver("3.14159265358979 ms"));
    assert!(found.iter().any(|one| one.code == "control::no-common-period"), "{found:?}");
}

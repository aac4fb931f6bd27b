//! What happens to sampled controllers in runs: sensors that fail, limits, sensors and controllers with clocks of their own.

use crate::common::{self, at, runs_only, signal};
use kardan::model::builtin;
use kardan::results::{Outcome, Run};
use kardan::study::{self, Settings, Silent};
use kardan::synthesis::{Clock, LoopBlocks, LoopPlant, SampledLoop, SampledPart, Survey};

fn ecu() -> &'static str {
    builtin("sia-steering-ecu").expect("built in").source
}

fn variant(source: &str, name: &str) -> Run {
    let settings = Settings { variants: vec![name.into()], ..runs_only() };
    study::run(source, &settings, &Silent).expect("a model without mistakes").runs.remove(0)
}

fn largest(run: &Run, name: &str) -> f64 {
    signal(run, name).iter().fold(0.0, |max, x| max.max(x.abs()))
}

fn fault(keys: &str) -> String {
    format!("{}\n[[scenario.fault]]\n{keys}\n", ecu())
}

/// An encoder that gives no number for 20 ms: the controller holds its last reading, counts it, and goes on.
#[test]
fn an_encoder_fault() {
    let run = variant(&fault("sensor = \"wg_encoder\"\nat = \"0.2 s\"\nuntil = \"0.22 s\""), "rack");
    assert_eq!(run.outcome, Outcome::Completed);
    assert!(run.series.signals.iter().all(|signal| signal.values.iter().all(|x| x.is_finite())));
    assert!(largest(&run, "wg_motor.tau") <= 1.3 && largest(&run, "rk_motor.tau") <= 60.0);
    let reported = |what: &str| run.events.iter().find(|event| event.description == what).map(|event| event.time);
    assert_eq!(reported("wg_encoder supplies no reading"), Some(0.2));
    assert_eq!(reported("wg_encoder works again"), Some(0.22));
    let note = run.notes.iter().find(|note| note.contains("not a number")).expect("reported");
    assert!(note.contains("column") && note.contains("in 20 of 15") && note.contains("first at 0.2"), "{note}");
    // It is felt, and gone in the end.
    let whole = variant(ecu(), "rack");
    let differs = |from: f64, until: f64| {
        let window = |time: &f64| (from..until).contains(time);
        let both = whole.series.time.iter().zip(signal(&whole, "wg_motor.command"));
        let both: Vec<f64> = both.filter(|(time, _)| window(time)).map(|(_, x)| *x).collect();
        let other = run.series.time.iter().zip(signal(&run, "wg_motor.command"));
        let other: Vec<f64> = other.filter(|(time, _)| window(time)).map(|(_, x)| *x).collect();
        both.iter().zip(&other).fold(0.0f64, |max, (a, b)| max.max((a - b).abs()))
    };
    assert_eq!(differs(0.0, 0.2), 0.0);
    assert!(differs(0.2, 0.25) > 0.0);
    assert!((at(&run, "rk.phi", 1.5) - at(&whole, "rk.phi", 1.5)).abs() < 0.02);
}

/// Of a sensor that sticks nobody is told: its readings are numbers.
#[test]
fn a_stuck_sensor() {
    let run = variant(&fault("sensor = \"bar.tau\"\nkind = \"stuck\"\nat = \"0.15 s\"\nuntil = \"0.16 s\""), "rack");
    assert_eq!(run.outcome, Outcome::Completed);
    assert!(!run.notes.iter().any(|note| note.contains("no number")), "{:?}", run.notes);
    assert!(run.events.iter().any(|event| event.description == "bar.tau keeps its last reading"));
    assert_ne!(signal(&run, "wg_motor.command"), signal(&variant(ecu(), "rack"), "wg_motor.command"));
}

/// An observer before a law of continuous time holds the last good reading too.
#[test]
fn an_observer_with_a_missing_reading() {
    let source = "\
[model]
name = \"servo\"
[shaft.a]
inertia = \"0.01 kg m^2\"
damping = \"0.01 N m s/rad\"
[motor.m]
shaft = \"a\"
[sensor.s]
measures = \"angle\"
shaft = \"a\"
[control.c]
law = \"decoupling\"
sample_time = \"1 ms\"
inputs = [\"m\"]
[[control.c.channels]]
output = \"a.phi\"
reference = \"r\"
natural_frequency = \"20 rad/s\"
damping_ratio = 1
[control.c.observer]
sensors = [\"s.phi\"]
disturbances = []
poles = [-100, -101]
[scenario]
duration = \"2 s\"
[[scenario.event]]
at = \"0.1 s\"
signal = \"r\"
to = \"1 rad\"
[[scenario.fault]]
sensor = \"s\"
at = \"0.15 s\"
until = \"0.155 s\"
";
    let run = common::run(source);
    assert_eq!(run.outcome, Outcome::Completed);
    let note = run.notes.iter().find(|note| note.contains("not a number")).expect("reported");
    // Those at both ends of the run among them.
    assert!(note.contains("in 5 of 2001 samples"), "{note}");
    assert!((at(&run, "a.phi", 2.0) - 1.0).abs() < 1e-6, "it arrives all the same");
}

/// The steering wheel is held by the driver, whom the controller without observer does not know: 20 N m are well within the
/// limits of the motors, and the governor lets them through.
#[test]
fn the_governor_passes_a_feasible_wheel_torque() {
    let text = ecu().replacen("step_force = \"0 N m\"", "step_force = \"20 N m\"", 1);
    let text = text.replacen("step_rack = \"0.4 rad\"", "step_rack = \"0 rad\"", 1);
    assert_ne!(text, ecu());
    let run = variant(&text, "full-state");
    let felt = -at(&run, "driver.tau", 1.5);
    assert!((felt / 20.0 - 1.0).abs() < 0.05, "{felt}");
    assert!(largest(&run, "wg_motor.tau") <= 1.3 && !run.notes.iter().any(|note| note.contains("governor")));
    // Half a turn of the rack at once is too much: held back, and told.
    let text = ecu().replacen("step_rack = \"0.4 rad\"", "step_rack = \"3 rad\"", 1);
    let run = variant(&text, "full-state");
    let note = run.notes.iter().find(|note| note.contains("governor")).expect("told");
    assert!(note.contains("full_state") && note.contains("first at 0.1"), "{note}");
    assert!(largest(&run, "wg_motor.tau") <= 1.3 && (at(&run, "rk.phi", 1.5) - 3.0).abs() < 0.01);
}

const INTEGRATORS: &str = "\
[model]
name = \"dynamic decoupling at its limits\"
[shaft.a]
inertia = \"0.01 kg m^2\"
[shaft.b]
inertia = \"0.01 kg m^2\"
damping = \"0.02 N m s/rad\"
[shaft.c]
inertia = \"0.01 kg m^2\"
damping = \"0.02 N m s/rad\"
[spring_damper.bc]
shaft_1 = \"c\"
shaft_2 = \"b\"
stiffness = \"10 N m/rad\"
damping = \"0.1 N m s/rad\"
[spring_damper.ac]
shaft_1 = \"c\"
shaft_2 = \"a\"
stiffness = \"10 N m/rad\"
[motor.on_a]
shaft = \"a\"
torque_limit = \"0.2 N m\"
[motor.on_b]
shaft = \"b\"
torque_limit = \"0.2 N m\"
[control.column]
law = \"decoupling\"
feedback = \"dynamic\"
CLOCK
inputs = [\"on_a\", \"on_b\"]
[[control.column.channels]]
output = \"b.phi\"
reference = \"rb\"
natural_frequency = \"15 rad/s\"
damping_ratio = 1
[[control.column.channels]]
output = \"c.phi\"
reference = \"rc\"
natural_frequency = \"15 rad/s\"
damping_ratio = 1
[scenario]
duration = \"6 s\"
[[scenario.event]]
at = \"0 s\"
signal = \"rb\"
to = \"20 rad\"
[[scenario.event]]
at = \"2 s\"
signal = \"rb\"
to = \"0.01 rad\"
";

/// Integrators of dynamic decoupling do not wind up while the motors are at their limits: when the reference can be reached again
/// at 2 s, the commands are back within 0.3 s and `c`, which nobody moves, is at rest soon after. (With integrators that wind up
/// it is 3 mrad away there, 9 mrad in the sampled loop.)
#[test]
fn integrators_do_not_wind_up() {
    for clock in ["", "sample_time = \"1 ms\"", "sample_time = \"1 ms\"\nprecision = \"single\""] {
        let settings = Settings { force: true, ..runs_only() };
        let run = study::run(&INTEGRATORS.replace("CLOCK", clock), &settings, &Silent).expect("forced").runs.remove(0);
        assert_eq!(run.outcome, Outcome::Completed, "{clock}");
        assert!(at(&run, "on_b.command", 1.9) > 1.0 && at(&run, "on_b.tau", 1.9) == 0.2, "{clock}: at the limit");
        assert!(at(&run, "on_b.command", 2.3) < 0.2, "{clock}: {}", at(&run, "on_b.command", 2.3));
        assert!(at(&run, "c.phi", 2.6).abs() < 2e-3, "{clock}: {}", at(&run, "c.phi", 2.6));
        assert!((at(&run, "b.phi", 6.0) - 0.01).abs() < 1e-6, "{clock}");
    }
}

/// Two bodies on a spring.
const TWO_BODIES: &str = "\
[model]
name = \"two bodies\"
[shaft.a]
inertia = \"0.01 kg m^2\"
damping = \"0.01 N m s/rad\"
[shaft.b]
inertia = \"0.02 kg m^2\"
damping = \"0.05 N m s/rad\"
[spring_damper.ab]
shaft_1 = \"a\"
shaft_2 = \"b\"
stiffness = \"5 N m/rad\"
damping = \"0.05 N m s/rad\"
";

/// A loop with slow sensors, one an angle, one a speed as a difference of angles, against a run.
#[test]
fn slow_sensors_in_the_map() {
    let source = TWO_BODIES.to_owned()
        + "\
[motor.m]
shaft = \"a\"
lag = \"0.7 ms\"
[motor.n]
shaft = \"b\"
[sensor.s]
measures = \"angle\"
shaft = \"a\"
sample_time = \"3 ms\"
[sensor.v]
measures = \"speed\"
shaft = \"b\"
resolution = \"1e-9 rad\"
sample_time = \"4 ms\"
[control.c]
law = \"pole_placement\"
sample_time = \"2 ms\"
delay = \"5 ms\"
inputs = [\"m\", \"n\"]
poles = [-5, -6, -7, -8]
[control.c.observer]
sensors = [\"s.phi\", \"v.w\", \"b.phi\"]
disturbances = []
poles = [-40, -41, -42, -43]
[scenario]
duration = \"0.6 s\"
output_step = \"1 ms\"
initial = { \"a.phi\" = \"0.1 rad\", \"b.phi\" = \"0.1 rad\" }
";
    let variant = common::first(&source);
    let model = &variant.design_models[0];
    let plant = LoopPlant::new(&model.linear, &model.lags()).with_sensors(&variant.reduced);
    assert_eq!(plant.slow_sensors.len(), 2);
    let laws = &variant.implemented;
    let parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, &plant)).collect();
    let found = SampledLoop::new(&plant, &parts).expect("a loop");
    assert!((found.period - 12e-3).abs() < 1e-12 && (found.sample_time - 2e-3).abs() < 1e-15);
    let run = common::run(&source);
    assert_eq!(run.outcome, Outcome::Completed);
    let names = &model.linear.coordinates;
    // The observer's start: the true angles.
    let state = |name: &str| laws[0].states().iter().position(|state| *state == format!("estimate of {name}"));
    let mut z = vec![0.0; found.map.rows()];
    let states = found.map.rows() - 3 - laws[0].states().len();
    for (k, name) in names.iter().enumerate() {
        z[k] = 0.1;
        z[states + state(&format!("{name}.phi")).expect("estimated")] = 0.1;
    }
    // The difference of the first reading has nothing before it: the reading stands there from the start.
    let last = z.len() - 1;
    z[last] = 0.1;
    let mut moved: f64 = 0.0;
    for period in 0..50 {
        let time = 12e-3 * f64::from(period);
        for (k, name) in names.iter().enumerate() {
            let (angle, speed) = (at(&run, &format!("{name}.phi"), time), at(&run, &format!("{name}.w"), time));
            assert!((angle - z[k]).abs() < 1e-6, "{name}.phi at {time}: {angle} {}", z[k]);
            assert!((speed - z[names.len() + k]).abs() < 1e-5, "{name}.w at {time}: {speed}");
            moved = moved.max(speed.abs());
        }
        found.pass(&mut z, &mut |_| {});
    }
    assert!(moved > 0.1, "{moved}");
}

/// Two bodies on a spring under `sampled_noninteracting`, with motors of different lags and a delay of 2.5 samples: a run equals the
/// exact map at every sample, its references in it.
#[test]
fn unequal_lags_and_a_long_delay() {
    let source = TWO_BODIES.to_owned()
        + "\
[motor.m]
shaft = \"a\"
lag = \"0.7 ms\"
[motor.n]
shaft = \"b\"
lag = \"3 ms\"
[control.column]
law = \"sampled_noninteracting\"
sample_time = \"1 ms\"
delay = \"2.5 ms\"
[[control.column.channels]]
output = \"a.phi\"
input = \"m\"
reference = \"ra\"
[[control.column.channels]]
output = \"b.phi\"
input = \"n\"
reference = \"rb\"
OBSERVER
[scenario]
duration = \"0.3 s\"
output_step = \"0.5 ms\"
[[scenario.event]]
at = \"0 s\"
signal = \"ra\"
to = \"1 rad\"
[[scenario.event]]
at = \"0 s\"
signal = \"rb\"
to = \"-0.5 rad\"
";
    let observer = "[control.column.observer]\nsensors = [\"a.phi\", \"b.phi\"]\ndisturbances = [\"a\"]";
    for observer in ["", observer] {
        let source = source.replace("OBSERVER", observer);
        let variant = common::first(&source);
        let model = &variant.design_models[0];
        let plant = LoopPlant::new(&model.linear, &model.lags());
        let laws = &variant.implemented;
        let parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, &plant)).collect();
        let found = SampledLoop::driven(&plant, &parts, 1.0).expect("a loop");
        assert!(found.slowest().expect("eigenvalues").stable && found.period == 1e-3);
        let run = common::run(&source);
        assert_eq!(run.outcome, Outcome::Completed);
        let names = &model.linear.coordinates;
        let mut z = vec![0.0; found.map.rows()];
        for (k, reference) in laws[0].references().iter().enumerate() {
            z[found.references[0] + k] = if reference.name == "ra" { 1.0 } else { -0.5 };
        }
        let mut interaction: f64 = 0.0;
        for sample in 0..300 {
            let time = 1e-3 * f64::from(sample);
            for (k, name) in names.iter().enumerate() {
                let angle = at(&run, &format!("{name}.phi"), time);
                assert!((angle - z[k]).abs() < 1e-8, "{observer} {name}.phi at {time}: {angle} {}", z[k]);
            }
            // The reference model, 1 − (1 + wt) e^{−wt} with 30 rad/s, as long as it lies behind delay and lags.
            let late = 30.0 * (time - 0.012).max(0.0);
            let early = 30.0 * time;
            let model = |wt: f64| 1.0 - (1.0 + wt) * (-wt).exp();
            let a = at(&run, "a.phi", time);
            assert!(a > model(late) - 0.02 && a < model(early) + 0.02, "{observer} a.phi at {time}: {a}");
            interaction = interaction.max((a + 2.0 * at(&run, "b.phi", time)).abs());
            found.pass(&mut z, &mut |_| {});
        }
        // One reference is minus twice the other, and so are the answers, but for the interaction.
        assert!(interaction < 0.05, "{observer}: {interaction}");
    }
}

/// A second controller with a clock of its own whose commands come to nothing changes neither the answers to steps nor the noise,
/// though the map is then that of a longer period.
#[test]
fn a_second_clock() {
    let variant = study::prepare(ecu()).0.variants.remove(0);
    let model = &variant.design_models[0];
    let plant = LoopPlant::new(&model.linear, &model.lags());
    let laws = &variant.implemented;
    let clock = Clock { period: 2.5e-3, delay: 1e-3, single: false };
    let shown = |count: usize| {
        let mut other = SampledPart::at(&*laws[1], &plant, Some(clock)).expect("finite");
        other.gains.fill(0.0);
        let mut parts = vec![SampledPart::of(&*laws[0], &plant), other];
        parts.truncate(count);
        let found = SampledLoop::driven(&plant, &parts, 1.0).expect("a loop");
        let command = found.commands.row(parts[0].inputs[1]).to_vec();
        let noise = found.noise(0, &[1e-8, 4e-9, 1e-6], std::slice::from_ref(&command))[0];
        let mut z = vec![0.0; found.map.rows()];
        z[found.references[0]] = 1.0;
        let mut largest: f64 = 0.0;
        for _ in 0..(0.2 / found.period).round() as usize {
            found.pass(&mut z, &mut |z| {
                largest = largest.max(command.iter().zip(z).map(|(a, b)| a * b).sum::<f64>().abs());
            });
        }
        (found.period, noise, largest, found.slowest().expect("eigenvalues"))
    };
    let (single_clock, both) = (shown(1), shown(2));
    // The motion that decays least, with the turns that the longer period hides.
    assert!((single_clock.3.growth - both.3.growth).abs() < 1e-9, "{single_clock:?} {both:?}");
    assert!((single_clock.0 - 1e-3).abs() < 1e-15 && (both.0 - 5e-3).abs() < 1e-12);
    assert!(single_clock.1 > 1e-4 && (both.1 / single_clock.1 - 1.0).abs() < 1e-6, "{single_clock:?} {both:?}");
    assert!(single_clock.2 > 1e-2 && (both.2 / single_clock.2 - 1.0).abs() < 1e-9, "{single_clock:?} {both:?}");
}

/// The noise that errors of readings make, against a run of the map with drawn errors.
#[test]
fn noise_against_drawn_errors() {
    let variant = study::prepare(ecu()).0.variants.remove(0);
    let model = &variant.design_models[0];
    let plant = LoopPlant::new(&model.linear, &model.lags()).with_sensors(&variant.reduced);
    let laws = &variant.implemented;
    let parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, &plant)).collect();
    let found = SampledLoop::driven(&plant, &parts, 1.0).expect("a loop");
    let command = found.commands.row(parts[0].inputs[1]).to_vec();
    let variances = [1e-8, 4e-9, 1e-6];
    let expected = found.noise(0, &variances, std::slice::from_ref(&command))[0];
    let mut dice = common::Dice(7);
    let mut z = vec![0.0; found.map.rows()];
    let (mut sum, mut count) = (0.0, 0);
    for sample in 0..200_000 {
        for (k, variance) in variances.iter().enumerate() {
            // Evenly spread within ± √3 σ.
            let unit = dice.next() as f64 / u64::MAX as f64;
            z[found.errors[0] + k] = (2.0 * unit - 1.0) * (3.0 * variance).sqrt();
        }
        found.pass(&mut z, &mut |_| {});
        if sample > 5000 {
            sum += command.iter().zip(&z).map(|(a, b)| a * b).sum::<f64>().powi(2);
            count += 1;
        }
    }
    let drawn = (sum / f64::from(count)).sqrt();
    // Neighbouring samples are alike: some thousand independent ones.
    assert!((drawn / expected - 1.0).abs() < 0.05, "{drawn} {expected}");
}

/// An oscillation that is fast against the common period of two clocks keeps its frequency, and a run of two sampled controllers
/// that feel each other equals the exact map.
#[test]
fn two_controllers_that_feel_each_other() {
    let source = "\
[model]
name = \"two\"
[shaft.a]
inertia = \"0.01 kg m^2\"
[shaft.b]
inertia = \"0.02 kg m^2\"
[spring_damper.ab]
shaft_1 = \"a\"
shaft_2 = \"b\"
stiffness = \"600 N m/rad\"
[motor.m]
shaft = \"a\"
[motor.n]
shaft = \"b\"
lag = \"1 ms\"
[control.on_a]
law = \"position_loop\"
sample_time = \"2 ms\"
delay = \"1 ms\"
output = \"a.phi\"
input = \"m\"
natural_frequency = \"5 rad/s\"
damping_ratio = 0.7
reference = \"ra\"
[control.on_b]
law = \"position_loop\"
sample_time = \"7 ms\"
output = \"b.phi\"
input = \"n\"
natural_frequency = \"3 rad/s\"
damping_ratio = 0.7
reference = \"rb\"
[scenario]
duration = \"0.5 s\"
output_step = \"1 ms\"
[[scenario.event]]
at = \"0 s\"
signal = \"ra\"
to = \"1 rad\"
";
    let variant = study::prepare(source).0.variants.remove(0);
    let model = &variant.design_models[0];
    let plant = LoopPlant::new(&model.linear, &model.lags());
    let laws = &variant.implemented;
    let parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, &plant)).collect();
    let found = SampledLoop::driven(&plant, &parts, 1.0).expect("a loop");
    assert!((found.period - 14e-3).abs() < 1e-12);
    // The motion of the spring, √(k (1/J_a + 1/J_b)) = 300 rad/s, decays least; the map of 14 ms alone cannot tell it from 149 rad/s.
    let slowest = found.slowest().expect("eigenvalues");
    assert!((slowest.frequency / 300.0 - 1.0).abs() < 0.02 && slowest.stable, "{slowest:?}");
    let settings = Settings { force: true, ..runs_only() };
    let run = study::run(source, &settings, &Silent).expect("forced").runs.remove(0);
    assert_eq!(run.outcome, Outcome::Completed);
    let mut z = vec![0.0; found.map.rows()];
    z[found.references[0]] = 1.0;
    for period in 0..35 {
        let time = 14e-3 * f64::from(period);
        for (k, name) in model.linear.coordinates.iter().enumerate() {
            let angle = at(&run, &format!("{name}.phi"), time);
            assert!((angle - z[k]).abs() < 1e-8 * z[k].abs().max(1.0), "{name}.phi at {time}: {angle} {}", z[k]);
        }
        found.pass(&mut z, &mut |_| {});
    }
}

const PLACED: &str = "\
[motor.m]
shaft = \"a\"
torque_limit = \"0.2 N m\"
[motor.n]
shaft = \"b\"
torque_limit = \"0.2 N m\"
[sensor.s]
measures = \"angle\"
shaft = \"a\"
sample_time = \"3 ms\"
[control.column]
law = \"pole_placement\"
sample_time = \"1 ms\"
inputs = [\"m\", \"n\"]
poles = [-20, -21, -22, -23]
[[control.column.channels]]
output = \"a.phi\"
reference = \"ra\"
[[control.column.channels]]
output = \"b.phi\"
reference = \"rb\"
[control.column.observer]
sensors = [\"s.phi\", \"b.phi\"]
disturbances = []
poles = [-40, -41, -42, -43]
";

/// A reference is refused for its torque only if the loop has settled at it when the run ends.
#[test]
fn limits_are_judged_where_the_loop_has_settled() {
    let limited = |stiffness: &str, duration: &str, events: &[(&str, &str)]| {
        let mut text = TWO_BODIES.replace("5 N m/rad", stiffness) + &PLACED.replace("sample_time = \"3 ms\"\n", "");
        text += &format!("[scenario]\nduration = \"{duration}\"\n");
        for (at, to) in events {
            text += &format!("[[scenario.event]]\nat = \"{at}\"\nsignal = \"ra\"\nto = \"{to}\"\n");
        }
        let found = study::check(&text);
        assert!(found.iter().all(|one| one.code != "control::unstable"), "{found:?}");
        found.iter().any(|one| one.code == "control::limit")
    };
    // Turned against each other by half a radian, the bodies need 2.5 N m for ever.
    assert!(limited("5 N m/rad", "2 s", &[("0 s", "0.5 rad")]));
    assert!(!limited("5 N m/rad", "2 s", &[("0 s", "0.5 rad"), ("0.5 s", "0.01 rad")]));
    assert!(!limited("5 N m/rad", "2 s", &[("1.99 s", "0.5 rad")]));
    // Hardly held by the spring, they need more than 0.2 N m while they are braked, and nothing in the end.
    for duration in ["0.05 s", "0.06 s", "0.1 s", "2 s"] {
        assert!(!limited("0.001 N m/rad", duration, &[("0 s", "0.5 rad")]), "{duration}");
    }
}

/// While the slowest rate is searched for, slow sensors keep step with the controller.
#[test]
fn slow_sensors_follow_the_period_in_the_search_for_the_rate() {
    let variant = common::first(&(TWO_BODIES.to_owned() + PLACED));
    let model = &variant.design_models[0];
    let laws = &variant.designed;
    let clocks = [Some(Clock { period: 1e-3, delay: 0.0, single: false })];
    let limit = |plant: LoopPlant| {
        let survey = Survey { plant: &plant, laws, clocks: &clocks, number: 0, blocks: &LoopBlocks::default() };
        survey.longest_period(0.5).expect("stable when fast").value
    };
    let plant = || LoopPlant::new(&model.linear, &model.lags());
    let slow = plant().with_sensors(&variant.reduced);
    assert_eq!(slow.slow_sensors.len(), 1);
    let found = limit(plant());
    assert!(found > 3e-3 && found < 1.0 && limit(slow) == found, "{found}");
}

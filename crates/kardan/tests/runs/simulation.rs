//! The loop stepped from outside: the same loop as a run, wherever one stops to look; snapshots bit for bit.

use crate::common::{Dice, prepared, variants};
use kardan::model;
use kardan::results::Outcome;
use kardan::simulate::{Scenario, Setup, SignalEvent, Simulation, SimulationError, Snapshot, Tolerance, simulate};
use kardan::study::PreparedVariant;

/// Models with everything that remembers: friction, limits, lag, clocks, delay, encoders, observers, noise, circuits.
const MODELS: [(&str, usize); 7] = [
    ("two-bodies", 0),
    ("sia-steering", 0),
    ("sia-steering-ecu", 3),
    ("sia-steering-ecu", 8),
    ("harmonic-drive", 4),
    ("harmonic-drive-ecu", 0),
    ("rlc-ladder", 0),
];

fn variant(name: &str, number: usize) -> std::sync::Arc<PreparedVariant> {
    variants(model::builtin(name).expect("built in").source).swap_remove(number)
}

fn setup<'a>(variant: &'a PreparedVariant, scenario: &'a Scenario) -> Setup<'a> {
    Setup { reduced: &variant.reduced, laws: &variant.implemented, scenario }
}

fn start(variant: &PreparedVariant) -> Simulation {
    Simulation::new(setup(variant, &variant.scenario), Tolerance::default())
}

/// The values of all signals now.
fn all(simulation: &mut Simulation) -> Vec<f64> {
    let ids: Vec<_> = simulation.signals().map(|(id, ..)| id).collect();
    ids.into_iter().map(|id| simulation.get(id)).collect()
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|x| x.to_bits()).collect()
}

/// Random times up to an end, in order.
fn times(seed: u64, count: usize, end: f64) -> Vec<f64> {
    let mut dice = Dice(seed);
    let mut out: Vec<f64> = (0..count).map(|_| end * (dice.next() >> 11) as f64 / (1u64 << 53) as f64).collect();
    out.sort_by(f64::total_cmp);
    out
}

/// A run with rows at these times, and the loop stepped to the same ones: the same bits, although the run has stopped nowhere.
#[test]
fn stepping_is_the_run() {
    for (name, number) in MODELS {
        let variant = variant(name, number);
        let times = times(7, 60, 0.4 * variant.scenario.duration);
        let mut rows = variant.scenario.clone();
        rows.times = times.clone();
        let run = simulate(setup(&variant, &rows), Tolerance::default(), &mut |_| None);
        assert_eq!(run.outcome, Outcome::Completed);
        let mut stepped = start(&variant);
        let names: Vec<String> = stepped.signals().map(|(_, name, _)| name.to_string()).collect();
        let noisy = |signal: &str| {
            variant.reduced.equations.sensors.iter().any(|(name, _)| signal.starts_with(&format!("{name}.")))
        };
        let mut compared = 0;
        for (row, time) in times.iter().enumerate() {
            stepped.advance(*time).expect("as the run");
            for (signal, value) in names.iter().zip(all(&mut stepped)) {
                // Sensors without a sample time read whenever one looks.
                if noisy(signal) {
                    continue;
                }
                let expected = run.series.signal(signal).expect("the same signals").values[row];
                assert_eq!(value.to_bits(), expected.to_bits(), "{name}: {signal} at {time}: {value} {expected}");
                compared += 1;
            }
        }
        assert!(compared > 300, "{name}: {compared}");
        // The same happened at the same times.
        let last = *times.last().expect("times");
        let happened: Vec<_> = run.events.into_iter().filter(|event| event.time < last).collect();
        assert_eq!(stepped.events(), happened, "{name}");
    }
}

/// From a snapshot, also one that went through bytes, another loop of the same model goes on bit for bit.
#[test]
fn a_snapshot_restores_the_state_of_the_loop() {
    for (name, number) in MODELS {
        let variant = variant(name, number);
        let end = 0.4 * variant.scenario.duration;
        let mut unbroken = start(&variant);
        unbroken.advance(end).expect("it runs");
        let expected = bits(&all(&mut unbroken));
        let mut first = start(&variant);
        for (k, at) in times(11, 3, 0.8 * end).into_iter().enumerate() {
            first.advance(at).expect("it runs");
            let snapshot = first.snapshot();
            let snapshot = Snapshot::from_bytes(&snapshot.to_bytes()).expect("whole");
            let mut second = start(&variant);
            if k % 2 == 1 {
                // Not only a loop that never moved.
                second.advance(0.3 * end).expect("it runs");
            }
            second.restore(&snapshot).expect("the same model");
            assert_eq!(second.time(), at);
            for later in times(13 + k as u64, 2, 0.5 * (end - at)) {
                let (mut one, mut other) = (start(&variant), start(&variant));
                one.restore(&snapshot).expect("the same model");
                other.restore(&second.snapshot()).expect("the same model");
                one.advance(at + later).expect("it runs");
                other.advance(at + later).expect("it runs");
                second.advance(at + later).expect("it runs");
                let expected = bits(&all(&mut one));
                assert_eq!(bits(&all(&mut other)), expected, "{name} from {at} to {}", at + later);
                assert_eq!(bits(&all(&mut second)), expected, "{name} from {at} to {}", at + later);
            }
            // Taking it has changed nothing, and the first goes on as the second.
            let mut resumed = start(&variant);
            resumed.restore(&snapshot).expect("the same model");
            resumed.advance(end).expect("it runs");
            assert_eq!(expected, bits(&all(&mut resumed)), "{name} from {at}");
        }
    }
}

/// A value set from outside is a step of the scenario at that time; of a sampled controller the sample at that very time sees it.
#[test]
fn what_is_set_is_a_step_of_the_scenario() {
    for (name, number, input, value) in
        [("two-bodies", 0, "motor_1.tau", 0.7), ("sia-steering-ecu", 0, "ref_rk", 0.2), ("sia-steering", 0, "u2", 1.5)]
    {
        let variant = variant(name, number);
        let mut scenario = variant.scenario.clone();
        scenario.events.clear();
        let quiet = scenario.clone();
        let source = scenario.sources.iter().position(|source| source.name == input).expect("a source");
        let steps = [(0.0, value), (0.05, -value), (0.12345, 0.5 * value)];
        scenario.events = steps.iter().map(|&(at, to)| SignalEvent { source, at, to, over: 0.0 }).collect();
        scenario.duration = 0.3;
        scenario.times = vec![0.3];
        let run = simulate(setup(&variant, &scenario), Tolerance::default(), &mut |_| None);
        let mut stepped = Simulation::new(setup(&variant, &quiet), Tolerance::default());
        let id = stepped.input(input).expect("an input");
        for (at, to) in steps {
            stepped.advance(at).expect("it runs");
            stepped.set(id, to).expect("a number");
        }
        stepped.advance(0.3).expect("it runs");
        let angles: Vec<String> = stepped
            .signals()
            .filter(|(_, name, _)| name.ends_with(".phi") || name.ends_with(".w"))
            .map(|(_, name, _)| name.into())
            .collect();
        let mut moved = 0.0f64;
        for signal in angles {
            if variant.reduced.equations.sensors.iter().any(|(name, _)| signal.starts_with(&format!("{name}."))) {
                continue;
            }
            let expected = run.series.signal(&signal).expect("a signal").values[0];
            let id = stepped.signal(&signal).expect("a signal");
            let found = stepped.get(id);
            assert!((found - expected).abs() < 1e-8 * (1.0 + expected.abs()), "{name}: {signal}: {found} {expected}");
            moved = moved.max(expected.abs());
        }
        assert!(moved > 1e-3, "{name}: something moves");
    }
}

/// Nothing is allocated per call once the loop moves, as long as nothing happens; where there is no friction also if signals change.
#[test]
fn calls_allocate_nothing() {
    for (name, changes) in [("two-bodies", true), ("sia-steering", false)] {
        let variant = variant(name, 0);
        let mut scenario = variant.scenario.clone();
        if changes {
            scenario.events.clear();
        }
        // The first tenth of a second after the first event in which nothing happens.
        let run = simulate(setup(&variant, &variant.scenario), Tolerance::default(), &mut |_| None);
        let mut quiet = run.events.windows(2).filter(|pair| pair[1].time - pair[0].time > 0.12 && pair[0].time >= 1.0);
        let warm = quiet.next().map_or(300, |pair| (1e3 * pair[0].time).ceil() as usize + 5);
        let end = warm + 100;
        let mut stepped = Simulation::new(setup(&variant, &scenario), Tolerance::default());
        let (input, _, _) = stepped.inputs().next().expect("an input");
        let signals: Vec<_> = stepped.signals().map(|(id, ..)| id).collect();
        let mut go = |from: usize, to: usize| {
            let mut sum = 0.0;
            for k in from..to {
                if changes {
                    stepped.set(input, 0.1 * (1.0 + (k % 7) as f64)).expect("a number");
                }
                stepped.advance(1e-3 * k as f64).expect("it runs");
                sum += signals.iter().map(|id| stepped.get(*id)).sum::<f64>();
            }
            (sum, stepped.events().len())
        };
        let (before, _) = go(0, warm);
        let mut after = (0.0, 0);
        let allocations = allocation_counter::measure(|| after = go(warm, end));
        assert!(after.0 != before && after.1 == 0, "{name}: it moves, and nothing happens");
        assert_eq!(allocations.count_total, 0, "{name}");
    }
}

/// A value of a parameter that changes at rest: the coordinates stay, and from there on the loop is the one with the other value.
#[test]
fn a_parameter_changes_at_the_state_of_the_loop() {
    let text = |stiffness: &str| {
        format!(
            "[model]\ncoordinates = [\"a\"]\n[shaft.a]\ninertia = \"1 kg m^2\"\nfriction = \"1 N m\"\n\
             [spring_damper.s]\nshaft_1 = \"a\"\nstiffness = \"{stiffness} N m/rad\"\n[motor.m]\nshaft = \"a\"\n"
        )
    };
    let [soft, hard] = ["1", "100"].map(|stiffness| prepared(&text(stiffness)).variants.remove(0));
    let mut soft_loop = start(&soft);
    let torque = soft_loop.input("m.tau").expect("an input");
    // Pushed, and let go: it comes to rest where the soft spring is weaker than the friction.
    soft_loop.set(torque, 1.4).expect("a number");
    soft_loop.advance(1.0).expect("it runs");
    soft_loop.set(torque, 0.0).expect("a number");
    soft_loop.advance(9.0).expect("it runs");
    let angle = soft_loop.signal("a.phi").expect("a signal");
    let settled = soft_loop.get(angle);
    assert!(settled > 0.05 && settled < 1.0, "{settled}");
    let mut hard_loop = start(&hard);
    hard_loop.restore(&soft_loop.snapshot()).expect("the same model");
    assert!((hard_loop.get(angle) - settled).abs() < 1e-15);
    // Half a period of ω = 10 rad/s later it has swung by twice its distance to the friction's edge, 0.01 rad.
    hard_loop.advance(9.0 + std::f64::consts::PI / 10.0).expect("it runs");
    let expected = 2.0 * 0.01 - settled;
    assert!((hard_loop.get(angle) - expected).abs() < 1e-6, "{} {expected}", hard_loop.get(angle));
}

#[test]
fn errors_are_reported() {
    let variant = variant("two-bodies", 0);
    let mut stepped = start(&variant);
    let reported = |error: SimulationError| error.to_string();
    assert_eq!(
        reported(stepped.signal("body_1.ph").unwrap_err()),
        "there is no signal `body_1.ph` that can be read; did you mean `body_1.phi`?"
    );
    assert!(reported(stepped.input("body_1.phi").unwrap_err()).contains("that can be set; "));
    let torque = stepped.input("motor_1.tau").expect("an input");
    assert_eq!(
        reported(stepped.set(torque, f64::NAN).unwrap_err()),
        "the value of motor_1.tau must be a finite number, found NaN"
    );
    assert!(stepped.advance(f64::INFINITY).is_err());
    stepped.advance(0.2).expect("it runs");
    assert!(reported(stepped.advance(0.1).unwrap_err()).contains("cannot go back to 0.1 s"));
    // Of another model; damaged; of the wrong length.
    let mut other = start(&self::variant("rlc-ladder", 0));
    assert!(reported(other.restore(&stepped.snapshot()).unwrap_err()).contains("of another model"));
    let whole = stepped.snapshot().to_bytes();
    for cut in [0, 7, 8, 16, 24, whole.len() - 8, whole.len() - 1] {
        assert!(Snapshot::from_bytes(&whole[..cut]).is_err(), "{cut}");
    }
    for at in 0..whole.len() {
        let mut damaged = whole.clone();
        damaged[at] ^= 1;
        let refused = Snapshot::from_bytes(&damaged).map_or(true, |snapshot| stepped.restore(&snapshot).is_err());
        assert!(refused, "byte {at}");
    }
    assert_eq!(stepped.time(), 0.2);
}

/// A loop that cannot go on says so, and keeps saying so, until a snapshot is restored.
#[test]
fn a_loop_that_fails_can_be_restored() {
    let text = "[shaft.a]\ninertia = \"1 kg m^2\"\n[motor.m]\nshaft = \"a\"\n";
    let prepared = prepared(text);
    let variant = &prepared.variants[0];
    let mut stepped = start(variant);
    let torque = stepped.input("m.tau").expect("an input");
    stepped.advance(0.01).expect("it runs");
    let snapshot = stepped.snapshot();
    // Faster than any drivetrain after 20 ms.
    stepped.set(torque, 5e7).expect("a number");
    let failed = stepped.advance(1.0).expect_err("it diverges");
    assert!(failed.to_string().contains("grows without bound"), "{failed}");
    assert!(stepped.time() < 0.1 && stepped.time() > 0.01);
    assert_eq!(stepped.advance(1.0), Err(failed));
    stepped.restore(&snapshot).expect("its own");
    stepped.advance(1.0).expect("it goes on");
}

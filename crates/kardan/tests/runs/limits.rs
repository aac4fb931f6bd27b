//! Runs that would never end: foretold with the element that is to blame, and ended with a clear word and all that was computed.

use kardan::diagnostics::Severity;
use kardan::results::{Outcome, Run};
use kardan::study::{self, Progress};

use super::common::runs_only;

/// Ends runs after so many steps, or after so many polls.
struct Limited {
    steps: usize,
    polls: Option<std::sync::atomic::AtomicUsize>,
}

impl Progress for Limited {
    fn advance(&self, _: usize, _: &str, _: f64) {}

    fn stop(&self) -> Option<String> {
        let remaining = self.polls.as_ref()?;
        let before =
            remaining.fetch_update(std::sync::atomic::Ordering::Relaxed, std::sync::atomic::Ordering::Relaxed, |x| {
                Some(x.saturating_sub(1))
            });
        (before == Ok(0)).then(|| "somebody asked for the end".into())
    }

    fn most_steps(&self) -> usize {
        self.steps
    }
}

fn run(source: &str, limits: &Limited) -> Run {
    // Alone: a second run would ask as well.
    let study = study::run(source, &runs_only(), limits);
    study.unwrap_or_else(|found| panic!("{found:?}")).runs.remove(0)
}

/// Everything that was computed is there and is finite.
fn is_whole(run: &Run) {
    let rows = run.series.time.len();
    assert!(rows > 0);
    for signal in &run.series.signals {
        assert_eq!(signal.values.len(), rows, "{}", signal.name);
        assert!(signal.values.iter().all(|x| x.is_finite()), "{}", signal.name);
    }
    let energy = &run.energy;
    let size = energy.input.abs().max(energy.stored.abs()).max(energy.dissipated);
    // 1e-9 J is what the integrator allows itself.
    assert!(energy.residual.abs() <= 1e-6 * size + 1e-9, "{energy:?}");
}

const TAIL: &str = "[disturbance.T]\nshaft = \"a\"\n[[scenario.event]]\nat = \"0 s\"\nsignal = \"T\"\nto = \"1 N m\"\n";

/// Models whose runs would take 10^8 steps and more, the element that is to blame, and its number.
fn endless() -> Vec<(&'static str, String, &'static str, &'static str)> {
    let small = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1e-9 kg m^2\"\n\
                 [spring_damper.d]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\ndamping = \"1e6 N m s/rad\"\n[scenario]\nduration = \"1 s\"\n";
    let mistyped = "[shaft.a]\ninertia = \"0.1 kg m^2\"\ndamping = \"1e9 N m s/rad\"\n[scenario]\nduration = \"1 s\"\n";
    let long = "[shaft.a]\ninertia = \"1 kg m^2\"\n[spring_damper.k]\nshaft_1 = \"a\"\nstiffness = \"200 N m/rad\"\n\
                [scenario]\nduration = \"1e9 s\"\noutput_step = \"1e4 s\"\n";
    // Robertson's kind: 1e-9 s, 1 s and 1e4 s, each damper handing on to the next.
    let robertson = "[shaft.a]\ninertia = \"1e-3 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n[shaft.c]\ninertia = \"1 kg m^2\"\n\
                     damping = \"1e-4 N m s/rad\"\n[spring_damper.first]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\ndamping = \"1e6 N m s/rad\"\n\
                     [spring_damper.second]\nshaft_1 = \"b\"\nshaft_2 = \"c\"\ndamping = \"1 N m s/rad\"\n\
                     [scenario]\nduration = \"1e4 s\"\noutput_step = \"1 s\"\n";
    let oscillator = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1e-6 kg m^2\"\n[spring_damper.stiff]\n\
                      shaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"1e9 N m/rad\"\n[scenario]\nduration = \"100 s\"\noutput_step = \"10 ms\"\n";
    [
        ("small inertia", small, "`d`", "1e6 N m s/rad"),
        ("mistyped damping", mistyped, "`a`", "1e9 N m s/rad"),
        ("long run", long, "`k`", "200 N m/rad"),
        ("Robertson", robertson, "`first`", "1e6 N m s/rad"),
        ("stiff oscillator", oscillator, "`stiff`", "1e9 N m/rad"),
    ]
    .map(|(name, head, element, value)| (name, head.to_string() + TAIL, element, value))
    .to_vec()
}

#[test]
fn endless_runs_are_foretold_and_end_with_a_word() {
    for (name, source, element, value) in endless() {
        let found = study::check(&source);
        assert!(found.iter().all(|d| d.severity == Severity::Warning), "{name}: {found:?}");
        let reported = found.iter().find(|d| d.code == "run::steps").unwrap_or_else(|| panic!("{name}: {found:?}"));
        assert!(reported.message.contains(element) && reported.message.contains(value), "{name}: {}", reported.message);
        let run = run(&source, &Limited { steps: 3000, polls: None });
        let Outcome::Failed { time, cause } = &run.outcome else { panic!("{name}: {:?}", run.effort) };
        assert!(cause.contains("3000 steps"), "{name}: {cause}");
        assert!(run.effort.steps >= 3000 && run.effort.steps < 3010, "{name}: {:?}", run.effort);
        assert!(run.series.time.last().is_some_and(|last| last <= time), "{name}");
        is_whole(&run);
    }
}

/// Blocks that compute too often are foretold too.
#[test]
fn blocks_that_compute_too_often_are_foretold() {
    let source = |duration: &str| {
        format!(
            "[shaft.a]\ninertia = \"1 kg m^2\"\n[block.b]\nkind = \"hold\"\ninput = \"a.w\"\nsample_time = \"1 us\"\n[scenario]\nduration = \"{duration}\"\n"
        )
    };
    let reported = |duration: &str| study::check(&source(duration)).into_iter().find(|one| one.code == "run::steps");
    let found = reported("200 s").expect("two hundred million samples");
    assert!(found.message.contains("its blocks compute 2e8 times"), "{}", found.message);
    assert!(reported("1 s").is_none());
}

/// The estimate against what runs took: within a factor of 4 where the fastest motion limits the steps.
#[test]
fn the_estimate_is_about_right() {
    let damped = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1e-3 kg m^2\"\n[spring_damper.d]\nshaft_1 = \"a\"\n\
                  shaft_2 = \"b\"\ndamping = \"10 N m s/rad\"\n[scenario]\nduration = \"1 s\"\n";
    let swings = "[shaft.a]\ninertia = \"1 kg m^2\"\n[spring_damper.k]\nshaft_1 = \"a\"\nstiffness = \"1e4 N m/rad\"\n\
                  [scenario]\nduration = \"10 s\"\n";
    for head in [damped, swings] {
        let source = head.to_string() + TAIL;
        let (prepared, _) = study::prepare(&source);
        let expected = study::expected_effort(&prepared.variants[0]);
        // 10 N m s/rad on 1e-3 kg m² against 1 kg m²; √(1e4/1).
        let rate = if head == damped { 10.0 * (1.0 + 1e3) } else { 100.0 };
        assert!((expected.rate / rate - 1.0).abs() < 1e-6, "{expected:?}");
        let run = run(&source, &Limited { steps: usize::MAX, polls: None });
        assert_eq!(run.outcome, Outcome::Completed);
        let ratio = expected.steps / run.effort.steps as f64;
        assert!((0.25..4.0).contains(&ratio), "{expected:?} against {:?}", run.effort);
    }
}

#[test]
fn a_run_ends_on_request_and_keeps_its_rows() {
    let (_, source, ..) = endless().remove(0);
    let run = run(&source, &Limited { steps: usize::MAX, polls: Some(20.into()) });
    let Outcome::Failed { cause, .. } = &run.outcome else { panic!("{:?}", run.effort) };
    assert!(cause.ends_with("somebody asked for the end"), "{cause}");
    assert!(run.effort.steps > 64 && run.effort.steps < 64 * 30, "{:?}", run.effort);
    is_whole(&run);
}

/// At one time a signal has one value; a jump from which a ramp begins is one, and so is what takes over from a ramp.
#[test]
fn events_of_one_signal_at_one_time() {
    let model = "[shaft.a]\ninertia = \"1 kg m^2\"\n[disturbance.T]\nshaft = \"a\"\n[disturbance.U]\nshaft = \"a\"\n[scenario]\nduration = \"3 s\"\n";
    let source = |events: &[(&str, &str, f64, f64)]| {
        let text = |(at, signal, to, over): &(&str, &str, f64, f64)| {
            format!(
                "[[scenario.event]]\nat = \"{at}\"\nsignal = \"{signal}\"\nto = \"{to} N m\"\nover = \"{over} s\"\n"
            )
        };
        model.to_string() + &events.iter().map(text).collect::<String>()
    };
    let reported = |events: &[(&str, &str, f64, f64)]| -> Vec<String> {
        let found = study::check(&source(events)).into_iter().filter(|d| d.code == "event::duplicate");
        found.map(|d| d.message).collect()
    };
    let five = [("1 s", "T", 1.0, 0.0); 5];
    let found = reported(&five);
    assert_eq!(found.len(), 4, "{found:?}");
    assert!(found[0].contains("entry 2") && found[0].contains("`T`") && found[0].contains("entry 1"), "{found:?}");
    for wrong in [
        &[("1 s", "T", 1.0, 0.0), ("1000 ms", "T", 2.0, 0.0)][..],
        &[("1 s", "T", 1.0, 0.5), ("1 s", "T", 2.0, 0.0)],
        &[("1 s", "T", 1.0, 0.5), ("1 s", "T", 2.0, 0.5)],
        &[("1 s", "T", 1.0, 0.0), ("1 s", "T", 2.0, 0.5), ("1 s", "T", 3.0, 0.5)],
    ] {
        assert!(!reported(wrong).is_empty(), "{wrong:?}");
    }
    for right in [
        &[("1 s", "T", 1.0, 0.0), ("1 s", "U", 1.0, 0.0)][..],
        &[("1 s", "T", 1.0, 0.0), ("1 s", "T", 2.0, 0.5)],
        &[("0.5 s", "T", 1.0, 0.5), ("1 s", "T", 2.0, 0.0)],
        &[("0.5 s", "T", 1.0, 2.0), ("1 s", "T", 2.0, 0.0)],
    ] {
        assert_eq!(reported(right), [""; 0], "{right:?}");
    }
}

/// What leaves its mode at rounding and comes back changes nothing that a list of events could show: it is named all the same.
#[test]
fn alternation_that_is_no_event_is_named() {
    let model = "[shaft.a]\ninertia = \"0.1 kg m^2\"\n[shaft.b]\ninertia = \"0.1 kg m^2\"\n[shaft.c]\ninertia = \"0.1 kg m^2\"\n\
                 [universal_joint.e0]\nshaft_1 = \"a\"\nshaft_2 = \"c\"\nangle = \"20 deg\"\n[one_way_clutch.e1]\ndriving = \"a\"\ndriven = \"c\"\n\
                 [universal_joint.e2]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nangle = \"20 deg\"\n[scenario]\nduration = \"2 s\"\n\
                 initial = { \"a.w\" = \"2 rad/s\" }\n";
    let run = run(model, &Limited { steps: 1_000_000, polls: None });
    if let Outcome::Failed { cause, .. } = &run.outcome {
        assert!(
            cause.contains("the contact state of `e1` switches repeatedly at its limit, to the last digits"),
            "{cause}"
        );
    }
}

/// Nothing is said of a loop where there is none.
#[test]
fn an_uncontrolled_model_has_no_diverging_loop() {
    let model = "[shaft.a]\ninertia = \"1 kg m^2\"\n[torque.t]\nshaft = \"a\"\nlaw = \"1 N m s^2/rad^2 * a.w^2\"\n\
                 [scenario]\nduration = \"2 s\"\ninitial = { \"a.w\" = \"1 rad/s\" }\n";
    let run = run(model, &Limited { steps: 1_000_000, polls: None });
    // w = 1 / (1 - t)
    let Outcome::Failed { time, cause } = &run.outcome else { panic!("it diverges at one second") };
    assert!((time - 1.0).abs() < 1e-5, "{time}");
    assert!(cause.contains("the motion grows without bound: a.w exceeds") && !cause.contains("loop"), "{cause}");
}

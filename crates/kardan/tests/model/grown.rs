//! However many entries a model has, and however deep they name each other, every command comes to its end.
//!
//! `KARDAN_MODELS=10000` makes models of so many entries.

use kardan::diagnostics::{Diagnostic, Severity, plain};
use kardan::study::{
    self, AnalyzeSettings, DesignSettings, EquationsForm, IdentifySettings, LogFile, Progress, Silent,
};
use kardan::study::{Project, Settings, SweepSettings};
use kardan::tables::read::in_memory;

use crate::common::grown::{CHAINS, CIRCLES, COUPLED, Kind, NESTED, REFUSED, WIDE};

/// Stops runs after few steps.
struct StepLimit;

impl Progress for StepLimit {
    fn advance(&self, _: usize, _: &str, _: f64) {}

    fn most_steps(&self) -> usize {
        20
    }
}

fn model_size(otherwise: usize) -> usize {
    std::env::var("KARDAN_MODELS").ok().and_then(|count| count.parse().ok()).unwrap_or(otherwise)
}

/// Does something on a thread with the stack of a program, whatever that of tests is.
fn on_usual_stack<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(2 << 20).spawn_scoped(scope, work).expect("a thread");
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

/// What is wrong with a model, each mistake in a line.
fn errors(source: &str) -> Vec<String> {
    let out = study::check(source);
    let wrong = out.iter().filter(|reported| reported.severity == Severity::Error);
    wrong.map(|reported| plain(source, std::slice::from_ref(reported))).collect()
}

/// What every command is asked for; what speaks against it is told.
fn commands(source: &str) {
    drop(study::check(source));
    let assert_rendered = |out: Vec<Diagnostic>| assert!(!plain(source, &out).is_empty());
    if let Err(out) = study::equations(source, EquationsForm::Text) {
        assert_rendered(out);
    }
    let settings = AnalyzeSettings::default();
    if let Err(out) = study::analyze(source, &settings, &Silent) {
        assert_rendered(out);
    }
    if let Err(out) = study::linearise(source, &settings, false) {
        assert_rendered(out);
    }
    if let Err(out) = study::design(source, &DesignSettings::default(), &Silent) {
        assert_rendered(out);
    }
    if let Err(out) = study::run(source, &Settings::default(), &StepLimit) {
        assert_rendered(out);
    }
    if let Err(out) = Project::open(source).sweep_plan(&SweepSettings::default()) {
        assert_rendered(out);
    }
    let log = LogFile { name: "log.csv".into(), bytes: in_memory(&b"t,a.phi,m.tau\n0,0,1\n0.1,0,1\n0.2,0.1,1\n"[..]) };
    if let Err(out) = study::identify(source, vec![log], &IdentifySettings::default(), &Silent) {
        assert_rendered(out);
    }
}

fn each(kinds: &[Kind], count: usize, check: impl Fn(&str, &str) + Sync) {
    for (name, model) in kinds {
        on_usual_stack(|| check(name, &model(count)));
    }
}

/// What stands beside each other or in a chain has no mistakes, and no command ends in an abort.
#[test]
fn wide_and_deep_models_come_to_an_end() {
    let count = model_size(6);
    // The matrices of coupled bodies grow with the square of their number.
    for (kinds, count) in [(WIDE, count), (CHAINS, count), (COUPLED, count.min(60))] {
        each(kinds, count, |name, source| {
            assert_eq!(errors(source), [""; 0], "{name}");
            commands(source);
        });
    }
}

/// As many messages as entries that have a mistake, each of a few lines.
#[test]
fn what_is_refused_is_reported_briefly() {
    let count = model_size(300);
    each(REFUSED, count, |name, source| {
        let reported = errors(source);
        assert!(reported.len() + 1 >= count && reported.len() <= count, "{name}: {}", reported.len());
        assert!(reported.iter().all(|message| message.len() < 500), "{name}");
    });
}

/// Chains of names are as deep as anybody likes: they are checked on a small stack.
#[test]
fn deep_chains_are_checked() {
    each(CHAINS, model_size(1500), |name, source| {
        let reported = errors(source);
        assert!(reported.is_empty(), "{name}: {}", reported[0]);
    });
}

/// What a chain of formulas comes to is what its recurrence says: f(k) = f(k − 1) + f(k − 2)/2, from 1.5 and 2 times the angle.
#[test]
fn formulas_of_the_two_before_follow_their_recurrence() {
    let (_, model) = CHAINS.iter().find(|(name, _)| *name == "formulas of the two before").expect("of that name");
    let source = model(40).replace("duration =", "initial = { \"a.phi\" = \"1 rad\" }\nduration =");
    let study = study::run(&source, &Settings::default(), &Silent).expect("runs");
    let last = |name: &str| {
        let signal = study.runs[0].series.signals.iter().find(|signal| signal.name == name).expect("a column");
        *signal.values.last().expect("a row")
    };
    let mut factors = vec![1.5, 2.0];
    (2..40).for_each(|k| factors.push(factors[k - 1] + 0.5 * factors[k - 2]));
    for (k, factor) in factors.iter().enumerate() {
        let (found, expected) = (last(&format!("x{k}")), factor * last("a.phi"));
        assert!((found - expected).abs() <= 1e-15 * k.max(4) as f64 * expected, "x{k}: {found} {expected}");
    }
}

/// A circle is told once, however long it is, in a message of a few lines.
#[test]
fn circles_are_reported_once() {
    for count in [2, 3, model_size(1500)] {
        each(CIRCLES, count, |name, source| {
            let reported = errors(source);
            assert_eq!(reported.len(), 1, "{name} of {count}: {:?}", reported.get(1));
            assert!(reported[0].contains("circular") && reported[0].len() < 1000, "{name}: {}", reported[0]);
            commands(source);
        });
    }
}

/// What is nested deeper than anybody writes is refused with a word, not with an abort.
#[test]
fn nested_texts_come_to_an_end() {
    for count in [10, 60, 900, model_size(10_000)] {
        each(NESTED, count, |_, source| commands(source));
    }
}

/// Bodies whose matrices would not fit into memory are refused at once.
#[test]
fn too_large_models_are_refused() {
    let shafts = |n: usize| {
        let shaft = |k: usize| format!("[shaft.x{k}]\ninertia = \"1 kg m^2\"\n");
        (0..n).map(shaft).collect::<String>()
    };
    let reported = errors(&shafts(20_000));
    assert_eq!(reported.len(), 1, "{}", reported.len());
    assert!(reported[0].contains("the model has 20000 shafts, masses and charges, more than 1500"), "{}", reported[0]);
    commands(&shafts(2_000));
}

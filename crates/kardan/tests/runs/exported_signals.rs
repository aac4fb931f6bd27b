//! What sampled laws tell blocks, what designs leave out, and commands that a signal takes away.

use kardan::results::{Outcome, Run};
use kardan::study::{self, DesignSettings, Project, Silent};

use crate::common::{runs_only, signal};

/// An arm under a load of 2 N m, held at 1 kHz by a law whose observer finds the load.
const LOADED_ARM: &str = r#"
[shaft.arm]
inertia = "0.5 kg m^2"
damping = "0.1 N m s/rad"

[motor.drive]
shaft = "arm"

[disturbance.load]
shaft = "arm"

[sensor.encoder]
measures = "angle"
shaft = "arm"

[control.unit]
law = "pole_placement"
inputs = ["drive"]
poles = [-8, -9]
sample_time = "1 ms"
FADE

[control.unit.observer]
sensors = ["encoder.phi"]
disturbances = ["arm"]
poles = [-40, -41, -42]

[scenario]
duration = "3 s"
output_step = "1 ms"

[[scenario.event]]
at = "0.1 s"
signal = "load"
to = "2 N m"
"#;

fn run(source: &str) -> Run {
    let study =
        crate::common::project(source).run(&runs_only(), &Silent).unwrap_or_else(|reported| panic!("{reported:?}"));
    let [run] = &study.runs[..] else { panic!("one run") };
    assert_eq!(run.outcome, Outcome::Completed, "{:?}", run.notes);
    run.clone()
}

fn last(run: &Run, name: &str) -> f64 {
    *signal(run, name).last().expect("rows")
}

const EXPORTED_SIGNALS: &str = "
[signal.found]
kind = \"expression\"
value = \"unit.arm.disturbance\"
[signal.speed]
kind = \"expression\"
value = \"unit.arm.w\"
[signal.told]
kind = \"expression\"
value = \"unit.drive.command\"
";

/// In the end nothing moves: the load that is found is the one that acts, the speed that is found is none, and what is told of the command
/// is the command.
#[test]
fn what_a_law_finds_and_commands_is_reported() {
    let run = run(&(LOADED_ARM.replace("FADE", "") + EXPORTED_SIGNALS));
    assert!((last(&run, "found") - 2.0).abs() < 1e-5, "{}", last(&run, "found"));
    assert!(last(&run, "speed").abs() < 1e-5 && last(&run, "drive.tau") < -1.9);
    let (reported, command) = (signal(&run, "told"), signal(&run, "drive.tau"));
    assert!(reported.iter().zip(command).skip(1).all(|(reported, command)| reported == command));
}

/// Commands times one are the commands, to the last bit; times a half they are half of what the law makes of what it sees; times zero none.
#[test]
fn a_signal_takes_commands_away() {
    let blended = |share: &str| {
        let signal = format!("[block.share]\nkind = \"gain\"\ngain = 1\ninput = \"{share}\"\nsample_time = \"1 ms\"\n");
        run(&(LOADED_ARM.replace("FADE", "blending_signal = \"share\"") + EXPORTED_SIGNALS + &signal))
    };
    let (whole, plain) = (blended("1"), run(&(LOADED_ARM.replace("FADE", "") + EXPORTED_SIGNALS)));
    assert_eq!(signal(&whole, "arm.phi"), signal(&plain, "arm.phi"));
    let half = blended("0.5");
    // At rest the observer finds the load, and the feedback gives half of K x̂ + the load: c φ + 2 = 2 · 2 with c = 0.5 · 8 · 9.
    assert!((last(&half, "found") - 2.0).abs() < 1e-3, "{}", last(&half, "found"));
    assert!((last(&half, "drive.tau") + 2.0).abs() < 0.02, "{}", last(&half, "drive.tau"));
    let none = blended("0");
    assert!(signal(&none, "drive.tau").iter().all(|command| *command == 0.0));
    // J w' = 2 - d w from 0.1 s on: the observer finds the load without any command.
    let expected = 20.0 * (1.0 - f64::exp(-2.9 * 0.2));
    assert!((last(&none, "arm.w") - expected).abs() < 1e-6, "{} {expected}", last(&none, "arm.w"));
    // The angle that it reads stands still between samples: a speed is off by some part of 40 rad/s · 1 ms, and what follows from it.
    assert!((last(&none, "found") - 2.0).abs() < 0.04, "{}", last(&none, "found"));
}

/// A law that is designed without a load is the law of the model that has none.
#[test]
fn a_design_leaves_elements_out() {
    let load = "
[shaft.wheel]
inertia = \"3 kg m^2\"
[spring_damper.bar]
shaft_1 = \"arm\"
shaft_2 = \"wheel\"
stiffness = \"40 N m/rad\"
damping = \"1 N m s/rad\"
[torque.drag]
shaft = \"wheel\"
law = \"-0.3 N m * sin(wheel.phi)\"
";
    let design = |source: &str| {
        let design = Project::open(source).design(&DesignSettings::default(), &Silent);
        design.unwrap_or_else(|reported| panic!("{reported:?}"))
    };
    let arm_only = design(&LOADED_ARM.replace("FADE", ""));
    let whole = design(&(LOADED_ARM.replace("FADE", "excluded_elements = [\"wheel\", \"bar\", \"drag\"]") + load));
    assert!(!arm_only.gains.is_empty() && arm_only.gains == whole.gains);
    assert_eq!(arm_only.controller_data, whole.controller_data);
    assert!(whole.design_model.ends_with("without `wheel`, `bar`, `drag`"), "{}", whole.design_model);
    // Its loop is that with the load: another one than without.
    let poles = |margins: &Option<kardan::results::Margins>| margins.as_ref().and_then(|found| found.spectral_radius);
    assert!(poles(&arm_only.margins) != poles(&whole.margins));
    let run = run(&(LOADED_ARM.replace("FADE", "excluded_elements = [\"wheel\", \"bar\", \"drag\"]")
        + load
        + EXPORTED_SIGNALS));
    assert!((last(&run, "found") - 2.0).abs() < 1.0 && signal(&run, "wheel.phi").iter().any(|phi| *phi != 0.0));
}

/// A law that is told true angles is told those of its part: at rest it holds 2 N m by its stiffness J 8 · 9 / s² alone, whatever stands
/// before its shaft by name and turns on its own.
#[test]
fn a_law_of_a_part_gets_the_angles_of_that_part() {
    let start = LOADED_ARM.find("[control.unit.observer]").expect("a table");
    let end = LOADED_ARM.find("[scenario]").expect("a table");
    let law = LOADED_ARM[..start].replace("FADE", "excluded_elements = [\"aa\"]") + &LOADED_ARM[end..];
    let turning = "[shaft.aa]\ninertia = \"1 kg m^2\"\n";
    let begins = "initial = { \"aa.phi\" = \"1 rad\", \"aa.w\" = \"3 rad/s\" }\noutput_step";
    let run = run(&(turning.to_string() + &law.replace("output_step", begins)));
    assert!((last(&run, "arm.phi") - 2.0 / 36.0).abs() < 1e-6, "{}", last(&run, "arm.phi"));
    assert!((last(&run, "aa.phi") - 10.0).abs() < 1e-9);
}

/// Estimates are those for the next sample: with an exact model and exact readings they are what is true there.
#[test]
fn what_is_found_is_foretold() {
    let law = LOADED_ARM.replace(
        "law = \"pole_placement\"\ninputs = [\"drive\"]\npoles = [-8, -9]",
        "law = \"sampled_noninteracting\"",
    );
    let channel = "[[control.unit.channels]]\noutput = \"arm.phi\"\ninput = \"drive\"\nbandwidth = \"20 rad/s\"\nreference = \"ref\"\n";
    let law = law
        .replace("poles = [-40, -41, -42]\n", "")
        .replace("FADE\n\n", channel)
        .replace("\"load\"\nto = \"2 N m\"", "\"ref\"\nto = \"1 rad\"");
    let run = run(&(law + EXPORTED_SIGNALS));
    let (reported, speed) = (signal(&run, "speed"), signal(&run, "arm.w"));
    assert!(speed.iter().any(|speed| *speed > 2.0));
    // Behind a step rows lie closer than samples.
    let is_sample = |time: &f64| (time * 1000.0 - (time * 1000.0).round()).abs() < 1e-9;
    let samples: Vec<usize> = (0..reported.len()).filter(|k| is_sample(&run.series.time[*k])).collect();
    assert_eq!(samples.len(), 3001);
    let worst = samples.windows(2).map(|pair| (reported[pair[0]] - speed[pair[1]]).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-6, "{worst}");
}

#[test]
fn signals_that_no_law_exports_are_named() {
    let read = |name: &str| {
        let signal = format!("[block.read]\nkind = \"delay\"\ninput = \"{name}\"\nsample_time = \"1 ms\"\n");
        let reported = study::check(&(LOADED_ARM.replace("FADE", "") + &signal));
        reported.iter().map(|one| format!("{} {}", one.code, one.message)).collect::<Vec<_>>()
    };
    assert_eq!(read("unit.arm.disturbance"), Vec::<String>::new());
    let typo = read("unit.arm.disturbanse");
    assert!(typo.iter().any(|reported| reported.starts_with("name::unknown")), "{typo:?}");
    let missing = LOADED_ARM.replace("FADE", "excluded_elements = [\"whel\"]");
    let reported = study::check(&missing);
    assert!(reported.iter().any(|one| one.message.contains("there is no element `whel`")), "{reported:?}");
    // What a controller needs cannot be left out.
    for needed in ["drive", "arm", "encoder"] {
        let reported = study::check(&LOADED_ARM.replace("FADE", &format!("excluded_elements = [\"{needed}\"]")));
        assert!(reported.iter().any(|one| one.code == "control::excluded-elements"), "{needed}: {reported:?}");
    }
    // A signal that nothing sets would switch it off.
    let reported = study::check(&LOADED_ARM.replace("FADE", "blending_signal = \"powr\""));
    assert!(reported.iter().any(|one| one.code == "control::blending-signal"), "{reported:?}");
    let set = "\n[[scenario.event]]\nat = \"0 s\"\nsignal = \"power\"\nto = 1\n";
    assert_eq!(study::check(&(LOADED_ARM.replace("FADE", "blending_signal = \"power\"") + set)), []);
    // Where the controller is not in the loop, it tells nothing.
    let variants = "[[variant]]\nname = \"with\"\n[[variant]]\nname = \"other\"\ncontrols = []\n";
    let reported = study::check(&(LOADED_ARM.replace("FADE", "") + EXPORTED_SIGNALS + variants));
    assert!(
        reported.iter().any(|one| one.code == "block::unavailable-signal" && one.message.contains("(variant `other`)")),
        "{reported:?}"
    );
    let continuous = LOADED_ARM.replace("FADE", "blending_signal = \"x\"").replace("sample_time = \"1 ms\"\n", "");
    let reported = study::check(&continuous);
    assert!(reported.iter().any(|one| one.message.contains("blending_signal")), "{reported:?}");
}

/// The opposite of a signal is an expression like any other.
#[test]
fn the_opposite_of_a_signal_is_measured() {
    let source = LOADED_ARM.replace("FADE", "")
        + "[[requirement]]\nsignal = \"-drive.tau\"\nmeasure = \"final\"\nabove = \"1.9 N m\"\nbelow = \"2.1 N m\"\n";
    let run = run(&source);
    assert!(run.requirements[0].passed, "{:?}", run.requirements);
    assert_eq!(run.requirements[0].measured, Some(-last(&run, "drive.tau")));
}

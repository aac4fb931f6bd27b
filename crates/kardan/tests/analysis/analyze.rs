//! `study::analyze` on models that a run would refuse, and the analysis in the study of a run.

use kardan::diagnostics::{Diagnostic, Severity};
use kardan::model;
use kardan::results::{Analysis, Complex, Pole};
use kardan::study::{self, AnalyzeSettings, Settings, Silent};

/// The harmonic drive with a spring of section 6.2, with the inertia of the flexspline given; empty: none.
fn drive(flexspline: &str) -> String {
    let source = model::builtin("harmonic-drive-spring").unwrap().source;
    let body = "[shaft.fs]\ninertia = \"50000 kg mm^2\"";
    assert!(source.contains(body));
    let inertia = if flexspline.is_empty() { String::new() } else { format!("inertia = \"{flexspline} kg m^2\"") };
    source.replace(body, &format!("[shaft.fs]\n{inertia}"))
}

fn analyze(source: &str, settings: &AnalyzeSettings) -> Result<Analysis, Vec<Diagnostic>> {
    let found = study::analyze(source, settings, &Silent);
    if let Err(reported) = &found {
        for diagnostic in reported.iter().filter(|d| d.severity == Severity::Error) {
            assert!(diagnostic.help.as_ref().is_some_and(|help| !help.is_empty()), "{diagnostic:?}");
            assert!(diagnostic.labels.iter().all(|label| source.get(label.place.span()).is_some()), "{diagnostic:?}");
        }
    }
    found
}

fn errors(source: &str, settings: &AnalyzeSettings) -> Vec<Diagnostic> {
    let reported = analyze(source, settings).expect_err("it should be refused");
    reported.into_iter().filter(|d| d.severity == Severity::Error).collect()
}

fn only(source: &str, settings: &AnalyzeSettings) -> Diagnostic {
    let mut reported = errors(source, settings);
    assert_eq!(reported.len(), 1, "{reported:?}");
    reported.remove(0)
}

/// Eigenvalues, every pair twice.
fn roots(analysis: &Analysis) -> Vec<Pole> {
    let both = |pole: Pole| if pole.im == 0.0 { vec![pole] } else { vec![pole, Complex::new(pole.re, -pole.im)] };
    analysis.modes.iter().flat_map(|mode| both(mode.eigenvalue)).collect()
}

#[test]
fn a_massless_motion_is_named_and_eliminated() {
    let source = drive("");
    let found = analyze(&source, &AnalyzeSettings::default()).unwrap().elimination.unwrap();
    assert_eq!((found.motions, found.direction.as_str()), (1, "fs"));
    // A run knows the motion as one of first order; the net torque of a shaft without inertia is zero, whatever the inputs do.
    let reported = study::run(&source, &Settings::default(), &Silent).unwrap_err();
    assert!(reported.iter().all(|d| d.code != "model::massless"), "{reported:?}");
    let design = reported.iter().find(|d| d.code == "control::design").unwrap();
    assert!(design.message.contains("no input reaches fs_torque.tau"), "{design:?}");
    // Other mistakes stay mistakes.
    let broken = format!("{source}\n[gear.more]\nshaft_1 = \"wg\"\nshaft_2 = \"nowhere\"\nratio = 2\n");
    assert_eq!(only(&broken, &AnalyzeSettings::default()).code, "name::unknown");
}

/// One of six states goes; the others move as they do with a very small inertia.
#[test]
fn the_massless_flexspline_is_the_limit_of_a_light_one() {
    let limit = analyze(&drive(""), &AnalyzeSettings::default()).unwrap();
    let structure = &limit.structure;
    assert_eq!((structure.states.len(), limit.coordinates.len()), (5, 3));
    let elimination = limit.elimination.as_ref().unwrap();
    assert_eq!((elimination.motions, elimination.direction.as_str(), elimination.removed.len()), (1, "fs", 1));
    assert!(elimination.definitions.is_empty());
    let mut last = f64::INFINITY;
    for light in ["1e-8", "1e-10"] {
        let with = analyze(&drive(light), &AnalyzeSettings::default()).unwrap();
        assert_eq!((with.structure.states.len(), &with.elimination), (6, &None));
        let (found, expected) = (roots(&with), roots(&limit));
        assert_eq!((found.len(), expected.len()), (6, 5));
        assert!(found[5].re < -1e4, "the sixth runs away: {found:?}");
        let gap = found.iter().zip(&expected).map(|(a, b)| (a.re - b.re).hypot(a.im - b.im)).fold(0.0, f64::max);
        assert!(gap < 0.2 * last && gap < 1e-2 * expected[4].re.hypot(expected[4].im), "{gap}: {found:?} {expected:?}");
        last = gap;
        // Generic answers are those of the limit.
        assert_eq!(with.structure.min_inputs, structure.min_inputs);
        assert_eq!((with.structure.controllable(), with.structure.observable()), (true, true));
    }
    assert!(structure.controllable() && structure.observable());
}

/// A set of places is listed exactly if motors (sensors) there make what remains controllable (observable).
#[test]
fn places_after_the_elimination_are_those_that_suffice() {
    let mut source = drive("").replace(
        "[motor.rk_motor]",
        "[motor.fs_motor]\nshaft = \"fs\"\n[motor.cs_motor]\nshaft = \"cs\"\n[motor.rk_motor]",
    );
    source = source.replace(
        "[[analysis.actuator]]\nshaft = \"wg\"",
        "[[analysis.actuator]]\nshaft = \"cs\"\n\n[[analysis.actuator]]\nshaft = \"wg\"",
    );
    let placement = analyze(&source, &AnalyzeSettings::default()).unwrap().placement;
    let (inputs, outputs) = (placement.inputs.unwrap(), placement.outputs.unwrap());
    assert_eq!((inputs.candidates.len(), inputs.exhaustive), (4, true));
    let listed = |search: &kardan::results::PlacementSearch, set: &[&str]| {
        search
            .sets
            .iter()
            .any(|other| other.places.len() == set.len() && set.iter().all(|p| other.places.iter().any(|q| q == p)))
    };
    let names = ["wg", "rk", "fs", "cs"];
    for (i, first) in names.iter().enumerate() {
        for second in &names[i + 1..] {
            let settings = AnalyzeSettings {
                inputs: [first, second].map(|name| format!("{name}_motor")).to_vec(),
                outputs: [first, second].map(|name| format!("{name}.phi")).to_vec(),
                ..AnalyzeSettings::default()
            };
            match analyze(&source, &settings) {
                Ok(with) => {
                    assert_eq!(listed(&inputs, &[first, second]), with.structure.controllable(), "{first}, {second}");
                    if ![*first, *second].contains(&"cs") {
                        let set = [format!("{first}.phi"), format!("{second}.phi")];
                        let set = [set[0].as_str(), set[1].as_str()];
                        assert_eq!(listed(&outputs, &set), with.structure.observable(), "{set:?}");
                    }
                }
                Err(reported) => panic!("{reported:?}"),
            }
        }
    }
    assert!(inputs.sets.iter().chain(&outputs.sets).all(|set| set.score > 0.0));
    assert!(inputs.sets[0].score >= inputs.sets.last().unwrap().score);
}

/// The plants of built-in models with a control unit stand in the others too, and their designs take long.
fn builtins_with_no_control_unit() -> impl Iterator<Item = &'static model::Builtin> {
    model::BUILTIN.iter().filter(|builtin| !builtin.source.contains("\"sampled_noninteracting\""))
}

#[test]
fn nothing_is_eliminated_of_a_regular_model() {
    for builtin in builtins_with_no_control_unit() {
        let plain = analyze(builtin.source, &AnalyzeSettings::default()).unwrap();
        assert_eq!(plain.elimination, None);
    }
}

/// R q' + q/C = u: one state, the charge, with the eigenvalue -1/(RC).
#[test]
fn an_rc_circuit_has_its_charge_as_state() {
    let source = "[voltage_source.V]\nfrom = \"ground\"\nto = \"a\"\n[resistor.R]\nfrom = \"a\"\nto = \"b\"\n\
                  resistance = \"2 Ohm\"\n[capacitor.C]\nfrom = \"b\"\nto = \"ground\"\ncapacitance = \"0.25 F\"\n";
    let settings = AnalyzeSettings { outputs: vec!["C.q".into(), "R.i".into()], ..AnalyzeSettings::default() };
    let found = analyze(source, &settings).unwrap();
    assert_eq!(found.modes.len(), 1);
    assert_eq!(found.structure.factors[0].polynomial, "s + 2");
    assert!((found.modes[0].eigenvalue.re + 2.0).abs() < 1e-12);
    assert!(found.structure.states[0].ends_with(".q") && found.elimination.unwrap().removed[0].ends_with(".i"));
    // The charge is an integral of the voltage, the current follows it at once.
    assert_eq!(found.structure.relative_degrees, [[Some(1)], [Some(0)]]);
}

/// A source behind a transformer 3 : 1 sees the load R2, C as 9 R2 and C/9: the pole is −1/((R1 + 9 R2) C/9). The winding itself
/// is the coordinate.
#[test]
fn a_winding_of_a_transformer_may_be_the_coordinate() {
    let source = "[voltage_source.V]\nfrom = \"ground\"\nto = \"a\"\n[resistor.R1]\nfrom = \"a\"\nto = \"b\"\n\
                  resistance = \"2 Ohm\"\n[transformer.zz]\nfrom_1 = \"b\"\nto_1 = \"ground\"\nfrom_2 = \"c\"\n\
                  to_2 = \"ground\"\nratio = 3\n[resistor.R2]\nfrom = \"c\"\nto = \"d\"\nresistance = \"1 Ohm\"\n\
                  [capacitor.C]\nfrom = \"d\"\nto = \"ground\"\ncapacitance = \"0.25 F\"\n\
                  [scenario]\nduration = \"1 s\"\ninitial = { \"zz.2.q\" = \"1 C\" }\n";
    let found = analyze(source, &AnalyzeSettings::default()).unwrap();
    assert_eq!((&found.structure.states, &found.structure.outputs), (&vec!["zz.2.q".into()], &vec!["zz.2.q".into()]));
    assert_eq!(found.structure.factors[0].polynomial, "s + 36/11");
    assert_eq!(found.elimination.unwrap().removed, ["zz.2.i"]);
    let (linear, _) = study::linearise(source, &AnalyzeSettings::default(), false).unwrap();
    assert_eq!((linear.states[0].name.as_str(), linear.states[0].unit.as_str()), ("zz.2.q", "C"));
    assert_eq!(linear.a[(0, 0)].to_string(), "-36/11");
    let settings = AnalyzeSettings { outputs: vec!["zz.1.i".into(), "zz.2.q".into()], ..AnalyzeSettings::default() };
    assert_eq!(analyze(source, &settings).unwrap().structure.relative_degrees, [[Some(0)], [Some(1)]]);
}

#[test]
fn what_cannot_be_eliminated_is_explained() {
    // b hangs on a spring, and a torque acts on it: its speed needs the derivative of the torque.
    let spring = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\n[spring_damper.s]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\n\
                  stiffness = \"2 N m/rad\"\n[motor.m]\nshaft = \"b\"\n";
    let reported = only(spring, &AnalyzeSettings { outputs: vec!["b.w".into()], ..AnalyzeSettings::default() });
    assert_eq!(reported.code, "analysis::massless");
    for part in ["derivative 1", "`b.w`", "`m`"] {
        assert!(reported.message.contains(part), "{reported:?}");
    }
    assert_eq!(&spring[reported.labels[0].place.span()], "b");
    // Its angle is fine: a + u/2.
    let angle =
        analyze(spring, &AnalyzeSettings { outputs: vec!["b.phi".into()], ..AnalyzeSettings::default() }).unwrap();
    assert_eq!(
        (angle.structure.states.join(" "), angle.structure.relative_degrees[0][0]),
        ("a.phi a.w".into(), Some(0))
    );
    // c is tied to nothing at all.
    let loose = format!("{spring}[shaft.c]\n");
    let reported = only(&loose, &AnalyzeSettings::default());
    assert!(reported.message.contains("`c` is not determined"), "{reported:?}");
    // Nothing but a spring to the wall.
    let rigid = "[shaft.a]\n[spring_damper.s]\nshaft_1 = \"a\"\nstiffness = \"2 N m/rad\"\n[motor.m]\nshaft = \"a\"\n";
    let reported = only(rigid, &AnalyzeSettings::default());
    assert!(reported.message.contains("no motion is left"), "{reported:?}");
}

/// The torque that a gear hands on to a massless shaft is that of its damper.
#[test]
fn torques_on_massless_shafts_are_outputs() {
    let source = format!("{}[sensor.torque]\nmeasures = \"torque\"\nelement = \"hd\"\nshaft = \"fs\"\n", drive(""));
    let settings = AnalyzeSettings { outputs: vec!["torque".into(), "fs.w".into()], ..AnalyzeSettings::default() };
    let found = analyze(&source, &settings).unwrap();
    // Two inputs, two outputs, one of which is 0.01 N m s/rad times the other.
    assert_eq!(found.structure.zeros.normal_rank, 1);
    assert_eq!(found.structure.relative_degrees[0], found.structure.relative_degrees[1]);
}

#[test]
fn parts_that_nothing_connects_are_named() {
    let source = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"2 kg m^2\"\n[shaft.c]\ninertia = \"2 kg m^2\"\n\
                  [gear.g]\nshaft_1 = \"b\"\nshaft_2 = \"c\"\nratio = 2\n[motor.m]\nshaft = \"a\"\n";
    let found = analyze(source, &AnalyzeSettings::default()).unwrap();
    assert!(
        found.notes.iter().any(|note| note.contains("2 parts") && note.contains("`a`; `b`, `c`")),
        "{:?}",
        found.notes
    );
    // A motor on each half would do; one reaches only its own.
    assert_eq!((found.structure.controllable_rank, found.structure.min_inputs), (2, 2));
    // Nothing stands in the way of a run: each part moves on its own.
    let run = study::run(source, &Settings::default(), &Silent).unwrap();
    assert!(
        run.warnings.iter().any(|note| note.contains("2 parts that nothing connects: `a`; `b`, `c`")),
        "{:?}",
        run.warnings
    );
}

#[test]
fn names_on_the_command_line_are_checked() {
    let source = model::builtin("two-bodies").unwrap().source;
    let matrices =
        br#"{"A": [[0, 1], [0, 0]], "B": [0, 1], "C": [[1, 0]], "inputs": ["torque"], "outputs": ["angle"]}"#;
    let list = |names: &[&str]| names.iter().map(|name| name.to_string()).collect::<Vec<_>>();
    for (inputs, outputs, code, part) in [
        (&[""][..], &[][..], "name::empty", "an input is empty"),
        (&["motor_1", "motor_1"], &[], "name::duplicate", "`motor_1` is named twice"),
        (&["moter_1"], &[], "name::unknown", "did you mean `motor_1`"),
        (&[], &["body_1"], "name::unknown", "`body_1.phi` or `body_1.w`"),
        (&[], &["bdy_1.phi"], "name::unknown", "did you mean `body_1.phi`"),
        (&[], &["body_1.phi", " body_1.phi"], "name::duplicate", "named twice"),
        (&[], &["motor_1.tau"], "name::unknown", "is no output"),
        (&[], &[" "], "name::empty", "an output is empty"),
    ] {
        let settings = AnalyzeSettings { inputs: list(inputs), outputs: list(outputs), ..AnalyzeSettings::default() };
        let reported = only(source, &settings);
        assert!(reported.code == code && reported.to_string().contains(part), "{reported:?}");
    }
    for (inputs, outputs, code, part) in [
        (&[""][..], &[][..], "name::empty", "an input is empty"),
        (&["torqe"], &[], "name::unknown", "did you mean `torque`"),
        (&[], &["angle", "angle"], "name::duplicate", "named twice"),
    ] {
        let settings = AnalyzeSettings { inputs: list(inputs), outputs: list(outputs), ..AnalyzeSettings::default() };
        let reported = study::analyze_state_space(matrices, &settings, &Silent).unwrap_err();
        assert!(
            reported.len() == 1 && reported[0].code == code && reported[0].to_string().contains(part),
            "{reported:?}"
        );
    }
    // Spaces around a name do no harm.
    let settings = AnalyzeSettings { inputs: list(&[" torque "]), ..AnalyzeSettings::default() };
    let found = study::analyze_state_space(matrices, &settings, &Silent).unwrap();
    assert_eq!((found.structure.inputs, found.modes.len()), (list(&["torque"]), 2));
    // A double root at zero is exactly that.
    assert!(found.modes.iter().all(|mode| mode.eigenvalue == Complex::default()));
}

#[test]
fn a_run_brings_the_analysis_of_its_first_variant() {
    // Its first variant alone: a run of all of them takes minutes, and the choice is tested below.
    for builtin in builtins_with_no_control_unit() {
        let first = model::read(builtin.source).0.variant_settings().swap_remove(0).name;
        let variants = if first.is_empty() { Vec::new() } else { vec![first] };
        let settings = Settings { variants, tolerance: Some(1e-6), ..Settings::default() };
        let study = crate::common::project(builtin.source).run(&settings, &Silent).unwrap();
        let expected = analyze(builtin.source, &AnalyzeSettings::default()).unwrap();
        let of_run = study.analysis.unwrap();
        assert_eq!((of_run.structure, of_run.modes), (expected.structure, expected.modes), "{}", builtin.name);
    }
    let source = model::builtin("sia-steering").unwrap().source;
    let chosen = "beta-20deg".to_string();
    let study =
        study::run(source, &Settings { variants: vec![chosen.clone()], ..Default::default() }, &Silent).unwrap();
    let expected = analyze(source, &AnalyzeSettings { variant: Some(chosen), ..AnalyzeSettings::default() }).unwrap();
    assert_eq!(study.analysis.unwrap().structure, expected.structure);
}

/// What would take long is left out, and said.
#[test]
fn a_run_does_not_wait_for_the_analysis_of_a_large_model() {
    let shaft = |k| format!("[shaft.s{k}]\ninertia = \"1 kg m^2\"\n");
    let spring =
        |k| format!("[spring_damper.k{k}]\nshaft_1 = \"s{k}\"\nshaft_2 = \"s{}\"\nstiffness = \"1 N m/rad\"\n", k + 1);
    let source: String = (0..40).map(shaft).chain((0..39).map(spring)).collect();
    let study = study::run(&source, &Settings::default(), &Silent).unwrap();
    assert!(study.analysis.is_none() && study.runs.len() == 1);
    assert!(study.warnings.iter().any(|warning| warning.contains("`kardan analyze`")), "{:?}", study.warnings);
}

/// Behind a voltage the charge of a motor counts what has flowed, and k q − J ω − d φ never changes: the inputs do not reach that one
/// combination. All motions they do reach, which is told; a second shaft that nothing drives is no matter of counting.
#[test]
fn a_charge_that_only_counts_is_distinguished_from_a_motion_that_is_not_reached() {
    let motor = "[shaft.rotor]\ninertia = \"0.01 kg m^2\"\ndamping = \"0.02 N m s/rad\"\n[voltage_source.V]\nfrom = \"ground\"\nto = \"a\"\n\
                 [dc_motor.M]\nfrom = \"a\"\nto = \"ground\"\nshaft = \"rotor\"\ntorque_constant = \"0.1 N m/A\"\nresistance = \"1 Ohm\"\n\
                 inductance = \"2 mH\"\n";
    let settings = AnalyzeSettings { outputs: vec!["rotor.phi".into()], ..AnalyzeSettings::default() };
    let found = analyze(motor, &settings).unwrap();
    assert_eq!((found.structure.controllable_rank, found.structure.states.len()), (3, 4));
    let counting = found.counting.unwrap();
    assert_eq!(counting.charges.len(), 1);
    assert!(counting.charges[0].ends_with(".q"), "{counting:?}");
    assert!(counting.remaining_controllable && counting.remaining_observable, "{counting:?}");
    let with_idle_shaft = format!("{motor}[shaft.idle]\ninertia = \"1 kg m^2\"\n");
    assert_eq!(analyze(&with_idle_shaft, &settings).unwrap().counting, None);
    // A charge that an output shows is seen.
    let shown = AnalyzeSettings { outputs: vec!["rotor.phi".into(), "M.q".into()], ..AnalyzeSettings::default() };
    let found = analyze(motor, &shown).unwrap();
    assert!(found.structure.observable());
    assert!(found.counting.is_some_and(|counting| counting.remaining_controllable && !counting.remaining_observable));
}

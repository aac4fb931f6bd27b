//! The door: files and programs write the same model, with the same mistakes, and a model writes itself down.

use kardan::diagnostics::{Diagnostic, Severity};
use kardan::entries::{Entries, Entry, RawValue};
use kardan::file::{syntax, to_toml};
use kardan::model;
use kardan::project::*;
use kardan::study::{EquationsForm, Settings, Silent};
use proptest::prelude::*;

use crate::common::project;

/// The example of the front page, which is run as it stands.
#[path = "../../examples/steering.rs"]
mod steering;

#[test]
fn the_steering_system_in_rust_does_all_that_it_says() {
    steering::main().expect("it runs to its end");
}

/// The same entries without places in a text, as if a program had written them.
fn by_a_program(entries: &Entries) -> Entries {
    let mut out = Entries::default();
    entries.iter().for_each(|entry| out.set(&entry.key, value_by_a_program(&entry.entry.value)));
    out
}

fn value_by_a_program(raw: &RawValue) -> RawValue {
    match raw {
        RawValue::Table(table) => RawValue::Table(by_a_program(table)),
        RawValue::List(list) => {
            RawValue::List(list.iter().map(|entry| Entry::from(value_by_a_program(&entry.value))).collect())
        }
        other => other.clone(),
    }
}

#[test]
fn built_in_models_written_and_read_again_are_the_same() {
    for builtin in model::BUILTIN {
        let project = project(builtin.source);
        let text = project.to_toml();
        let again = Project::open(text.as_str());
        assert!(project.entries().same_as(again.entries()), "{}:\n{text}", builtin.name);
        assert_eq!(again.to_toml(), text, "{}", builtin.name);
        let reported = |project: &Project| -> Vec<String> {
            project.diagnostics().iter().map(|d| format!("{} {} {:?}", d.code, d.message, d.help)).collect()
        };
        let sorted = |mut list: Vec<String>| {
            list.sort();
            list
        };
        assert_eq!(sorted(reported(&project)), sorted(reported(&again)), "{}", builtin.name);
        let built = Project::build(Builder::from_entries(by_a_program(project.entries())));
        assert_eq!(sorted(reported(&project)), sorted(reported(&built)), "{}", builtin.name);
    }
}

/// A run of a model that was written and read again, or built, is the same to the last bit.
#[test]
fn a_model_built_runs_as_that_of_the_file() {
    let source = model::builtin("two-bodies").expect("it is built in").source;
    let file = Project::open(source);
    let runs = [Project::open(file.to_toml()), Project::build(Builder::from_entries(by_a_program(file.entries())))]
        .map(|project| project.run(&Settings::default(), &Silent).expect("no mistakes"));
    let expected = file.run(&Settings::default(), &Silent).expect("no mistakes");
    for run in runs {
        assert_eq!(run.runs, expected.runs);
    }
}

/// Every element and controller of the built-in models is the typed struct of its kind, and this writes the same table.
#[test]
fn typed_structs_hold_every_key() {
    fn element<E: ElementKeys>(project: &Project) -> usize {
        let Some(group) = project.entries().table(E::KEYWORD) else { return 0 };
        for entry in group.iter() {
            let read = project.element::<E>(&entry.key).unwrap_or_else(|| panic!("{} {}", E::KEYWORD, entry.key));
            let RawValue::Table(table) = &entry.entry.value else { panic!("{} is a table", entry.key) };
            assert!(read.entries().same_as(table), "{} {}: {read:?}", E::KEYWORD, entry.key);
        }
        group.iter().count()
    }
    fn law<L: LawKeys>(project: &Project) -> usize {
        let Some(group) = project.entries().table("control") else { return 0 };
        let read: Vec<_> = group.iter().filter_map(|entry| Some((entry, project.control::<L>(&entry.key)?))).collect();
        for (entry, read) in &read {
            let RawValue::Table(table) = &entry.entry.value else { panic!("{} is a table", entry.key) };
            let built = Project::build(Builder::default().control(&entry.key, read.clone()));
            let again = built.entries().table("control").and_then(|group| group.table(&entry.key));
            assert!(again.is_some_and(|again| again.same_as(table)), "{}: {}", entry.key, built.to_toml());
        }
        read.len()
    }
    let (mut elements, mut laws) = (0, 0);
    for builtin in model::BUILTIN {
        let project = &Project::open(builtin.source);
        let found = [
            element::<Shaft>(project),
            element::<HarmonicDrive>(project),
            element::<Planetary>(project),
            element::<Gear>(project),
            element::<SpringDamper>(project),
            element::<UniversalJoint>(project),
            element::<Constraint>(project),
            element::<Motor>(project),
            element::<Disturbance>(project),
            element::<Sensor>(project),
            element::<Inductor>(project),
            element::<Resistor>(project),
            element::<Capacitor>(project),
            element::<Transformer>(project),
            element::<VoltageSource>(project),
            element::<Mass>(project),
            element::<RackAndPinion>(project),
            element::<PrescribedMotion>(project),
            element::<Torque>(project),
            element::<Brake>(project),
            element::<Lock>(project),
            element::<kardan::element::Vehicle>(project),
            element::<Driver>(project),
        ];
        assert_eq!(found.iter().sum::<usize>(), {
            let groups = kardan::element::REGISTRY.iter().filter_map(|kind| project.entries().table(kind.keyword));
            groups.map(|group| group.iter().count()).sum::<usize>()
        });
        elements += found.iter().sum::<usize>();
        let found = [
            law::<ComputedTorque>(project),
            law::<Decoupling>(project),
            law::<Flatness>(project),
            law::<Lqr>(project),
            law::<Noninteracting>(project),
            law::<PolePlacement>(project),
            law::<PositionLoop>(project),
            law::<Program>(project),
            law::<SampledNoninteracting>(project),
        ];
        let controls = project.entries().table("control").map_or(0, |group| group.iter().count());
        assert_eq!(found.iter().sum::<usize>(), controls, "{}", builtin.name);
        laws += controls;
    }
    assert!(elements > 50 && laws > 10, "{elements} elements, {laws} laws");
}

/// What is wrong with a file is wrong with the same model of a program: the same codes, words and help, and a path instead of a line.
#[test]
fn a_program_gets_the_same_errors() {
    let mut checked = 0;
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/bad");
    for file in std::fs::read_dir(folder).expect("the folder is there") {
        let path = file.expect("it can be read").path();
        let Ok(source) = std::fs::read_to_string(&path) else { continue };
        let (entries, diagnostics) = syntax(&source);
        if path.extension().is_none_or(|end| end != "toml") || !diagnostics.is_empty() || entries.is_empty() {
            continue;
        }
        let key = |d: &Diagnostic| (d.code, d.message.clone(), d.help.clone(), d.labels.len());
        let sorted = |list: &[Diagnostic]| {
            let mut list: Vec<_> = list.iter().map(key).collect();
            list.sort();
            list
        };
        let file = Project::open(source.as_str());
        let built = Project::build(Builder::from_entries(by_a_program(&entries)));
        assert_eq!(sorted(built.diagnostics()), sorted(file.diagnostics()), "{}", path.display());
        for diagnostic in built.diagnostics() {
            let paths: Vec<&str> = diagnostic.labels.iter().filter_map(|label| label.place.path()).collect();
            assert_eq!(paths.len(), diagnostic.labels.len(), "{}: {diagnostic:?}", path.display());
            for path in paths {
                assert!(leads_somewhere(built.entries(), path), "{path} of {diagnostic:?}");
            }
        }
        checked += 1;
    }
    assert!(checked > 50, "{checked} files");
}

/// Whether an entry stands at the path.
fn leads_somewhere(entries: &Entries, path: &str) -> bool {
    fn paths(entries: &Entries, out: &mut Vec<String>) {
        for keyed in entries.iter() {
            out.extend(keyed.place.path().map(str::to_string));
            entry(&keyed.entry, out);
        }
    }
    fn entry(found: &Entry, out: &mut Vec<String>) {
        out.extend(found.place.path().map(str::to_string));
        match &found.value {
            RawValue::Table(table) => paths(table, out),
            RawValue::List(list) => list.iter().for_each(|one| entry(one, out)),
            _ => {}
        }
    }
    let mut all = Vec::new();
    paths(entries, &mut all);
    all.iter().any(|found| found == path)
}

#[test]
fn paths_name_the_entry() {
    let channel = NoninteractingChannel::new("no.phi", "m", "position", "ref");
    let good = NoninteractingChannel::new("a.phi", "m", "position", "ref_a");
    let project = Project::build(
        Builder::new("axle")
            .element("a", Shaft::new().inertia("1 kg m^2"))
            .element("m", Motor::new("a"))
            .control("column", Noninteracting::new([good, channel])),
    );
    let paths: Vec<&str> =
        project.diagnostics().iter().filter_map(|diagnostic| diagnostic.labels.first()?.place.path()).collect();
    assert!(paths.contains(&"control.column.channels[1].output"), "{:#?}", project.diagnostics());
    let shown = project.diagnostics()[0].to_string();
    assert!(shown.contains("control.column.channels[1].output"), "{shown}");
}

fn key() -> impl Strategy<Value = String> {
    prop_oneof!["[a-z][a-z_0-9]{0,8}", "[ -~]{1,10}", "\\PC{1,4}"]
}

fn raw() -> impl Strategy<Value = RawValue> {
    let leaf = prop_oneof![
        any::<String>().prop_map(RawValue::Text),
        "[ -~]{0,20}".prop_map(RawValue::Text),
        any::<i64>().prop_map(|number| RawValue::Number(number.to_string())),
        any::<f64>().prop_filter("finite", |x| x.is_finite()).prop_map(|x| Quantity::from(x).raw()),
    ];
    leaf.prop_recursive(4, 40, 5, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..5)
                .prop_map(|list| RawValue::List(list.into_iter().map(Entry::from).collect())),
            prop::collection::vec((key(), inner), 0..5).prop_map(|list| {
                let mut table = Entries::default();
                list.into_iter().for_each(|(key, value)| table.set(&key, value));
                RawValue::Table(table)
            }),
        ]
    })
}

proptest! {
    /// Whatever stands in a model, writing and reading it is the identity.
    #[test]
    fn written_and_read_again_is_the_same(list in prop::collection::vec((key(), raw()), 0..6)) {
        let mut entries = Entries::default();
        list.into_iter().for_each(|(key, value)| entries.set(&key, value));
        let text = to_toml(&entries);
        let (again, diagnostics) = syntax(&text);
        prop_assert_eq!(diagnostics, [], "{}", &text);
        prop_assert!(entries.same_as(&again), "{}\n{:?}\n{:?}", text, entries, again);
    }

    /// A quantity that a program computed is read as the number it is.
    #[test]
    fn exact_quantities_survive_the_file(above in any::<i64>(), below in 1_i64.., turns in -2..3_i32) {
        use kardan::units::{Dimension, Exact, parse_quantity};
        let value = Exact::new(Exact::from_ratio(above, below).rational, turns);
        for dimension in [Dimension::TORQUE, Dimension::ANGLE, Dimension::STIFFNESS, Dimension::DAMPING] {
            let text = kardan::units::format_quantity(&value, dimension);
            prop_assert_eq!(parse_quantity(&text), Ok((value.clone(), dimension)), "{}", text);
        }
    }
}

/// What a key holds is told whole, an expression of a number too.
#[test]
fn the_manual_says_what_keys_hold() {
    let text = model::manual_of("lock").expect("an element");
    assert!(text.contains("engaged (expression of a number, required)"), "{text}");
    let brake = model::manual_of("brake").expect("an element");
    assert!(brake.contains("torque (expression of N m; for masses N, required)"), "{brake}");
}

/// Equations have nothing of the controllers, so none is designed for them: where a design fails they are written all the same, and where it does not they
/// are the same as those of a project that has designed all.
#[test]
fn equations_need_no_controller_design() {
    let source = model::builtin("harmonic-drive").expect("it is built in").source;
    let (fresh, designed) = (Project::open(source), Project::open(source));
    assert!(designed.diagnostics().iter().all(|diagnostic| diagnostic.severity != Severity::Error));
    for form in [EquationsForm::Text, EquationsForm::Latex, EquationsForm::Plan] {
        assert_eq!(fresh.equations(form).expect("equations").0, designed.equations(form).expect("equations").0);
    }
    let raw = |project: &Project| project.symbolic_text(EquationsForm::Text).expect("symbols").0;
    assert_eq!(raw(&fresh), raw(&designed));
    // Nothing connects the motor to the second shaft.
    let apart = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"2 kg m^2\"\n[spring_damper.s]\nshaft_1 = \"b\"\nstiffness = \"3 N m/rad\"\n\
                 [motor.m]\nshaft = \"a\"\n[control.c]\nlaw = \"pole_placement\"\ninputs = [\"m\"]\npoles = [-1, -2, -3, -4]\n\
                 [scenario]\nduration = \"1 s\"\n";
    let (text, _) = Project::open(apart).equations(EquationsForm::Text).expect("equations");
    assert!(text.contains("2 b''"), "{text}");
    assert!(Project::open(apart).diagnostics().iter().any(|diagnostic| diagnostic.severity == Severity::Error));
}

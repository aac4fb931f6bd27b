//! Tests of `src/study/project.rs`.

use super::*;
use crate::study::{AnalyzeSettings, DesignSettings, EquationsForm, Settings};

/// The finished fractions of the preparation.
#[derive(Default)]
struct Recorded(std::sync::Mutex<Vec<f64>>);

impl Progress for Recorded {
    fn advance(&self, _: usize, _: &str, _: f64) {}

    fn preparing(&self, fraction: f64) {
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(fraction);
    }
}

/// Each law is designed once for each variant, whatever the number of commands.
#[test]
fn each_law_is_designed_once_for_each_variant() {
    let text = "\
[parameters]
push = \"1 N m\"
[variants]
push = [\"1 N m\", \"2 N m\", \"3 N m\"]
[shaft.a]
inertia = \"1 kg m^2\"
[shaft.b]
inertia = \"2 kg m^2\"
[spring_damper.s]
shaft_1 = \"a\"
shaft_2 = \"b\"
stiffness = \"50 N m/rad\"
damping = \"1 N m s/rad\"
[motor.m]
shaft = \"a\"
[disturbance.load]
shaft = \"b\"
[control.counted_once]
law = \"decoupling\"
inputs = [\"m\"]
sample_time = \"1 ms\"
[[control.counted_once.channels]]
output = \"a.phi\"
reference = \"ref_a\"
[scenario]
duration = \"0.2 s\"
[[scenario.event]]
at = \"0.1 s\"
signal = \"load\"
to = \"push\"
";
    let project = Project::open(text);
    let fractions = Recorded::default();
    project.prepare_with_progress(&fractions);
    assert_eq!(project.diagnostics(), []);
    // The equations, the law, the sampled loop and its margins of three variants, begin and end.
    let mut fractions = fractions.0.into_inner().unwrap_or_default();
    assert_eq!((fractions.len(), fractions.first(), fractions.last()), (14, Some(&0.0), Some(&1.0)));
    fractions.sort_by(f64::total_cmp);
    fractions.dedup();
    assert_eq!(fractions.len(), 13, "{fractions:?}");
    // No command prepares, and so designs, again.
    let again = Recorded::default();
    let study = project.run(&Settings::default(), &again).expect("no errors");
    assert_eq!((study.runs.len(), study.designs.len()), (3, 1));
    project.analyze(&AnalyzeSettings::default(), &again).expect("no errors");
    let simulated = DesignSettings { simulate: true, ..DesignSettings::default() };
    project.design(&simulated, &again).expect("no errors");
    project.equations(EquationsForm::Text).expect("no errors");
    assert!(again.0.into_inner().unwrap_or_default().is_empty());
}

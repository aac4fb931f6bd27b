//! Stand-in for the parts of the library that are still being written, behind their agreed signatures.
//!
//! When they exist, this file becomes `pub use kardan::{model, report, study};`.

pub use kardan::report;

pub mod model {
    use kardan::diagnostics::Diagnostic;

    pub struct Builtin {
        pub name: &'static str,
        pub summary: &'static str,
        pub source: &'static str,
    }

    pub const BUILTIN: &[Builtin] = &[Builtin {
        name: "sia-steering",
        summary: "Steering with superimposed motion by a harmonic drive (stand-in).",
        source: "# stand-in\n",
    }];

    pub fn check(source: &str) -> Vec<Diagnostic> {
        let mut found = Vec::new();
        for (at, _) in source.match_indices("kq") {
            let unknown = Diagnostic::error("unit::unknown", "unknown unit `kq`");
            found.push(unknown.at(at..at + 2, "here").help("did you mean `kg`?"));
        }
        for (at, _) in source.match_indices("odd") {
            found.push(Diagnostic::warning("model::odd", "this is odd").at(at..at + 3, "here"));
        }
        found
    }

    pub fn manual() -> String {
        "[shaft.NAME]  A rigid rotating body.\n".into()
    }

    pub fn manual_of(name: &str) -> Option<String> {
        (name == "shaft").then(manual)
    }
}

pub mod study {
    use kardan::diagnostics::{Diagnostic, Severity};
    use kardan::results::*;

    pub trait Progress: Sync {
        fn advance(&self, variant: usize, name: &str, fraction: f64);
    }

    #[derive(Default)]
    pub struct Settings {}

    #[derive(Clone, Copy)]
    pub enum EquationsForm {
        Text,
        Latex,
    }

    pub fn run(source: &str, _settings: &Settings, progress: &dyn Progress) -> Result<Study, Vec<Diagnostic>> {
        let diagnostics = super::model::check(source);
        if diagnostics.iter().any(|d| d.severity == Severity::Error) {
            return Err(diagnostics);
        }
        let mut study = Study { warnings: diagnostics.iter().map(Diagnostic::to_string).collect(), ..Study::default() };
        study.model.name = "stand-in".into();
        study.plots = vec![Plot {
            id: "rack-angle".into(),
            title: "Rack angle".into(),
            signals: vec!["rk.phi".into()],
            ..Plot::default()
        }];
        for (index, name) in ["beta-0deg", "beta-10deg"].into_iter().enumerate() {
            let time: Vec<f64> = (0..=3000).map(|i| i as f64 * 1e-3).collect();
            let values = time.iter().map(|t| (t * (index + 1) as f64).sin()).collect();
            if source.contains("slow") {
                for percent in 0..100 {
                    std::thread::sleep(std::time::Duration::from_millis(10));
                    progress.advance(index, name, percent as f64 / 100.0);
                }
            }
            let phi = Signal {
                name: "rk.phi".into(),
                physical: Physical::Angle,
                description: "angle of the rack pinion".into(),
                values,
            };
            let beta = (index * 10) as f64;
            let bound = if source.contains("strict") { 0.5 } else { 2.0 };
            study.runs.push(Run {
                name: name.into(),
                parameters: vec![ParameterValue {
                    name: "beta".into(),
                    value: beta.to_radians(),
                    unit: "rad".into(),
                    text: format!("{beta} deg"),
                }],
                series: Series { time, signals: vec![phi] },
                energy: Energy { input: 3.0, stored: 1.0, dissipated: 2.0 - 1e-9, residual: 1e-9 },
                events: vec![Event { time: 0.5, what: "rk sticks".into() }],
                outcome: if index == 1 && source.contains("fail") {
                    Outcome::Failed { time: 3.0, cause: "step size fell below 1e-14 s".into() }
                } else {
                    Outcome::Completed
                },
                requirements: vec![RequirementResult {
                    text: format!("max |rk.phi| < {bound} rad"),
                    measured: 1.0,
                    unit: "rad".into(),
                    passed: 1.0 < bound,
                }],
                notes: vec!["the split between fs and rk is not unique".into()],
                effort: Effort { steps: 1234, rejected: 5, evaluations: 15_000, events: 1 },
            });
            progress.advance(index, name, 1.0);
        }
        Ok(study)
    }

    pub fn equations(source: &str, form: EquationsForm) -> Result<(String, Vec<Diagnostic>), Vec<Diagnostic>> {
        let diagnostics = super::model::check(source);
        if diagnostics.iter().any(|d| d.severity == Severity::Error) {
            return Err(diagnostics);
        }
        let text = match form {
            EquationsForm::Text => "J phi'' = tau\n",
            EquationsForm::Latex => "J \\ddot\\varphi = \\tau\n",
        };
        Ok((text.into(), diagnostics))
    }
}

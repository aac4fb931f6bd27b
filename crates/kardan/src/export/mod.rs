//! Export: bytes from results; nothing is computed here.
//!
//! | function | gives | reads it |
//! |---|---|---|
//! | [`csv()`] | one table, a column for each signal | anything |
//! | [`parquet()`] | the same table, with units in the metadata | pyarrow, polars, DuckDB, MATLAB |
//! | [`mat()`] | the same table | MATLAB, Octave, SciPy |
//! | [`mdf()`] | tables with a time of their own each | CANape, dSPACE, asammdf |
//! | [`json`] | the outcome of a study in a few numbers | scripts |
//! | [`analysis_json`] | the structure analysis of a model | scripts, independent checks |
//! | [`design_json`] | a designed controller with its proofs | scripts, independent checks |
//! | [`controller_json`] | the numbers that a designed controller runs with | firmware builds |
//! | [`identification_json`] | parameters found in logs | scripts |
//! | [`bench_json`] | plan, true values and files of a virtual bench | scripts |
//! | [`bench_study_json`] | a study on a virtual bench | scripts |
//! | [`truth_toml`] | what the plant of a virtual bench has | `kardan bench --truth` |
//! | [`json_error`] | why there is no outcome | scripts |

mod analysis;
mod bench;
mod design;
mod extremes;
mod identification;
mod json;
mod tables;
mod truth;

pub use analysis::analysis_json;
pub use bench::{WrittenLog, bench_json, bench_study_json};
pub use design::{controller_json, design_json};
pub use extremes::{Extremes, extremes};
pub use identification::identification_json;
pub use json::{Files, json, json_error};
pub use tables::{csv, mat, mdf, parquet};
pub use truth::truth_toml;

#[cfg(test)]
mod example {
    use crate::results::{
        Energy, Event, Outcome, ParameterValue, Physical, RequirementResult, Run, Series, Signal, Study,
    };

    pub fn run(name: &str, time: Vec<f64>, columns: Vec<(&str, Vec<f64>)>) -> Run {
        let signals = columns
            .into_iter()
            .map(|(name, values)| Signal {
                name: name.to_owned(),
                physical: Physical::Angle,
                description: format!("angle of {name}"),
                values,
            })
            .collect();
        Run {
            name: name.to_owned(),
            parameters: vec![ParameterValue {
                name: "beta".into(),
                value: 0.5,
                unit: "rad".into(),
                text: "0.5 rad".into(),
            }],
            series: Series { time, signals },
            energy: Energy { input: 3.0, stored: 1.0, dissipated: 2.0, residual: 1e-12 },
            events: vec![Event { time: 0.5, what: "rk sticks".into() }],
            outcome: Outcome::Completed,
            requirements: vec![RequirementResult {
                text: "max |rk.phi| < 9 rad".into(),
                measured: None,
                unit: "rad".into(),
                passed: false,
            }],
            notes: vec!["the split is not unique".into()],
            strains: vec![],
            effort: Default::default(),
        }
    }

    pub fn study(runs: Vec<Run>) -> Study {
        let mut study = Study { runs, warnings: vec!["look here".into()], ..Study::default() };
        study.model.name = "gear".into();
        study
    }
}

//! Export: bytes from results; nothing is computed here.
//!
//! | function | gives | reads it |
//! |---|---|---|
//! | [`csv()`] | one table, a column for each signal | anything |
//! | [`parquet()`] | the same table, with units in the metadata | pyarrow, polars, DuckDB, MATLAB |
//! | [`mat()`] | the same table | MATLAB, Octave, SciPy |
//! | [`mdf()`] | tables with a time of their own each | CANape, dSPACE, asammdf |
//! | [`json`] | the result of a study in a few numbers | scripts |
//! | [`analysis_json`] | the structure analysis of a model | scripts, independent checks |
//! | [`linear_json`], [`linear_mat`], [`linear_python`] | A, B, C, D of a model with names and units | `kardan analyze`, MATLAB, python-control |
//! | [`realisations_json`], [`realisations_mat`] | minimal realisation, Kalman's decomposition, staircase form | any tool |
//! | [`design_json`] | a designed controller with its proofs | scripts, independent checks |
//! | [`controller_json`] | the numbers that a designed controller runs with | firmware builds |
//! | [`identification_json`] | parameters identified from logs | scripts |
//! | [`bench_json`] | plan, true values and files of a virtual bench | scripts |
//! | [`bench_study_json`] | a study on a virtual bench | scripts |
//! | [`safety_json`], [`safety_csv`] | the effects of faults, and their detection | scripts, spreadsheets |
//! | [`sweep_json`], [`sweep_rows`] | the results of a sweep, its rows | scripts; pyarrow, polars, DuckDB |
//! | [`truth_toml`] | true values of the plant of a virtual bench | `kardan bench --truth` |
//! | [`json_error`] | why there is no result | scripts |
//! | [`equations_json`], [`check_json`], [`models_json`], [`elements_json`] … | output of commands that compute nothing | scripts, editors |
//! | [`schema()`] | the JSON schema of one of these | validators |

mod analysis;
mod bench;
mod design;
mod identification;
mod json;
mod linear;
mod printed;
mod reference;
mod safety;
mod schema;
mod sweep;
mod tables;
mod truth;

pub use analysis::analysis_json;
pub use bench::{LogFiles, bench_json, bench_study_json};
pub use design::{controller_json, design_json};
pub use identification::identification_json;
pub use json::{Files, json, json_error};
pub use linear::{linear_json, linear_mat, linear_python, realisations_json, realisations_mat};
pub use reference::{check_json, completions_json, elements_json, equations_json, models_json};
pub use safety::{safety_csv, safety_json};
pub use schema::{schema, schemas, schemas_json};
pub use sweep::{RowsError, read_sweep_rows, rows_of_any_sweep, samples_and_seed, sweep_json, sweep_rows};
pub use tables::{csv, figures_csv, mat, mdf, parquet};
pub use truth::truth_toml;

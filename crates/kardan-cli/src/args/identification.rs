//! The options of `identify`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::shared_options::{Changes, number};

/// Find parameters of a model in measured logs: values with confidence intervals, unidentifiable parameters, residual
/// tests, validation on segments left out of the fit.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "Logs: CSV and other text, Parquet, MAT (v5 to v7), MDF 4. Columns with names of signals of the \
                        model (wg.phi, cs.w, wg_motor.tau) are assigned; [log.NAME] of the model file names others \
                        (kardan elements log).\n\nExamples:\n  kardan identify my.toml bench.mf4\n  \
                        kardan identify my.toml day1.csv day2.csv --parameters wg.damping,wg.friction --report fit.html\n  \
                        kardan identify my.toml bench.mat --method dynamic --window \"50 ms\" --loss huber\n  \
                        kardan identify my.toml bench.parquet --compare --write identified.toml && kardan analyze identified.toml"
)]
pub struct IdentifyArgs {
    /// Path of a model file, name of a built-in model, or `-` for standard input.
    pub model: PathBuf,
    /// The logs; several are several recordings, or are joined by time where the model file has a [log.NAME] for each.
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<PathBuf>,
    /// Parameters to identify, separated by commas: `shaft.damping`, `bar.stiffness`, `gear.backlash`, or entries of [parameters], which
    /// torque laws may use too; those of
    /// [identification], or every damping and friction, if not given (with `--method dynamic` every inertia and stiffness too).
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub parameters: Vec<String>,
    /// Segments of constant speed, or all samples with filtered derivatives.
    #[arg(long, value_enum)]
    pub method: Option<IdentifyMethod>,
    /// Width of the windows in which samples are smoothed: `50ms`, `0.05`; 50 samples if not given.
    #[arg(long, value_name = "TIME")]
    pub window: Option<String>,
    /// Weight of residuals: outliers count squared like all others, linearly, or not at all.
    #[arg(long, value_enum)]
    pub loss: Option<IdentifyLoss>,
    /// Confidence of the intervals in percent [default: 95].
    #[arg(long, value_name = "PERCENT", value_parser = confidence)]
    pub confidence: Option<f64>,
    /// Compare models by cross-validation: those of [[identification.candidate]], or with and without each kind of friction.
    #[arg(long)]
    pub compare: bool,
    /// Try the terms that the residual tests suggest, one by one on segments left out of the fit, and report which to take.
    #[arg(long)]
    pub suggest: bool,
    /// Variant of the model; the first if not given.
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Print one JSON object instead of the text; `kardan schema` lists its keys.
    #[arg(long)]
    pub json: bool,
    /// Write the identification as one HTML page too, as Markdown if FILE ends with `.md`; a file that exists is replaced.
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Write a copy of the model file with the identified values and their intervals, and with identified terms (those that `--suggest`
    /// takes, too) as torque laws; a file that exists is replaced.
    #[arg(long, value_name = "FILE")]
    pub write: Option<PathBuf>,
    /// Exit with 1 unless every parameter is identified from complete logs with sound clocks, without a warning.
    #[arg(long)]
    pub strict: bool,
    #[command(flatten)]
    pub changes: Changes,
}

/// A percentage from 1 to below 100.
fn confidence(text: &str) -> Result<f64, String> {
    match number(text.trim().trim_end_matches('%')) {
        // An interval with a confidence below 1 % has no use.
        Some(x) if x > 0.0 && x < 1.0 => Err(format!("in percent: did you mean {}?", 100.0 * x)),
        Some(x) if (1.0..100.0).contains(&x) => Ok(x),
        _ => Err("not from 1 to below 100: write 95".into()),
    }
}

/// Which samples of a log are used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum IdentifyMethod {
    /// Segments of constant speed.
    Steady,
    /// All samples, with filtered derivatives.
    Dynamic,
}

/// Weight of residuals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum IdentifyLoss {
    /// Squares.
    Squares,
    /// Large ones linearly.
    Huber,
    /// Large ones not at all.
    Bisquare,
}

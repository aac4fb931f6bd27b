//! The options of the commands that simulate one model: `run`, `bench` and `safety`.

use std::path::PathBuf;

use clap::Args;
use kardan::study::Settings;

use super::shared_options::{Changes, Format, Limits, RunMethod, relative_tolerance};

/// Run the study of a model file: one table for each variant, the plots and a report.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "Examples:\n  kardan run\n  kardan run ./my.toml --out my-out --variant beta-10deg\n  kardan run my.toml --set beta=\"20 deg\" --set wg.inertia=\"140 kg mm^2\"\n  kardan run my.toml --watch\n  \
                        kardan run my.toml --json | jq '.variants[].signals[\"rk.phi\"].max'"
)]
pub struct RunArgs {
    /// Path of a model file, name of a built-in model, or `-` for standard input; a file with the name of a built-in
    /// model needs the prefix `./`.
    #[arg(default_value = "sia-steering")]
    pub model: PathBuf,
    /// Folder for all files; created if missing.
    #[arg(long, short, value_name = "DIR", default_value = "kardan-out")]
    pub out: PathBuf,
    /// Format of the tables.
    #[arg(long, value_enum, default_value = "csv")]
    pub format: Format,
    /// Print one JSON object instead of the summary.
    #[arg(long)]
    pub json: bool,
    /// Print everything that the report says, instead of a summary of at most 60 lines.
    #[arg(long, short, conflicts_with = "json")]
    pub verbose: bool,
    /// Write the tables only, neither report nor plots.
    #[arg(long)]
    pub no_report: bool,
    /// Write the report as Markdown (`report.md`) instead of HTML.
    #[arg(long, conflicts_with = "no_report")]
    pub markdown: bool,
    /// Run only these variants (may be given several times).
    #[arg(long = "variant", value_name = "NAME")]
    pub variants: Vec<String>,
    /// Rerun rows of `kardan sweep` with all signals: a file of rows, in place of the variants. The same model, `--set`, `--method` and `--tolerance`
    /// give the same bits.
    #[arg(long, value_name = "FILE")]
    pub variants_from: Option<PathBuf>,
    /// Rerun only the rows of these samples, separated by commas.
    #[arg(long = "sample", value_name = "NUMBERS", value_delimiter = ',', requires = "variants_from")]
    pub samples: Vec<u64>,
    /// Also inject these faults of the file, `[fault.NAME]`, separated by commas.
    #[arg(long = "fault", value_name = "NAMES", value_delimiter = ',', conflicts_with = "variants_from")]
    pub faults: Vec<String>,
    /// Also run controllers that are unstable at their sample time, or whose references no motor can balance.
    #[arg(long)]
    pub force: bool,
    /// Only simulate: no structure analysis, no controller designs, no error estimate. Faster.
    #[arg(long)]
    pub runs_only: bool,
    /// End with exit code 1 if the numbers of a run are doubtful: an estimated error of a tenth of a signal or more, or a
    /// second run with other events.
    #[arg(long, conflicts_with = "runs_only")]
    pub strict: bool,
    /// How the runs are integrated.
    #[arg(long, value_enum, default_value = "automatic")]
    pub method: RunMethod,
    /// Relative error allowed per step, from 1e-13 to 1e-3, in place of that of the file (1e-10 if it gives none).
    #[arg(long, value_name = "NUMBER", value_parser = relative_tolerance)]
    pub tolerance: Option<f64>,
    #[command(flatten)]
    pub limits: Limits,
    #[command(flatten)]
    pub changes: Changes,
}

impl RunArgs {
    /// What is run and how; rows of a sweep replace the variants.
    pub fn settings(&self) -> Settings {
        let of_file = self.variants_from.is_none();
        Settings {
            variants: if of_file { self.variants.clone() } else { Vec::new() },
            faults: self.faults.clone(),
            force: self.force,
            runs_only: self.runs_only,
            method: self.method.into(),
            tolerance: self.tolerance,
        }
    }
}

/// Run the virtual test bench of a model: logs of a plant whose true values the model does not know, driven by an excitation that
/// is designed for the best identification of parameters, or by the controllers of the file.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "Examples:\n  kardan bench\n  kardan bench my.toml --plan multisine --format csv,parquet --out logs\n  \
                        kardan bench my.toml --truth hidden.toml --seed 7 --repetitions 20\n  \
                        kardan bench harmonic-drive-bench --control drive\n  \
                        kardan bench harmonic-drive-bench --study --out study\n  \
                        kardan bench --json | jq '.plan.parameters[] | {name, standard_error}'"
)]
pub struct BenchArgs {
    /// Path of a model file, name of a built-in model, or `-` for standard input; a file with the name of a built-in
    /// model needs the prefix `./`.
    #[arg(default_value = "harmonic-drive-bench")]
    pub model: PathBuf,
    /// Folder for the logs, `plan.txt` and `truth.toml` (and what a study writes); created if missing.
    #[arg(long, short, value_name = "DIR", default_value = "kardan-out")]
    pub out: PathBuf,
    /// Formats of the logs, separated by commas.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "csv")]
    pub format: Vec<Format>,
    /// Seed of noise, drawn true values and drawn excitations; that of the file, or 1, if not given.
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// How the motors move the plant: constant_speeds, multisine or random_steps; that of the file if not given.
    #[arg(long, value_name = "PLAN")]
    pub plan: Option<String>,
    /// A file with the table `[bench.truth]`, which then stays out of the model file.
    #[arg(long, value_name = "FILE")]
    pub truth: Option<PathBuf>,
    /// Logs to write, each with the next seed: other noise, another start, the same plant and plan.
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub repetitions: u32,
    /// Variant whose parameter values apply; the first if not given.
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Run the scenario of the file under its controllers, this one among them, instead of an excitation; with `--study`: the
    /// controller of the study, if it is not the first.
    #[arg(long, value_name = "NAME", conflicts_with = "plan")]
    pub control: Option<String>,
    /// Run the complete study: excite, log, identify, write the model with the identified values, design its controller on them, run that in
    /// simulation and on the bench, and show both side by side in `report.html`.
    #[arg(long)]
    pub study: bool,
    /// Write the report of the study as Markdown (`report.md`) instead of HTML.
    #[arg(long, requires = "study")]
    pub markdown: bool,
    /// Print one JSON object instead of the text; `kardan schema` lists its keys.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub limits: Limits,
    #[command(flatten)]
    pub changes: Changes,
}

/// Try every fault of a model file in every variant and at every value of `[safety]`: when each is detected, how the unit reacts, its
/// effects, and whether they are within bounds; with the command that reruns each row.
///
/// The exit code is 1 if a fault is not detected and harmful, if its effect is beyond a bound, or if something is detected without a fault.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "Examples:\n  kardan safety my.toml\n  kardan safety my.toml --report faults.html --csv faults.csv\n  kardan safety my.toml --set v=\"20 m/s\"\n  \
                        kardan safety my.toml --json | jq '.rows[] | [.command, .verdict]'"
)]
pub struct SafetyArgs {
    /// Path of a model file, name of a built-in model, or `-` for standard input; a file with the name of a built-in
    /// model needs the prefix `./`.
    pub model: PathBuf,
    /// Write a report there, as HTML or, to a file that ends with `.md`, as Markdown; a file that exists is replaced.
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Write the table there as comma-separated values; a file that exists is replaced.
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Print one JSON object instead of the text; `kardan schema` lists its keys.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub limits: Limits,
    #[command(flatten)]
    pub changes: Changes,
}

//! The options of the command line.

mod analysis;
mod identification;
mod runs;
mod shared_options;
mod sweep;

pub use analysis::{AnalyzeArgs, DesignArgs, EquationsArgs, LinearFormat, LineariseArgs};
pub use identification::IdentifyArgs;
pub use runs::{BenchArgs, RunArgs, SafetyArgs};
pub use shared_options::{Changes, Format, Limits, MOST_STEPS, RunMethod, number, word};
pub use sweep::{MergeArgs, SweepArgs, SweepCommand, Target};

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;

/// Derive equations, controllers, closed-loop runs and a report from one model file of a drivetrain.
#[derive(Debug, Parser)]
#[command(
    name = "kardan",
    version,
    arg_required_else_help = true,
    after_help = "Examples:\n  kardan run                        run the built-in study, report in kardan-out/report.html\n  \
                  kardan models sia-steering --write my.toml\n  kardan check my.toml\n  kardan run my.toml --out my-out\n  kardan analyze my.toml\n  kardan design my.toml\n  kardan identify my.toml bench.csv\n  kardan schema run                 the JSON keys of `kardan run --json`\n\n\
                  Exit codes: 0 done, 1 a requirement of the study failed (or, with `--strict` of `run` and `identify`, the result is doubtful), \
                  2 error, a run whose energy balance does not close, or ended early by a limit or a signal (results until then are written)."
)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
    /// No progress bars and no notes.
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// Interpret the equations instead of compiling machine code; the results are the same.
    #[arg(long, global = true)]
    pub portable: bool,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    Run(RunArgs),
    Analyze(AnalyzeArgs),
    Design(DesignArgs),
    Identify(IdentifyArgs),
    Bench(BenchArgs),
    Safety(SafetyArgs),
    Sweep(SweepArgs),
    Equations(EquationsArgs),
    Linearise(LineariseArgs),
    Check(CheckArgs),
    Models(ModelsArgs),
    #[command(alias = "element")]
    Elements(ElementsArgs),
    Schema(SchemaArgs),
    Completions(CompletionsArgs),
}

/// What commands have in common.
pub struct Common<'a> {
    /// Whether the command prints one JSON object instead of text.
    pub json: bool,
    pub limits: Option<&'a Limits>,
    /// The model file, and whether the command repeats when it changes.
    pub model: Option<(&'a PathBuf, &'a Changes)>,
}

impl Command {
    pub fn common(&self) -> Common<'_> {
        let (json, limits, model) = match self {
            Self::Run(a) => (a.json, Some(&a.limits), Some((&a.model, &a.changes))),
            Self::Analyze(a) => (a.json, None, Some((a.state_space.as_ref().unwrap_or(&a.model), &a.changes))),
            Self::Design(a) => (a.json, Some(&a.limits), Some((&a.model, &a.changes))),
            Self::Identify(a) => (a.json, None, Some((&a.model, &a.changes))),
            Self::Bench(a) => (a.json, Some(&a.limits), Some((&a.model, &a.changes))),
            Self::Safety(a) => (a.json, Some(&a.limits), Some((&a.model, &a.changes))),
            Self::Sweep(SweepArgs { merge: Some(SweepCommand::Merge(a)), .. }) => (a.json, None, None),
            Self::Sweep(a) => (a.json, Some(&a.limits), a.model.as_ref().map(|model| (model, &a.changes))),
            Self::Equations(a) => (a.json, None, Some((&a.model, &a.changes))),
            Self::Linearise(a) => (a.json, None, Some((&a.model, &a.changes))),
            Self::Check(a) => (a.json, None, Some((&a.model, &a.changes))),
            Self::Models(a) => (a.json, None, None),
            Self::Elements(a) => (a.json, None, None),
            Self::Schema(a) => (a.json, None, None),
            Self::Completions(a) => (a.json, None, None),
        };
        Common { json, limits, model }
    }
}

/// Check a model file for errors without running it.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Example:\n  kardan check my.toml")]
pub struct CheckArgs {
    /// Path of a model file, name of a built-in model, or `-` for standard input.
    pub model: PathBuf,
    /// Print one JSON object instead of the text; `kardan schema` lists its keys.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub changes: Changes,
}

/// List the built-in models, or print or save one of them.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Examples:\n  kardan models\n  kardan models sia-steering --write my.toml")]
pub struct ModelsArgs {
    /// The model whose TOML to print.
    pub name: Option<String>,
    /// Save it there instead of printing it; a file that exists is not touched.
    #[arg(long, value_name = "FILE", requires = "name")]
    pub write: Option<PathBuf>,
    /// Print one JSON object instead of the text; `kardan schema` lists its keys.
    #[arg(long)]
    pub json: bool,
}

/// Print the manual of the tables that a model file may have.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Example:\n  kardan elements harmonic_drive")]
pub struct ElementsArgs {
    /// The table whose page to print.
    pub name: Option<String>,
    /// Print one JSON object instead of the text; `kardan schema` lists its keys.
    #[arg(long)]
    pub json: bool,
}

/// List the JSON schemas of model files and of what commands print with `--json`, or print one of them.
///
/// `kardan schema model` is for editors: with it they complete keys, show units and mark errors in a model file (docs/editors.md).
/// Each object begins with the key `schema`: the version of the format, `kardan/2`. Numbers are in SI; a non-finite one is
/// `null`, a complex one is `[re, im]`, an exact one a text.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "Examples:\n  kardan schema\n  kardan schema run > run.schema.json\n  kardan schema model > kardan.schema.json"
)]
pub struct SchemaArgs {
    /// Subject of the schema: `model` for model files, or one of those that `kardan schema` lists.
    pub name: Option<String>,
    /// Print one JSON object instead of the text; `kardan schema` lists its keys.
    #[arg(long)]
    pub json: bool,
}

/// Print a completion script for a shell.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Example:\n  kardan completions bash > ~/.local/share/bash-completion/completions/kardan")]
pub struct CompletionsArgs {
    /// The shell.
    pub shell: Shell,
    /// Print one JSON object instead of the text; `kardan schema` lists its keys.
    #[arg(long)]
    pub json: bool,
}

#[cfg(test)]
#[path = "../../tests/unit/args.rs"]
mod tests;

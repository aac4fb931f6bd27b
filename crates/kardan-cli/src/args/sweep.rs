//! The options of `sweep` and of its subcommands.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use kardan::study::Shard;

use super::shared_options::{Changes, Limits, MOST_STEPS, RunMethod, relative_tolerance};

/// Run a model over many values of its parameters: probabilities of its requirements, distributions of its figures, and their dependence on parameters.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "Examples:\n  kardan sweep my.toml\n  kardan sweep my.toml --samples 10000 --seed 7 --out out\n  kardan sweep my.toml --samples 10000 --seed 7 --out out --resume\n  \
                        kardan sweep my.toml --samples 100000 --until 0.01 --out out\n  kardan sweep my.toml --samples 2000 --worst 1\n  \
                        kardan sweep my.toml --samples 1000 --rare 'max |bar.tau|'\n  \
                        kardan sweep my.toml --samples 10000 --shard 2/7 --out part2\n  kardan sweep merge my.toml part1 part2 --out all\n  \
                        kardan sweep my.toml --samples 1000000 --on slurm --out swept\n  kardan sweep my.toml --samples 1000000 --on slurm --out swept --dry-run\n  \
                        kardan sweep template slurm > mine.sh\n  kardan sweep my.toml --on slurm --template mine.sh --out swept\n  \
                        kardan sweep my.toml --json | jq '.requirements[] | [.text, .probability, .interval]'"
)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct SweepArgs {
    #[command(subcommand)]
    pub merge: Option<SweepCommand>,
    /// Path of a model file, name of a built-in model, or `-` for standard input; a file with the name of a built-in
    /// model needs the prefix `./`.
    #[arg(required = true)]
    pub model: Option<PathBuf>,
    /// Samples, in place of those of the file.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = samples)]
    pub samples: Option<u64>,
    /// Another seed, other samples: in place of that of the file.
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = seed)]
    pub seed: Option<u64>,
    /// Run these variants only (may be given several times), in place of those of `[sweep]`.
    #[arg(long = "variant", value_name = "NAME")]
    pub variants: Vec<String>,
    /// Folder for the rows, a Parquet file for each block of samples, written as soon as it is complete, and for the report; created if missing.
    /// Without it no file is written.
    #[arg(long, short, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Continue with the rows in the folder: complete blocks are not run again.
    #[arg(long, requires = "out")]
    pub resume: bool,
    /// Replace the rows of another sweep in the folder.
    #[arg(long, requires = "out", conflicts_with = "resume")]
    pub force: bool,
    /// Run samples, at most those given, until the half-width of each requirement's interval is at most this: `0.01` for a probability to 1 %.
    #[arg(long, value_name = "HALF", conflicts_with_all = ["worst", "rare", "shard", "on"])]
    pub until: Option<f64>,
    /// Search for the worst case of a requirement, by its number or its text, with at most `--samples` samples: half of them fill the space, the others start from
    /// the worst one.
    #[arg(long, value_name = "REQUIREMENT", conflicts_with_all = ["rare", "shard", "on"])]
    pub worst: Option<String>,
    /// Failure probability of such a requirement, down to some 1e-7, by subset simulation; `--samples` is the number per level.
    #[arg(long, value_name = "REQUIREMENT", conflicts_with_all = ["shard", "on"])]
    pub rare: Option<String>,
    /// Run this part of the samples alone, such as `2/7`, on as many machines as there are parts: `kardan sweep merge` merges them.
    #[arg(long, value_name = "I/N", value_parser = shard, requires = "out")]
    pub shard: Option<Shard>,
    /// Threads that run the samples [default: as many as there are cores]; with `--on` those of each shard [default: 1]. Rows do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1024))]
    pub threads: Option<u64>,
    /// Print one JSON object instead of the text; `kardan schema` lists its keys.
    #[arg(long)]
    pub json: bool,
    /// How the runs are integrated; `automatic` also runs them in SIMD lanes if only coefficients vary, and states their deviation
    /// from separate runs.
    #[arg(long, value_enum, default_value = "automatic")]
    pub method: RunMethod,
    /// Relative error allowed per step, from 1e-13 to 1e-3, in place of that of the file (1e-10 if it gives none).
    #[arg(long, value_name = "NUMBER", value_parser = relative_tolerance)]
    pub tolerance: Option<f64>,
    #[command(flatten)]
    pub limits: Limits,
    #[command(flatten)]
    pub changes: Changes,
    #[command(flatten)]
    pub on: OnArgs,
}

/// Where the shards of a sweep run.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "On many machines")]
pub struct OnArgs {
    /// Run the sweep as shards: write an array job into the folder, submit it, follow it, submit again what failed, merge. All machines see the folder
    /// under the same path. With `--resume` the same command follows the missing shards.
    #[arg(long, value_enum, value_name = "WHERE", requires = "out", conflicts_with_all = ["shard", "watch"])]
    pub on: Option<Target>,
    /// How many shards [default: about 1000 samples each, at most 1000; `local`: not fewer than processes].
    #[arg(long, value_name = "N", requires = "on", value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub shards: Option<u64>,
    /// How often kardan resubmits failed shards, at most.
    #[arg(long, value_name = "N", requires = "on", default_value = "2", value_parser = clap::value_parser!(u64).range(0..=100))]
    pub retries: u64,
    /// A job template in place of kardan's: `kardan sweep template slurm` prints one to start from.
    #[arg(long, value_name = "FILE", requires = "on")]
    pub template: Option<PathBuf>,
    /// Write and print the job; submit nothing.
    #[arg(long, requires = "on", conflicts_with = "json")]
    pub dry_run: bool,
}

/// The system that runs shards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Target {
    /// An array of Slurm: `sbatch`, `squeue`.
    Slurm,
    /// An array of HyperQueue: `hq`, with a server that runs.
    Hyperqueue,
    /// An Indexed Job of Kubernetes: `kubectl`. The pods mount the claim `kardan` and have the image `kardan`; a template names others.
    Kubernetes,
    /// The ranks of `mpirun`, each with a part of the shards.
    Mpi,
    /// Processes on this machine.
    Local,
}

/// Subcommands of `kardan sweep`.
#[derive(Debug, Clone, Subcommand)]
pub enum SweepCommand {
    Merge(MergeArgs),
    Template(TemplateArgs),
}

/// Print the job template that `--on` uses, as a start for a custom one: words in double braces are replaced.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Example:\n  kardan sweep template slurm > mine.sh")]
pub struct TemplateArgs {
    /// The system that runs the shards.
    pub on: Target,
}

/// Merge the rows of shards: check that all are present and of one sweep, and report their results.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "Examples:\n  kardan sweep merge my.toml part1 part2 part3 --out all\n  kardan sweep merge my.toml parts/* --json"
)]
pub struct MergeArgs {
    /// The model of the sweep.
    pub model: PathBuf,
    /// Folders with rows, those of `--out` of each shard.
    #[arg(required = true, value_name = "DIR")]
    pub parts: Vec<PathBuf>,
    /// The variants of `--variant`, if it was given.
    #[arg(long = "variant", value_name = "NAME")]
    pub variants: Vec<String>,
    /// Folder for the page and the results as JSON; created if missing. Without it no file is written.
    #[arg(long, short, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print one JSON object instead of the text; `kardan schema` lists its keys.
    #[arg(long)]
    pub json: bool,
    /// How the runs were integrated.
    #[arg(long, value_enum, default_value = "automatic")]
    pub method: RunMethod,
    /// The relative error that was allowed per step, if it was given.
    #[arg(long, value_name = "NUMBER", value_parser = relative_tolerance)]
    pub tolerance: Option<f64>,
    /// Steps of the integrator after which runs ended early.
    #[arg(long, value_name = "N", default_value_t = MOST_STEPS, value_parser = clap::value_parser!(u64).range(1..))]
    pub max_steps: u64,
    #[command(flatten)]
    pub changes: Changes,
}

fn samples(text: &str) -> Result<u64, String> {
    match whole(text) {
        Some(0) => Err("a sweep has at least one sample; write a number such as 1000".into()),
        Some(number) => Ok(number),
        None => Err("samples are counted by a whole number; write it in digits only, such as 1000".into()),
    }
}

fn seed(text: &str) -> Result<u64, String> {
    whole(text)
        .ok_or_else(|| format!("a seed is a whole number from 0 to {}; write it in digits only, such as 7", u64::MAX))
}

/// A number in digits only.
fn whole(text: &str) -> Option<u64> {
    text.parse().ok()
}

fn shard(text: &str) -> Result<Shard, String> {
    let part =
        text.split_once('/').and_then(|(number, of)| Some((number.trim().parse().ok()?, of.trim().parse().ok()?)));
    match part {
        Some((number, of)) if (1..=of).contains(&number) => Ok(Shard { number, of }),
        Some((number, of)) => Err(format!("there is no part {number} of {of}: parts are 1 to {of}")),
        None => Err("not a part, such as 2/7".into()),
    }
}

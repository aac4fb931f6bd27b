//! The options of the command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use kardan::study::Shard;
use kardan::units::parse_number;

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

impl Command {
    /// Whether the command prints one JSON object instead of text.
    pub fn json(&self) -> bool {
        match self {
            Self::Run(args) => args.json,
            Self::Analyze(args) => args.json,
            Self::Design(args) => args.json,
            Self::Identify(args) => args.json,
            Self::Bench(args) => args.json,
            Self::Safety(args) => args.json,
            Self::Sweep(SweepArgs { merge: Some(SweepCommand::Merge(args)), .. }) => args.json,
            Self::Sweep(args) => args.json,
            Self::Equations(args) => args.json,
            Self::Check(args) => args.json,
            Self::Models(args) => args.json,
            Self::Elements(args) => args.json,
            Self::Schema(args) => args.json,
            Self::Completions(args) => args.json,
            Self::Linearise(args) => args.json,
        }
    }
}

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

/// How runs are integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum RunMethod {
    /// The Runge-Kutta method of order 8 of Dormand and Prince for everything: the reference.
    Dop853,
    /// Taylor series of the equations: fewest evaluations. Loops with a law that is evaluated at every instant run with dop853.
    Taylor,
    /// Radau IIA, an implicit method with exact Jacobian: for stiff loops, whose fastest motions decay at once. Loops with a law that
    /// is evaluated at every instant run with dop853.
    Radau,
    /// Loops that are linear between the breakpoints of the scenario by matrix exponentials, however stiff; others by radau where the rates
    /// at the start show that this takes less time, else by taylor. The effort table names the method used.
    Automatic,
}

/// A number, written as in model files.
pub fn number(text: &str) -> Option<f64> {
    parse_number(text.trim()).ok().map(|number| number.to_f64())
}

fn relative_tolerance(text: &str) -> Result<f64, String> {
    let number = number(text).ok_or("not a number, such as 1e-8")?;
    let from_to = kardan::study::TOLERANCES;
    match from_to.contains(&number) {
        true => Ok(number),
        false => Err(format!("from {:e} to {:e}", from_to.start(), from_to.end())),
    }
}

/// Analyse the structure of a model: modes, controllability, observability, zeros, minimum numbers and placement of motors
/// and sensors, and the distance of toleranced parameters from losing it.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Examples:\n  kardan analyze two-bodies\n  kardan analyze my.toml --inputs motor --outputs \
                        rack.phi,rack.w --report analysis.html\n  kardan analyze my.toml --json | jq '.uncontrollable'\n  \
                        kardan analyze my.toml --certify\n  kardan analyze my.toml --parity --false-alarms 0.01 --filter 0.02\n  kardan analyze --state-space abcd.json")]
pub struct AnalyzeArgs {
    /// Path of a model file, name of a built-in model, or `-` for standard input; a file with the name of a built-in
    /// model needs the prefix `./`.
    #[arg(default_value = "sia-steering")]
    pub model: PathBuf,
    /// Analyse plain matrices A, B, C, D from this file instead of a model (`-` for standard input).
    #[arg(long, value_name = "FILE", conflicts_with_all = ["model", "variant", "set"])]
    pub state_space: Option<PathBuf>,
    /// Print one JSON object instead of the text; `kardan schema` lists its keys.
    #[arg(long)]
    pub json: bool,
    /// Write the analysis as one HTML page too, as Markdown if FILE ends with `.md`; a file that exists is replaced.
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Write minimal realisation, Kalman's decomposition and staircase form as matrices to this file, `.json` (exact and
    /// decimal) or `.mat`; a file that exists is replaced.
    #[arg(long, value_name = "FILE")]
    pub export: Option<PathBuf>,
    /// Variant to analyse; the first if not given.
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Inputs, separated by commas; those of the model file, or all motors, if not given.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub inputs: Vec<String>,
    /// Outputs, separated by commas: signals such as `rack.phi`, or sensors; those of the model file if not given.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub outputs: Vec<String>,
    /// Operating point in place of `at` of `[analysis]` (may be given several times): `--at car.v="20 km/h"` in steady motion, `--at arm.phi="60 deg"` at
    /// rest, `--at t="3.2 s"` the state of the run at that time.
    #[arg(long, value_name = "SIGNAL=VALUE", conflicts_with = "state_space")]
    pub at: Vec<String>,
    /// Prove every result over the rationals; without it some are wrong with a tiny, stated probability.
    #[arg(long)]
    pub certify: bool,
    /// Without effect: kardan eliminates motions without inertia (massless shafts) automatically.
    #[arg(long, conflicts_with = "state_space")]
    pub eliminate_massless: bool,
    /// Report which faults of sensors and inputs can be detected and isolated at all, by which relations between the
    /// readings, from which thresholds, and with which smallest sets of sensors; disturbances are unknown.
    #[arg(long, conflicts_with = "state_space")]
    pub parity: bool,
    /// False alarms that a residual of `--parity` may give, per hour [default: 0.001].
    #[arg(long, value_name = "PER_HOUR", value_parser = rate, requires = "parity")]
    pub false_alarms: Option<f64>,
    /// Consecutive samples beyond a threshold of `--parity` that raise an alarm [default: 3].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000), requires = "parity")]
    pub debounce: Option<u32>,
    /// Time constant, s, of the filter for time residuals of `--parity`, applied once per derivative [default: ten samples].
    #[arg(long, value_name = "SECONDS", value_parser = seconds, requires = "parity")]
    pub filter: Option<f64>,
    #[command(flatten)]
    pub changes: Changes,
}

/// Design one controller of a model: whether its outputs can be decoupled, gains, poles, zero dynamics, the exact proof and
/// the remaining cross coupling in the nonlinear simulation.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Examples:\n  kardan design\n  kardan design my.toml --control column --report design.html \
                        --controller column.json\n  kardan design my.toml --law decoupling --inputs wg_motor,rk_motor \
                        --outputs rk.phi,fs.phi\n  kardan design robot-joint --law lqr --at arm.phi=\"60 deg\"\n  kardan design my.toml --json | jq '.gains.K.exact'\n  \
                        kardan design sia-steering-ecu --explore --tolerance 20% --report design.html")]
pub struct DesignArgs {
    /// Path of a model file, name of a built-in model, or `-` for standard input; a file with the name of a built-in
    /// model needs the prefix `./`.
    #[arg(default_value = "sia-steering")]
    pub model: PathBuf,
    /// Controller of the file to design; the one with the most motors if not given.
    #[arg(long, value_name = "NAME")]
    pub control: Option<String>,
    /// Design a controller with this law that is not in the file; channels have 20 rad/s and a damping ratio of 0.7
    /// [default: decoupling].
    #[arg(long, value_name = "LAW", conflicts_with = "control")]
    pub law: Option<String>,
    /// Inputs of that controller, separated by commas; those of `[analysis]`, or all motors, if not given.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', conflicts_with = "control")]
    pub inputs: Vec<String>,
    /// Outputs of that controller, separated by commas: signals such as `rack.phi`; those of `[analysis]` if not given.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', conflicts_with = "control")]
    pub outputs: Vec<String>,
    /// Operating point of that controller, `--at arm.phi="60 deg"` (may be given several times), as by the key `at`.
    #[arg(long, value_name = "SIGNAL=VALUE", conflicts_with = "control")]
    pub at: Vec<String>,
    /// Which feedback may decouple; as the controller says, or static, if not given.
    #[arg(long, value_enum)]
    pub feedback: Option<FeedbackKind>,
    /// Variant to design for; the first if not given.
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Print one JSON object instead of the text; `kardan schema` lists its keys.
    #[arg(long)]
    pub json: bool,
    /// Write the design as one HTML page too, as Markdown if FILE ends with `.md`; a file that exists is replaced.
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Write the designed controller as JSON for firmware, numbers to the last bit; a file that exists is replaced.
    #[arg(long, value_name = "FILE")]
    pub controller: Option<PathBuf>,
    /// Do not measure cross coupling in the nonlinear simulation.
    #[arg(long)]
    pub no_simulation: bool,
    /// Also explore other designs: interaction against torque, rate, bandwidth and sensors, and which sensor to add first.
    #[arg(long)]
    pub explore: bool,
    /// Try the design on plants within the tolerances of the file, or, with a percentage, within that part of every inertia,
    /// damping and stiffness: 1000 samples and a search for the worst corner.
    #[arg(long, value_name = "PERCENT", num_args = 0..=1, default_missing_value = "file")]
    pub tolerance: Option<String>,
    /// Also show a controller that is unstable at its sample time.
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub limits: Limits,
    #[command(flatten)]
    pub changes: Changes,
}

/// Values that replace those of the model file, and whether to wait for a new file.
#[derive(Debug, Clone, Default, Args)]
pub struct Changes {
    /// Replace a value (may be given several times): of a parameter, `beta="20 deg"`; of a key of a named table,
    /// `wg.inertia="2 kg cm^2"`; of any key by its path, `scenario.duration="2 s"`, `requirement[0].below="1 rad"`.
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Repeat whenever the model file or another input file changes, until Ctrl-C.
    #[arg(long)]
    pub watch: bool,
}

/// The name of a choice, as in a model file.
pub fn word(choice: impl ValueEnum) -> Option<String> {
    choice.to_possible_value().map(|value| value.get_name().into())
}

/// Default number of steps of a simulation.
pub const MOST_STEPS: u64 = 100_000_000;

/// When a command ends early, with partial results and exit code 2.
#[derive(Debug, Clone, Copy, Args)]
pub struct Limits {
    /// Steps of the integrator after which a simulation ends early; results until then are written.
    #[arg(long, value_name = "N", default_value_t = MOST_STEPS, value_parser = clap::value_parser!(u64).range(1..))]
    pub max_steps: u64,
    /// Time after which the command ends early, s; results until then are written [default: none].
    #[arg(long, value_name = "SECONDS", value_parser = seconds, conflicts_with = "watch")]
    pub time_limit: Option<f64>,
}

/// A number of events per hour above zero.
fn rate(text: &str) -> Result<f64, String> {
    match number(text) {
        Some(x) if x > 0.0 => Ok(x),
        _ => Err("not a number above zero: write 0.001 for one in a thousand hours".into()),
    }
}

/// A time above zero, s.
fn seconds(text: &str) -> Result<f64, String> {
    match number(text.trim().trim_end_matches('s')) {
        Some(x) if x > 0.0 => Ok(x),
        _ => Err("not a time above zero in seconds: write 60".into()),
    }
}

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

/// How outputs are decoupled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FeedbackKind {
    /// Every output by static state feedback.
    Static,
    /// Integrators before some inputs where static feedback fails.
    Dynamic,
    /// Blocks of outputs by static state feedback.
    Block,
}

/// How tables are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Comma-separated values.
    Csv,
    /// Apache Parquet, with units in the metadata.
    Parquet,
    /// MATLAB's MAT files, version 5: a variable for each signal, units beside.
    Mat,
    /// ASAM MDF 4.
    Mdf,
}

/// Print the equations of motion of a model.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "Examples:\n  kardan equations sia-steering --latex > equations.tex\n  kardan equations sia-steering --plan       the \
                  operations of one evaluation, and how many\n  kardan equations sia-steering --symbolic   in the names of the values \
                  instead of numbers"
)]
pub struct EquationsArgs {
    /// Path of a model file, name of a built-in model, or `-` for standard input.
    pub model: PathBuf,
    /// LaTeX instead of plain text.
    #[arg(long)]
    pub latex: bool,
    /// The list of operations by which a run evaluates them, with its cost.
    #[arg(long, conflicts_with_all = ["latex", "json"])]
    pub plan: bool,
    /// The names of parameters and values instead of their numbers: H, forces, input map, constraints and their torques as formulas.
    #[arg(long, conflicts_with = "plan")]
    pub symbolic: bool,
    /// Print one JSON object instead of the text; `kardan schema` lists its keys.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub changes: Changes,
}

/// Print the linear model of a variant at its operating point: A, B, C, D with names and units, for other tools.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "Examples:\n  kardan linearise sia-steering --format py > steering.py\n  kardan linearise my.toml \
                        --inputs motor --outputs rack.phi --format mat --out abcd.mat\n  kardan linearise my.toml | kardan \
                        analyze --state-space -"
)]
pub struct LineariseArgs {
    /// Path of a model file, name of a built-in model, or `-` for standard input.
    pub model: PathBuf,
    /// `json`: exact, read again by `kardan analyze --state-space`; `mat`: MATLAB; `py`: NumPy arrays and python-control.
    #[arg(long, value_enum, default_value = "json")]
    pub format: LinearFormat,
    /// Write to this file, replaced if it exists, instead of standard output.
    #[arg(long, short, value_name = "FILE", required_if_eq("format", "mat"))]
    pub out: Option<PathBuf>,
    /// Variant; the first if not given.
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Inputs, separated by commas; those of the model file, or all motors, if not given.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub inputs: Vec<String>,
    /// Outputs, separated by commas: signals such as `rack.phi`, or sensors; those of the model file if not given.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub outputs: Vec<String>,
    /// Operating point in place of `at` of `[analysis]` (may be given several times): `--at car.v="20 km/h"` in steady motion, `--at arm.phi="60 deg"` at
    /// rest, `--at t="3.2 s"` the state of the run at that time.
    #[arg(long, value_name = "SIGNAL=VALUE")]
    pub at: Vec<String>,
    /// Leave the inertia on the left side: E ẋ = A x + B u.
    #[arg(long)]
    pub descriptor: bool,
    /// Without effect: kardan eliminates motions without inertia (massless shafts) automatically.
    #[arg(long)]
    pub eliminate_massless: bool,
    /// The same as `--format json`.
    #[arg(long, conflicts_with = "format")]
    pub json: bool,
    #[command(flatten)]
    pub changes: Changes,
}

/// How a linear model is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum LinearFormat {
    /// Exact fractions, decimals beside them.
    Json,
    /// MATLAB, version 5.
    Mat,
    /// A Python program.
    Py,
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
#[path = "../tests/unit/args.rs"]
mod tests;

//! The options of the commands that analyse a model or design its control: `analyze`, `design`, `equations` and `linearise`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::shared_options::{Changes, Limits, number, seconds};

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

/// A number of events per hour above zero.
fn rate(text: &str) -> Result<f64, String> {
    match number(text) {
        Some(x) if x > 0.0 => Ok(x),
        _ => Err("not a number above zero: write 0.001 for one in a thousand hours".into()),
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

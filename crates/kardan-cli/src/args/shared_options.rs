//! Options that several commands have: replaced values, limits, how runs are integrated, how tables are written.

use clap::{Args, ValueEnum};
use kardan::simulate::Method;
use kardan::units::parse_number;

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

impl From<RunMethod> for Method {
    fn from(choice: RunMethod) -> Self {
        match choice {
            RunMethod::Automatic => Self::Automatic,
            RunMethod::Taylor => Self::Taylor,
            RunMethod::Dop853 => Self::Dop853,
            RunMethod::Radau => Self::Radau,
        }
    }
}

/// A number, written as in model files.
pub fn number(text: &str) -> Option<f64> {
    parse_number(text.trim()).ok().map(|number| number.to_f64())
}

pub(super) fn relative_tolerance(text: &str) -> Result<f64, String> {
    let number = number(text).ok_or("not a number, such as 1e-8")?;
    let from_to = kardan::study::TOLERANCES;
    match from_to.contains(&number) {
        true => Ok(number),
        false => Err(format!("from {:e} to {:e}", from_to.start(), from_to.end())),
    }
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

/// A time above zero, s.
pub(super) fn seconds(text: &str) -> Result<f64, String> {
    match number(text.trim().trim_end_matches('s')) {
        Some(x) if x > 0.0 => Ok(x),
        _ => Err("not a time above zero in seconds: write 60".into()),
    }
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

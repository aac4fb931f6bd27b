//! Control laws, one file each: from a linear model and what is asked of it to gains that a `kardan-rt` block runs.
//!
//! [`REGISTRY`] is the one list of laws; the parser of `[control.<name>]` tables, the manual and the tests read it.

mod closed_loop;
pub mod decoupling;
pub mod inversion;
mod noninteracting;
pub mod observer;
mod position_loop;
pub mod regulator;

pub use closed_loop::closed_loop_poles;
pub use noninteracting::{ChannelDesign, NoninteractingDesign, design_noninteracting};

use crate::element::Values;
use crate::num::{Matrix, Rational};
use crate::reduce::LinearModel;
use crate::results::{LawSummary, Physical};
use crate::schema::Field;

/// A designed law that can run in the loop. Measures angles and speeds of shafts, commands inputs.
pub trait Law: Send {
    /// Names of the inputs that it commands, in the order of `out` of [`Law::command`].
    fn inputs(&self) -> &[String];
    /// The signals that the scenario sets for it.
    fn references(&self) -> &[Reference];
    /// Commands in N m from the angles (rad) and speeds (rad/s) of all shafts, sorted by name, and the references.
    fn command(&mut self, angles: &[f64], speeds: &[f64], references: &[f64], out: &mut [f64]);
    /// The linear part of [`Law::command`]: gains on angles and speeds, one row per input, one column per shaft.
    fn gains(&self) -> (Matrix<f64>, Matrix<f64>);
    /// What was designed, for a reader.
    fn summary(&self) -> LawSummary;
}

/// A signal from the scenario to a law.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// Name.
    pub name: String,
    /// Angle or torque.
    pub physical: Physical,
    /// One sentence.
    pub description: String,
}

/// What a law is designed for.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// Name of the controller in the model file.
    pub name: &'a str,
    /// Its keys.
    pub values: &'a Values,
    /// The model to design on.
    pub model: &'a LinearModel,
    /// Shaft names, sorted.
    pub shafts: &'a [String],
}

/// The description of a kind of law.
#[derive(Debug, Clone, Copy)]
pub struct LawKind {
    /// The word after `law =`, and the name of the file here.
    pub keyword: &'static str,
    /// What it does, in one sentence.
    pub summary: &'static str,
    /// Its keys besides `law` and `design`.
    pub fields: &'static [Field],
    /// An example, valid TOML.
    pub example: &'static str,
    /// The inputs that the keys name.
    pub inputs: fn(&Values) -> Vec<String>,
    /// The references and load estimates that the keys introduce.
    pub references: fn(&Values) -> Vec<Reference>,
    /// The design.
    pub design: fn(&Request<'_>) -> Result<Box<dyn Law>, SynthesisError>,
}

/// All laws.
pub const REGISTRY: &[LawKind] = &[noninteracting::NONINTERACTING, position_loop::POSITION_LOOP];

/// The law with that keyword.
pub fn find(keyword: &str) -> Option<&'static LawKind> {
    REGISTRY.iter().find(|law| law.keyword == keyword)
}

/// Why a law cannot be designed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SynthesisError {
    /// An output is not the angle of a shaft.
    #[error("`{signal}` is not the angle of a shaft; a law controls an output such as `{example}`")]
    NotAnAngle {
        /// The signal.
        signal: String,
        /// One that would do.
        example: String,
    },
    /// The decoupling matrix is singular.
    #[error(
        "the outputs {} cannot be decoupled by static state feedback with the inputs {}: their accelerations depend on \
         the inputs through a matrix of rank {rank} only{}",
        list(outputs),
        list(inputs),
        unreached(not_reached)
    )]
    NotDecouplable {
        /// The outputs.
        outputs: Vec<String>,
        /// The inputs.
        inputs: Vec<String>,
        /// Exact rank of C H⁻¹ F.
        rank: usize,
        /// Outputs whose acceleration no chosen input reaches directly (relative degree above two).
        not_reached: Vec<String>,
    },
    /// The input does not act on the acceleration of the output.
    #[error("the motor `{input}` does not act on the acceleration of `{output}` (relative degree above two)")]
    NotReached {
        /// The input.
        input: String,
        /// The output.
        output: String,
    },
    /// The same input or output twice.
    #[error("`{name}` is used by two channels; every channel needs an {what} of its own")]
    Twice {
        /// The name.
        name: String,
        /// `input` or `output`.
        what: &'static str,
    },
}

fn list(names: &[String]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

fn unreached(names: &[String]) -> String {
    if names.is_empty() {
        String::new()
    } else {
        format!(" (no chosen input reaches the acceleration of {})", list(names))
    }
}

/// The shaft number behind a signal `<shaft>.phi`.
fn output_shaft(signal: &str, shafts: &[String]) -> Result<usize, SynthesisError> {
    signal.strip_suffix(".phi").and_then(|name| shafts.iter().position(|shaft| shaft == name)).ok_or_else(|| {
        SynthesisError::NotAnAngle {
            signal: signal.to_string(),
            example: format!("{}.phi", shafts.first().map_or("shaft", String::as_str)),
        }
    })
}

/// `1/(c H⁻¹ cᵀ)`: the inertia that a torque along the output feels, kg m², exact.
///
/// For the flexspline of the steering system this is J̃_fs \[diss. (6.129)\].
///
/// # Panics
/// If the inertia matrix is singular or the direction has no motion (the model checks the first before).
pub fn effective_inertia(model: &LinearModel, shaft: usize) -> Rational {
    inertia_between(model, shaft, &model.direction(shaft).transpose())
        .expect("a shaft that can move feels its own torque")
}

/// `1/(c H⁻¹ f)`: torque of an input per acceleration of an output, kg m², exact; `None` if the input does not act on it.
///
/// The effective inertia where the input acts on the output's own shaft; through a gear, that over the ratio.
///
/// # Panics
/// If the inertia matrix is singular (the model checks this before).
pub fn input_inertia(model: &LinearModel, shaft: usize, input: usize) -> Option<Rational> {
    let f = Matrix::from_fn(model.inertia.rows(), 1, |i, _| model.input[(i, input)].clone());
    inertia_between(model, shaft, &f)
}

fn inertia_between(model: &LinearModel, shaft: usize, f: &Matrix<Rational>) -> Option<Rational> {
    let x = model.inertia.solve(f).expect("reduced inertia is positive definite");
    let mobility = model.direction(shaft).multiply(&x)[(0, 0)].clone();
    (!mobility.is_zero()).then(|| Rational::ONE / mobility)
}

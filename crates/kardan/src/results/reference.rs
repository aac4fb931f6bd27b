//! What commands tell that compute nothing: equations of motion, tables of model files, built-in models.

use schemars::JsonSchema;
use serde::Serialize;

use super::ExactMatrix;

/// The reduced equations of motion of a variant, `H q'' + D q' + S q + friction = F u`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct MotionEquations {
    /// Name of the model.
    pub model: String,
    /// Reduced coordinates.
    pub coordinates: Vec<String>,
    /// Inputs.
    pub inputs: Vec<String>,
    /// Whether the matrices hold at every position, or at the initial one alone.
    pub constant: bool,
    /// The equations as text, one for each coordinate.
    pub equations: Vec<Equation>,
    /// The constraints as text.
    pub constraints: Vec<ConstraintEquation>,
    /// The matrices `H`, `D`, `S`, `F` and their exact entries.
    pub matrices: Vec<ExactMatrix>,
    /// All of it for a document.
    pub latex: String,
}

/// One equation.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct Equation {
    /// Its left-hand side.
    pub left: String,
    /// Its right-hand side.
    pub right: String,
}

/// The equation of a constraint.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct ConstraintEquation {
    /// The element that it comes from.
    pub element: String,
    /// The equation.
    pub equation: String,
}

/// A table of model files, as the manual has it.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct ManualTable {
    /// Name of its page: `harmonic_drive`.
    pub name: String,
    /// Its header: `[harmonic_drive.NAME]`.
    pub header: String,
    /// What it stands for: `element`, `law` or `study`.
    pub group: String,
    /// What it is, in one sentence.
    pub summary: String,
    /// Its keys.
    pub keys: Vec<ManualKey>,
    /// An example, valid TOML; may be empty.
    pub example: String,
}

/// A key of such a table.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct ManualKey {
    /// The key.
    pub name: String,
    /// What it holds: `kg m^2, above zero`.
    pub holds: String,
    /// Whether the table is incomplete without it.
    pub required: bool,
    /// What holds when it is left out, if that is one value.
    pub default: Option<String>,
    /// What it says.
    pub summary: String,
    /// Keys of the tables that it holds.
    pub keys: Vec<ManualKey>,
}

/// A model that is part of the program.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct BuiltinModel {
    /// Its name on the command line.
    pub name: String,
    /// One sentence.
    pub summary: String,
    /// The model file; where a list was asked for it is left out.
    pub source: Option<String>,
    /// Where it was saved.
    pub file: Option<String>,
}

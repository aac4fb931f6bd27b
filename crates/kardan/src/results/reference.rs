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
    /// The equations in the names of their values, if they are asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub symbolic: Option<SymbolicEquations>,
}

/// The reduced equations of motion in the names of their values,
/// `H q'' + velocity + D q' + stiffness + friction + held = F u + A^T lambda`; every formula as text and as LaTeX.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SymbolicEquations {
    /// Letters that stand for values of the model.
    pub values: Vec<SymbolOfValue>,
    /// Letters that stand for formulas, each behind those that it needs.
    pub intermediate_symbols: Vec<SymbolicFormula>,
    /// Functions that have no formula: curves through points.
    pub functions: Vec<SymbolicFunction>,
    /// Coordinates that follow: `cs`, its rate `cs'`, and what its acceleration is.
    pub dependent_coordinates: Vec<SymbolicFormula>,
    /// Entries of H on and below the diagonal that are not zero.
    pub inertia: Vec<SymbolicFormula>,
    /// Forces that are quadratic in speeds, and those of prescribed speeds and accelerations, by coordinate; those that are not zero, as in all
    /// lists below.
    pub velocity: Vec<SymbolicFormula>,
    /// Entries of D on and below the diagonal that are not zero.
    pub damping: Vec<SymbolicFormula>,
    /// Forces of springs by coordinate.
    pub stiffness: Vec<SymbolicFormula>,
    /// Coulomb friction by coordinate; `sgn` is set-valued at rest.
    pub friction: Vec<SymbolicFormula>,
    /// What clutches, stops, locks and teeth carry, by coordinate.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub unilateral_forces: Vec<SymbolicFormula>,
    /// On what that depends.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub contact_states: Vec<SymbolicMode>,
    /// F u by coordinate.
    pub input: Vec<SymbolicFormula>,
    /// A^T lambda by coordinate: what kept constraints do.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub multiplier_forces: Vec<SymbolicFormula>,
    /// The constraints that are kept with their multipliers.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub multiplier_constraints: Vec<SymbolicMultiplierConstraint>,
    /// What constraints prescribe as functions of time, where no formula of the time and of parameters is one of the letters.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub prescribed: Vec<SymbolicMode>,
    /// Torques among the inputs that expressions give, as they are written.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub laws: Vec<SymbolicLaw>,
    /// Multipliers of the constraints, from the motion of all coordinates.
    pub constraint_torques: Vec<SymbolicFormula>,
    /// What must not be zero.
    pub divisors: Vec<SymbolicText>,
    /// What was taken as zero because it is so for the values of the model: the equations hold only there.
    pub zeros: Vec<SymbolicText>,
    /// Parameters that are not in the equations because their value is zero.
    pub zero_parameters: Vec<String>,
    /// Motors whose ripple acts beside their torque, and is not in the equations.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub ripples: Vec<String>,
}

/// A constraint that is kept with its multiplier.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct SymbolicMultiplierConstraint {
    /// The element.
    pub element: String,
    /// Its multiplier.
    pub multiplier: SymbolicText,
    /// What is zero at all times, of a relation of positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<SymbolicText>,
    /// Its row of A over the coordinates, what is not zero.
    pub row: Vec<SymbolicFormula>,
    /// `A q' = b`, left and right side; nothing where accelerations alone are prescribed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rates: Option<SymbolicFormula>,
    /// `A q'' = b' - A' q'`
    pub accelerations: SymbolicFormula,
}

/// What something is, in words.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct SymbolicMode {
    /// As it stands in the formulas.
    pub symbol: SymbolicText,
    /// The element.
    pub element: String,
    /// What it is.
    pub description: String,
}

/// A torque that an expression gives.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct SymbolicLaw {
    /// The element.
    pub element: String,
    /// Its law as it is written in the model.
    pub law: String,
}

/// A letter for a value of the model.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SymbolOfValue {
    /// As it is written in the formulas.
    pub symbol: SymbolicText,
    /// The parameter or key that it is.
    pub name: String,
    /// How it follows from other parameters, if it does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub derived_from: Option<String>,
    /// Its value.
    pub value: f64,
    /// Its SI unit.
    pub unit: String,
}

/// A function without a formula.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct SymbolicFunction {
    /// As it is written in the formulas; its derivatives have `'` and `''`.
    pub symbol: SymbolicText,
    /// The element whose curve it is.
    pub element: String,
}

/// A formula for one thing.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct SymbolicFormula {
    /// What it is a formula for.
    pub symbol: SymbolicText,
    /// The formula.
    pub formula: SymbolicText,
}

/// A letter or a formula in both ways of writing.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct SymbolicText {
    /// As expressions of a model file.
    pub text: String,
    /// For a document.
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
    pub value_type: String,
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
    /// How the mechanism looks, in lines of text; left out where there is none.
    pub sketch: Option<String>,
    /// The model file; where a list was asked for it is left out.
    pub source: Option<String>,
    /// Where it was saved.
    pub file: Option<String>,
}

//! Results of commands that compute nothing: equations of motion, tables of model files, built-in models.

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
    /// Whether the matrices are valid at every position, or only at the initial one.
    pub constant: bool,
    /// The equations as text, one for each coordinate.
    pub equations: Vec<Equation>,
    /// The constraints as text.
    pub constraints: Vec<ConstraintEquation>,
    /// The matrices `H`, `D`, `S`, `F` and their exact entries.
    pub matrices: Vec<ExactMatrix>,
    /// All of it for a document.
    pub latex: String,
    /// The equations in the names of their values, if requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub symbolic: Option<SymbolicEquations>,
}

/// The reduced equations of motion in the names of their values,
/// `H q'' + velocity + D q' + stiffness + friction + held = F u + A^T lambda`; every formula as text and as LaTeX.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SymbolicEquations {
    /// Symbols of values of the model.
    pub values: Vec<SymbolOfValue>,
    /// Symbols of formulas, each after those that it needs.
    pub intermediate_symbols: Vec<SymbolicFormula>,
    /// Functions that have no formula: curves through points.
    pub functions: Vec<SymbolicFunction>,
    /// Dependent coordinates: `cs`, its rate `cs'`, and its acceleration.
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
    /// Forces of clutches, stops, locks and gears, by coordinate.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub unilateral_forces: Vec<SymbolicFormula>,
    /// Its arguments.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub contact_states: Vec<SymbolicMode>,
    /// F u by coordinate.
    pub input: Vec<SymbolicFormula>,
    /// A^T lambda by coordinate: the forces of constraints enforced by multipliers.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub multiplier_forces: Vec<SymbolicFormula>,
    /// The constraints enforced by multipliers.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub multiplier_constraints: Vec<SymbolicMultiplierConstraint>,
    /// Prescribed functions of time of constraints, if they are not a symbol for a formula of the time and of parameters.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub prescribed: Vec<SymbolicMode>,
    /// Torques among the inputs that expressions define, with their source text.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub laws: Vec<SymbolicLaw>,
    /// Multipliers of the constraints, from the motion of all coordinates.
    pub constraint_torques: Vec<SymbolicFormula>,
    /// Expressions that must not be zero.
    pub divisors: Vec<SymbolicText>,
    /// Expressions assumed zero because they are zero for the values of the model: the equations are valid only there.
    pub zeros: Vec<SymbolicText>,
    /// Parameters that are not in the equations because their value is zero.
    pub zero_parameters: Vec<String>,
    /// Motors whose ripple acts in addition to their torque, and is not in the equations.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub ripples: Vec<String>,
}

/// A constraint enforced by its multiplier.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct SymbolicMultiplierConstraint {
    /// The element.
    pub element: String,
    /// Its multiplier.
    pub multiplier: SymbolicText,
    /// The expression that is always zero, of a relation of positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<SymbolicText>,
    /// Its row of A over the coordinates, nonzero entries.
    pub row: Vec<SymbolicFormula>,
    /// `A q' = b`, left and right side; `null` if only accelerations are prescribed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rates: Option<SymbolicFormula>,
    /// `A q'' = b' - A' q'`
    pub accelerations: SymbolicFormula,
}

/// A symbol with its description.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct SymbolicMode {
    /// Its symbol in the formulas.
    pub symbol: SymbolicText,
    /// The element.
    pub element: String,
    /// What it is.
    pub description: String,
}

/// A torque from an expression.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct SymbolicLaw {
    /// The element.
    pub element: String,
    /// Its law, as source text of the model.
    pub law: String,
}

/// A symbol for a value of the model.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SymbolOfValue {
    /// Its symbol in the formulas.
    pub symbol: SymbolicText,
    /// Its parameter or key.
    pub name: String,
    /// Its expression of other parameters, if it has one.
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
    /// Its symbol in the formulas; its derivatives have `'` and `''`.
    pub symbol: SymbolicText,
    /// The element whose curve it is.
    pub element: String,
}

/// A formula for one quantity.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct SymbolicFormula {
    /// Its quantity.
    pub symbol: SymbolicText,
    /// The formula.
    pub formula: SymbolicText,
}

/// A symbol or a formula in both notations.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct SymbolicText {
    /// In the syntax of model files.
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

/// A table of model files, as in the manual.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct ManualTable {
    /// Name of its page: `harmonic_drive`.
    pub name: String,
    /// Its header: `[harmonic_drive.NAME]`.
    pub header: String,
    /// Its group: `element`, `law` or `study`.
    pub group: String,
    /// Summary in one sentence.
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
    /// Its values: `kg m^2, above zero`.
    pub value_type: String,
    /// Whether it is required.
    pub required: bool,
    /// Its default, if that is one value.
    pub default: Option<String>,
    /// Its help.
    pub summary: String,
    /// Keys of the tables in it.
    pub keys: Vec<ManualKey>,
}

/// A model that is part of the program.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct BuiltinModel {
    /// Its name on the command line.
    pub name: String,
    /// One sentence.
    pub summary: String,
    /// A sketch of the mechanism as lines of text; omitted if there is none.
    pub sketch: Option<String>,
    /// The model file; omitted in a list.
    pub source: Option<String>,
    /// Where it was saved.
    pub file: Option<String>,
}

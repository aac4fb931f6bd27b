//! The output of commands that compute nothing, as JSON objects.

use schemars::JsonSchema;
use serde::Serialize;

use super::json::{Place, places};
use super::printed::printed;
use kardan_results::{BuiltinModel, ManualTable, MotionEquations, SignalNode};
use kardan_schema::diagnostics::Diagnostic;

/// A model file without errors.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Check")]
pub(super) struct CheckView<'a> {
    /// The model file.
    file: &'a str,
    /// Blocks, formulas of signals and laws that are programs, in the order in which they compute; of the first variant.
    signals: &'a [SignalNode],
    /// Warnings of the model file.
    warnings: Vec<Place<'a>>,
}

/// The equations of motion of the first variant.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Equations")]
pub(super) struct EquationsView<'a> {
    #[serde(flatten)]
    equations: &'a MotionEquations,
    /// Warnings of the model file.
    warnings: Vec<Place<'a>>,
}

/// The built-in models.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Models")]
pub(super) struct ModelsView<'a> {
    /// All of them, or the requested one.
    models: &'a [BuiltinModel],
}

/// The tables of a model file.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Elements")]
pub(super) struct ElementsView<'a> {
    /// All of them, or the requested one.
    tables: &'a [ManualTable],
}

/// A completion script.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Completions")]
pub(super) struct CompletionsView<'a> {
    /// The shell.
    shell: &'a str,
    /// The script.
    script: &'a str,
}

/// Gives the blocks and the warnings of a model file without errors as one JSON object on one line.
pub fn check_json(checked: &str, source: &str, signals: &[SignalNode], warnings: &[Diagnostic]) -> String {
    printed(CheckView { file: checked, signals, warnings: places(source, warnings) })
}

/// Gives the equations of motion as one JSON object on one line.
pub fn equations_json(equations: &MotionEquations, source: &str, warnings: &[Diagnostic]) -> String {
    printed(EquationsView { equations, warnings: places(source, warnings) })
}

/// Gives built-in models as one JSON object on one line.
pub fn models_json(models: &[BuiltinModel]) -> String {
    printed(ModelsView { models })
}

/// Gives tables of the manual as one JSON object on one line.
pub fn elements_json(tables: &[ManualTable]) -> String {
    printed(ElementsView { tables })
}

/// Gives a completion script as one JSON object on one line.
pub fn completions_json(shell: &str, script: &str) -> String {
    printed(CompletionsView { shell, script })
}

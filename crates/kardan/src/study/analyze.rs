//! What `kardan analyze` asks for.

use crate::diagnostics::Diagnostic;
use crate::results::Analysis;

use super::Progress;

/// What to analyse and how, beyond what the model file says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AnalyzeSettings {
    /// Variant to analyse; `None`: the first.
    pub variant: Option<String>,
    /// Inputs; empty: those of `[analysis]`, else all motors.
    pub inputs: Vec<String>,
    /// Outputs (signals such as `rk.phi`, or sensors); empty: those of `[analysis]`, else all sensors, else the outputs
    /// that the laws control, else the angles of all coordinates.
    pub outputs: Vec<String>,
    /// Prove every answer over the rationals instead of stating a failure probability.
    pub certify: bool,
    /// Eliminate motions without inertia instead of refusing them.
    pub eliminate_massless: bool,
}

/// Analyses a model file.
///
/// # Errors
/// All mistakes of the file, or why it cannot be analysed.
pub fn analyze(
    source: &str,
    _settings: &AnalyzeSettings,
    _progress: &dyn Progress,
) -> Result<Analysis, Vec<Diagnostic>> {
    let (prepared, diagnostics) = super::prepare(source);
    let Some(variant) = prepared.variants.first() else { return Err(diagnostics) };
    Ok(Analysis {
        name: prepared.name.clone(),
        description: prepared.description.clone(),
        coordinates: variant.reduced.coordinate_names(),
        ..Analysis::default()
    })
}

/// Analyses a plain state space `x' = A x + B u`, `y = C x + D u`; `bytes` is the file as it is.
///
/// # Errors
/// All mistakes of the file, or why it cannot be analysed.
pub fn analyze_state_space(
    _bytes: &[u8],
    _settings: &AnalyzeSettings,
    _progress: &dyn Progress,
) -> Result<Analysis, Vec<Diagnostic>> {
    Ok(Analysis::default())
}

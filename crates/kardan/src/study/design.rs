//! The design of one controller, from what a model file or a caller asks for.

use super::Progress;
use crate::diagnostics::Diagnostic;
use crate::results::Design;

/// Which controller is designed and how.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DesignSettings {
    /// Controller of the model file; `None`: the only one, or the first.
    pub control: Option<String>,
    /// Law of a controller that is not in the file; with it go `inputs` and `outputs`.
    pub law: Option<String>,
    /// Inputs of that controller.
    pub inputs: Vec<String>,
    /// Outputs of that controller.
    pub outputs: Vec<String>,
    /// `static`, `dynamic` or `block`; `None`: as the controller says.
    pub feedback: Option<String>,
    /// Variant to design for; `None`: the first.
    pub variant: Option<String>,
    /// Whether cross coupling is measured in the nonlinear simulation.
    pub simulate: bool,
}

/// Designs one controller, proves what it does to the linear loop, and measures what it does to the nonlinear one.
///
/// # Errors
/// All mistakes of the file and of the settings.
pub fn design(_source: &str, _settings: &DesignSettings, _progress: &dyn Progress) -> Result<Design, Vec<Diagnostic>> {
    Err(vec![Diagnostic::error("design::not-yet", "controllers cannot be designed on their own yet")])
}

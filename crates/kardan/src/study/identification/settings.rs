//! Settings of an identification.

use std::sync::Arc;

use kardan_tables::read::Bytes;

/// A log to be read.
pub struct LogFile {
    /// Its name.
    pub name: String,
    /// Its content.
    pub bytes: Arc<dyn Bytes>,
}

/// Settings of an identification; omitted ones come from the model file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct IdentifySettings {
    /// Variant of the model; the first if not given.
    pub variant: Option<String>,
    /// The parameters to identify.
    pub parameters: Vec<String>,
    /// `steady` or `dynamic`.
    pub method: Option<String>,
    /// Width of the windows, s.
    pub window: Option<f64>,
    /// `squares`, `huber` or `bisquare`.
    pub loss: Option<String>,
    /// Confidence of the intervals.
    pub confidence: Option<f64>,
    /// Whether candidates are compared.
    pub compare: bool,
    /// Whether to try terms that the residuals suggest.
    pub suggest: bool,
}

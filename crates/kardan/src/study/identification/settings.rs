//! How parameters are identified.

use std::sync::Arc;

use kardan_tables::read::Bytes;

/// A log to be read.
pub struct LogFile {
    /// What to call it.
    pub name: String,
    /// What is in it.
    pub bytes: Arc<dyn Bytes>,
}

/// How parameters are identified; what is left out is as the model file says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct IdentifySettings {
    /// Variant of the model; the first if not given.
    pub variant: Option<String>,
    /// What is to be found.
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
    /// Whether terms that what is left over asks for are tried.
    pub suggest: bool,
}

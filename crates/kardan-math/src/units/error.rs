//! Errors in the text of a quantity.

use std::ops::Range;

/// An error in the text of a quantity.
///
/// ```
/// use kardan_math::units::parse_quantity;
/// let diagnostic = parse_quantity("130 kq mm^2").unwrap_err();
/// assert_eq!(diagnostic.to_string(), "unknown unit `kq`");
/// assert_eq!((diagnostic.code, diagnostic.span), ("unit::unknown", 4..6));
/// assert_eq!(diagnostic.help.as_deref(), Some("did you mean `kg`?"));
/// ```
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct UnitError {
    /// `unit::unknown`, `unit::syntax`, `number::syntax`, `number::not-finite` or `number::range`; of a tolerance also
    /// `unit::dimension`, `tolerance::syntax` or `tolerance::bounds`.
    pub code: &'static str,
    /// Byte range within the text.
    pub span: Range<usize>,
    /// The error and its reason.
    pub message: String,
    /// The remedy.
    pub help: Option<String>,
}

impl UnitError {
    pub(super) fn new(code: &'static str, span: Range<usize>, message: impl Into<String>) -> Self {
        Self { code, span, message: message.into(), help: None }
    }

    pub(super) fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

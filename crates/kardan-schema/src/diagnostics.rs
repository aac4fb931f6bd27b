//! Errors and warnings in a user's file: each with its place, its reason and a remedy.
//!
//! Data only. The library never prints; the command line renders a [`Diagnostic`] with the source text underneath.

use std::fmt;

use crate::entries::Place;
pub use kardan_math::names::{bidi_escaped, nearest, quoted, shortened};
use kardan_math::units::{Dimension, UnitError};

/// How serious a [`Diagnostic`] is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The model is usable, but its author should check this.
    Warning,
    /// The model cannot be used.
    Error,
}

impl Severity {
    /// The word in messages.
    fn word(self) -> &'static str {
        match self {
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// A place in the model with a label.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Label {
    /// Where: in the source text, or the path of an entry.
    pub place: Place,
    /// The label.
    pub text: String,
}

/// One error or warning in a model file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// A stable code such as `unit::dimension`, for searching the manual.
    pub code: &'static str,
    /// The error and its reason, in one sentence.
    pub message: String,
    /// Where; empty if the error concerns the whole file.
    pub labels: Vec<Label>,
    /// The remedy.
    pub help: Option<String>,
}

impl Diagnostic {
    /// An error without a place yet.
    pub fn error(code: &'static str, message: impl Into<String>) -> Self {
        Self { severity: Severity::Error, code, message: message.into(), labels: Vec::new(), help: None }
    }

    /// A warning without a place yet.
    pub fn warning(code: &'static str, message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::error(code, message) }
    }

    /// The error of a quantity or an expression that was read from a text, with the remedy that it knows.
    pub fn of_unit_error(what: &str, error: UnitError, text: &str, place: &Place) -> Self {
        let at = place.part(text, error.span);
        let diagnostic = Self::error(error.code, format!("{what}: {}", error.message)).at(at, "");
        Self { help: error.help, ..diagnostic }
    }

    /// The error of a quantity of another dimension than expected; the remedy is another unit.
    pub fn wrong_dimension(what: &str, [expected, found]: [Dimension; 2], place: impl Into<Place>) -> Self {
        let message = format!("{what}: expected {}, found {}", expected.noun(), found.noun());
        let help = format!("write a unit such as {}", expected.example());
        Self::error("unit::dimension", message).at(place, found.noun()).help(help)
    }

    /// The error of a name that nothing has; the remedy lists what there is.
    pub fn no_such(what: &str, noun: &str, name: &str, place: impl Into<Place>) -> Self {
        let message = format!("{what}: there is no {noun} `{}`", shortened(name));
        Self::error("name::unknown", message).at(place, format!("no such {noun}"))
    }

    /// The error of something that is given a second time.
    pub fn duplicate(
        code: &'static str,
        message: impl Into<String>,
        again: impl Into<Place>,
        first: impl Into<Place>,
    ) -> Self {
        Self::error(code, message).at(again, "again here").at(first, "first here")
    }

    /// Whether it is an error, which no run may follow.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }

    /// Adds a place and its label.
    pub fn at(mut self, place: impl Into<Place>, text: impl Into<String>) -> Self {
        self.labels.push(Label { place: place.into(), text: text.into() });
        self
    }

    /// Adds a place and its label if there is one.
    pub fn at_optional(self, place: Option<impl Into<Place>>, text: impl Into<String>) -> Self {
        match place {
            Some(place) => self.at(place, text),
            None => self,
        }
    }

    /// Sets the remedy.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// Several places at once.
impl Diagnostic {
    /// Adds places with one label.
    pub fn at_each(self, places: impl IntoIterator<Item: Into<Place>>, text: &str) -> Self {
        places.into_iter().fold(self, |diagnostic, place| diagnostic.at(place, text))
    }
}

/// One error, where all are expected.
impl From<Diagnostic> for Vec<Diagnostic> {
    fn from(one: Diagnostic) -> Self {
        vec![one]
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}[{}]: {}", self.severity.word(), self.code, self.message)?;
        if let Some(path) = self.labels.first().and_then(|label| label.place.path()) {
            write!(f, " (at `{path}`)")?;
        }
        if let Some(help) = &self.help {
            write!(f, " ({help})")?;
        }
        Ok(())
    }
}

/// Renders diagnostics as plain text with line and column, or the path, of every place, for logs and tests.
///
/// ```
/// use kardan_schema::diagnostics::{Diagnostic, plain};
/// let diagnostic = Diagnostic::error("unit::unknown", "unknown unit `kq`").at(4..6, "here").help("did you mean `kg`?");
/// assert_eq!(plain("x = kq", &[diagnostic]), "error[unit::unknown] 1:5: unknown unit `kq` | here | help: did you mean `kg`?\n");
/// ```
pub fn plain(source: &str, diagnostics: &[Diagnostic]) -> String {
    let mut out = String::new();
    let lines = Lines::new(source);
    for d in diagnostics {
        out.push_str(&format!("{}[{}]", d.severity.word(), d.code));
        if let Some(label) = d.labels.first() {
            match &label.place {
                Place::Text(span) => {
                    let (line, column) = lines.line_column(source, span.start);
                    out.push_str(&format!(" {line}:{column}"));
                }
                Place::Path(path) => out.push_str(&format!(" {path}")),
            }
        }
        out.push_str(&format!(": {}", d.message));
        for label in &d.labels {
            if !label.text.is_empty() {
                out.push_str(&format!(" | {}", label.text));
            }
        }
        if let Some(help) = &d.help {
            out.push_str(&format!(" | help: {help}"));
        }
        out.push('\n');
    }
    out
}

/// Where the lines of a text begin, found in one pass: a place is then located without reading the text from its start again,
/// however many places there are and however long the lines.
///
/// ```
/// use kardan_schema::diagnostics::Lines;
/// let text = "a = 1\nβ = 2\n";
/// let lines = Lines::new(text);
/// assert_eq!(lines.line_column(text, 9), (2, 3));
/// assert_eq!((lines.line(9), lines.start(1), lines.start(99)), (1, 6, text.len()));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lines {
    /// Offsets of the first byte of each line.
    starts: Vec<usize>,
    /// Characters before every [`EVERY`]th byte.
    characters: Vec<usize>,
    /// Bytes of the text.
    length: usize,
}

/// Bytes between two counts of characters.
const EVERY: usize = 256;

impl Lines {
    /// The lines of a text.
    pub fn new(text: &str) -> Self {
        let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(at, _)| at + 1);
        let mut count = 0;
        let characters = text.as_bytes().chunks(EVERY).map(|part| {
            let before = count;
            count += beginnings(part);
            before
        });
        Self { characters: characters.collect(), starts: std::iter::once(0).chain(ends).collect(), length: text.len() }
    }

    /// The line (from 0) of a byte offset.
    pub fn line(&self, offset: usize) -> usize {
        self.starts.partition_point(|start| *start <= offset) - 1
    }

    /// The offset of the first byte of a line (from 0); that of the end after the last line.
    pub fn start(&self, line: usize) -> usize {
        self.starts.get(line).map_or(self.length, |start| *start)
    }

    /// Line and column (both from 1, columns in characters) of a byte offset in the text that these are the lines of.
    pub fn line_column(&self, text: &str, offset: usize) -> (usize, usize) {
        let offset = text.floor_char_boundary(offset);
        let line = self.line(offset);
        let before = |offset: usize| {
            let mark = (offset / EVERY).min(self.characters.len().saturating_sub(1));
            let counted = self.characters.get(mark).map_or(0, |count| *count);
            counted + text.as_bytes().get(mark * EVERY..offset).map_or(0, beginnings)
        };
        (line + 1, before(offset) - before(self.start(line)) + 1)
    }
}

/// How many characters begin in some bytes of UTF-8.
fn beginnings(bytes: &[u8]) -> usize {
    bytes.iter().filter(|byte| **byte & 0xC0 != 0x80).count()
}

#[cfg(test)]
#[path = "../tests/unit/diagnostics.rs"]
mod tests;

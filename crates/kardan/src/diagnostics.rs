//! What is wrong with a user's file: every mistake with its place, its reason and what to do about it.
//!
//! Data only. The library never prints; the command line renders a [`Diagnostic`] with the source text underneath.

use std::fmt;
use std::ops::Range;

/// How serious a [`Diagnostic`] is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The model is used, but its author should look here.
    Warning,
    /// The model cannot be used.
    Error,
}

/// A place in the source text with a few words beneath it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Label {
    /// Byte range in the source text.
    pub span: Range<usize>,
    /// What is to be seen there.
    pub text: String,
}

/// One mistake (or one warning) in a model file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// A stable code such as `unit::dimension`, for searching the manual.
    pub code: &'static str,
    /// What is wrong and why, in one sentence.
    pub message: String,
    /// Where; empty if the mistake is the file as a whole.
    pub labels: Vec<Label>,
    /// What to do.
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

    /// Adds a place and the words beneath it.
    pub fn at(mut self, span: Range<usize>, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: text.into() });
        self
    }

    /// Says what to do.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let severity = match self.severity {
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        write!(f, "{severity}[{}]: {}", self.code, self.message)?;
        if let Some(help) = &self.help {
            write!(f, " ({help})")?;
        }
        Ok(())
    }
}

/// Renders diagnostics as plain text with line and column of every place, for logs and tests.
///
/// ```
/// use kardan::diagnostics::{Diagnostic, plain};
/// let mistake = Diagnostic::error("unit::unknown", "unknown unit `kq`").at(4..6, "here").help("did you mean `kg`?");
/// assert_eq!(plain("x = kq", &[mistake]), "error[unit::unknown] 1:5: unknown unit `kq` | here | help: did you mean `kg`?\n");
/// ```
pub fn plain(source: &str, diagnostics: &[Diagnostic]) -> String {
    let mut out = String::new();
    for d in diagnostics {
        let severity = match d.severity {
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        out.push_str(&format!("{severity}[{}]", d.code));
        if let Some(label) = d.labels.first() {
            let (line, column) = line_column(source, label.span.start);
            out.push_str(&format!(" {line}:{column}"));
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

/// Line and column (both from 1, columns in characters) of a byte offset.
pub fn line_column(source: &str, offset: usize) -> (usize, usize) {
    let mut offset = offset.min(source.len());
    while !source.is_char_boundary(offset) {
        offset -= 1;
    }
    let before = &source[..offset];
    let line_start = before.rfind('\n').map_or(0, |at| at + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

/// The candidate nearest to a misspelt word, if one is near enough to be meant.
///
/// Letters are compared without regard to case; a single letter has no other letter near it. Among equally near
/// candidates the one with the same letters in upper and lower case wins, then the one with the same first letter.
///
/// ```
/// use kardan::diagnostics::nearest;
/// assert_eq!(nearest("inerta", ["damping", "inertia"]), Some("inertia"));
/// assert_eq!(nearest("q", ["a", "b"]), None);
/// assert_eq!(nearest("Q", ["a", "q"]), Some("q"));
/// ```
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    const LONGEST: usize = 100; // the distance takes the product of both lengths
    let length = word.chars().count();
    if length > LONGEST {
        return None;
    }
    let tolerance = if length < 2 { 0 } else { 1 + length / 3 };
    let lower = word.to_lowercase();
    candidates
        .into_iter()
        .filter(|candidate| candidate.len() <= 4 * LONGEST)
        .map(|candidate| (strsim::damerau_levenshtein(&lower, &candidate.to_lowercase()), candidate))
        .filter(|(distance, _)| *distance <= tolerance && (*distance < length || *distance == 0))
        .min_by_key(|(distance, candidate)| {
            let exact = strsim::damerau_levenshtein(word, candidate);
            (*distance, exact, candidate.chars().next() != word.chars().next(), candidate.len())
        })
        .map(|(_, candidate)| candidate)
}

/// Names in backquotes for a sentence, at most a dozen of them: `` `a`, `b` and 3 more ``.
pub(crate) fn quoted<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    const MOST: usize = 12;
    let names: Vec<String> = names.into_iter().map(|name| format!("`{}`", shortened(name))).collect();
    match names.len() {
        0..=MOST => names.join(", "),
        count => format!("{} and {} more", names[..MOST].join(", "), count - MOST),
    }
}

/// A text of the file inside a message: cut off if it is long.
pub(crate) fn shortened(text: &str) -> String {
    const MOST: usize = 60;
    if text.chars().count() <= MOST {
        return text.to_string();
    }
    text.chars().take(MOST).chain(['…']).collect()
}

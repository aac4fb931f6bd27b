//! Diagnostics as text for a reader: all of them with the source underneath, then how many there are.

use std::fmt::Write as _;
use std::io::{IsTerminal, Write as _};
use std::sync::Arc;

use kardan::diagnostics::{Diagnostic, Label, Lines, Severity, bidi_escaped};
use miette::{
    GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteDiagnostic, MietteError, MietteSpanContents, SourceCode,
    SourceSpan, SpanContents,
};

use crate::source::Source;

/// Lines longer than this many bytes are not shown.
const LONG: usize = 400;

/// Why a command gave up.
#[derive(Debug)]
pub struct Failure {
    /// The model file, if the diagnostics are about its text.
    pub source: Option<Source>,
    pub diagnostics: Vec<Diagnostic>,
}

impl From<Diagnostic> for Failure {
    fn from(diagnostic: Diagnostic) -> Self {
        Self { source: None, diagnostics: vec![diagnostic] }
    }
}

impl Failure {
    /// Of a model whose diagnostics `shown` the user has seen: errors, and warnings that are new.
    pub fn beside(source: Source, mut diagnostics: Vec<Diagnostic>, shown: &[Diagnostic]) -> Self {
        diagnostics.retain(|d| d.severity == Severity::Error || !shown.contains(d));
        Self { source: Some(source), diagnostics }
    }

    /// The text that the places of the diagnostics refer to.
    pub fn text(&self) -> &str {
        self.source.as_ref().map_or("", |source| &source.text)
    }

    /// The whole failure in one sentence.
    pub fn message(&self) -> String {
        let mut errors = self.diagnostics.iter().filter(|d| d.severity == Severity::Error);
        match (errors.next(), errors.next(), &self.source) {
            (Some(only), None, _) => only.message.clone(),
            (_, _, Some(source)) => count(&self.diagnostics, source),
            _ => "several errors".into(),
        }
    }

    /// Prints it on standard error.
    pub fn show(&self) {
        show(self.source.as_ref(), &self.diagnostics);
    }
}

/// Prints diagnostics on standard error; those about a model file end with a line that counts them.
pub fn show(source: Option<&Source>, diagnostics: &[Diagnostic]) {
    if diagnostics.is_empty() {
        return;
    }
    let mut text = String::new();
    let handler = handler();
    let shared = source.map(|source| Arc::new(Shown::new(&source.name, &source.text)));
    for diagnostic in diagnostics {
        render(&mut text, &handler, diagnostic, shared.as_ref());
    }
    if let Some(source) = source {
        let _ = writeln!(text, "{}", count(diagnostics, source));
    }
    stderr(&text);
}

/// A note on standard error.
pub fn note(text: &str) {
    stderr(&format!("note: {}\n", visible(text)));
}

/// Writes to standard error; a failure cannot be reported.
pub fn stderr(text: &str) {
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}

/// The text of a message: control characters (terminal escapes) replaced, those of direction as escapes.
pub fn visible(text: &str) -> String {
    replaced(&bidi_escaped(text), |c| c.is_control())
}

/// The text of a source, with both replaced: every byte offset stays what it was.
fn aligned(text: &str) -> String {
    replaced(text, |c| c.is_control() || bidi_escaped(c.encode_utf8(&mut [0; 4])).len() > c.len_utf8())
}

fn replaced(text: &str, is_hidden: impl Fn(char) -> bool) -> String {
    let hidden = |c: char| is_hidden(c) && !matches!(c, '\n' | '\r' | '\t');
    if !text.contains(hidden) {
        return text.to_owned();
    }
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if hidden(c) { out.extend(std::iter::repeat_n('?', c.len_utf8())) } else { out.push(c) }
    }
    out
}

/// Whether a terminal understands more than text.
pub fn obeys() -> bool {
    std::env::var_os("TERM").is_none_or(|kind| kind != "dumb")
}

fn handler() -> GraphicalReportHandler {
    let colours =
        std::io::stderr().is_terminal() && obeys() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
    let theme = if colours { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
    let width = terminal_size::terminal_size_of(std::io::stderr()).map_or(100, |(width, _)| usize::from(width.0));
    GraphicalReportHandler::new_themed(theme)
        .with_width(width.clamp(40, 120))
        .with_links(false)
        .with_break_words(false)
        .with_word_splitter(textwrap::WordSplitter::NoHyphenation)
}

fn count(diagnostics: &[Diagnostic], source: &Source) -> String {
    let errors = diagnostics.iter().filter(|d| d.severity == Severity::Error).count();
    let warnings = diagnostics.len() - errors;
    let some = |n: usize, word: &str| match n {
        0 => None,
        1 => Some(format!("1 {word}")),
        _ => Some(format!("{n} {word}s")),
    };
    let parts: Vec<String> = [some(errors, "error"), some(warnings, "warning")].into_iter().flatten().collect();
    format!("{} in {}", parts.join(" and "), visible(&source.to_string()))
}

/// A source text as the reader sees it, with an index of its lines: the cost of a diagnostic depends only on its shown lines, not on its position.
#[derive(Debug)]
struct Shown {
    name: String,
    text: String,
    lines: Lines,
}

impl Shown {
    fn new(name: &str, text: &str) -> Self {
        let text = aligned(text);
        Self { name: visible(name), lines: Lines::new(&text), text }
    }
}

impl SourceCode for Shown {
    /// As miette reads a text, but only the lines around the span instead of all from the start.
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let Self { name, text, lines } = self;
        // A line more on either side, so that the window ends where the text would go on.
        let first = lines.line(span.offset()).saturating_sub(before + 1);
        let (from, to) = (lines.start(first), lines.start(lines.line(span.offset() + span.len()) + after + 2));
        let window = text.get(from..to).ok_or(MietteError::OutOfBounds)?;
        let inside = SourceSpan::from((span.offset() - from, span.len()));
        let found = window.read_span(&inside, before, after)?;
        let place = SourceSpan::from((found.span().offset() + from, found.span().len()));
        let data = &text.as_bytes()[place.offset()..place.offset() + place.len()];
        let count = data.iter().filter(|byte| **byte == b'\n').count();
        let (line, column) = (found.line() + first, found.column());
        Ok(Box::new(MietteSpanContents::new_named(name.clone(), data, place, line, column, count)))
    }
}

fn render(out: &mut String, handler: &GraphicalReportHandler, diagnostic: &Diagnostic, source: Option<&Arc<Shown>>) {
    let severity = match diagnostic.severity {
        Severity::Error => miette::Severity::Error,
        Severity::Warning => miette::Severity::Warning,
    };
    let mut shown =
        MietteDiagnostic::new(visible(&diagnostic.message)).with_code(diagnostic.code).with_severity(severity);
    if let Some(help) = &diagnostic.help {
        shown = shown.with_help(visible(help));
    }
    // Values that the command set in the model are in no line of the file.
    let (added, in_source): (Vec<&Label>, Vec<&Label>) =
        diagnostic.labels.iter().partition(|label| label.place.path().is_some());
    if let Some(path) = added.first().and_then(|label| label.place.path()) {
        shown.message = format!("{} (at `{}`)", shown.message, visible(path));
    }
    let report = match source {
        Some(shown_source) if !in_source.is_empty() => {
            let Shown { name, text, lines } = &**shown_source;
            let labels: Vec<LabeledSpan> = in_source
                .iter()
                .map(|label| {
                    let (start, end) = clamp(text, label.place.start(), label.place.span().end);
                    LabeledSpan::new((!label.text.is_empty()).then(|| visible(&label.text)), start, end - start)
                })
                .collect();
            if labels.iter().any(|label| unreadable(lines, label)) {
                let (line, column) = lines.line_column(text, labels[0].offset());
                shown.message = format!("{name}:{line}:{column}: {}", shown.message);
                miette::Report::new(shown)
            } else {
                miette::Report::new(shown.with_labels(labels)).with_source_code(Arc::clone(shown_source))
            }
        }
        _ => miette::Report::new(shown),
    };
    let start = out.len();
    if handler.render_report(out, report.as_ref()).is_err() {
        out.truncate(start);
        let _ = writeln!(out, "{}", visible(&diagnostic.to_string()));
    }
    out.push('\n');
}

/// A span inside the text, on character boundaries and of a few lines at most.
fn clamp(text: &str, start: usize, end: usize) -> (usize, usize) {
    let start = text.floor_char_boundary(start);
    let end = text.floor_char_boundary(end).max(start);
    let inside = &text[start..end];
    match inside.find('\n') {
        Some(first) if inside.matches('\n').count() > 12 => (start, start + first),
        _ => (start, end),
    }
}

/// Whether a line that would be shown for this label is too long for a reader.
fn unreadable(lines: &Lines, label: &LabeledSpan) -> bool {
    let (first, last) = (lines.line(label.offset()), lines.line(label.offset() + label.len()));
    (first.saturating_sub(1)..=last + 1).any(|line| lines.start(line + 1) - lines.start(line) > LONG)
}

#[cfg(test)]
#[path = "../tests/unit/render.rs"]
mod tests;

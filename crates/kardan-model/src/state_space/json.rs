//! A system in JSON.

use std::collections::BTreeMap;
use std::ops::Range;

use serde_json::value::RawValue;

use super::parsed::{
    LastDigits, MATRICES, MAX_REPORTED, MOST, NAMES, ParsedMatrix, ParsedNames, ParsedSystem, SAMPLE_TIMES, discrete,
    more, sampled,
};
use super::system::StateSpace;
use kardan_math::names::did_you_mean;
use kardan_math::num::{Matrix, Rational};
use kardan_math::units::parse_number;
use kardan_schema::diagnostics::{Diagnostic, Lines, nearest, quoted, shortened};

/// Descriptive keys without effect on the matrices; `kardan linearise` writes them.
const METADATA_KEYS: [&str; 9] =
    ["schema", "name", "description", "units", "operating_point", "decimal", "side", "opposite_side", "notes"];

/// Reads an object whose keys are the matrices.
pub(super) fn read_json(text: &str) -> Result<StateSpace, Vec<Diagnostic>> {
    // Checks the syntax and preserves numbers as written; the depth is unlimited.
    if let Err(error) = serde_json::from_str::<&RawValue>(text) {
        return Err(vec![syntax(text, &error)]);
    }
    let json = Json { text };
    let whole = json.trimmed(0..text.len());
    if json.kind(&whole) != "an object" {
        let message = format!("expected an object with the matrix `A`, found {}", json.kind(&whole));
        let shown = whole.start..(whole.start + 1);
        return Err(vec![
            Diagnostic::error("state-space::type", message)
                .at(shown, "here")
                .help("write {\"A\": [[0, 1], [-2, -3]], \"B\": [0, 1], \"C\": [1, 0]}"),
        ]);
    }
    let mut diagnostics = Vec::new();
    let mut parsed = ParsedSystem::default();
    let mut first_spans: BTreeMap<String, Range<usize>> = BTreeMap::new();
    let mut unknown = 0;
    for (key_span, value) in json.members(&whole) {
        let key = json.string(&key_span);
        if let Some(first) = first_spans.get(&key) {
            let message = format!("`{}` is given twice", shortened(&key));
            let diagnostic = Diagnostic::duplicate("state-space::duplicate", message, key_span, first.clone());
            diagnostics.push(diagnostic.help("keep one of them"));
            continue;
        }
        first_spans.insert(key.clone(), key_span.clone());
        if let Some(name) = MATRICES.iter().find(|name| **name == key) {
            parsed.matrices.insert(name, json.matrix(name, &value, &mut diagnostics));
        } else if let Some(name) = NAMES.iter().find(|name| **name == key) {
            parsed.names.insert(name, json.names(name, &value, &mut diagnostics));
        } else if SAMPLE_TIMES.contains(&key.as_str()) {
            let time = parse_number(&text[value.clone()]).map_err(drop).and_then(|number| sampled(number.rational));
            match time {
                _ if json.kind(&value) == "null" => {}
                Ok(time) => parsed.sample_time = time,
                Err(()) => diagnostics.push(discrete(&key).at(key_span, "here")),
            }
        } else if !METADATA_KEYS.contains(&key.as_str()) {
            unknown += 1;
            if unknown <= MAX_REPORTED {
                let keys = || MATRICES.into_iter().chain(NAMES).chain(SAMPLE_TIMES).chain(METADATA_KEYS);
                let help = did_you_mean(nearest(&key, keys()), || format!("known keys: {}", quoted(keys())));
                let message = format!("unknown key `{}`", shortened(&key));
                diagnostics.push(Diagnostic::error("state-space::unknown", message).at(key_span, "here").help(help));
            }
        }
    }
    parsed.system(diagnostics)
}

fn syntax(text: &str, error: &serde_json::Error) -> Diagnostic {
    let start = text.split_inclusive('\n').take(error.line().saturating_sub(1)).map(str::len).sum::<usize>();
    let at = text.floor_char_boundary((start + error.column().saturating_sub(1)).min(text.len()));
    let end = (at..=text.len()).skip(1).find(|end| text.is_char_boundary(*end)).unwrap_or(at);
    let what = error.to_string();
    let what = what.split(" at line ").next().unwrap_or_default();
    // serde_json stops after the first letter of an unknown word.
    let word_start = text[..at].trim_end_matches(|c: char| c.is_ascii_alphabetic()).len();
    let help = if ["NaN", "nan", "Inf", "inf"].iter().any(|word| text[word_start..].starts_with(word)) {
        "NaN and Infinity are no numbers of JSON, and no coefficients of a system"
    } else {
        "write JSON such as {\"A\": [[0, 1], [-2, -3]], \"B\": [0, 1], \"C\": [1, 0]}, or give a MAT file"
    };
    // Columns of characters, as everywhere in kardan; serde_json counts bytes.
    let (line, column) = Lines::new(text).line_column(text, at);
    let message = format!("this is no JSON: {what} (line {line}, column {column})");
    Diagnostic::error("json::syntax", message).at(at..end, "here").help(help)
}

/// Locates values in a text that is valid JSON.
struct Json<'a> {
    text: &'a str,
}

impl Json<'_> {
    fn kind(&self, value: &Range<usize>) -> &'static str {
        match self.text.as_bytes().get(value.start) {
            Some(b'{') => "an object",
            Some(b'[') => "a list",
            Some(b'"') => "a text",
            Some(b't' | b'f') => "a truth value",
            Some(b'n') => "null",
            _ => "a number",
        }
    }

    /// The place to mark: the bracket of a possibly long value.
    fn head(&self, value: &Range<usize>) -> Range<usize> {
        match self.kind(value) {
            "a list" | "an object" => value.start..value.start + 1,
            _ => value.clone(),
        }
    }

    fn trimmed(&self, span: Range<usize>) -> Range<usize> {
        let inside = &self.text[span.clone()];
        let start = span.start + (inside.len() - inside.trim_start().len());
        start..start + inside.trim().len()
    }

    /// The end of the value that starts at `at`.
    fn end(&self, at: usize) -> usize {
        let bytes = self.text.as_bytes();
        let (mut depth, mut i) = (0usize, at);
        while i < bytes.len() {
            match bytes[i] {
                b'"' => {
                    i += 1;
                    while i < bytes.len() && bytes[i] != b'"' {
                        i += if bytes[i] == b'\\' { 2 } else { 1 };
                    }
                }
                b'[' | b'{' => depth += 1,
                b']' | b'}' => {
                    if depth == 0 {
                        return i; // closes what contains a number
                    }
                    depth -= 1;
                }
                b',' | b':' | b' ' | b'\n' | b'\r' | b'\t' if depth == 0 => return i,
                _ => {
                    i += 1;
                    continue;
                }
            }
            i += 1;
            if depth == 0 {
                return i.min(bytes.len());
            }
        }
        bytes.len()
    }

    /// The values of a list or of an object; in an object, keys and values in turn.
    fn items(&self, list: &Range<usize>) -> Vec<Range<usize>> {
        let bytes = self.text.as_bytes();
        let mut out = Vec::new();
        let (mut i, last) = (list.start + 1, list.end.saturating_sub(1));
        while i < last {
            if matches!(bytes[i], b',' | b':' | b' ' | b'\n' | b'\r' | b'\t') {
                i += 1;
            } else {
                let end = self.end(i).max(i + 1);
                out.push(i..end);
                i = end;
            }
        }
        out
    }

    fn members(&self, object: &Range<usize>) -> Vec<(Range<usize>, Range<usize>)> {
        self.items(object).chunks_exact(2).map(|pair| (pair[0].clone(), pair[1].clone())).collect()
    }

    fn string(&self, span: &Range<usize>) -> String {
        let raw = &self.text[span.clone()];
        // An escaped half of a surrogate pair is the one text that is JSON and cannot be decoded.
        serde_json::from_str(raw).unwrap_or_else(|_| raw.trim_matches('"').to_string())
    }

    fn matrix(&self, name: &str, value: &Range<usize>, diagnostics: &mut Vec<Diagnostic>) -> Option<ParsedMatrix> {
        let mut refuse = |code, message: String, span: &Range<usize>, help: &str| {
            diagnostics.push(Diagnostic::error(code, message).at(span.clone(), "").help(help));
            None
        };
        let rows = match self.kind(value) {
            "a list" => self.items(value),
            "a number" | "a text" => vec![value.clone()],
            kind => {
                let message = format!("`{name}` is {kind}, not a matrix");
                return refuse(
                    "state-space::type",
                    message,
                    &self.head(value),
                    "write one list per row: [[0, 1], [-2, -3]]",
                );
            }
        };
        let lists = rows.iter().filter(|row| self.kind(row) == "a list").count();
        // One row, or a list of numbers; the user of [`ParsedMatrix`] decides which.
        let flat = lists == 0;
        if !flat && lists < rows.len() {
            let (number, row) = rows.iter().enumerate().find(|(_, row)| self.kind(row) != "a list")?;
            let message = format!("row {} of `{name}` is {}, not a list of numbers", number + 1, self.kind(row));
            return refuse("state-space::type", message, &self.head(row), "write one list per row: [[0, 1], [-2, -3]]");
        }
        self.wide(name, rows.len(), value, diagnostics)?;
        let cells: Vec<Vec<Range<usize>>> =
            if flat { vec![rows.clone()] } else { rows.iter().map(|row| self.items(row)).collect() };
        let columns = cells[0].len();
        let ragged: Vec<usize> = (1..cells.len()).filter(|i| cells[*i].len() != columns).collect();
        for i in ragged.iter().take(MAX_REPORTED) {
            let message = format!(
                "row {} of `{name}` has {} entries, but row 1 has {columns}: all rows must be equally long",
                i + 1,
                cells[*i].len()
            );
            diagnostics.push(
                Diagnostic::error("state-space::ragged", message)
                    .at(self.head(&rows[*i]), "this row")
                    .at(self.head(&rows[0]), "row 1")
                    .help("is a comma or an entry missing?"),
            );
        }
        if !ragged.is_empty() {
            return None;
        }
        self.wide(name, columns, value, diagnostics)?;
        let list = flat && columns > 0 && self.kind(value) == "a list";
        let (entries, digits) = self.entries(name, &cells, value, list, diagnostics)?;
        let height = if columns == 0 && flat { 0 } else { cells.len() };
        let matrix = Matrix::from_fn(height, columns, |i, j| entries[i * columns + j].clone());
        Some(ParsedMatrix { matrix, digits, list, span: Some(self.head(value)) })
    }

    /// Reports too many rows or columns.
    fn wide(&self, name: &str, count: usize, value: &Range<usize>, diagnostics: &mut Vec<Diagnostic>) -> Option<()> {
        if count <= MOST {
            return Some(());
        }
        let message =
            format!("`{name}` has {count} rows or columns: at most {MOST} states, inputs or outputs are accepted");
        diagnostics.push(
            Diagnostic::error("state-space::too-large", message)
                .at(value.start..value.start + 1, "")
                .help("exact answers of larger systems would take too long"),
        );
        None
    }

    /// All entries row by row, unless one of them is no number.
    fn entries(
        &self,
        name: &str,
        rows: &[Vec<Range<usize>>],
        value: &Range<usize>,
        list: bool,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<(Vec<Rational>, LastDigits)> {
        let mut out = Vec::with_capacity(rows.iter().map(Vec::len).sum());
        let mut digits = LastDigits::default();
        let mut bad = 0;
        for (i, row) in rows.iter().enumerate() {
            for (j, span) in row.iter().enumerate() {
                match self.entry(span) {
                    Ok(number) => {
                        digits.add_decimal(self.text[span.clone()].trim_matches('"'), &number);
                        out.push(number);
                    }
                    Err((code, reason, help)) => {
                        bad += 1;
                        if bad <= MAX_REPORTED {
                            let place = match self.kind(value) {
                                "a list" if list => format!("entry {} of `{name}`", j + 1),
                                "a list" => format!("entry {} of row {} of `{name}`", j + 1, i + 1),
                                _ => format!("`{name}`"),
                            };
                            let diagnostic = Diagnostic::error(code, format!("{place}: {reason}"));
                            diagnostics.push(diagnostic.at(self.head(span), "here").help(help));
                        }
                    }
                }
            }
        }
        more(name, bad, Some(&(value.start..value.start + 1)), diagnostics);
        (bad == 0).then_some((out, digits))
    }

    fn entry(&self, span: &Range<usize>) -> Result<Rational, (&'static str, String, String)> {
        let text = match self.kind(span) {
            "a number" => self.text[span.clone()].to_string(),
            "a text" => self.string(span),
            "null" => {
                let reason = "null is not a number (NaN and Infinity are often saved as null)".to_string();
                return Err(("number::not-finite", reason, "every coefficient must be a finite number".into()));
            }
            kind => {
                let help = "write a number or a text such as \"1/3\"".into();
                return Err(("state-space::entry", format!("{kind} is not a number"), help));
            }
        };
        let number = parse_number(&text).map_err(|error| {
            let help = error.help.unwrap_or_else(|| "write a number or a text such as \"1/3\"".into());
            (error.code, error.message, help)
        })?;
        if number.pi != 0 {
            let reason = format!("`{}` has a factor π and is no rational number", shortened(&text));
            let help = "write it as a decimal with as many digits as you mean".into();
            return Err(("state-space::irrational", reason, help));
        }
        Ok(number.rational)
    }

    fn names(&self, key: &str, value: &Range<usize>, diagnostics: &mut Vec<Diagnostic>) -> Option<ParsedNames> {
        let mut refuse = |message: String, span: Range<usize>| {
            let help = format!("write a list of texts: \"{key}\": [\"a\", \"b\"]");
            diagnostics.push(Diagnostic::error("state-space::names", message).at(span, "here").help(help));
        };
        let start = value.start..value.start + 1;
        if self.kind(value) != "a list" {
            refuse(format!("`{key}` is {}, not a list of names", self.kind(value)), start);
            return None;
        }
        let spans = self.items(value);
        if spans.len() > MOST {
            refuse(format!("`{key}` has {} names: at most {MOST} are accepted", spans.len()), start);
            return None;
        }
        let bad = spans.iter().enumerate().find(|(_, span)| self.kind(span) != "a text");
        if let Some((i, span)) = bad {
            refuse(format!("name {} of `{key}` is {}, not a text", i + 1, self.kind(span)), span.start..span.start + 1);
            return None;
        }
        Some(ParsedNames { names: spans.iter().map(|span| self.string(span)).collect(), spans, span: Some(start) })
    }
}

//! Model file text to typed tables, by the lists of [`Field`]s in the schema; every mistake is reported, none stops it.
//!
//! [`syntax`] reads the text, [`Node`] walks its tables, [`table`] reads one table by its schema and [`value`] one value.
//! Each of them adds to a list of diagnostics and gives what could be read; the caller uses the model only if no error
//! is in that list.
//!
//! ```
//! use kardan::diagnostics::plain;
//! use kardan::model::parse::{Node, syntax, table};
//! use kardan::schema::{Field, Kind, Sign};
//! use kardan::units::Dimension;
//!
//! static SHAFT: [Field; 1] = [Field::required("inertia", Kind::Quantity(Dimension::INERTIA, Sign::Positive), "Inertia.")];
//! let source = "[shaft.wg]\ninertia = 0.05\n";
//! let (document, mut mistakes) = syntax(source);
//! let shafts = Node::root(&document).child("shaft", &mut mistakes);
//! for shaft in shafts.map(|shafts| shafts.children(&mut mistakes)).unwrap_or_default() {
//!     table(&SHAFT, &shaft, &format!("shaft `{}`", shaft.name), &mut mistakes);
//! }
//! assert_eq!(
//!     plain(source, &mistakes),
//!     "error[unit::dimension] 2:11: `inertia` of shaft `wg`: expected a moment of inertia, \
//!      found a number without a unit | a number without a unit \
//!      | help: write the unit too: \"0.05 kg m^2\"\n"
//! );
//! ```

use std::ops::Range;

use toml::Spanned as Toml;
use toml::de::{DeArray, DeTable, DeValue};

use crate::diagnostics::{Diagnostic, nearest, shortened};
use crate::schema::{Field, Kind, Scalar, Sign, Spanned, Table, Value};
use crate::units::{
    Dimension, Exact, UnitError, parse_number, parse_poles, parse_quantity, parse_tolerated, tolerance_mark,
};

/// Reads the text of a model file as TOML; what is broken is reported and the rest is still there.
///
/// # Errors
///
/// One diagnostic `toml::syntax` for each line that is not TOML. A value without quotes is read as if it had them.
///
/// ```
/// use kardan::model::parse::syntax;
/// let (document, mistakes) = syntax("inertia = 130 kg mm^2\n");
/// assert!(document.get_ref().contains_key("inertia"));
/// assert_eq!(mistakes[0].help.as_deref(), Some("write \"130 kg mm^2\""));
/// ```
pub fn syntax(source: &str) -> (Toml<DeTable<'_>>, Vec<Diagnostic>) {
    let (document, errors) = DeTable::parse_recoverable(source);
    let mut errors: Vec<(Range<usize>, &str)> =
        errors.iter().map(|error| (error.span().unwrap_or(0..0), error.message())).collect();
    errors.sort_by_key(|(span, _)| (span.start, span.end));
    // What follows the first mistake of a line mostly follows from it.
    let line =
        |span: &Range<usize>| source.as_bytes()[..span.start.min(source.len())].iter().filter(|b| **b == b'\n').count();
    errors.dedup_by_key(|(span, _)| line(span));
    let diagnostics = errors.into_iter().map(|(span, message)| {
        let text = source.get(span.clone()).unwrap_or("").trim();
        let (message, help) = if message.starts_with("string values must be quoted") {
            match text {
                "" => {
                    ("a key without a value".to_string(), "write a value after the `=`, or remove the key".to_string())
                }
                _ => ("text without quotes".to_string(), format!("write \"{text}\"")),
            }
        } else if message.starts_with("duplicate key") {
            ("a key that was given before".to_string(), "keep one of the two".to_string())
        } else {
            let start = source[..span.start.min(source.len())].rfind('\n').map_or(0, |at| at + 1);
            let line = shortened(source[start..].lines().next().unwrap_or("").split('#').next().unwrap_or("").trim());
            let help = match message {
                m if m.starts_with("unclosed table") => format!("write `{line}]`"),
                m if m.starts_with("unclosed array table") => format!("write `{}]]`", line.trim_end_matches(']')),
                m if m.contains("string, expected") => "end the text with the quote it begins with".to_string(),
                m if m.starts_with("key with no value") => "write it as `key = value`".to_string(),
                m if m.contains("recurse") => "nothing in a model file is nested that deeply".to_string(),
                _ => "see https://toml.io for how a file of keys and values is written".to_string(),
            };
            (message.to_string(), help)
        };
        Diagnostic::error("toml::syntax", format!("this is not TOML: {message}")).at(span, "").help(help)
    });
    let diagnostics = diagnostics.collect();
    (document, diagnostics)
}

/// A table of the document with its name and its place.
///
/// ```
/// use kardan::model::parse::{Node, syntax};
/// let (document, mut mistakes) = syntax("[scenario]\nevents = 2\n[[scenario.event]]\ntime = \"1 s\"\n");
/// let root = Node::root(&document);
/// root.expect_keys(&["model", "scenario"], "the file", &mut mistakes);
/// let scenario = root.child("scenario", &mut mistakes).ok_or("no scenario")?;
/// scenario.expect_keys(&["event"], "the scenario", &mut mistakes);
/// assert_eq!(mistakes[0].help.as_deref(), Some("did you mean `event`?"));
/// assert_eq!(scenario.list("event", &mut mistakes)[0].entries()[0].0, "time");
/// # Ok::<(), &str>(())
/// ```
#[derive(Debug, Clone)]
pub struct Node<'t> {
    /// The key that leads to it; for an entry of a list the key of the list.
    pub name: &'t str,
    /// Byte range of that key.
    pub name_span: Range<usize>,
    /// Byte range of the header (`[shaft.wg]`), or of the whole of an inline table.
    pub span: Range<usize>,
    /// Its keys and values.
    pub table: &'t DeTable<'t>,
}

impl<'t> Node<'t> {
    /// The document as a whole.
    pub fn root(document: &'t Toml<DeTable<'t>>) -> Self {
        Self { name: "", name_span: document.span(), span: document.span(), table: document.get_ref() }
    }

    /// Name, place of the name, and value of each key, in the order of the file.
    pub fn entries(&self) -> Vec<(&'t str, Range<usize>, &'t Toml<DeValue<'t>>)> {
        let mut entries: Vec<_> =
            self.table.iter().map(|(key, value)| (key.get_ref().as_ref(), key.span(), value)).collect();
        entries.sort_by_key(|(_, span, _)| span.start);
        entries
    }

    /// The table under a key, if it is there; `type::wrong` is reported if something else is.
    pub fn child(&self, key: &str, out: &mut Vec<Diagnostic>) -> Option<Node<'t>> {
        let (name, span, value) = self.entry(key)?;
        self.as_table(name, span, value, out)
    }

    /// All keys as tables, in the order of the file; `type::wrong` is reported for each that is none.
    pub fn children(&self, out: &mut Vec<Diagnostic>) -> Vec<Node<'t>> {
        self.entries().into_iter().filter_map(|(name, span, value)| self.as_table(name, span, value, out)).collect()
    }

    /// The tables of the list `[[key]]` (or the single table `[key]`), none if it is not there; `type::wrong` is
    /// reported for each that is no table.
    pub fn list(&self, key: &str, out: &mut Vec<Diagnostic>) -> Vec<Node<'t>> {
        let Some((name, span, value)) = self.entry(key) else { return Vec::new() };
        match value.get_ref() {
            DeValue::Array(entries) => {
                entries.iter().filter_map(|entry| self.as_table(name, span.clone(), entry, out)).collect()
            }
            _ => self.as_table(name, span, value, out).into_iter().collect(),
        }
    }

    /// Reports `key::unknown` for each key that is not among the known ones.
    pub fn expect_keys(&self, known: &[&str], what: &str, out: &mut Vec<Diagnostic>) {
        for (name, span, _) in self.entries() {
            if !known.contains(&name) {
                out.push(unknown_key(name, span, known, what));
            }
        }
    }

    fn entry(&self, key: &str) -> Option<(&'t str, Range<usize>, &'t Toml<DeValue<'t>>)> {
        let (name, value) = self.table.get_key_value(key)?;
        Some((name.get_ref().as_ref(), name.span(), value))
    }

    fn as_table(
        &self,
        name: &'t str,
        name_span: Range<usize>,
        value: &'t Toml<DeValue<'t>>,
        out: &mut Vec<Diagnostic>,
    ) -> Option<Node<'t>> {
        if let DeValue::Table(table) = value.get_ref() {
            return Some(Node { name, name_span, span: value.span(), table });
        }
        let path = if self.name.is_empty() { name.to_string() } else { format!("{}.{name}", self.name) };
        out.push(
            Diagnostic::error("type::wrong", format!("`{path}`: expected a table, found {}", found(value.get_ref())))
                .at(value.span(), "not a table")
                .help(format!("write it as `[{path}]` with its keys below")),
        );
        None
    }
}

/// Reads one table by its schema.
///
/// `what` names the table in the messages: ``shaft `wg` ``. The result holds each key that could be read; those that
/// could not, or that are missing, are reported in `out`. If `out` has a `toml::syntax` already, missing keys are not
/// reported: they may stand in the broken part.
///
/// # Errors
///
/// `key::unknown`, `key::missing`, and for each value the errors of [`value`].
pub fn table(fields: &'static [Field], node: &Node<'_>, what: &str, out: &mut Vec<Diagnostic>) -> Table {
    let known: Vec<&str> = fields.iter().map(|field| field.name).collect();
    let mut read = Table { span: node.span.clone(), ..Table::default() };
    let mut misspelt = Vec::new();
    for (name, span, entry) in node.entries() {
        match fields.iter().find(|field| field.name == name) {
            Some(field) => {
                let before = out.len();
                match value(&field.kind, &format!("`{name}` of {what}"), entry, out) {
                    Some(entry) if field.required && entry.value == Value::Tables(Vec::new()) => {
                        let message = format!("`{name}` of {what}: expected one or more tables, found an empty list");
                        out.push(
                            Diagnostic::error("list::length", message)
                                .at(entry.span, "empty")
                                .help(format!("write it like `{}`", example(&field.kind))),
                        );
                        read.unread.push(field.name);
                    }
                    Some(entry) => {
                        // In part: what could be read is checked further.
                        if out.len() > before {
                            read.unread.push(field.name);
                        }
                        read.values.insert(field.name, entry);
                    }
                    None => read.unread.push(field.name),
                }
            }
            None => {
                misspelt.extend(nearest(name, known.iter().copied()));
                out.push(unknown_key(name, span, &known, what));
            }
        }
    }
    let broken = out.iter().any(|diagnostic| diagnostic.code == "toml::syntax");
    for field in fields.iter().filter(|field| field.required && !broken) {
        // A key that was misspelt is reported once only.
        if !node.table.contains_key(field.name) && !misspelt.contains(&field.name) {
            read.unread.push(field.name);
            out.push(
                Diagnostic::error("key::missing", format!("{what} needs the key `{}`", field.name))
                    .at(node.span.clone(), format!("`{}` is missing", field.name))
                    .help(format!("add `{} = {}`: {}", field.name, example(&field.kind), field.doc)),
            );
        }
    }
    let unknown = |name: &&&str| !node.table.contains_key(**name);
    read.unread.extend(
        fields.iter().map(|field| field.name).filter(|name| misspelt.iter().filter(unknown).any(|m| m == name)),
    );
    read
}

/// Reads one value by its kind; nothing if it could not be read, and then the reason is in `out`. Of a list or a table
/// with mistakes the entries that could be read are given.
///
/// `what` names the value in the messages: ``parameter `s` ``. A text that has the form of a name where a number or a
/// quantity is asked for is a reference to a parameter; whether that exists is not checked here, nor whether shafts,
/// elements and signals do.
///
/// # Errors
///
/// `type::wrong`, `unit::unknown`, `unit::dimension`, `unit::syntax`, `number::syntax`, `number::sign`,
/// `number::not-finite`, `number::range`, `name::invalid`, `name::duplicate`, `choice::unknown`, `list::length`,
/// `tolerance::syntax`, `tolerance::bounds`. A tolerance is read of every scalar; where it may stand is checked elsewhere.
///
/// ```
/// use kardan::model::parse::{syntax, value};
/// use kardan::schema::{Kind, Scalar, Sign, Value};
/// use kardan::units::{Dimension, Exact};
/// let (document, mut mistakes) = syntax("ratio = \"51/50\"");
/// let ratio = value(&Kind::Number(Sign::NonZero), "`ratio`", &document.get_ref()["ratio"], &mut mistakes);
/// let expected = Value::Scalar(Scalar::Literal(Exact::from_ratio(51, 50), Dimension::NONE));
/// assert_eq!(ratio.map(|r| r.value), Some(expected));
/// ```
pub fn value(kind: &Kind, what: &str, value: &Toml<DeValue<'_>>, out: &mut Vec<Diagnostic>) -> Option<Spanned<Value>> {
    let span = value.span();
    // What the TOML reader put in place of something broken: reported by `syntax`.
    if span.is_empty() {
        return None;
    }
    let reader = Reader { kind, what, span: span.clone() };
    let read = match (kind, value.get_ref()) {
        (
            Kind::Shaft
            | Kind::Node
            | Kind::Element(_)
            | Kind::Signal
            | Kind::Output
            | Kind::Name
            | Kind::Text
            | Kind::Choice(_),
            DeValue::String(text),
        ) => reader.word(text, out).map(Value::Word),
        (Kind::Shafts(_) | Kind::Elements(_) | Kind::Signals | Kind::Outputs | Kind::Words, DeValue::Array(list)) => {
            reader.words(list, out)
        }
        (Kind::Quantity(..) | Kind::AnyQuantity | Kind::Number(_), literal) => {
            reader.scalar(literal, out).map(Value::Scalar)
        }
        (Kind::Coefficients, DeValue::Table(entries)) => reader.map(&Kind::Number(Sign::Any), entries, out),
        (Kind::Overrides | Kind::Lists, DeValue::Table(entries)) => reader.map(&Kind::AnyQuantity, entries, out),
        (Kind::Tables(fields), DeValue::Array(list)) => {
            let mut tables = Vec::new();
            for (i, entry) in list.iter().enumerate() {
                let what = format!("entry {} of {what}", i + 1);
                match entry.get_ref() {
                    DeValue::Table(entries) => tables.push(table(fields, &reader.node(entries, entry), &what, out)),
                    other => Reader { what: &what, span: entry.span(), ..reader }.wrong_type("a table", other, out),
                }
            }
            Some(Value::Tables(tables))
        }
        (Kind::Poles, DeValue::Array(list)) => reader.poles(list, out),
        (Kind::Tables(fields) | Kind::Table(fields), DeValue::Table(entries)) => {
            Some(Value::Tables(vec![table(fields, &reader.node(entries, value), what, out)]))
        }
        (_, other) => {
            reader.wrong_type(&expected(kind), other, out);
            None
        }
    };
    read.map(|value| Spanned { value, span })
}

/// The longest name, in characters: names become parts of file names.
const NAME_LIMIT: usize = 100;

/// Whether a text has the form of a name: a letter or `_`, then letters, digits, `_` and `-`, at most a hundred in all.
///
/// ```
/// use kardan::model::parse::is_name;
/// assert!(is_name("s_wg-2") && !is_name("rk.phi") && !is_name("2s") && !is_name(""));
/// ```
pub fn is_name(text: &str) -> bool {
    text.len() <= NAME_LIMIT
        && text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
}

/// What makes a text a name.
pub(super) const NAME_RULE: &str =
    "a name begins with a letter and goes on with letters (a to z), digits, `_` or `-`, at most 100 in all";

/// What is being read: for the messages.
struct Reader<'r> {
    kind: &'r Kind,
    what: &'r str,
    span: Range<usize>,
}

impl Reader<'_> {
    fn error(&self, code: &'static str, message: impl AsRef<str>, label: impl Into<String>) -> Diagnostic {
        Diagnostic::error(code, format!("{}: {}", self.what, message.as_ref())).at(self.span.clone(), label)
    }

    fn wrong_type(&self, expected: &str, value: &DeValue<'_>, out: &mut Vec<Diagnostic>) {
        let found = found(value);
        let message = format!("expected {expected}, found {found}");
        out.push(self.error("type::wrong", message, found).help(format!("write it like `{}`", example(self.kind))));
    }

    fn node<'t>(&self, table: &'t DeTable<'t>, value: &Toml<DeValue<'_>>) -> Node<'t> {
        Node { name: "", name_span: value.span(), span: value.span(), table }
    }

    fn word(&self, text: &str, out: &mut Vec<Diagnostic>) -> Option<String> {
        if text.trim().is_empty() {
            let message = format!("expected {}, found an empty text", expected(self.kind));
            out.push(
                self.error("type::wrong", message, "empty").help(format!("write it like `{}`", example(self.kind))),
            );
            return None;
        }
        match self.kind {
            Kind::Choice(choices) if !choices.contains(&text) => {
                let help = match nearest(text, choices.iter().copied()) {
                    Some(meant) => format!("did you mean \"{meant}\"?"),
                    None => format!("choose {}", expected(self.kind)),
                };
                let message = format!("unknown choice `{}`", shortened(text));
                out.push(self.error("choice::unknown", message, "unknown").help(help));
                None
            }
            Kind::Name | Kind::Node if !is_name(text) => {
                out.push(
                    self.error("name::invalid", format!("`{}` cannot be a name", shortened(text)), "not a name")
                        .help(NAME_RULE),
                );
                None
            }
            _ => Some(text.to_string()),
        }
    }

    fn words(&self, list: &DeArray<'_>, out: &mut Vec<Diagnostic>) -> Option<Value> {
        let mut words: Vec<Spanned<String>> = Vec::new();
        for entry in list.iter().filter(|entry| !entry.span().is_empty()) {
            let here = Reader { span: entry.span(), ..*self };
            let DeValue::String(text) = entry.get_ref() else {
                here.wrong_type("a text", entry.get_ref(), out);
                continue;
            };
            let Some(word) = here.word(text, out) else { continue };
            match words.iter().find(|other| other.value == word) {
                Some(first) => out.push(
                    here.error("name::duplicate", format!("`{word}` is listed twice"), "again here")
                        .at(first.span.clone(), "first here")
                        .help("remove one of the two"),
                ),
                None => words.push(Spanned { value: word, span: entry.span() }),
            }
        }
        let count = list.len();
        let enough = match *self.kind {
            Kind::Shafts(0) | Kind::Elements(_) => count > 0,
            Kind::Shafts(asked) => count == asked,
            _ => true,
        };
        if !enough {
            let names = if count == 1 { "name" } else { "names" };
            let message = format!("expected {}, found {count} {names}", expected(self.kind));
            let label = format!("{count} {names}");
            let or = if matches!(self.kind, Kind::Elements(_)) { ", or leave it out" } else { "" };
            out.push(
                self.error("list::length", message, label).help(format!("write it like `{}`{or}", example(self.kind))),
            );
        }
        Some(Value::Words(words))
    }

    fn poles(&self, list: &DeArray<'_>, out: &mut Vec<Diagnostic>) -> Option<Value> {
        let mut poles = Vec::new();
        for entry in list.iter().filter(|entry| !entry.span().is_empty()) {
            let here = Reader { span: entry.span(), ..*self };
            let text = match entry.get_ref() {
                DeValue::String(text) => text.as_ref(),
                DeValue::Integer(number) if number.radix() == 10 => number.as_str(),
                DeValue::Float(number) => number.as_str(),
                other => {
                    here.wrong_type("a number or a text", other, out);
                    continue;
                }
            };
            match parse_poles(text) {
                Ok(found) => poles.extend(found),
                Err(error) => out.push(
                    here.error(error.code, error.message, "not a pole")
                        .help("write it like `-50`, `\"-14 + 14.3j\"` or, for a pair, `\"-14 ± 14.3j\"`"),
                ),
            }
        }
        if list.is_empty() {
            let message = format!("expected {}, found an empty list", expected(self.kind));
            out.push(
                self.error("list::length", message, "empty").help(format!("write it like `{}`", example(self.kind))),
            );
        }
        Some(Value::Poles(poles))
    }

    fn map(&self, kind: &Kind, table: &DeTable<'_>, out: &mut Vec<Diagnostic>) -> Option<Value> {
        let mut map = Vec::new();
        let node = Node { name: "", name_span: self.span.clone(), span: self.span.clone(), table };
        for (name, name_span, entry) in node.entries() {
            let what = format!("`{name}` in {}", self.what);
            let mut read = |entry: &Toml<DeValue<'_>>| {
                if let Some(Spanned { value: Value::Scalar(scalar), span }) = value(kind, &what, entry, out) {
                    let name = Spanned { value: name.to_string(), span: name_span.clone() };
                    map.push((name, Spanned { value: scalar, span }));
                }
            };
            match entry.get_ref() {
                DeValue::Array(list) if *self.kind == Kind::Lists && !list.is_empty() => list.iter().for_each(read),
                _ => read(entry),
            }
        }
        if table.is_empty() && *self.kind == Kind::Coefficients {
            let message = format!("expected {}, found an empty table", expected(self.kind));
            out.push(
                self.error("list::length", message, "empty").help(format!("write it like `{}`", example(self.kind))),
            );
        }
        Some(Value::Map(map))
    }

    fn scalar(&self, value: &DeValue<'_>, out: &mut Vec<Diagnostic>) -> Option<Scalar> {
        let (text, quoted) = match value {
            DeValue::String(text) => (text.as_ref(), true),
            DeValue::Integer(number) if number.radix() == 10 => (number.as_str(), false),
            DeValue::Float(number) => (number.as_str(), false),
            other => {
                self.wrong_type(&expected(self.kind), other, out);
                return None;
            }
        };
        if text.is_empty() && !quoted {
            return None; // A malformed number: reported by `syntax`.
        }
        if text.trim().is_empty() {
            self.word(text, out);
            return None;
        }
        let marked = quoted && tolerance_mark(text).is_some();
        let read = match self.kind {
            _ if marked => parse_tolerated(text).map(|read| (read.value.clone(), read.dimension, Some(read))),
            Kind::Number(_) => parse_number(text).map(|number| (number, Dimension::NONE, None)),
            _ => parse_quantity(text).map(|(number, dimension)| (number, dimension, None)),
        };
        let (number, dimension, tolerated) = match read {
            Ok(read) => read,
            Err(error) if quoted && is_name(text) && error.code != "number::not-finite" => {
                return Some(Scalar::Parameter(text.to_string()));
            }
            Err(error) => {
                out.push(self.unit_error(error, text, quoted));
                return None;
            }
        };
        let sign = match *self.kind {
            Kind::Quantity(expected, _) if expected != dimension => {
                let message = format!("expected {}, found {}", expected.noun(), dimension.noun());
                let help = expected.hint(tolerated.as_ref().map_or(text, |read| read.text.as_str()));
                out.push(self.error("unit::dimension", message, dimension.noun()).help(help));
                return None;
            }
            Kind::Number(_) if dimension != Dimension::NONE => {
                let message = format!("expected {}, found {}", Dimension::NONE.noun(), dimension.noun());
                out.push(
                    self.error("unit::dimension", message, dimension.noun()).help("write the number without a unit"),
                );
                return None;
            }
            Kind::Quantity(_, sign) | Kind::Number(sign) => sign,
            _ => Sign::Any,
        };
        if let Some((rule, help)) = broken(sign, &number) {
            out.push(self.error("number::sign", format!("{rule}, found {}", shortened(text.trim())), rule).help(help));
            return None;
        }
        Some(tolerated.map_or(Scalar::Literal(number, dimension), |read| Scalar::Tolerated(Box::new(read))))
    }

    /// Points into the text where its bytes are those of the file.
    fn unit_error(&self, error: UnitError, text: &str, quoted: bool) -> Diagnostic {
        let offset = match self.span.len().checked_sub(text.len()) {
            Some(0) => Some(0),
            Some(2) if quoted => Some(1),
            _ => None,
        };
        let span = match offset {
            Some(offset) if !error.span.is_empty() => {
                let start = self.span.start + offset;
                start + error.span.start..start + error.span.end
            }
            _ => self.span.clone(),
        };
        let diagnostic = Diagnostic::error(error.code, format!("{}: {}", self.what, error.message)).at(span, "");
        Diagnostic { help: error.help, ..diagnostic }
    }
}

/// The rule that a number breaks, and what to do about it.
fn broken(sign: Sign, number: &Exact) -> Option<(&'static str, &'static str)> {
    match (sign, number.signum()) {
        (Sign::NonNegative, -1) => Some(("must not be negative", "write zero or a number above zero")),
        (Sign::Positive, -1 | 0) => Some(("must be more than zero", "write a number above zero")),
        (Sign::NonZero, 0) => Some(("must not be zero", "write a number other than zero")),
        _ => None,
    }
}

fn unknown_key(name: &str, span: Range<usize>, known: &[&str], what: &str) -> Diagnostic {
    let help = match nearest(name, known.iter().copied()) {
        Some(meant) => format!("did you mean `{meant}`?"),
        None if known.is_empty() => format!("{what} takes no keys; remove it"),
        None => format!("known keys are {}", listed(known, "and")),
    };
    Diagnostic::error("key::unknown", format!("{what} has no key `{}`", shortened(name)))
        .at(span, "unknown key")
        .help(help)
}

fn found(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) if text.chars().count() <= 40 => format!("the text {text:?}"),
        DeValue::String(_) => "a text".to_string(),
        DeValue::Integer(number) if number.as_str().len() <= 40 => format!("the number {number}"),
        DeValue::Float(number) if number.as_str().len() <= 40 => format!("the number {number}"),
        DeValue::Integer(_) | DeValue::Float(_) => "a number".to_string(),
        DeValue::Boolean(_) => "a boolean".to_string(),
        DeValue::Datetime(_) => "a date or time".to_string(),
        DeValue::Array(_) => "a list".to_string(),
        DeValue::Table(_) => "a table".to_string(),
    }
}

/// What a kind asks for, as words of a sentence.
fn expected(kind: &Kind) -> String {
    match kind {
        Kind::Shaft => "the name of a shaft".to_string(),
        Kind::Node => "the name of a node".to_string(),
        Kind::Shafts(0) => "a list of one or more shaft names".to_string(),
        Kind::Shafts(1) => "a list of one shaft name".to_string(),
        Kind::Shafts(count) => format!("a list of {count} shaft names"),
        Kind::Quantity(dimension, _) => format!("{} such as {}", dimension.noun(), dimension.example()),
        Kind::Number(_) => "a decimal number or the name of a parameter".to_string(),
        Kind::Coefficients => "a table from shaft names to numbers".to_string(),
        Kind::Choice(choices) => format!("one of {}", listed(choices, "or")),
        Kind::Element(kinds) => format!("the name of an element of the kind {}", listed(kinds, "or")),
        Kind::Elements(kinds) => format!("a list of one or more names of elements of the kind {}", listed(kinds, "or")),
        Kind::Signal => "the name of a signal".to_string(),
        Kind::Signals => "a list of signal names".to_string(),
        Kind::Words => "a list of names".to_string(),
        Kind::Name => "a new name".to_string(),
        Kind::Text => "a text".to_string(),
        Kind::AnyQuantity => "a quantity such as \"1.3 N m\"".to_string(),
        Kind::Overrides => "a table from names to quantities".to_string(),
        Kind::Lists => "a table from names to lists of quantities".to_string(),
        Kind::Tables(_) => "a list of tables".to_string(),
        Kind::Table(_) => "a table".to_string(),
        Kind::Output => "an angle or speed of a shaft, or a sensor".to_string(),
        Kind::Outputs => "a list of angles and speeds of shafts, and of sensors".to_string(),
        Kind::Poles => "a list of poles in 1/s".to_string(),
    }
}

/// A value of a kind as it stands in a file.
fn example(kind: &Kind) -> String {
    match kind {
        Kind::Shaft => "\"wg\"".to_string(),
        Kind::Node => "\"out\"".to_string(),
        Kind::Shafts(1) => "[\"wg\"]".to_string(),
        Kind::Shafts(0 | 2) => "[\"wg\", \"cs\"]".to_string(),
        Kind::Shafts(3) => "[\"wg\", \"cs\", \"fs\"]".to_string(),
        Kind::Shafts(_) => "[\"wg\", \"cs\", \"fs\", …]".to_string(),
        Kind::Quantity(dimension, _) => dimension.example(),
        Kind::Number(_) => "1.5".to_string(),
        Kind::Coefficients => "{ wg = 1, cs = -51, fs = 50 }".to_string(),
        Kind::Choice(choices) => format!("\"{}\"", choices.first().unwrap_or(&"")),
        Kind::Element(kinds) => format!("\"my_{}\"", kinds.first().unwrap_or(&"element")),
        Kind::Elements(kinds) => format!("[\"my_{}\"]", kinds.first().unwrap_or(&"element")),
        Kind::Signal => "\"rk.phi\"".to_string(),
        Kind::Signals => "[\"rk.phi\", \"rk.w\"]".to_string(),
        Kind::Words => "[\"nominal\"]".to_string(),
        Kind::Name => "\"ref_rk\"".to_string(),
        Kind::Text => "\"a text\"".to_string(),
        Kind::AnyQuantity => "\"1.3 N m\"".to_string(),
        Kind::Overrides => "{ beta = \"0 deg\" }".to_string(),
        Kind::Lists => "{ wg = [\"20 rad/s\", \"60 rad/s\"] }".to_string(),
        Kind::Output => "\"rk.phi\"".to_string(),
        Kind::Outputs => "[\"rk.phi\", \"fs.phi\"]".to_string(),
        Kind::Poles => "[-50, \"-14 ± 14.3j\"]".to_string(),
        Kind::Tables(fields) | Kind::Table(fields) => {
            let keys: Vec<String> = fields
                .iter()
                .filter(|field| field.required)
                .map(|field| format!("{} = {}", field.name, example(&field.kind)))
                .collect();
            let table = format!("{{ {} }}", keys.join(", "));
            if matches!(kind, Kind::Table(_)) { table } else { format!("[{table}]") }
        }
    }
}

/// `` `a`, `b` or `c` ``
fn listed(words: &[&str], conjunction: &str) -> String {
    let quoted: Vec<String> = words.iter().map(|word| format!("`{word}`")).collect();
    match quoted.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, rest)) => format!("{} {conjunction} {last}", rest.join(", ")),
        None => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::diagnostics::plain;

    static EVENT: [Field; 2] = [
        Field::required("time", Kind::Quantity(Dimension::TIME, Sign::NonNegative), "When it happens."),
        Field::optional("set", Kind::Overrides, "What changes; nothing if left out."),
    ];

    static ELEMENT: [Field; 16] = [
        Field::required("inertia", Kind::Quantity(Dimension::INERTIA, Sign::Positive), "Moment of inertia."),
        Field::optional("stiffness", Kind::Quantity(Dimension::STIFFNESS, Sign::NonNegative), "Stiffness."),
        Field::optional("damping", Kind::Quantity(Dimension::DAMPING, Sign::NonNegative), "Damping."),
        Field::optional("angle", Kind::Quantity(Dimension::ANGLE, Sign::Any), "Angle."),
        Field::optional("ratio", Kind::Number(Sign::NonZero), "Ratio."),
        Field::optional("shaft", Kind::Shaft, "Shaft."),
        Field::optional("shafts", Kind::Shafts(2), "Shafts."),
        Field::optional("any_shafts", Kind::Shafts(0), "Shafts."),
        Field::optional("law", Kind::Choice(&["linear", "quadratic"]), "Law."),
        Field::optional("motor", Kind::Element(&["motor"]), "Motor."),
        Field::optional("terms", Kind::Coefficients, "Terms."),
        Field::optional("outputs", Kind::Signals, "Outputs."),
        Field::optional("value", Kind::AnyQuantity, "Value."),
        Field::optional("name", Kind::Name, "Name."),
        Field::optional("text", Kind::Text, "Text."),
        Field::optional("event", Kind::Tables(&EVENT), "Events."),
    ];

    /// Reads a file that is one table, and renders what is wrong with it.
    fn read(source: &str) -> (Table, String) {
        let (document, mut out) = syntax(source);
        let table = table(&ELEMENT, &Node::root(&document), "shaft `wg`", &mut out);
        (table, plain(source, &out))
    }

    /// What is wrong with one line; `inertia` is there.
    fn mistakes(line: &str) -> String {
        read(&format!("{line}\ninertia = \"1 kg m^2\"\n")).1
    }

    #[test]
    fn a_table_without_mistakes_is_read() {
        let (table, mistakes) = read(concat!(
            "inertia = \"130 kg mm^2\"\nstiffness = 's_wg'\nangle = \"30 deg\"\nratio = 1.02\nshaft = \"wg\"\n",
            "shafts = [\"wg\", \"cs\"]\nlaw = \"linear\"\nterms = { wg = 1, fs = \"50/51\", cs = \"k\" }\n",
            "outputs = [\"rk.phi\"]\nvalue = 3\ntext = '''\nmany\nlines'''\n",
            "event = [{ time = \"1 s\" }, { time = \"2 s\", set = { beta = \"0 deg\", n = -2 } }]\n",
        ));
        assert_eq!(mistakes, "");
        let literal = |a, b, dimension| Scalar::Literal(Exact::from_ratio(a, b), dimension);
        let get = |key: &str| &table.values[key].value;
        assert_eq!(get("inertia"), &Value::Scalar(literal(130, 1_000_000, Dimension::INERTIA)));
        assert_eq!(table.values["inertia"].span, 10..23);
        assert_eq!(get("stiffness"), &Value::Scalar(Scalar::Parameter("s_wg".to_string())));
        assert_eq!(get("ratio"), &Value::Scalar(literal(51, 50, Dimension::NONE)));
        assert_eq!(get("value"), &Value::Scalar(literal(3, 1, Dimension::NONE)));
        let Value::Map(terms) = get("terms") else { panic!("terms are a map") };
        let terms: Vec<_> = terms.iter().map(|(name, scalar)| (name.value.as_str(), scalar.value.clone())).collect();
        assert_eq!(
            terms,
            [
                ("wg", literal(1, 1, Dimension::NONE)),
                ("fs", literal(50, 51, Dimension::NONE)),
                ("cs", Scalar::Parameter("k".to_string())),
            ]
        );
        let Value::Tables(events) = get("event") else { panic!("events are tables") };
        assert_eq!(events.len(), 2);
        assert_eq!(events[1].values["time"].value, Value::Scalar(literal(2, 1, Dimension::TIME)));
        assert_eq!(table.values.len(), 12);
    }

    #[test]
    fn all_mistakes_of_a_file_are_reported_at_once() {
        let source = concat!(
            "inerta = 0.05\n",
            "stiffness = \"100 N m\"\n",
            "damping = \"0.0081 N m s\"\n",
            "angle = \"30 dge\"\n",
            "ratio = 0\n",
            "zzz = \"red\"\n",
            "shafts = [\"wg\", \"wg\", \"cs\"]\n",
        );
        assert_eq!(
            read(source).1,
            concat!(
                "error[key::unknown] 1:1: shaft `wg` has no key `inerta` | unknown key | help: did you mean `inertia`?\n",
                "error[unit::dimension] 2:13: `stiffness` of shaft `wg`: expected a torsional stiffness, found a torque ",
                "| a torque | help: did you mean \"100 N m/rad\"?\n",
                "error[unit::dimension] 3:11: `damping` of shaft `wg`: expected a torsional damping, found a quantity in ",
                "kg m^2/s | a quantity in kg m^2/s | help: did you mean \"0.0081 N m s/rad\"?\n",
                "error[unit::unknown] 4:13: `angle` of shaft `wg`: unknown unit `dge` | help: did you mean `deg`?\n",
                "error[number::sign] 5:9: `ratio` of shaft `wg`: must not be zero, found 0 | must not be zero ",
                "| help: write a number other than zero\n",
                "error[key::unknown] 6:1: shaft `wg` has no key `zzz` | unknown key | help: known keys are `inertia`, ",
                "`stiffness`, `damping`, `angle`, `ratio`, `shaft`, `shafts`, `any_shafts`, `law`, `motor`, `terms`, ",
                "`outputs`, `value`, `name`, `text` and `event`\n",
                "error[name::duplicate] 7:17: `shafts` of shaft `wg`: `wg` is listed twice | again here | first here ",
                "| help: remove one of the two\n",
                "error[list::length] 7:10: `shafts` of shaft `wg`: expected a list of 2 shaft names, found 3 names ",
                "| 3 names | help: write it like `[\"wg\", \"cs\"]`\n",
            )
        );
    }

    #[test]
    fn a_missing_key_is_shown_at_the_header() {
        let source = "[shaft.wg]\ndamping = \"d\"\n[shaft.cs]\ninertia = \"J\"";
        let (document, mut out) = syntax(source);
        let shafts = Node::root(&document).child("shaft", &mut out).expect("the table is there");
        let names: Vec<_> = shafts.children(&mut out).iter().map(|shaft| shaft.name.to_string()).collect();
        assert_eq!(names, ["wg", "cs"]);
        for shaft in shafts.children(&mut out) {
            table(&ELEMENT, &shaft, &format!("shaft `{}`", shaft.name), &mut out);
        }
        assert_eq!(
            plain(source, &out),
            "error[key::missing] 1:1: shaft `wg` needs the key `inertia` | `inertia` is missing \
             | help: add `inertia = \"130 kg mm^2\"`: Moment of inertia.\n"
        );
    }

    #[test]
    fn each_kind_says_what_it_expects() {
        for (line, expected) in [
            (
                "stiffness = true",
                "error[type::wrong] 1:13: `stiffness` of shaft `wg`: expected a torsional stiffness such as \"100 N m/rad\", found a boolean | a boolean | help: write it like `\"100 N m/rad\"`\n",
            ),
            (
                "stiffness = 0.05",
                "error[unit::dimension] 1:13: `stiffness` of shaft `wg`: expected a torsional stiffness, found a number without a unit | a number without a unit | help: write the unit too: \"0.05 N m/rad\"\n",
            ),
            (
                "stiffness = inf",
                "error[number::not-finite] 1:13: `stiffness` of shaft `wg`: `inf` is not a finite number | help: write a decimal number\n",
            ),
            (
                "stiffness = -nan",
                "error[number::not-finite] 1:14: `stiffness` of shaft `wg`: `nan` is not a finite number | help: write a decimal number\n",
            ),
            (
                "ratio = \"nan\"",
                "error[number::not-finite] 1:10: `ratio` of shaft `wg`: `nan` is not a finite number | help: write a decimal number\n",
            ),
            (
                "stiffness = \"-1 N m/rad\"",
                "error[number::sign] 1:13: `stiffness` of shaft `wg`: must not be negative, found -1 N m/rad | must not be negative | help: write zero or a number above zero\n",
            ),
            (
                "stiffness = \"\"",
                "error[type::wrong] 1:13: `stiffness` of shaft `wg`: expected a torsional stiffness such as \"100 N m/rad\", found an empty text | empty | help: write it like `\"100 N m/rad\"`\n",
            ),
            (
                "ratio = \"5 kg\"",
                "error[unit::dimension] 1:12: `ratio` of shaft `wg`: expected a number without a unit, found a unit | help: write \"5\"\n",
            ),
            (
                "ratio = 0x1F",
                "error[type::wrong] 1:9: `ratio` of shaft `wg`: expected a decimal number or the name of a parameter, found the number 0x1F | the number 0x1F | help: write it like `1.5`\n",
            ),
            (
                "ratio = 1e400",
                "error[number::range] 1:9: `ratio` of shaft `wg`: `1e400` is too large: a number must be below 1.8e308 in SI units | help: check the exponent and the unit\n",
            ),
            (
                "shaft = \" \"",
                "error[type::wrong] 1:9: `shaft` of shaft `wg`: expected the name of a shaft, found an empty text | empty | help: write it like `\"wg\"`\n",
            ),
            (
                "shaft = 1979-05-27",
                "error[type::wrong] 1:9: `shaft` of shaft `wg`: expected the name of a shaft, found a date or time | a date or time | help: write it like `\"wg\"`\n",
            ),
            (
                "shafts = \"wg\"",
                "error[type::wrong] 1:10: `shafts` of shaft `wg`: expected a list of 2 shaft names, found the text \"wg\" | the text \"wg\" | help: write it like `[\"wg\", \"cs\"]`\n",
            ),
            (
                "shafts = [\"wg\", 1]",
                "error[type::wrong] 1:17: `shafts` of shaft `wg`: expected a text, found the number 1 | the number 1 | help: write it like `[\"wg\", \"cs\"]`\n",
            ),
            (
                "any_shafts = []",
                "error[list::length] 1:14: `any_shafts` of shaft `wg`: expected a list of one or more shaft names, found 0 names | 0 names | help: write it like `[\"wg\", \"cs\"]`\n",
            ),
            (
                "law = \"liner\"",
                "error[choice::unknown] 1:7: `law` of shaft `wg`: unknown choice `liner` | unknown | help: did you mean \"linear\"?\n",
            ),
            (
                "law = \"cosine\"",
                "error[choice::unknown] 1:7: `law` of shaft `wg`: unknown choice `cosine` | unknown | help: choose one of `linear` or `quadratic`\n",
            ),
            (
                "motor = []",
                "error[type::wrong] 1:9: `motor` of shaft `wg`: expected the name of an element of the kind `motor`, found a list | a list | help: write it like `\"my_motor\"`\n",
            ),
            (
                "terms = { wg = \"1 kg\", cs = [1] }",
                "error[unit::dimension] 1:19: `wg` in `terms` of shaft `wg`: expected a number without a unit, found a unit | help: write \"1\"\nerror[type::wrong] 1:29: `cs` in `terms` of shaft `wg`: expected a decimal number or the name of a parameter, found a list | a list | help: write it like `1.5`\n",
            ),
            (
                "terms = {}",
                "error[list::length] 1:9: `terms` of shaft `wg`: expected a table from shaft names to numbers, found an empty table | empty | help: write it like `{ wg = 1, cs = -51, fs = 50 }`\n",
            ),
            (
                "name = \"rk.phi\"",
                "error[name::invalid] 1:8: `name` of shaft `wg`: `rk.phi` cannot be a name | not a name | help: a name begins with a letter and goes on with letters (a to z), digits, `_` or `-`, at most 100 in all\n",
            ),
            (
                "value = \"5 N m/rad s\"",
                "error[unit::syntax] 1:20: `value` of shaft `wg`: it is not clear whether `/` also divides by `s` | help: write `N m/rad * s` or `N m/(rad s)`\n",
            ),
            (
                "value = \"\\u0035 kq\"",
                "error[unit::unknown] 1:9: `value` of shaft `wg`: unknown unit `kq` | help: did you mean `kg`?\n",
            ),
            (
                "event = [{ tme = \"1 s\" }, 3, {}]",
                "error[key::unknown] 1:12: entry 1 of `event` of shaft `wg` has no key `tme` | unknown key | help: did you mean `time`?\nerror[type::wrong] 1:27: entry 2 of `event` of shaft `wg`: expected a table, found the number 3 | the number 3 | help: write it like `[{ time = \"2 ms\" }]`\nerror[key::missing] 1:30: entry 3 of `event` of shaft `wg` needs the key `time` | `time` is missing | help: add `time = \"2 ms\"`: When it happens.\n",
            ),
            (
                "event = { time = \"1 kg\" }",
                "error[unit::dimension] 1:18: `time` of `event` of shaft `wg`: expected a time, found a mass | a mass | help: write it like \"2 ms\"\n",
            ),
        ] {
            assert_eq!(mistakes(line), expected, "{line}");
        }
    }

    #[test]
    fn what_is_not_toml_is_reported_once_and_the_rest_is_read() {
        for (line, expected) in [
            (
                "stiffness = 100 N m/rad",
                "error[toml::syntax] 1:13: this is not TOML: text without quotes | help: write \"100 N m/rad\"\n",
            ),
            (
                "stiffness = 100 N m",
                "error[toml::syntax] 1:13: this is not TOML: text without quotes | help: write \"100 N m\"\nerror[unit::dimension] 1:13: `stiffness` of shaft `wg`: expected a torsional stiffness, found a torque | a torque | help: did you mean \"100 N m/rad\"?\n",
            ),
            (
                "stiffness = ",
                "error[toml::syntax] 1:13: this is not TOML: a key without a value | help: write a value after the `=`, or remove the key\n",
            ),
            (
                "ratio = 0.5.2",
                "error[toml::syntax] 1:12: this is not TOML: invalid float, expected nothing | help: see https://toml.io for how a file of keys and values is written\n",
            ),
            (
                "ratio = 1\nratio = 2",
                "error[toml::syntax] 2:1: this is not TOML: a key that was given before | help: keep one of the two\n",
            ),
            (
                "stiffness \"s\"",
                "error[toml::syntax] 1:11: this is not TOML: key with no value, expected `=` | help: write it as `key = value`\n",
            ),
        ] {
            assert_eq!(mistakes(line), expected, "{line}");
        }
    }

    #[test]
    fn nodes_lead_through_the_document() {
        let source = "model = 1\n[[scenario.event]]\na = 1\n[[scenario.event]]\n[study]\n[[sweep]]\n";
        let (document, mut out) = syntax(source);
        let root = Node::root(&document);
        assert!(root.child("model", &mut out).is_none() && root.child("shaft", &mut out).is_none());
        let scenario = root.child("scenario", &mut out).expect("the table is there");
        assert_eq!(scenario.list("event", &mut out).len(), 2);
        assert_eq!(scenario.list("nothing", &mut out).len(), 0);
        assert_eq!(root.list("study", &mut out)[0].span, source.find("[study]").map_or(0..0, |at| at..at + 7));
        root.expect_keys(&["model", "scenario", "studio"], "the file", &mut out);
        assert_eq!(
            plain(source, &out),
            "error[type::wrong] 1:9: `model`: expected a table, found the number 1 | not a table \
             | help: write it as `[model]` with its keys below\n\
             error[key::unknown] 5:2: the file has no key `study` | unknown key | help: did you mean `studio`?\n\
             error[key::unknown] 6:3: the file has no key `sweep` | unknown key \
             | help: known keys are `model`, `scenario` and `studio`\n"
        );
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused(
            text in any::<String>(),
            near in "((inertia|ratio|shafts|terms|event|law|name|x) ?= ?[\\[{\"'a-z0-9 ,=./]{0,12}[\\]}\"']?\n){0,6}",
        ) {
            for source in [text, near] {
                let (document, mut out) = syntax(&source);
                let root = Node::root(&document);
                table(&ELEMENT, &root, "shaft `wg`", &mut out);
                for node in root.children(&mut out) {
                    table(&ELEMENT, &node, "shaft `wg`", &mut out);
                }
                for label in out.iter().flat_map(|diagnostic| &diagnostic.labels) {
                    prop_assert!(source.get(label.span.clone()).is_some(), "{label:?}");
                }
                prop_assert!(out.iter().all(|diagnostic| diagnostic.help.is_some() && !diagnostic.labels.is_empty()));
            }
        }

        #[test]
        fn what_is_read_without_a_mistake_is_what_was_written(numerator in any::<i32>(), denominator in 1_i64..1000) {
            let source = format!("inertia = \"1 kg m^2\"\nratio = \"{numerator}/{denominator}\"\nvalue = {numerator}");
            let (table, mistakes) = read(&source);
            prop_assert_eq!(mistakes.is_empty(), numerator != 0);
            let expected = Value::Scalar(Scalar::Literal(Exact::from_integer(numerator.into()), Dimension::NONE));
            prop_assert_eq!(&table.values["value"].value, &expected);
        }
    }
}

//! Entries to typed tables, by the lists of [`Field`]s in the schema; every mistake is reported, none stops it.
//!
//! [`Node`] walks the tables of a model, [`table`] reads one table by its schema and [`value`] one value. Each of them adds to a list
//! of diagnostics and gives what could be read; the caller uses the model only if no error is in that list.
//!
//! ```
//! use kardan::diagnostics::plain;
//! use kardan::file::syntax;
//! use kardan::model::parse::{Node, table};
//! use kardan::schema::{Field, Kind, Sign};
//! use kardan::units::Dimension;
//!
//! static SHAFT: [Field; 1] = [Field::required("inertia", Kind::Quantity(Dimension::INERTIA, Sign::Positive), "Inertia.")];
//! let source = "[shaft.wg]\ninertia = 0.05\n";
//! let (entries, mut mistakes) = syntax(source);
//! let shafts = Node::root(&entries).child("shaft", &mut mistakes);
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

use crate::diagnostics::{Diagnostic, nearest, shortened};
use crate::entries::{Entries, Entry, KeyedEntry, Place, Written};
use crate::names::did_you_mean;
use crate::schema::{Field, Kind, Placed, Scalar, Sign, Table, Value};
use crate::units::{
    Dimension, Exact, Tolerated, UnitError, parse_number, parse_poles, parse_quantity, parse_tolerated, tolerance_mark,
    written_quantity,
};

/// A table of the model with its name and its place.
///
/// ```
/// use kardan::file::syntax;
/// use kardan::model::parse::Node;
/// let (entries, mut mistakes) = syntax("[scenario]\nevents = 2\n[[scenario.event]]\ntime = \"1 s\"\n");
/// let root = Node::root(&entries);
/// root.expect_keys(&["model", "scenario"], "the file", &mut mistakes);
/// let scenario = root.child("scenario", &mut mistakes).ok_or("no scenario")?;
/// scenario.expect_keys(&["event"], "the scenario", &mut mistakes);
/// assert_eq!(mistakes[0].help.as_deref(), Some("did you mean `event`?"));
/// assert!(scenario.list("event", &mut mistakes)[0].table.get("time").is_some());
/// # Ok::<(), &str>(())
/// ```
#[derive(Debug, Clone)]
pub struct Node<'t> {
    /// The key that leads to it; for an entry of a list the key of the list.
    pub name: &'t str,
    /// Place of that key.
    pub name_place: Place,
    /// Place of the header (`[shaft.wg]`), or of the whole of an inline table.
    pub place: Place,
    /// Its keys and values.
    pub table: &'t Entries,
}

impl<'t> Node<'t> {
    /// The model as a whole.
    pub fn root(entries: &'t Entries) -> Self {
        Self { name: "", name_place: Place::default(), place: Place::default(), table: entries }
    }

    /// The table under a key, if it is there; `type::wrong` is reported if something else is.
    pub fn child(&self, key: &str, out: &mut Vec<Diagnostic>) -> Option<Node<'t>> {
        let found = self.table.keyed(key)?;
        self.as_table(found, &found.entry, out)
    }

    /// All keys as tables, in the order of the file; `type::wrong` is reported for each that is none.
    pub fn children(&self, out: &mut Vec<Diagnostic>) -> Vec<Node<'t>> {
        self.table.iter().filter_map(|found| self.as_table(found, &found.entry, out)).collect()
    }

    /// The tables of the list `[[key]]` (or the single table `[key]`), none if it is not there; `type::wrong` is
    /// reported for each that is no table.
    pub fn list(&self, key: &str, out: &mut Vec<Diagnostic>) -> Vec<Node<'t>> {
        let Some(found) = self.table.keyed(key) else { return Vec::new() };
        match &found.entry.value {
            Written::List(entries) => entries.iter().filter_map(|entry| self.as_table(found, entry, out)).collect(),
            _ => self.as_table(found, &found.entry, out).into_iter().collect(),
        }
    }

    /// Reports `key::unknown` for each key that is not among the known ones.
    pub fn expect_keys(&self, known: &[&str], what: &str, out: &mut Vec<Diagnostic>) {
        for entry in self.table.iter() {
            if !known.contains(&entry.key.as_str()) {
                out.push(unknown_key(entry, known, what));
            }
        }
    }

    fn as_table(&self, found: &'t KeyedEntry, entry: &'t Entry, out: &mut Vec<Diagnostic>) -> Option<Node<'t>> {
        let name = found.key.as_str();
        if let Written::Table(table) = &entry.value {
            return Some(Node { name, name_place: found.place.clone(), place: entry.place.clone(), table });
        }
        let path = if self.name.is_empty() { name.to_string() } else { format!("{}.{name}", self.name) };
        out.push(
            Diagnostic::error(
                "type::wrong",
                format!("`{path}`: expected a table, found {}", self::found(&entry.value)),
            )
            .at(entry.place.clone(), "not a table")
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
    let mut read = Table { fields, place: node.place.clone(), ..Table::default() };
    let mut misspelt = Vec::new();
    for found in node.table.iter() {
        let name = found.key.as_str();
        match fields.iter().find(|field| field.name == name) {
            Some(field) => {
                let before = out.len();
                match value(&field.kind, &format!("`{name}` of {what}"), &found.entry, out) {
                    Some(entry) if field.required && entry.value == Value::Tables(Vec::new()) => {
                        let message = format!("`{name}` of {what}: expected one or more tables, found an empty list");
                        out.push(
                            Diagnostic::error("list::length", message)
                                .at(entry.place, "empty")
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
                out.push(unknown_key(found, &known, what));
            }
        }
    }
    let broken = out.iter().any(|diagnostic| diagnostic.code == "toml::syntax");
    for field in fields.iter().filter(|field| field.required && !broken) {
        // A key that was misspelt is reported once only.
        if node.table.keyed(field.name).is_none() && !misspelt.contains(&field.name) {
            read.unread.push(field.name);
            out.push(
                Diagnostic::error("key::missing", format!("{what} needs the key `{}`", field.name))
                    .at(node.place.clone(), format!("`{}` is missing", field.name))
                    .help(format!("add `{} = {}`: {}", field.name, example(&field.kind), field.doc)),
            );
        }
    }
    let unknown = |name: &&&str| node.table.keyed(name).is_none();
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
/// use kardan::file::syntax;
/// use kardan::model::parse::value;
/// use kardan::schema::{Kind, Scalar, Sign, Value};
/// use kardan::units::{Dimension, Exact};
/// let (entries, mut mistakes) = syntax("ratio = \"51/50\"");
/// let written = &entries.keyed("ratio").ok_or("no ratio")?.entry;
/// let ratio = value(&Kind::Number(Sign::NonZero), "`ratio`", written, &mut mistakes);
/// let expected = Value::Scalar(Scalar::Literal(Exact::from_ratio(51, 50), Dimension::NONE));
/// assert_eq!(ratio.map(|r| r.value), Some(expected));
/// # Ok::<(), &str>(())
/// ```
pub fn value(kind: &Kind, what: &str, entry: &Entry, out: &mut Vec<Diagnostic>) -> Option<Placed<Value>> {
    let place = entry.place.clone();
    let reader = Reader { kind, what, place: place.clone() };
    let read = match (kind, &entry.value) {
        // Reported by the reader of the file.
        (_, Written::Broken) => None,
        (
            Kind::Shaft
            | Kind::Node
            | Kind::Element(_)
            | Kind::Signal
            | Kind::Output
            | Kind::Name
            | Kind::Text
            | Kind::Choice(_),
            Written::Text(text),
        ) => reader.word(text, out).map(Value::Word),
        (Kind::Shafts(_) | Kind::Elements(_) | Kind::Signals | Kind::Outputs | Kind::Words, Written::List(list)) => {
            reader.words(list, out)
        }
        (Kind::Quantity(..) | Kind::AnyQuantity | Kind::Number(_), literal) => {
            reader.scalar(literal, out).map(Value::Scalar)
        }
        (Kind::Coefficients, Written::Table(entries)) => reader.map(&Kind::Number(Sign::Any), entries, out),
        (Kind::Overrides | Kind::Lists, Written::Table(entries)) => reader.map(&Kind::AnyQuantity, entries, out),
        (Kind::Tables(fields), Written::List(list)) => {
            let mut tables = Vec::new();
            for (i, entry) in list.iter().enumerate() {
                let what = format!("entry {} of {what}", i + 1);
                match &entry.value {
                    Written::Table(entries) => tables.push(table(fields, &unnamed(entries, &entry.place), &what, out)),
                    other => {
                        Reader { what: &what, place: entry.place.clone(), ..reader }.wrong_type("a table", other, out)
                    }
                }
            }
            Some(Value::Tables(tables))
        }
        (Kind::Poles, Written::List(list)) => reader.poles(list, out),
        (Kind::Tables(fields) | Kind::Table(fields), Written::Table(entries)) => {
            Some(Value::Tables(vec![table(fields, &unnamed(entries, &place), what, out)]))
        }
        (_, other) => {
            reader.wrong_type(&expected(kind), other, out);
            None
        }
    };
    read.map(|value| Placed { value, place })
}

/// A table without a name of its own.
fn unnamed<'t>(table: &'t Entries, place: &Place) -> Node<'t> {
    Node { name: "", name_place: place.clone(), place: place.clone(), table }
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
const NAME_RULE: &str =
    "a name begins with a letter and goes on with letters (a to z), digits, `_` or `-`, at most 100 in all";

/// Whether a name can be one; if not, that is reported.
pub(super) fn check_name(name: &str, place: Place, what: &str, out: &mut Vec<Diagnostic>) -> bool {
    let valid = is_name(name);
    if !valid {
        out.push(
            Diagnostic::error("name::invalid", format!("`{}` cannot be the name of a {what}", shortened(name)))
                .at(place, "this name")
                .help(NAME_RULE),
        );
    }
    valid
}

/// What is being read: for the messages.
struct Reader<'r> {
    kind: &'r Kind,
    what: &'r str,
    place: Place,
}

impl Reader<'_> {
    fn error(&self, code: &'static str, message: impl AsRef<str>, label: impl Into<String>) -> Diagnostic {
        Diagnostic::error(code, format!("{}: {}", self.what, message.as_ref())).at(self.place.clone(), label)
    }

    fn wrong_type(&self, expected: &str, value: &Written, out: &mut Vec<Diagnostic>) {
        let found = found(value);
        let message = format!("expected {expected}, found {found}");
        out.push(self.error("type::wrong", message, found).help(format!("write it like `{}`", example(self.kind))));
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

    fn words(&self, list: &[Entry], out: &mut Vec<Diagnostic>) -> Option<Value> {
        let mut words: Vec<Placed<String>> = Vec::new();
        for entry in list.iter().filter(|entry| entry.value != Written::Broken) {
            let here = Reader { place: entry.place.clone(), ..*self };
            let Written::Text(text) = &entry.value else {
                here.wrong_type("a text", &entry.value, out);
                continue;
            };
            let Some(word) = here.word(text, out) else { continue };
            match words.iter().find(|other| other.value == word) {
                Some(first) => out.push(
                    here.error("name::duplicate", format!("`{word}` is listed twice"), "again here")
                        .at(first.place.clone(), "first here")
                        .help("remove one of the two"),
                ),
                None => words.push(Placed { value: word, place: entry.place.clone() }),
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

    fn poles(&self, list: &[Entry], out: &mut Vec<Diagnostic>) -> Option<Value> {
        let mut poles = Vec::new();
        for entry in list.iter().filter(|entry| entry.value != Written::Broken) {
            let here = Reader { place: entry.place.clone(), ..*self };
            let text = match &entry.value {
                Written::Text(text) | Written::Number(text) => text,
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

    fn map(&self, kind: &Kind, table: &Entries, out: &mut Vec<Diagnostic>) -> Option<Value> {
        let mut map = Vec::new();
        for found in table.iter() {
            let what = format!("`{}` in {}", found.key, self.what);
            let mut read = |entry: &Entry| {
                if let Some(Placed { value: Value::Scalar(scalar), place }) = value(kind, &what, entry, out) {
                    let name = Placed { value: found.key.clone(), place: found.place.clone() };
                    map.push((name, Placed { value: scalar, place }));
                }
            };
            match &found.entry.value {
                Written::List(list) if *self.kind == Kind::Lists && !list.is_empty() => list.iter().for_each(read),
                _ => read(&found.entry),
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

    fn scalar(&self, value: &Written, out: &mut Vec<Diagnostic>) -> Option<Scalar> {
        let (text, quoted) = match value {
            Written::Text(text) => (text.as_str(), true),
            Written::Number(text) => (text.as_str(), false),
            Written::Quantity(number, dimension) => {
                let text = written_quantity(number, *dimension);
                return self.literal(number.clone(), *dimension, None, &text, out);
            }
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
                out.push(self.unit_error(error, text));
                return None;
            }
        };
        self.literal(number, dimension, tolerated, text, out)
    }

    /// A number that was read, if its dimension and its sign are those asked for.
    fn literal(
        &self,
        number: Exact,
        dimension: Dimension,
        tolerated: Option<Tolerated>,
        text: &str,
        out: &mut Vec<Diagnostic>,
    ) -> Option<Scalar> {
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
    fn unit_error(&self, error: UnitError, text: &str) -> Diagnostic {
        let message = format!("{}: {}", self.what, error.message);
        let diagnostic = Diagnostic::error(error.code, message).at(self.place.part(text, error.span), "");
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

fn unknown_key(found: &KeyedEntry, known: &[&str], what: &str) -> Diagnostic {
    let name = found.key.as_str();
    let help = did_you_mean(nearest(name, known.iter().copied()), || match known {
        [] => format!("{what} takes no keys; remove it"),
        known => format!("known keys are {}", listed(known, "and")),
    });
    Diagnostic::error("key::unknown", format!("{what} has no key `{}`", shortened(name)))
        .at(found.place.clone(), "unknown key")
        .help(help)
}

fn found(value: &Written) -> String {
    match value {
        Written::Text(text) if text.chars().count() <= 40 => format!("the text {text:?}"),
        Written::Text(_) => "a text".to_string(),
        Written::Number(number) | Written::Other("a number", number) if number.len() <= 40 => {
            format!("the number {number}")
        }
        Written::Number(_) => "a number".to_string(),
        Written::Quantity(number, dimension) => written_quantity(number, *dimension),
        Written::Other(what, _) => (*what).to_string(),
        Written::List(_) => "a list".to_string(),
        Written::Table(_) => "a table".to_string(),
        Written::Broken => "nothing that could be read".to_string(),
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
    use crate::file::syntax;

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
        assert_eq!(table.values["inertia"].place.span(), 10..23);
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
        assert_eq!(root.list("study", &mut out)[0].place.span(), source.find("[study]").map_or(0..0, |at| at..at + 7));
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
                    prop_assert!(source.get(label.place.span()).is_some(), "{label:?}");
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

//! Entries to typed tables, by the lists of [`Field`]s in the schema; every error is reported, none stops reading.
//!
//! [`Node`] walks the tables of a model, [`table`] reads one table by its schema and [`value`] one value. Each of them adds to a list
//! of diagnostics and returns the readable parts; the caller uses the model only if no error is in that list.
//!
//! ```
//! use kardan_schema::diagnostics::plain;
//! use kardan_schema::file::syntax;
//! use kardan_model::parse::{Node, table};
//! use kardan_schema::schema::{Field, Kind, Sign};
//! use kardan_math::units::Dimension;
//!
//! static SHAFT: [Field; 1] = [Field::required("inertia", Kind::Quantity(Dimension::INERTIA, Sign::Positive), "Inertia.")];
//! let source = "[shaft.wg]\ninertia = 0.05\n";
//! let (entries, mut diagnostics) = syntax(source);
//! let shafts = Node::root(&entries).child("shaft", &mut diagnostics);
//! for shaft in shafts.map(|shafts| shafts.children(&mut diagnostics)).unwrap_or_default() {
//!     table(&SHAFT, &shaft, &format!("shaft `{}`", shaft.name), &mut diagnostics);
//! }
//! assert_eq!(
//!     plain(source, &diagnostics),
//!     "error[unit::dimension] 2:11: `inertia` of shaft `wg`: expected a moment of inertia, \
//!      found a number without a unit | a number without a unit \
//!      | help: write the unit too: \"0.05 kg m^2\"\n"
//! );
//! ```

mod masses;
mod missing;
mod node;
#[cfg(test)]
#[path = "../../tests/unit/parse.rs"]
mod tests;
mod wording;

use missing::{missing, own_shafts};
use node::HintSource;
pub use node::Node;
pub(super) use wording::example;
use wording::{describe_value, expected, unknown_key};

use self::masses::{misnamed_bodies, names_masses};
use kardan_math::names::nearest_or_similar;
use kardan_math::units::{
    Dimension, Exact, Expression, Tolerated, UnitError, format_quantity, parse_number, parse_poles, parse_quantity,
    parse_tolerated, tolerance_mark,
};
use kardan_schema::diagnostics::{Diagnostic, nearest, shortened};
use kardan_schema::entries::{Entries, Entry, KeyedEntry, Place, RawValue};
use kardan_schema::schema::{Field, Kind, Placed, SHORTEST_PERIOD, Scalar, Sign, Table, Value, present_name};

/// Reads one table by its schema.
///
/// `what` names the table in the messages: ``shaft `wg` ``. The result holds each key that could be read; those that
/// could not, or that are missing, are reported in `out`. If `out` has a `toml::syntax` already, missing keys are not
/// reported: they may be in the broken part.
///
/// # Errors
///
/// `key::unknown`, `key::missing`, and for each value the errors of [`value`].
pub fn table(fields: &'static [Field], node: &Node<'_>, what: &str, out: &mut Vec<Diagnostic>) -> Table {
    let hints: Vec<&str> = fields.iter().map(|field| field.name).collect();
    let mut read = Table { fields, place: node.place.clone(), ..Table::default() };
    let mut misspelt = Vec::new();
    let misnamed = misnamed_bodies(fields, node);
    read.translational = names_masses(fields, node).unwrap_or_else(|| values_of_masses(fields, node));
    for keyed in node.table.iter() {
        let name = keyed.key.as_str();
        let field = fields.iter().find(|field| field.name == name);
        match field.or_else(|| fields.iter().find(|field| field.alias().is_some_and(|alias| alias == name))) {
            Some(field) if name != field.name && node.table.keyed(field.name).is_some() => {
                let message = format!("{what}: `{name}` is an alias of `{}`, which is also present", field.name);
                out.push(
                    Diagnostic::error("key::duplicate", message)
                        .at(&keyed.place, "the second name")
                        .help("remove one of the two"),
                );
            }
            Some(field) => {
                let before = out.len();
                let label = format!("`{name}` of {what}");
                let kind = field.kind.for_translation(read.translational);
                match value_near(&kind, &label, &keyed.entry, node.hints, out) {
                    Some(entry) if field.required && entry.value == Value::Tables(Vec::new()) => {
                        let reader = Reader { kind: &field.kind, what: &label, place: entry.place, hints: node.hints };
                        reader.unlike("list::length", "one or more tables", "an empty list", "empty", out);
                        read.unread.push(field.name);
                    }
                    Some(entry) => {
                        // In part: readable values are checked further.
                        if out.len() > before {
                            read.unread.push(field.name);
                        }
                        if let (Kind::Quantity(..) | Kind::AnyQuantity | Kind::OfTime(_), RawValue::Text(text)) =
                            (&kind, &keyed.entry.value)
                        {
                            read.source_text.insert(field.name, text.clone());
                        }
                        read.values.insert(field.name, entry);
                    }
                    None => read.unread.push(field.name),
                }
            }
            None if let Some(one) = misnamed.iter().find(|one| one.key == name) => {
                misspelt.push(one.field.name);
                let message = format!("{what} has no key `{name}`");
                let help = format!("did you mean `{}`?", one.called);
                out.push(Diagnostic::error("key::unknown", message).at(&keyed.place, "unknown key").help(help));
            }
            None => {
                misspelt.extend(present_name(name, &hints).or_else(|| nearest_or_similar(name, hints.iter().copied())));
                out.push(unknown_key(keyed, &hints, what, node.name));
            }
        }
    }
    let broken = out.iter().any(|diagnostic| diagnostic.code == "toml::syntax");
    let mut proposed = own_shafts(node.table);
    for field in fields.iter().filter(|field| field.required && !broken) {
        // A key that was misspelt is reported once only.
        let has_key = |name: &str| node.table.keyed(name).is_some();
        let absent = !has_key(field.name) && !field.alias().is_some_and(|alias| has_key(&alias));
        if absent && !misspelt.contains(&field.name) {
            read.unread.push(field.name);
            out.push(
                Diagnostic::error("key::missing", format!("{what} needs the key `{}`", field.name))
                    .at(&node.place, format!("`{}` is missing", field.name))
                    .help(missing(field, node.hints, &mut proposed)),
            );
        }
    }
    let unknown = |name: &&&str| node.table.keyed(name).is_none();
    read.unread.extend(
        fields.iter().map(|field| field.name).filter(|name| misspelt.iter().filter(unknown).any(|m| m == name)),
    );
    read
}

/// Whether the values of an element without a body are those for masses: one of them does not fit shafts.
fn values_of_masses(fields: &[Field], node: &Node<'_>) -> bool {
    let has_body = fields.iter().any(|field| field.kind == Kind::Body && field.required);
    let reads = |field: &Field, masses: bool| {
        let Some(keyed) = node.table.keyed(field.name) else { return true };
        value_near(&field.kind.for_translation(masses), "", &keyed.entry, node.hints, &mut Vec::new()).is_some()
    };
    let differs = |field: &&Field| field.kind.for_translation(true) != field.kind.for_translation(false);
    has_body && fields.iter().filter(differs).any(|field| !reads(field, false) && reads(field, true))
}

/// Reads one value by its kind; `None` if it could not be read, and then the reason is in `out`. Of a list or a table
/// with errors the readable entries are returned.
///
/// `what` names the value in the messages: ``parameter `s` ``. A text that has the form of a name where a number or a
/// quantity is expected is a reference to a parameter; whether that exists is not checked here, nor whether shafts,
/// elements and signals do.
///
/// # Errors
///
/// `type::wrong`, `unit::unknown`, `unit::dimension`, `unit::syntax`, `number::syntax`, `number::sign`,
/// `number::not-finite`, `number::range`, `name::invalid`, `name::duplicate`, `choice::unknown`, `list::length`,
/// `tolerance::syntax`, `tolerance::bounds`. A tolerance is read for every scalar; where it is allowed is checked elsewhere.
///
/// ```
/// use kardan_schema::file::syntax;
/// use kardan_model::parse::value;
/// use kardan_schema::schema::{Kind, Scalar, Sign, Value};
/// use kardan_math::units::{Dimension, Exact};
/// let (entries, mut diagnostics) = syntax("ratio = \"51/50\"");
/// let written = &entries.keyed("ratio").ok_or("no ratio")?.entry;
/// let ratio = value(&Kind::Number(Sign::NonZero), "`ratio`", written, &mut diagnostics);
/// let expected = Value::Scalar(Scalar::Literal(Exact::from_ratio(51, 50), Dimension::NONE));
/// assert_eq!(ratio.map(|r| r.value), Some(expected));
/// # Ok::<(), &str>(())
/// ```
pub fn value(kind: &Kind, what: &str, entry: &Entry, out: &mut Vec<Diagnostic>) -> Option<Placed<Value>> {
    value_near(kind, what, entry, HintSource::default(), out)
}

/// The same, with the source of hints.
pub(crate) fn value_near(
    kind: &Kind,
    what: &str,
    entry: &Entry,
    hints: HintSource<'_>,
    out: &mut Vec<Diagnostic>,
) -> Option<Placed<Value>> {
    let place = entry.place.clone();
    let reader = Reader { kind, what, place: place.clone(), hints };
    let read = match (kind, &entry.value) {
        // Reported by the reader of the file.
        (_, RawValue::Broken) => None,
        (
            Kind::Shaft
            | Kind::Mass
            | Kind::Body
            | Kind::Node
            | Kind::Element(_)
            | Kind::Signal
            | Kind::Output
            | Kind::Name
            | Kind::Text
            | Kind::Choice(_),
            RawValue::Text(text),
        ) => reader.word(text, out).map(Value::Word),
        (Kind::Shafts(_) | Kind::Elements(_) | Kind::Signals | Kind::Outputs | Kind::Names, RawValue::List(list)) => {
            reader.names(list, out)
        }
        (
            Kind::Quantity(..) | Kind::Mechanical(..) | Kind::AnyQuantity | Kind::Coefficient | Kind::Number(_),
            literal,
        ) => reader.scalar(literal, out).map(Value::Scalar),
        (Kind::Coefficients, RawValue::Table(entries)) => reader.map(&Kind::Coefficient, entries, out),
        (Kind::Overrides | Kind::Lists | Kind::Point, RawValue::Table(entries)) => {
            reader.map(&Kind::AnyQuantity, entries, out)
        }
        (Kind::Point, RawValue::Text(text)) => match entries_in(text, &place) {
            Some(entries) => reader.map(&Kind::AnyQuantity, &entries, out),
            None => {
                reader.wrong_type(&expected(kind), &entry.value, out);
                None
            }
        },
        (Kind::OfTime(_), RawValue::Text(text)) if is_of_time(text) => reader.formula(text, out).map(Value::Scalar),
        (Kind::OfTime(_), literal) => reader.scalar(literal, out).map(Value::Scalar),
        (Kind::Formula(_) | Kind::Surface | Kind::Expression, RawValue::Text(text) | RawValue::Number(text)) => {
            reader.formula(text, out).map(Value::Scalar)
        }
        (Kind::Formulas | Kind::Expressions | Kind::Functions, RawValue::Table(entries)) => {
            Some(reader.functions(entries, out))
        }
        (Kind::Tables(fields), RawValue::List(list)) => {
            let mut tables = Vec::new();
            for (i, entry) in list.iter().enumerate() {
                let what = format!("entry {} of {what}", i + 1);
                match &entry.value {
                    RawValue::Table(entries) => {
                        tables.push(table(fields, &Node::unnamed(entries, &entry.place, hints), &what, out))
                    }
                    other => {
                        Reader { what: &what, place: entry.place.clone(), ..reader }.wrong_type("a table", other, out)
                    }
                }
            }
            Some(Value::Tables(tables))
        }
        (Kind::Poles, RawValue::List(list)) => reader.poles(list, out),
        (Kind::Tables(fields) | Kind::Table(fields), RawValue::Table(entries)) => {
            Some(Value::Tables(vec![table(fields, &Node::unnamed(entries, &place, hints), what, out)]))
        }
        (_, other) => {
            reader.wrong_type(&expected(kind), other, out);
            None
        }
    };
    read.map(|value| Placed { value, place })
}

/// Whether a text is an expression of the time `t`, or of tables, which a quantity is not.
fn is_of_time(text: &str) -> bool {
    Expression::parse_law(text).is_ok_and(|read| read.names().contains(&"t") || !read.tables().is_empty())
}

/// The longest name, in characters: names become parts of file names.
const NAME_LIMIT: usize = 100;

/// Whether a text has the form of a name: a letter or `_`, then letters, digits, `_` and `-`, at most a hundred in all.
///
/// ```
/// use kardan_model::parse::is_name;
/// assert!(is_name("s_wg-2") && !is_name("rk.phi") && !is_name("2s") && !is_name(""));
/// ```
pub fn is_name(text: &str) -> bool {
    text.len() <= NAME_LIMIT
        && text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
}

/// The rule for names.
const NAME_RULE: &str = "a name is a letter followed by letters (a to z), digits, `_` or `-`, at most 100 characters";

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

/// The error of a name that means something else.
pub(super) fn reserved_name(name: &str, place: &Place, what: &str, reason: &str) -> Diagnostic {
    let message = format!("`{name}` cannot be the name of a {what}: {reason}");
    let diagnostic = Diagnostic::error("name::reserved", message).at(place, "this name");
    diagnostic.help(format!("choose another name, such as `{name}_1`"))
}

/// The entries of a text such as `t = 3.2 s`, with commas between several; `None` if it is none.
fn entries_in(text: &str, place: &Place) -> Option<Entries> {
    let one = |part: &str| {
        let (key, value) = part.split_once('=')?;
        let entry = Entry { value: RawValue::Text(value.trim().into()), place: place.clone() };
        Some(KeyedEntry { key: key.trim().into(), place: place.clone(), entry })
    };
    text.split(',').map(one).collect()
}

/// The name of the value in messages.
struct Reader<'r> {
    kind: &'r Kind,
    what: &'r str,
    place: Place,
    hints: HintSource<'r>,
}

impl Reader<'_> {
    fn error(&self, code: &'static str, message: impl AsRef<str>, label: impl Into<String>) -> Diagnostic {
        Diagnostic::error(code, format!("{}: {}", self.what, message.as_ref())).at(&self.place, label)
    }

    /// A value of another type than expected.
    fn unlike(&self, code: &'static str, expected: &str, source_text: &str, label: &str, out: &mut Vec<Diagnostic>) {
        let message = format!("expected {expected}, found {source_text}");
        out.push(self.error(code, message, label).help(format!("write it like `{}`", example(self.kind))));
    }

    fn wrong_type(&self, expected: &str, value: &RawValue, out: &mut Vec<Diagnostic>) {
        let source_text = describe_value(value);
        self.unlike("type::wrong", expected, &source_text, &source_text, out);
    }

    fn word(&self, text: &str, out: &mut Vec<Diagnostic>) -> Option<String> {
        if text.trim().is_empty() {
            self.unlike("type::wrong", &expected(self.kind), "an empty text", "empty", out);
            return None;
        }
        match self.kind {
            Kind::Choice(choices) if !choices.contains(&text) => {
                let help = match (present_name(text, choices), nearest(text, choices.iter().copied())) {
                    (Some(new), _) => format!("it is called \"{new}\""),
                    (None, Some(nearest_choice)) => format!("did you mean \"{nearest_choice}\"?"),
                    (None, None) => format!("choose {}", expected(self.kind)),
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

    fn names(&self, list: &[Entry], out: &mut Vec<Diagnostic>) -> Option<Value> {
        let mut names: Vec<Placed<String>> = Vec::new();
        for entry in list.iter().filter(|entry| entry.value != RawValue::Broken) {
            let here = Reader { place: entry.place.clone(), ..*self };
            let RawValue::Text(text) = &entry.value else {
                here.wrong_type("a text", &entry.value, out);
                continue;
            };
            let Some(word) = here.word(text, out) else { continue };
            match names.iter().find(|candidate| candidate.value == word) {
                Some(first) => {
                    let message = format!("{}: `{word}` is listed twice", self.what);
                    let diagnostic = Diagnostic::duplicate("name::duplicate", message, &entry.place, &first.place);
                    out.push(diagnostic.help("remove one of the two"));
                }
                None => names.push(Placed { value: word, place: entry.place.clone() }),
            }
        }
        let count = list.len();
        let enough = match *self.kind {
            Kind::Shafts(0) | Kind::Elements(_) => count > 0,
            Kind::Shafts(arity) => count == arity,
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
        Some(Value::Names(names))
    }

    fn poles(&self, list: &[Entry], out: &mut Vec<Diagnostic>) -> Option<Value> {
        let mut poles = Vec::new();
        for entry in list.iter().filter(|entry| entry.value != RawValue::Broken) {
            let here = Reader { place: entry.place.clone(), ..*self };
            let text = match &entry.value {
                RawValue::Text(text) | RawValue::Number(text) => text,
                other => {
                    here.wrong_type("a number or a text", other, out);
                    continue;
                }
            };
            match parse_poles(text) {
                Ok(read) => poles.extend(read),
                Err(error) => out.push(
                    here.error(error.code, error.message, "not a pole")
                        .help("write it like `-50`, `\"-14 + 14.3j\"` or, for a pair, `\"-14 ± 14.3j\"`"),
                ),
            }
        }
        if list.is_empty() {
            self.unlike("list::length", &expected(self.kind), "an empty list", "empty", out);
        }
        Some(Value::Poles(poles))
    }

    fn map(&self, kind: &Kind, table: &Entries, out: &mut Vec<Diagnostic>) -> Option<Value> {
        let mut map = Vec::new();
        for keyed in table.iter() {
            let what = format!("`{}` in {}", keyed.key, self.what);
            let mut read = |entry: &Entry| {
                if let Some(Placed { value: Value::Scalar(scalar), place }) =
                    value_near(kind, &what, entry, self.hints, out)
                {
                    let name = Placed { value: keyed.key.clone(), place: keyed.place.clone() };
                    map.push((name, Placed { value: scalar, place }));
                }
            };
            match &keyed.entry.value {
                RawValue::List(list) if *self.kind == Kind::Lists && list.is_empty() => {
                    let here = Reader { what: &what, place: keyed.entry.place.clone(), ..*self };
                    let help =
                        format!("write its values, for a curve two at least: `{} = [\"1 N m\", \"2 N m\"]`", keyed.key);
                    out.push(here.error("list::length", "a list needs at least one value", "no value").help(help));
                }
                RawValue::List(list) if *self.kind == Kind::Lists => list.iter().for_each(read),
                _ => read(&keyed.entry),
            }
        }
        if table.is_empty() && *self.kind == Kind::Coefficients {
            self.unlike("list::length", &expected(self.kind), "an empty table", "empty", out);
        }
        Some(Value::Map(map))
    }

    /// An expression of what moves.
    fn formula(&self, text: &str, out: &mut Vec<Diagnostic>) -> Option<Scalar> {
        match Expression::parse_law(text) {
            Ok(read) => Some(Scalar::Expression(Box::new(read))),
            Err(error) => {
                out.push(self.unit_error(error, text));
                None
            }
        }
    }

    /// Functions of time by name.
    fn functions(&self, table: &Entries, out: &mut Vec<Diagnostic>) -> Value {
        let mut map = Vec::new();
        for keyed in table.iter() {
            let what = format!("`{}` in {}", keyed.key, self.what);
            let here = Reader { what: &what, place: keyed.entry.place.clone(), ..*self };
            let read = match &keyed.entry.value {
                RawValue::Text(text) | RawValue::Number(text) => here.formula(text, out),
                RawValue::Broken => None,
                other => {
                    here.wrong_type("a function of time such as \"2 N m * sin(2 pi t / 1 s)\"", other, out);
                    None
                }
            };
            if let Some(value) = read {
                let name = Placed { value: keyed.key.clone(), place: keyed.place.clone() };
                map.push((name, Placed { value, place: keyed.entry.place.clone() }));
            }
        }
        Value::Map(map)
    }

    fn scalar(&self, value: &RawValue, out: &mut Vec<Diagnostic>) -> Option<Scalar> {
        let (text, quoted) = match value {
            RawValue::Text(text) => (text.as_str(), true),
            RawValue::Number(text) => (text.as_str(), false),
            RawValue::Quantity(number, dimension) => {
                let text = format_quantity(number, *dimension);
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
        if let Some(read) = self.of_parameter(text).filter(|_| quoted) {
            return Some(Scalar::Expression(Box::new(read)));
        }
        let marked = quoted && tolerance_mark(text).is_some();
        let read = match self.kind {
            _ if marked => parse_tolerated(text).map(|read| (read.value.clone(), read.dimension, Some(read))),
            Kind::Number(_) => {
                // `90 %`
                let share = parse_quantity(text).ok().filter(|(_, dimension)| *dimension == Dimension::NONE);
                let number = parse_number(text).or_else(|error| share.map(|(number, _)| number).ok_or(error));
                number.map(|number| (number, Dimension::NONE, None))
            }
            _ => parse_quantity(text).map(|(number, dimension)| (number, dimension, None)),
        };
        let (number, dimension, tolerated) = match read {
            Ok(read) => read,
            Err(error) if quoted && is_name(text) && error.code != "number::not-finite" => {
                return Some(Scalar::Parameter(text.to_string()));
            }
            Err(error) => match self.expression(error, quoted && !marked, text) {
                Ok(Scalar::Literal(value, dimension)) => (value, dimension, None),
                Ok(expression) => return Some(expression),
                Err(error) => {
                    out.push(self.unit_error(error, text));
                    return None;
                }
            },
        };
        self.literal(number, dimension, tolerated, text, out)
    }

    /// A number times a parameter of the model, where its name is that of a unit too: `2*J` is 2 times the parameter, `2 J` an energy.
    fn of_parameter(&self, text: &str) -> Option<Expression> {
        let parameters = self.hints.model?.table("parameters")?;
        if !text.contains(['*', '/', '·', '⋅']) || parse_quantity(text).is_err() {
            return None;
        }
        let read = Expression::parse(text).ok()?;
        read.names().iter().any(|name| parameters.get(name).is_some()).then_some(read)
    }

    /// A text that is not a quantity, as an expression, or the error if it is not one. Without names it becomes a value directly.
    fn expression(&self, error: UnitError, quoted: bool, text: &str) -> Result<Scalar, UnitError> {
        // A number with a unit where none may be is no expression either.
        if !quoted || ["number::not-finite", "unit::ambiguous"].contains(&error.code) || parse_quantity(text).is_ok() {
            return Err(error);
        }
        // A text without any sign of an expression is an invalid quantity.
        let called = |at: usize| text[..at].ends_with(|c: char| c.is_ascii_alphanumeric() || c == '_');
        let calls = text.match_indices('(').any(|(at, _)| called(at));
        let is_formula =
            calls || text.contains('+') || [" * ", " - ", " / ", "^("].iter().any(|sign| text.contains(sign));
        // A text that begins with a name or a parenthesis is not a number.
        let named = text.trim_start().starts_with(|c: char| c.is_alphabetic() || matches!(c, '(' | '_' | '\''));
        let read = match Expression::parse(text) {
            Ok(read) => read,
            Err(own) if named && text.contains(['*', '/', '^', '(', '×', '·']) => return Err(own),
            Err(own) => {
                let sums = [" + ", " - "].iter().any(|sign| text.contains(sign));
                return Err(if is_formula && (sums || error.code != "unit::syntax") { own } else { error });
            }
        };
        if !read.names().is_empty() {
            return Ok(Scalar::Expression(Box::new(read)));
        }
        let found = read.evaluate(&|_| None)?;
        if !found.exact || *self.kind == Kind::AnyQuantity {
            // The place of use reports that it was rounded, and that it was computed.
            return Ok(Scalar::Expression(Box::new(read)));
        }
        let dimension = match *self.kind {
            Kind::Quantity(expected, _) if expected.is_like(&found.dimension) => expected,
            Kind::Number(_) if Dimension::NONE.is_like(&found.dimension) => Dimension::NONE,
            _ => found.dimension,
        };
        Ok(Scalar::Literal(found.value, dimension))
    }

    /// A number that was read, if its dimension and its sign are those expected.
    fn literal(
        &self,
        number: Exact,
        dimension: Dimension,
        tolerated: Option<Tolerated>,
        text: &str,
        out: &mut Vec<Diagnostic>,
    ) -> Option<Scalar> {
        let (mut number, mut dimension) = (number, dimension);
        if let (Kind::Quantity(expected, _), None) = (self.kind, &tolerated)
            && let Some(period) = expected.of_other(&number, &dimension)
        {
            (number, dimension) = (period, *expected);
        }
        let sign = match *self.kind {
            Kind::Quantity(expected, _) if expected != dimension => {
                let help = expected.hint(tolerated.as_ref().map_or(text, |read| read.text.as_str()));
                out.push(Diagnostic::wrong_dimension(self.what, [expected, dimension], &self.place).help(help));
                return None;
            }
            Kind::Coefficient if !is_coefficient(dimension) => {
                let message = format!("expected {}, found {}", expected(self.kind), dimension.noun());
                let help = "write `2`, or `\"7 mm/rad\"` for a shaft that moves a mass";
                out.push(self.error("unit::dimension", message, dimension.noun()).help(help));
                return None;
            }
            Kind::Number(_) if dimension != Dimension::NONE => {
                let help = "write the number without a unit";
                out.push(Diagnostic::wrong_dimension(self.what, [Dimension::NONE, dimension], &self.place).help(help));
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
        Diagnostic::of_unit_error(self.what, error, text, &self.place)
    }
}

/// A number without a unit, or a length for each angle.
fn is_coefficient(dimension: Dimension) -> bool {
    dimension == Dimension::NONE || Dimension::LENGTH.is_like(&dimension)
}

/// The rule that a number violates, and the remedy.
pub fn broken(sign: Sign, number: &Exact) -> Option<(&'static str, &'static str)> {
    match (sign, number.signum()) {
        (Sign::NonNegative, -1) => Some(("must not be negative", "write zero or a number above zero")),
        (Sign::Positive | Sign::Period, -1 | 0) => Some(("must be more than zero", "write a number above zero")),
        (Sign::NonZero, 0) => Some(("must not be zero", "write a number other than zero")),
        (Sign::Period, _) if number.to_f64() < SHORTEST_PERIOD => Some((
            "must be at least 1 us",
            "check its unit; a run computes every sample: a million per second with \"1 us\", a thousand with \"1 ms\"",
        )),
        _ => None,
    }
}

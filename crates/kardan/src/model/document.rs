//! The text of a model file as typed tables; names are not looked up yet.

use std::collections::BTreeSet;
use std::sync::LazyLock;

use super::parse::{NAME_RULE, Node, is_name, table, value};
use super::resolve::{Setting, TableReader};
use super::tables;
use crate::diagnostics::{Diagnostic, Severity, nearest, quoted, shortened};
use crate::element::{self, Element};
use crate::entries::{Entries, Entry, KeyedEntry, Place, Written};
use crate::file::syntax;
use crate::schema::{Field, Keys, Kind, Placed, Scalar, Sign, Table, Value};
use crate::synthesis::{self, LawKind};
use crate::units::{
    Dimension, Exact, Spread, Tolerated, UnitError, parse_number, parse_quantity, parse_quantity_list, tolerance_mark,
    written_quantity,
};

/// What tells the law of a `[control.<name>]`; the other keys are those of the law.
pub const CONTROL: &[Field] = &[Field::required("law", Kind::Choice(LAWS), "Which control law.")];

/// The keywords of [`synthesis::REGISTRY`]; a test keeps them equal.
const LAWS: &[&str] = &[
    "computed_torque",
    "decoupling",
    "flatness",
    "lqr",
    "noninteracting",
    "pole_placement",
    "position_loop",
    "sampled_noninteracting",
];

/// All keys of a control table, by law.
static CONTROL_FIELDS: LazyLock<Vec<Vec<Field>>> =
    LazyLock::new(|| synthesis::REGISTRY.iter().map(|law| [CONTROL, law.fields].concat()).collect());

/// An entry of `[parameters]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name.
    pub name: String,
    /// Place of the value.
    pub place: Place,
    /// SI value.
    pub value: Exact,
    /// Dimension.
    pub dimension: Dimension,
    /// The value as written, without its tolerance.
    pub text: String,
    /// How far it may be from its value, if that is written behind it.
    pub spread: Option<Spread>,
}

/// An entry of `[variants]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Variants {
    /// The parameter.
    pub parameter: Placed<String>,
    /// `(SI value, as written)`.
    pub values: Vec<(Exact, String)>,
    /// Dimension of the values.
    pub dimension: Dimension,
}

/// An entry of `[[variant]]`: parameter values with a name.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedVariant {
    /// The name.
    pub name: Placed<String>,
    /// The values.
    pub settings: Vec<Setting>,
    /// The controllers in the loop; `None`: all.
    pub controls: Option<Vec<Placed<String>>>,
}

/// An element's table.
#[derive(Debug, Clone)]
pub struct Instance {
    /// Its kind.
    pub kind: &'static Element,
    /// Its name.
    pub name: String,
    /// Place of the header.
    pub place: Place,
    /// Its keys.
    pub table: Table,
}

/// A controller's table.
#[derive(Debug, Clone)]
pub struct Control {
    /// Its law.
    pub law: &'static LawKind,
    /// Its name.
    pub name: String,
    /// Place of the header.
    pub place: Place,
    /// Its keys.
    pub table: Table,
}

/// A model file as typed tables.
#[derive(Debug, Clone, Default)]
pub struct Document {
    /// `[model]`
    pub model: Table,
    /// `[parameters]`
    pub parameters: Vec<Parameter>,
    /// Keys of elements that are written with a tolerance: parameters of the names `<element>.<key>`.
    pub implicit: Vec<Parameter>,
    /// `[variants]`
    pub variants: Vec<Variants>,
    /// `[[variant]]`
    pub named_variants: Vec<NamedVariant>,
    /// All elements.
    pub elements: Vec<Instance>,
    /// All controllers.
    pub controls: Vec<Control>,
    /// `[scenario]`
    pub scenario: Table,
    /// `[analysis]`
    pub analysis: Table,
    /// `[bench]`
    pub bench: Table,
    /// `[[requirement]]`
    pub requirements: Vec<Table>,
    /// `[[plot]]`
    pub plots: Vec<Table>,
    /// `[identification]`
    pub identification: Table,
    /// `[log.<name>]`: names and tables.
    pub logs: Vec<(String, Table)>,
    /// What could not be read.
    pub doubts: Doubts,
}

/// What a document may hold beyond what could be read. A mistake that was reported must not lead to further ones: what
/// names something in doubt is passed over in silence.
#[derive(Debug, Clone, Default)]
pub struct Doubts {
    /// Any name may exist: a header was broken.
    pub all: bool,
    /// Names that may stand for anything: of elements, controllers, parameters.
    pub names: BTreeSet<String>,
    /// There may be further references, and motors that they command.
    pub references: bool,
    /// There may be further variants.
    pub variants: bool,
    /// The equations are not those of the file: an element, a controller, a parameter or the choice of coordinates is
    /// wrong.
    pub equations: bool,
}

impl Doubts {
    /// Whether a name may exist that was not read.
    pub fn has(&self, name: &str) -> bool {
        self.all || self.names.contains(name)
    }
}

impl Document {
    /// Whether a parameter differs between the variants.
    pub fn is_varied(&self, parameter: &str) -> bool {
        self.variants.iter().any(|variants| variants.parameter.value == parameter)
            || self.named_variants.iter().any(|variant| variant.settings.iter().any(|s| s.name == parameter))
    }

    /// Number of runs.
    pub fn runs(&self) -> usize {
        let named = self.named_variants.len().max(1);
        self.variants.iter().fold(named, |runs, variants| runs.saturating_mul(variants.values.len()))
    }
}

/// Most runs that one study may have.
const MOST_VARIANTS: usize = 1000;

/// Reads a model file. All mistakes of syntax, keys, types and units are reported together.
pub fn read(source: &str) -> (Document, Vec<Diagnostic>) {
    let (entries, mistakes, broken) = open(source);
    read_entries(&entries, mistakes, broken)
}

/// The entries of a model file, what is not TOML in it, and whether a broken line may have held a header.
pub fn open(source: &str) -> (Entries, Vec<Diagnostic>, bool) {
    if source.trim().is_empty() {
        let mistake = Diagnostic::error("file::empty", "the model file is empty")
            .help("a model needs at least one shaft: `[shaft.motor]` with `inertia = \"1 kg m^2\"`");
        return (Entries::default(), vec![mistake], true);
    }
    let (entries, mistakes) = syntax(source);
    // A broken line may have held a header, a broken text or list may have swallowed one.
    let broken = mistakes.iter().any(|mistake| {
        let harmless = ["text without quotes", "a key without a value", "a key that was given before", "invalid float"];
        let start = mistake.labels.first().map_or(0, |label| label.place.span().start);
        let line_start = source[..start].rfind('\n').map_or(0, |at| at + 1);
        source[line_start..].trim_start().starts_with('[')
            || !harmless.iter().any(|message| mistake.message.contains(message))
    });
    (entries, mistakes, broken)
}

/// Reads the entries of a model: `mistakes` are those told already, and after `broken` ones any name may exist.
pub fn read_entries(entries: &Entries, mistakes: Vec<Diagnostic>, broken: bool) -> (Document, Vec<Diagnostic>) {
    let mut document = Document::default();
    document.doubts.all = broken;
    if broken && entries.is_empty() {
        return (document, mistakes);
    }
    // Two lists: mistakes that leave the equations in doubt and others. Both begin with what is broken, for `table`.
    let broken = mistakes.len();
    let mut study = mistakes.clone();
    let mut out = mistakes;
    let root = Node::root(entries);
    check_tables(&root, &mut document.doubts, &mut out, &mut study);
    let single = |key: &str, fields: &'static [Field], out: &mut Vec<Diagnostic>| {
        let what = format!("`[{key}]`");
        let mut table = root.child(key, out).map(|node| table(fields, &node, &what, out)).unwrap_or_default();
        refuse_tolerances(&mut table, &what, REMOVE_TOLERANCE, out);
        table
    };
    let several = |key: &str, fields: &'static [Field], out: &mut Vec<Diagnostic>| {
        let mut tables = Vec::new();
        for node in root.list(key, out) {
            let named = node.table.iter().find(|found| {
                matches!(found.entry.value, Written::Table(_)) && fields.iter().all(|field| field.name != found.key)
            });
            if let Some(found) = named {
                let message =
                    format!("`{key}` is a list of tables without a name, found the table `{key}.{}`", found.key);
                out.push(
                    Diagnostic::error("type::wrong", message)
                        .at(found.place.clone(), "a name")
                        .help(format!("write each as `[[{key}]]`")),
                );
                continue;
            }
            let what = format!("`[[{key}]]`");
            let mut table = table(fields, &node, &what, out);
            refuse_tolerances(&mut table, &what, REMOVE_TOLERANCE, out);
            tables.push(table);
        }
        tables
    };
    document.model = single("model", tables::Header::FIELDS, &mut out);
    document.scenario = single("scenario", tables::Scenario::FIELDS, &mut study);
    document.analysis = single("analysis", tables::Analysis::FIELDS, &mut study);
    document.identification = single("identification", tables::Identification::FIELDS, &mut study);
    document.bench = single("bench", tables::Bench::FIELDS, &mut study);
    document.requirements = several("requirement", tables::Requirement::FIELDS, &mut study);
    document.plots = several("plot", tables::Plot::FIELDS, &mut study);
    read_parameters(&root, &mut document, &mut out);
    let tables = several("variant", tables::Variant::FIELDS, &mut study);
    read_named_variants(&tables, &mut document, &mut study);
    read_variants(&root, &mut document, &mut study);
    for kind in element::REGISTRY {
        for node in named_tables(&root, kind.keyword, kind.fields, &mut document.doubts, &mut out) {
            let what = format!("{} `{}`", kind.keyword, shortened(node.name));
            let before = out.len();
            let mut table = table(kind.fields, &node, &what, &mut out);
            let implicit = implicit_parameters(node.name, &mut table);
            refuse_tolerances(&mut table, &what, "declare a parameter with it, and write its name here", &mut out);
            if out.len() > before {
                document.doubts.names.insert(node.name.to_string());
            }
            document.implicit.extend(implicit);
            document.elements.push(Instance {
                kind,
                name: node.name.to_string(),
                place: node.name_place.clone(),
                table,
            });
        }
    }
    for node in named_tables(&root, "control", CONTROL, &mut document.doubts, &mut out) {
        let what = format!("control `{}`", shortened(node.name));
        let given = node.table.keyed("law").map(|found| &found.entry);
        let word = given.map(|given| if let Written::Text(word) = &given.value { word.as_str() } else { "" });
        let law = word.and_then(|word| synthesis::REGISTRY.iter().position(|law| law.keyword == word));
        let Some(number) = law else {
            // Says what is wrong with `law` alone: the other keys depend on it.
            match given {
                Some(given) => drop(value(&CONTROL[0].kind, &format!("`law` of {what}"), given, &mut out)),
                None => {
                    drop(table(&CONTROL[..1], &Node { table: &Entries::default(), ..node.clone() }, &what, &mut out))
                }
            }
            document.doubts.references = true;
            document.doubts.equations = true;
            continue;
        };
        let before = out.len();
        let mut table = table(&CONTROL_FIELDS[number], &node, &what, &mut out);
        refuse_tolerances(&mut table, &what, REMOVE_TOLERANCE, &mut out);
        document.doubts.references |= out.len() > before;
        let law = &synthesis::REGISTRY[number];
        document.controls.push(Control { law, name: node.name.to_string(), place: node.name_place.clone(), table });
    }
    for node in named_tables(&root, "log", tables::Log::FIELDS, &mut Doubts::default(), &mut study) {
        let what = format!("log `{}`", shortened(node.name));
        let mut table = table(tables::Log::FIELDS, &node, &what, &mut study);
        refuse_tolerances(&mut table, &what, REMOVE_TOLERANCE, &mut study);
        document.logs.push((node.name.to_string(), table));
    }
    check_unique(&document, &mut out);
    check_named_controls(&document, &mut study);
    let is_error = |d: &Diagnostic| d.severity == Severity::Error;
    if document.elements.iter().all(|e| e.kind.keyword != "shaft" && e.kind.charges(&e.name).is_empty())
        && !document.doubts.all
        && !out.iter().chain(&study).any(is_error)
    {
        out.push(
            Diagnostic::error("model::no-shaft", "the model has no shaft")
                .help("add at least one: `[shaft.motor]` with `inertia = \"1 kg m^2\"`"),
        );
    }
    document.doubts.equations |= out.iter().any(is_error);
    out.extend(study.drain(broken..));
    (document, out)
}

/// The study's tables; all others make the equations.
const STUDY: [&str; 7] = ["scenario", "requirement", "plot", "analysis", "bench", "identification", "log"];

/// Reports tables that a model file does not have.
fn check_tables(root: &Node<'_>, doubts: &mut Doubts, out: &mut Vec<Diagnostic>, study: &mut Vec<Diagnostic>) {
    let mut known = vec!["model", "parameters", "variants", "variant", "control"];
    known.extend(STUDY);
    known.extend(element::REGISTRY.iter().map(|kind| kind.keyword));
    for found in root.table.iter() {
        let (name, value) = (found.key.as_str(), &found.entry.value);
        if known.contains(&name) {
            continue;
        }
        let meant = nearest(name, known.iter().copied());
        let is_table = matches!(value, Written::Table(_) | Written::List(_));
        let help = match (meant, name) {
            (Some(meant), _) => format!("did you mean `{meant}`?"),
            (None, "event" | "events") => "write each as `[[scenario.event]]`".to_string(),
            (None, "fault" | "faults") => "write each as `[[scenario.fault]]`".to_string(),
            (None, "extra" | "candidate") => format!("write each as `[[identification.{name}]]`"),
            (None, "channel" | "channels") => "write each as `[[log.NAME.channel]]`".to_string(),
            (None, "actuator" | "actuators") => "write each as `[[analysis.actuator]]`".to_string(),
            (None, "tolerance" | "tolerances") => "write a tolerance behind its value: \"1 N m ± 10 %\"".to_string(),
            (None, "sources" | "source" | "input" | "inputs") => {
                "torques come from `motor` and `disturbance`".to_string()
            }
            (None, _) => format!(
                "known tables are {}",
                known.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
            ),
        };
        let (what, label) = if is_table { ("table", "unknown table") } else { ("key", "unknown key") };
        let mistake =
            Diagnostic::error("key::unknown", format!("a model file has no {what} `{}` at the top", shortened(name)))
                .at(found.place.clone(), label)
                .help(help);
        if !is_table || meant.is_some_and(|meant| STUDY.contains(&meant)) {
            study.push(mistake);
            continue;
        }
        out.push(mistake);
        doubts.references |= meant.is_none_or(|meant| meant == "control");
        doubts.variants |= meant.is_none_or(|meant| meant == "variants");
        doubts.all |= !doubt_names(value, doubts);
    }
}

/// The names that a table of tables or a list of tables would have introduced; false if it is neither.
fn doubt_names(value: &Written, doubts: &mut Doubts) -> bool {
    match value {
        Written::Table(table) => doubts.names.extend(table.iter().map(|found| found.key.clone())),
        Written::List(list) => {
            for entry in list {
                let Written::Table(table) = &entry.value else { return false };
                let Some(Written::Text(name)) = table.get("name") else { return false };
                doubts.names.insert(name.clone());
            }
        }
        _ => return false,
    }
    true
}

/// The tables `[keyword.NAME]`.
fn named_tables<'t>(
    root: &Node<'t>,
    keyword: &str,
    fields: &[Field],
    doubts: &mut Doubts,
    out: &mut Vec<Diagnostic>,
) -> Vec<Node<'t>> {
    let Some(found) = root.table.keyed(keyword) else { return Vec::new() };
    let given = &found.entry.value;
    let Written::Table(_) = given else {
        doubts.all |= !doubt_names(given, doubts);
        doubts.references |= keyword == "control";
        let what = if matches!(given, Written::List(_)) { "a list" } else { "a value" };
        out.push(
            Diagnostic::error("type::wrong", format!("`{keyword}`: expected tables with a name each, found {what}"))
                .at(found.place.clone(), "not a table")
                .help(format!("write each as `[{keyword}.NAME]` with its keys below")),
        );
        return Vec::new();
    };
    let Some(mut group) = root.child(keyword, out) else { return Vec::new() };
    let is_table = |found: &&KeyedEntry| matches!(found.entry.value, Written::Table(_));
    let loose = group.table.iter().find(|found| !is_table(found) && fields.iter().any(|f| f.name == found.key));
    if let Some(found) = loose {
        doubts.all = true;
        let message = format!("a {keyword} needs a name: `{}` stands in `[{keyword}]` itself", found.key);
        out.push(
            Diagnostic::error("name::missing", message)
                .at(group.place.clone(), "no name")
                .help(format!("write `[{keyword}.NAME]` with a name of your choice")),
        );
    }
    doubts.names.extend(group.table.iter().filter(|found| !is_table(found)).map(|found| found.key.clone()));
    group.name = if loose.is_some() { "" } else { group.name };
    let nodes = if loose.is_some() { group.children(&mut Vec::new()) } else { group.children(out) };
    for node in &nodes {
        check_name(node.name, node.name_place.clone(), keyword, out);
    }
    nodes
}

fn check_name(name: &str, place: Place, what: &str, out: &mut Vec<Diagnostic>) -> bool {
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

fn check_unique(document: &Document, out: &mut Vec<Diagnostic>) {
    let mut seen: Vec<(&str, &str, &Place)> = Vec::new();
    let elements = document.elements.iter().map(|e| (e.name.as_str(), e.kind.keyword, &e.place));
    let controls = document.controls.iter().map(|c| (c.name.as_str(), "control", &c.place));
    for (name, kind, place) in elements.chain(controls) {
        match seen.iter().find(|(other, _, _)| *other == name) {
            Some((_, other_kind, other_span)) => out.push(
                Diagnostic::error(
                    "name::duplicate",
                    format!("the name `{name}` is used for a {other_kind} and a {kind}"),
                )
                .at(place.clone(), "again here")
                .at((*other_span).clone(), "first here")
                .help("give each element and each controller a name of its own"),
            ),
            None => seen.push((name, kind, place)),
        }
    }
}

/// The controllers that variants name must be there, and each controller in some variant.
fn check_named_controls(document: &Document, out: &mut Vec<Diagnostic>) {
    let variants = &document.named_variants;
    let used = |name: &String| {
        variants.iter().any(|v| v.controls.as_ref().is_none_or(|names| names.iter().any(|other| other.value == *name)))
    };
    for control in document.controls.iter().filter(|control| !variants.is_empty() && !used(&control.name)) {
        out.push(
            Diagnostic::warning("control::unused", format!("no variant uses the controller `{}`", control.name))
                .at(control.place.clone(), "in no loop, hence not checked")
                .help("name it in `controls` of a `[[variant]]`, or remove it"),
        );
    }
    for variant in &document.named_variants {
        for word in variant.controls.iter().flatten() {
            let names = || document.controls.iter().map(|control| control.name.as_str());
            if names().any(|name| name == word.value) || document.doubts.references || document.doubts.has(&word.value)
            {
                continue;
            }
            let help = match nearest(&word.value, names()) {
                Some(near) => format!("did you mean `{near}`?"),
                None if document.controls.is_empty() => "the model has no `[control.NAME]`".to_string(),
                None => format!("there are {}", quoted(names())),
            };
            let name = &variant.name.value;
            let message = format!("variant `{name}`: there is no controller `{}`", shortened(&word.value));
            out.push(
                Diagnostic::error("name::unknown", message).at(word.place.clone(), "no such controller").help(help),
            );
        }
    }
}

fn read_parameters(root: &Node<'_>, document: &mut Document, out: &mut Vec<Diagnostic>) {
    let before = out.len();
    let Some(node) = root.child("parameters", out) else {
        document.doubts.all |= out.len() > before;
        return;
    };
    for found in node.table.iter() {
        let (name, place, given) = (found.key.as_str(), found.place.clone(), &found.entry);
        // In doubt until it is read: what uses it is not wrong for that.
        document.doubts.names.insert(name.to_string());
        if !check_name(name, place.clone(), "parameter", out) {
            continue;
        }
        let number = parse_number(name);
        if number.is_ok() || number.is_err_and(|error| error.code == "number::not-finite") {
            out.push(
                Diagnostic::error(
                    "name::reserved",
                    format!("`{name}` cannot be the name of a parameter: it means a number"),
                )
                .at(place, "this name")
                .help(format!("choose another name, such as `{name}_1`")),
            );
            continue;
        }
        let what = format!("parameter `{name}`");
        let is_number = matches!(given.value, Written::Number(_));
        let kind = if is_number { Kind::Number(Sign::Any) } else { Kind::AnyQuantity };
        let Some(read) = value(&kind, &what, given, out) else { continue };
        let name = name.to_string();
        match read.value {
            Value::Scalar(Scalar::Literal(value, dimension)) => {
                let text = match &given.value {
                    Written::Text(text) | Written::Number(text) => text.clone(),
                    _ => written_quantity(&value, dimension),
                };
                document.doubts.names.remove(&name);
                document.parameters.push(Parameter { name, place: read.place, value, dimension, text, spread: None });
            }
            Value::Scalar(Scalar::Tolerated(tolerated)) => {
                document.doubts.names.remove(&name);
                document.parameters.push(parameter(name, read.place, *tolerated));
            }
            _ => out.push(
                Diagnostic::error("parameter::literal", format!("{what} must be a quantity, not a name"))
                    .at(read.place, "not a quantity")
                    .help("write a number with its unit, such as \"30 deg\""),
            ),
        }
    }
}

fn parameter(name: String, place: Place, read: Tolerated) -> Parameter {
    let Tolerated { value, dimension, spread, text } = read;
    Parameter { name, place, value, dimension, text, spread: Some(spread) }
}

/// Takes the tolerances out of an element's table: each such key becomes a parameter of the name `<element>.<key>`.
fn implicit_parameters(element: &str, table: &mut Table) -> Vec<Parameter> {
    let mut out = Vec::new();
    for (key, given) in &mut table.values {
        let name = format!("{element}.{key}");
        if let Value::Scalar(scalar @ Scalar::Tolerated(_)) = &mut given.value
            && let Scalar::Tolerated(read) = std::mem::replace(scalar, Scalar::Parameter(name.clone()))
        {
            out.push(parameter(name, given.place.clone(), *read));
        }
    }
    out
}

const REMOVE_TOLERANCE: &str = "remove the tolerance: elements and `[parameters]` can have one";

/// Reports tolerances where a value cannot have one, and goes on with the value itself.
fn refuse_tolerances(table: &mut Table, what: &str, help: &str, out: &mut Vec<Diagnostic>) {
    let refuse = |scalar: &mut Scalar, place: &Place, what: String, out: &mut Vec<Diagnostic>| {
        if let Scalar::Tolerated(read) = scalar {
            out.push(
                Diagnostic::error("tolerance::place", format!("{what} cannot have a tolerance"))
                    .at(place.clone(), "with a tolerance")
                    .help(help),
            );
            *scalar = Scalar::Literal(read.value.clone(), read.dimension);
        }
    };
    for (key, given) in &mut table.values {
        match &mut given.value {
            Value::Scalar(scalar) => refuse(scalar, &given.place, format!("`{key}` of {what}"), out),
            Value::Map(entries) => {
                for (name, scalar) in entries {
                    let what = format!("`{}` in `{key}` of {what}", shortened(&name.value));
                    refuse(&mut scalar.value, &scalar.place, what, out);
                }
            }
            Value::Tables(tables) => {
                for (i, table) in tables.iter_mut().enumerate() {
                    refuse_tolerances(table, &format!("entry {} of `{key}` of {what}", i + 1), help, out);
                }
            }
            Value::Word(_) | Value::Words(_) | Value::Poles(_) => {}
        }
    }
}

const VARIANTS_HELP: &str = "write a list such as \"[0, 10, 20, 30] deg\" or [\"0 deg\", \"10 deg\"]";

/// A value of a list of variants with its place.
type VariantValue = (Exact, Dimension, String, Place);

/// The values in a list of variants; nothing if something is wrong with it, which is reported.
fn variant_values(name: &str, given: &Entry, out: &mut Vec<Diagnostic>) -> Option<Vec<VariantValue>> {
    let before = out.len();
    let mut values = Vec::new();
    let unreadable = |error: UnitError, text: &str, place: &Place| {
        Diagnostic::error(error.code, format!("variants of `{name}`: {}", error.message))
            .at(place.part(text, error.span), "")
            .help(error.help.unwrap_or_else(|| VARIANTS_HELP.to_string()))
    };
    let toleranced = |text: &str, place: &Place| {
        tolerance_mark(text)?;
        Some(
            Diagnostic::error("tolerance::place", format!("variants of `{name}` cannot have a tolerance"))
                .at(place.clone(), "with a tolerance")
                .help("write the tolerance behind the value under `[parameters]`; `±` moves along with the variants"),
        )
    };
    match &given.value {
        Written::Text(text) if toleranced(text, &given.place).is_some() => out.extend(toleranced(text, &given.place)),
        Written::Text(text) if text.trim_start().starts_with('[') => match parse_quantity_list(text) {
            Ok(list) => {
                let one = |(value, dimension, text)| (value, dimension, text, given.place.clone());
                values.extend(list.into_iter().map(one));
            }
            Err(error) => out.push(unreadable(error, text, &given.place)),
        },
        Written::List(list) => {
            for entry in list {
                let text = match &entry.value {
                    Written::Text(text) | Written::Number(text) => text.clone(),
                    Written::Quantity(value, dimension) => {
                        let text = written_quantity(value, *dimension);
                        values.push((value.clone(), *dimension, text, entry.place.clone()));
                        continue;
                    }
                    _ => {
                        let message = format!("variants of `{name}`: expected a quantity");
                        out.push(
                            Diagnostic::error("type::wrong", message)
                                .at(entry.place.clone(), "not a quantity")
                                .help(VARIANTS_HELP),
                        );
                        continue;
                    }
                };
                if let Some(mistake) = toleranced(&text, &entry.place) {
                    out.push(mistake);
                    continue;
                }
                match parse_quantity(&text) {
                    Ok((value, dimension)) => {
                        values.push((value, dimension, text.trim().to_string(), entry.place.clone()));
                    }
                    Err(error) => out.push(unreadable(error, &text, &entry.place)),
                }
            }
        }
        Written::Broken => return None,
        _ => {
            let message = format!("variants of `{name}` must be a list of quantities");
            out.push(
                Diagnostic::error("type::wrong", message).at(given.place.clone(), "not a list").help(VARIANTS_HELP),
            );
        }
    }
    if values.is_empty() && out.len() == before {
        let message = format!("the list of variants of `{name}` is empty");
        out.push(Diagnostic::error("list::length", message).at(given.place.clone(), "no entry").help(VARIANTS_HELP));
    }
    (out.len() == before).then_some(values)
}

fn read_named_variants(tables: &[Table], document: &mut Document, out: &mut Vec<Diagnostic>) {
    let before = out.len();
    for table in tables {
        let Some(Placed { value: Value::Word(name), place }) = table.values.get("name") else { continue };
        let what = format!("variant `{name}`");
        if let Some(other) = document.named_variants.iter().find(|other| other.name.value.eq_ignore_ascii_case(name)) {
            out.push(
                Diagnostic::error("name::duplicate", format!("there are two variants named `{name}`"))
                    .at(place.clone(), "again here")
                    .at(other.name.place.clone(), "first here")
                    .help("give each variant a name of its own; it becomes a file name"),
            );
            continue;
        }
        let settings = TableReader::new(document, &[]).settings(table, "set", &what, out);
        let name = Placed { value: name.clone(), place: place.clone() };
        let controls = match table.values.get("controls").map(|given| &given.value) {
            Some(Value::Words(words)) => Some(words.clone()),
            _ => None,
        };
        document.named_variants.push(NamedVariant { name, settings, controls });
    }
    if document.named_variants.len() > MOST_VARIANTS {
        let message = format!("{} variants are more than one study may have ({MOST_VARIANTS})", tables.len());
        out.push(
            Diagnostic::error("list::length", message)
                .at(document.named_variants[MOST_VARIANTS].name.place.clone(), "one too many")
                .help("split the study into several files"),
        );
        document.named_variants.clear();
    }
    document.doubts.variants |= out.len() > before || tables.len() > document.named_variants.len();
}

fn read_variants(root: &Node<'_>, document: &mut Document, out: &mut Vec<Diagnostic>) {
    let before = out.len();
    let Some(node) = root.child("variants", out) else {
        document.doubts.variants |= out.len() > before;
        return;
    };
    let mut count = document.named_variants.len().max(1);
    for found in node.table.iter() {
        let (name, place, given) = (found.key.as_str(), &found.place, &found.entry);
        if let Some(other) = document.named_variants.iter().find(|v| v.settings.iter().any(|s| s.name == name)) {
            let message = format!("`{name}` is varied here and set by the variant `{}`", other.name.value);
            out.push(
                Diagnostic::error("name::duplicate", message)
                    .at(place.clone(), "varied here")
                    .at(other.name.place.clone(), "set in this variant")
                    .help("vary it here, or set it in each `[[variant]]`"),
            );
        }
        let declared = document.parameters.iter().find(|p| p.name == name);
        if declared.is_none() && !document.doubts.has(name) {
            let names = document.parameters.iter().map(|p| p.name.as_str());
            let help = match nearest(name, names.clone()) {
                Some(near) => format!("did you mean `{near}`?"),
                None if document.parameters.is_empty() => {
                    format!("declare it first: `[parameters]` with `{name} = ...`")
                }
                None => format!("there are {}; declare it under `[parameters]`", quoted(names)),
            };
            let message = format!("there is no parameter `{}` to vary", shortened(name));
            out.push(Diagnostic::error("name::unknown", message).at(place.clone(), "not declared").help(help));
        }
        let Some(values) = variant_values(name, given, out) else { continue };
        count = count.saturating_mul(values.len());
        let dimension = declared.map_or(values[0].1, |declared| declared.dimension);
        let mut good: Vec<(Exact, String)> = Vec::new();
        let wrong_before = out.len();
        for (value, found, text, place) in values {
            if found != dimension {
                let message = match declared {
                    Some(_) => format!(
                        "variants of `{name}`: expected {} as under `[parameters]`, found {}",
                        dimension.noun(),
                        found.noun()
                    ),
                    None => {
                        format!("variants of `{name}`: the first is {}, this one {}", dimension.noun(), found.noun())
                    }
                };
                let mut mistake =
                    Diagnostic::error("unit::dimension", message).at(place, found.noun()).help(dimension.hint(&text));
                if let Some(declared) = declared {
                    mistake = mistake.at(declared.place.clone(), dimension.noun());
                }
                // One unit for a whole list is one mistake.
                if out[wrong_before..].iter().all(|d| d.labels[0].place != mistake.labels[0].place) {
                    out.push(mistake);
                }
            } else if good.iter().any(|(other, _)| *other == value) {
                let message = format!("variants of `{name}`: the value {} is listed twice", shortened(&text));
                out.push(
                    Diagnostic::error("name::duplicate", message)
                        .at(place, "listed twice")
                        .help("remove one of the two"),
                );
            } else {
                good.push((value, text));
            }
        }
        if declared.is_some() && out.len() == wrong_before {
            let parameter = Placed { value: name.to_string(), place: place.clone() };
            document.variants.push(Variants { parameter, values: good, dimension });
        }
    }
    if count > MOST_VARIANTS {
        out.push(
            Diagnostic::error(
                "list::length",
                format!("{count} variants are more than one study may have ({MOST_VARIANTS})"),
            )
            .at(node.name_place.clone(), "all combinations are run")
            .help("vary fewer values at a time"),
        );
        document.variants.clear();
    }
    document.doubts.variants |= out.len() > before;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_law_can_be_chosen() {
        let keywords: Vec<&str> = synthesis::REGISTRY.iter().map(|law| law.keyword).collect();
        assert!(!keywords.is_empty());
        assert_eq!(keywords, LAWS);
    }

    #[test]
    fn every_element_with_friction_can_be_stuck() {
        let has = |kind: &&Element| kind.fields.iter().any(|field| field.name == "friction");
        let keywords: Vec<&str> = element::REGISTRY.iter().filter(has).map(|kind| kind.keyword).collect();
        assert_eq!(keywords, tables::FRICTION);
    }

    /// The examples of the manual are valid tables of their kind.
    #[test]
    fn examples_parse() {
        let examples = element::REGISTRY.iter().map(|kind| (kind.keyword, kind.example));
        let laws = synthesis::REGISTRY.iter().map(|law| (law.keyword, law.example));
        let mut seen = 0;
        for (keyword, example) in examples.chain(laws) {
            let (document, mistakes) = read(example);
            let mistakes: Vec<_> = mistakes.into_iter().filter(|d| d.code != "model::no-shaft").collect();
            assert_eq!(mistakes, [], "{keyword}");
            // The example of a law may need a sensor.
            let law = synthesis::find(keyword).is_some();
            assert_eq!(if law { document.controls.len() } else { document.elements.len() }, 1, "{keyword}");
            seen += 1;
        }
        assert!(seen > 0);
    }
}

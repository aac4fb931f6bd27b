//! The text of a model file as typed tables; names are not looked up yet.

use std::ops::Range;
use std::sync::LazyLock;

use toml::de::DeValue;

use super::parse::{Node, is_name, syntax, table, value};
use crate::diagnostics::{Diagnostic, nearest};
use crate::element::{self, Element};
use crate::schema::{Field, Kind, Scalar, Sign, Spanned, Table, Value};
use crate::synthesis::{self, LawKind};
use crate::units::{Dimension, Exact, parse_quantity_list};

/// Keys of `[model]`.
pub const MODEL: &[Field] = &[
    Field::optional("name", Kind::Text, "Name of the model; left out: `model`."),
    Field::optional("description", Kind::Text, "A sentence for the report."),
    Field::optional(
        "coordinates",
        Kind::Shafts(0),
        "Shafts to use as reduced coordinates; left out: chosen so that the equations stay well scaled.",
    ),
];

/// Keys of `[scenario]`.
pub const SCENARIO: &[Field] = &[
    Field::optional("duration", Kind::Quantity(Dimension::TIME, Sign::Positive), "Length of the run; left out: 1 s."),
    Field::optional(
        "output_step",
        Kind::Quantity(Dimension::TIME, Sign::Positive),
        "Time between rows of the results, a quarter of it for 20 rows after each event; left out: 1 ms.",
    ),
    Field::optional(
        "relative_tolerance",
        Kind::Number(Sign::Positive),
        "Relative error allowed per integration step, from 1e-13 to 1e-3; left out: 1e-10.",
    ),
    Field::optional(
        "initial",
        Kind::Overrides,
        "Initial angles and speeds of the reduced coordinates: { \"rk.phi\" = \"10 deg\" }; left out: zero.",
    ),
    Field::optional("event", Kind::Tables(EVENT), "Steps and ramps of signals: `[[scenario.event]]`."),
];

/// Keys of `[[scenario.event]]`.
pub const EVENT: &[Field] = &[
    Field::required("at", Kind::Quantity(Dimension::TIME, Sign::NonNegative), "When it happens (or the ramp begins)."),
    Field::required("signal", Kind::Signal, "A reference, a disturbance, or `<motor>.tau` of a motor without a law."),
    Field::required("to", Kind::AnyQuantity, "The new value."),
    Field::optional(
        "over",
        Kind::Quantity(Dimension::TIME, Sign::NonNegative),
        "Length of a ramp to the new value; left out: a step.",
    ),
];

/// Keys of `[[requirement]]`.
pub const REQUIREMENT: &[Field] = &[
    Field::required("signal", Kind::Signal, "The signal to judge."),
    Field::required(
        "measure",
        Kind::Choice(&["max", "min", "max_abs", "final"]),
        "Largest, smallest, largest in size, or last value in the window.",
    ),
    Field::optional("below", Kind::AnyQuantity, "The measure must be less than this."),
    Field::optional("above", Kind::AnyQuantity, "The measure must be more than this."),
    Field::optional("from", Kind::Quantity(Dimension::TIME, Sign::NonNegative), "Begin of the window; left out: 0 s."),
    Field::optional("until", Kind::Quantity(Dimension::TIME, Sign::Positive), "End of the window; left out: the end."),
    Field::optional("variants", Kind::Words, "Variants that it applies to; left out: all."),
];

/// Keys of `[[plot]]`.
pub const PLOT: &[Field] = &[
    Field::required("name", Kind::Name, "Name of the file and place in the report: `rack-angle`."),
    Field::required("title", Kind::Text, "Title."),
    Field::optional("caption", Kind::Text, "A sentence beneath the plot."),
    Field::required("signals", Kind::Signals, "Signals drawn for every variant."),
    Field::optional("references", Kind::Signals, "Signals drawn once, dashed."),
    Field::optional("variants", Kind::Words, "Variants to draw; left out: all."),
];

/// Keys that every `[control.<name>]` has.
pub const CONTROL: &[Field] = &[
    Field::required("law", Kind::Choice(LAWS), "Which control law."),
    Field::optional(
        "design",
        Kind::Overrides,
        "Parameter values of the model that the law is designed on, where they differ: { beta = \"0 deg\" }. Coulomb \
         friction is left out of every design.",
    ),
];

/// The keywords of [`synthesis::REGISTRY`]; a test keeps them equal.
const LAWS: &[&str] = &["noninteracting", "position_loop"];

/// All keys of a control table, by law.
static CONTROL_FIELDS: LazyLock<Vec<Vec<Field>>> =
    LazyLock::new(|| synthesis::REGISTRY.iter().map(|law| [CONTROL, law.fields].concat()).collect());

/// An entry of `[parameters]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name.
    pub name: String,
    /// Place of the value.
    pub span: Range<usize>,
    /// SI value.
    pub value: Exact,
    /// Dimension.
    pub dimension: Dimension,
    /// As written.
    pub text: String,
}

/// An entry of `[variants]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Variants {
    /// The parameter.
    pub parameter: Spanned<String>,
    /// `(SI value, as written)`.
    pub values: Vec<(Exact, String)>,
    /// Dimension of the values.
    pub dimension: Dimension,
}

/// An element's table.
#[derive(Debug, Clone)]
pub struct Instance {
    /// Its kind.
    pub kind: &'static Element,
    /// Its name.
    pub name: String,
    /// Place of the header.
    pub span: Range<usize>,
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
    pub span: Range<usize>,
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
    /// `[variants]`
    pub variants: Vec<Variants>,
    /// All elements.
    pub elements: Vec<Instance>,
    /// All controllers.
    pub controls: Vec<Control>,
    /// `[scenario]`
    pub scenario: Table,
    /// `[[requirement]]`
    pub requirements: Vec<Table>,
    /// `[[plot]]`
    pub plots: Vec<Table>,
}

/// Most runs that one study may have.
const MOST_VARIANTS: usize = 1000;

/// Reads a model file. All mistakes of syntax, keys, types and units are reported together.
pub fn read(source: &str) -> (Document, Vec<Diagnostic>) {
    let mut out = Vec::new();
    if source.trim().is_empty() {
        out.push(
            Diagnostic::error("file::empty", "the model file is empty")
                .help("a model needs at least one shaft: `[shaft.motor]` with `inertia = \"1 kg m^2\"`"),
        );
        return (Document::default(), out);
    }
    let (toml, mistakes) = syntax(source);
    out.extend(mistakes);
    let root = Node::root(&toml);
    let mut known = vec!["model", "parameters", "variants", "control", "scenario", "requirement", "plot"];
    known.extend(element::REGISTRY.iter().map(|kind| kind.keyword));
    root.expect_keys(&known, "a model file", &mut out);
    let single = |key: &str, fields: &'static [Field], out: &mut Vec<Diagnostic>| {
        root.child(key, out).map(|node| table(fields, &node, &format!("`[{key}]`"), out)).unwrap_or_default()
    };
    let several = |key: &str, fields: &'static [Field], out: &mut Vec<Diagnostic>| {
        let nodes = root.list(key, out);
        nodes.iter().map(|node| table(fields, node, &format!("`[[{key}]]`"), out)).collect::<Vec<_>>()
    };
    let mut document = Document {
        model: single("model", MODEL, &mut out),
        scenario: single("scenario", SCENARIO, &mut out),
        requirements: several("requirement", REQUIREMENT, &mut out),
        plots: several("plot", PLOT, &mut out),
        ..Document::default()
    };
    read_parameters(&root, source, &mut document, &mut out);
    read_variants(&root, &mut document, &mut out);
    for kind in element::REGISTRY {
        let Some(group) = root.child(kind.keyword, &mut out) else { continue };
        for node in group.children(&mut out) {
            check_name(&node, kind.keyword, &mut out);
            let what = format!("{} `{}`", kind.keyword, node.name);
            let table = table(kind.fields, &node, &what, &mut out);
            document.elements.push(Instance { kind, name: node.name.to_string(), span: node.name_span.clone(), table });
        }
    }
    for node in root.child("control", &mut out).map(|group| group.children(&mut out)).unwrap_or_default() {
        check_name(&node, "control", &mut out);
        let what = format!("control `{}`", node.name);
        let word = node.table.get("law").map(|value| value.get_ref().as_str().unwrap_or_default());
        let law = word.and_then(|word| synthesis::REGISTRY.iter().position(|law| law.keyword == word));
        let Some(number) = law else {
            // Says what is wrong with `law` alone: the other keys depend on it.
            match node.table.get("law") {
                Some(given) => drop(value(&CONTROL[0].kind, &format!("`law` of {what}"), given, &mut out)),
                None => drop(table(&CONTROL[..1], &Node { table: &Default::default(), ..node.clone() }, &what, &mut out)),
            }
            continue;
        };
        let table = table(&CONTROL_FIELDS[number], &node, &what, &mut out);
        let law = &synthesis::REGISTRY[number];
        document.controls.push(Control { law, name: node.name.to_string(), span: node.name_span.clone(), table });
    }
    check_unique(&document, &mut out);
    if document.elements.iter().all(|element| element.kind.keyword != "shaft") && out.is_empty() {
        out.push(
            Diagnostic::error("model::no-shaft", "the model has no shaft")
                .help("add at least one: `[shaft.motor]` with `inertia = \"1 kg m^2\"`"),
        );
    }
    (document, out)
}

fn check_name(node: &Node<'_>, what: &str, out: &mut Vec<Diagnostic>) {
    if !is_name(node.name) {
        out.push(
            Diagnostic::error("name::invalid", format!("`{}` cannot be the name of a {what}", node.name))
                .at(node.name_span.clone(), "this name")
                .help("a name begins with a letter and goes on with letters, digits, `_` or `-`"),
        );
    }
}

fn check_unique(document: &Document, out: &mut Vec<Diagnostic>) {
    let mut seen: Vec<(&str, &str, &Range<usize>)> = Vec::new();
    let elements = document.elements.iter().map(|e| (e.name.as_str(), e.kind.keyword, &e.span));
    let controls = document.controls.iter().map(|c| (c.name.as_str(), "control", &c.span));
    for (name, kind, span) in elements.chain(controls) {
        match seen.iter().find(|(other, _, _)| *other == name) {
            Some((_, other_kind, other_span)) => out.push(
                Diagnostic::error("name::duplicate", format!("the name `{name}` is used for a {other_kind} and a {kind}"))
                    .at(span.clone(), "again here")
                    .at((*other_span).clone(), "first here")
                    .help("give each element and each controller a name of its own"),
            ),
            None => seen.push((name, kind, span)),
        }
    }
}

fn read_parameters(root: &Node<'_>, source: &str, document: &mut Document, out: &mut Vec<Diagnostic>) {
    let Some(node) = root.child("parameters", out) else { return };
    for (name, span, given) in node.entries() {
        if !is_name(name) {
            out.push(
                Diagnostic::error("name::invalid", format!("`{name}` cannot be the name of a parameter"))
                    .at(span, "this name")
                    .help("a name begins with a letter and goes on with letters, digits, `_` or `-`"),
            );
            continue;
        }
        let what = format!("parameter `{name}`");
        let kind = if given.get_ref().is_str() { Kind::AnyQuantity } else { Kind::Number(Sign::Any) };
        let Some(read) = value(&kind, &what, given, out) else { continue };
        match read.value {
            Value::Scalar(Scalar::Literal(value, dimension)) => {
                let text = source.get(read.span.clone()).unwrap_or_default().trim_matches(['"', '\'']).to_string();
                document.parameters.push(Parameter { name: name.into(), span: read.span, value, dimension, text });
            }
            _ => out.push(
                Diagnostic::error("parameter::literal", format!("{what} must be a quantity, not a name"))
                    .at(read.span, "not a quantity")
                    .help("write a number with its unit, such as \"30 deg\""),
            ),
        }
    }
}

fn read_variants(root: &Node<'_>, document: &mut Document, out: &mut Vec<Diagnostic>) {
    let Some(node) = root.child("variants", out) else { return };
    let mut count = 1usize;
    for (name, span, given) in node.entries() {
        let help = "write a list such as \"[0, 10, 20, 30] deg\" or [\"0 deg\", \"10 deg\"]";
        let texts: Vec<(String, Range<usize>)> = match given.get_ref() {
            DeValue::String(text) => vec![(text.to_string(), given.span())],
            DeValue::Array(list) => list
                .iter()
                .map(|entry| {
                    let text = match entry.get_ref() {
                        DeValue::String(text) => text.to_string(),
                        DeValue::Integer(x) => x.as_str().to_string(),
                        DeValue::Float(x) => x.as_str().to_string(),
                        _ => String::new(),
                    };
                    (text, entry.span())
                })
                .collect(),
            _ => {
                let message = format!("variants of `{name}` must be a list of quantities");
                out.push(Diagnostic::error("type::wrong", message).at(given.span(), "not a list").help(help));
                continue;
            }
        };
        let mut values = Vec::new();
        let mut dimension = None;
        for (text, place) in texts {
            let list = if text.trim_start().starts_with('[') { text.clone() } else { format!("[{text}]") };
            match parse_quantity_list(&list) {
                Ok(entries) => {
                    for (value, found, shown) in entries {
                        if *dimension.get_or_insert(found) != found {
                            let message = format!("the variants of `{name}` have different dimensions");
                            let label = format!("{} here", found.si());
                            out.push(Diagnostic::error("unit::dimension", message).at(place.clone(), label).help(help));
                        }
                        values.push((value, shown));
                    }
                }
                Err(error) => out.push(
                    Diagnostic::error("unit::unknown", format!("variants of `{name}`: {}", error.message))
                        .at(place, "cannot be read")
                        .help(error.help.unwrap_or_else(|| help.to_string())),
                ),
            }
        }
        let parameter = Spanned { value: name.to_string(), span: span.clone() };
        match document.parameters.iter().find(|p| p.name == name) {
            None => {
                let names = document.parameters.iter().map(|p| p.name.as_str());
                let help = match nearest(name, names) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => format!("declare it first: `[parameters]` with `{name} = ...`"),
                };
                let message = format!("there is no parameter `{name}` to vary");
                out.push(Diagnostic::error("name::unknown", message).at(span, "not declared").help(help));
                continue;
            }
            Some(declared) if dimension.is_some_and(|found| found != declared.dimension) => {
                let message = format!("the variants of `{name}` have another dimension than the parameter");
                out.push(
                    Diagnostic::error("unit::dimension", message)
                        .at(given.span(), dimension.map(|d| d.noun()).unwrap_or_default())
                        .at(declared.span.clone(), declared.dimension.noun())
                        .help("use the same kind of unit for both"),
                );
                continue;
            }
            Some(_) => {}
        }
        if values.is_empty() {
            let message = format!("the list of variants of `{name}` is empty");
            out.push(Diagnostic::error("list::length", message).at(given.span(), "no entry").help(help));
            continue;
        }
        count = count.saturating_mul(values.len());
        document.variants.push(Variants { parameter, values, dimension: dimension.unwrap_or(Dimension::NONE) });
    }
    if count > MOST_VARIANTS {
        out.push(
            Diagnostic::error("list::length", format!("{count} variants are more than one study may have ({MOST_VARIANTS})"))
                .at(node.name_span.clone(), "all combinations are run")
                .help("vary fewer values at a time"),
        );
    }
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
            assert_eq!(document.elements.len() + document.controls.len(), 1, "{keyword}");
            seen += 1;
        }
        assert!(seen > 0);
    }
}

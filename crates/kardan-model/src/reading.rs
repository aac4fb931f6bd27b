//! Entries of a model as typed tables; all errors in keys, types and units are reported together.

use std::collections::{BTreeSet, HashMap};
use std::sync::LazyLock;

use super::composites::with_parts;
use super::document::{BlockTable, Control, Document, Instance, Parameter, SignalTable, SuppressedChecks};
use super::examples::example_of;
use super::keys::named_keys;
use super::manoeuvres::{
    check_drivers, check_manoeuvres, cones, lanes, leave_made_out, unfollowed_manoeuvres, with_manoeuvres,
};
use super::parameters::{
    REMOVE_TOLERANCE, follow, implicit_nested, implicit_parameters, read_parameters, refuse_tolerances,
};
use super::parse::{Node, check_name, reserved_name, table, value};
use super::tables;
use super::units_as_names::warn_of_units;
use super::variants::{check_named_controls, check_named_faults, read_named_variants, read_variants};
use kardan_elements::manoeuvre::{Manoeuvre, Path};
use kardan_elements::{block, element, signal};
use kardan_math::names::{NamedList, how_to_fix_shaft, is_fixed_name, nearest_or_similar};
use kardan_math::units::{Dimension, Expression};
use kardan_results::signal_name::SignalName;
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::entries::{Entries, KeyedEntry, Place, RawValue};
use kardan_schema::file::syntax;
use kardan_schema::schema::{Field, Keys, Kind, Placed, Sign, Table};

/// The key that selects the law of a `[control.<name>]`; the other keys are those of the law.
pub const CONTROL: &[Field] = &[Field::required("law", Kind::Choice(LAWS), "Which control law.")];

/// The key that selects the kind of a `[signal.<name>]`; the other keys are those of the kind.
pub const SIGNAL: &[Field] = &[Field::required("kind", Kind::Choice(SIGNALS), "Which kind of signal.")];

/// The key that selects the kind of a `[block.<name>]`, and the common keys; the other keys are those of the kind.
pub const BLOCK: &[Field] = &[
    Field::required("kind", Kind::Choice(BLOCKS), "Which kind of block."),
    Field::optional(
        "sample_time",
        Kind::Quantity(Dimension::TIME, Sign::Period),
        "When it computes, as on a control unit; its output is held until the next sample. Left out: at every instant.",
    ),
    Field::optional(
        "unit",
        Kind::Text,
        "Unit of its output, `N m`; needed where it depends on itself through other blocks, else kardan derives it from what it reads.",
    ),
];

/// The keywords of a registry.
macro_rules! keywords {
    ($registry:expr) => {{
        const ALL: [&str; $registry.len()] = {
            let mut keywords = [""; $registry.len()];
            let mut k = 0;
            while k < keywords.len() {
                keywords[k] = $registry[k].keyword;
                k += 1;
            }
            keywords
        };
        &ALL
    }};
}

const LAWS: &[&str] = keywords!(kardan_synthesis::REGISTRY);
const SIGNALS: &[&str] = keywords!(signal::REGISTRY);
const BLOCKS: &[&str] = keywords!(block::REGISTRY);

/// Reads a model file. All errors of syntax, keys, types and units are reported together.
pub fn read(source: &str) -> (Document, Vec<Diagnostic>) {
    let (entries, diagnostics, broken) = open(source);
    read_entries(&entries, diagnostics, broken)
}

/// The entries of a model file, its TOML errors, and whether a broken line may have contained a header.
pub fn open(source: &str) -> (Entries, Vec<Diagnostic>, bool) {
    if source.trim().is_empty() {
        let diagnostic = Diagnostic::error("file::empty", "the model file is empty")
            .help("a model needs at least one shaft: `[shaft.motor]` with `inertia = \"1 kg m^2\"`");
        return (Entries::default(), vec![diagnostic], true);
    }
    let (entries, diagnostics) = syntax(source);
    // A broken line may have contained a header, a broken text or list may have swallowed one.
    let broken = diagnostics.iter().any(|diagnostic| {
        let harmless = ["text without quotes", "a key without a value", "a duplicate key", "invalid float"];
        let start = diagnostic.labels.first().map_or(0, |label| label.place.span().start);
        let line_start = source[..start].rfind('\n').map_or(0, |at| at + 1);
        source[line_start..].trim_start().starts_with('[')
            || !harmless.iter().any(|message| diagnostic.message.contains(message))
    });
    (entries, diagnostics, broken)
}

/// Reads the entries of a model: `diagnostics` are those reported already, and after `broken` ones any name may exist.
pub fn read_entries(entries: &Entries, diagnostics: Vec<Diagnostic>, broken: bool) -> (Document, Vec<Diagnostic>) {
    let mut document = Document::default();
    document.suppressed.all = broken;
    if broken && entries.is_empty() {
        return (document, diagnostics);
    }
    let driven = with_manoeuvres(entries);
    let (source_entries, entries) = (entries, &*with_parts(&driven));
    // Two lists: errors that make the equations doubtful and others. Both start with the broken parts, for `table`.
    let broken = diagnostics.len();
    let mut study = diagnostics.clone();
    let mut out = diagnostics;
    let root = Node::root(entries);
    check_tables(&root, &mut document.suppressed, &mut out, &mut study);
    document.model = single(&root, "model", tables::Header::FIELDS, &mut out);
    (document.scenario, document.of_runs) = scenario(&root, &mut study);
    document.analysis = single(&root, "analysis", tables::Analysis::FIELDS, &mut study);
    document.identification = single(&root, "identification", tables::Identification::FIELDS, &mut study);
    document.bench = single(&root, "bench", tables::Bench::FIELDS, &mut study);
    document.safety = single(&root, "safety", tables::Safety::FIELDS, &mut study);
    document.sweep = single(&root, "sweep", tables::Sweep::FIELDS, &mut study);
    document.requirements = several(&root, "requirement", tables::Requirement::FIELDS, &mut study);
    document.figures = several(&root, "figure", tables::Figure::FIELDS, &mut study);
    document.plots = several(&root, "plot", tables::Plot::FIELDS, &mut study);
    let mut following = read_parameters(&root, &mut document, &mut out);
    let tables = several(&root, "variant", tables::Variant::FIELDS, &mut study);
    read_elements(&root, &mut document, &mut out);
    following.extend(named_keys(entries, &mut document));
    follow(following, &mut document, &mut out);
    read_named_variants(&tables, &mut document, &mut study);
    read_variants(&root, &mut document, &mut study);
    read_controls(&root, &mut document, &mut out);
    let logs = read_named(&root, "log", tables::Log::FIELDS, |_, _| {}, &mut study);
    document.logs.extend(logs.into_iter().map(|(name, table, _)| (name.value, table)));
    let mut of_faults = Vec::new();
    let take = |name: &str, table: &mut Table| of_faults.extend(implicit_nested(&format!("fault.{name}"), table, true));
    let faults = read_named(&root, "fault", tables::Fault::FIELDS, take, &mut study);
    document.faults.extend(faults.into_iter().map(|(name, table, _)| (name, table)));
    document.of_runs.extend(of_faults);
    (document.cones, document.lanes) = (cones(source_entries), lanes(source_entries));
    read_signals(&root, &mut document, &mut study);
    read_blocks(&root, &mut document, &mut study);
    read_tables(&root, &mut document, &mut out);
    read_manoeuvres(&root, &tables, &mut document, (&mut out, &mut study));
    check_drivers(&mut document, &mut out);
    document.mark_formulas();
    check_unique(&document, &mut out);
    warn_of_units(entries, &document, &mut study);
    check_named_controls(&document, &mut study);
    check_named_faults(&document, &mut study);
    if document.elements.iter().all(|e| e.body().is_none() && e.kind.charges(&e.name).is_empty())
        && !document.suppressed.all
        && !out.iter().chain(&study).any(Diagnostic::is_error)
    {
        out.push(
            Diagnostic::error("model::no-shaft", "the model has no shaft")
                .help("add at least one: `[shaft.motor]` with `inertia = \"1 kg m^2\"`"),
        );
    }
    check_size(&document, &mut out);
    document.suppressed.equations |= out.iter().any(Diagnostic::is_error);
    out.extend(study.drain(broken..));
    if !out.iter().any(Diagnostic::is_error) {
        unused_parameters((entries, source_entries), &document, &mut out);
        unused_tables(entries, &document, &mut out);
        unfollowed_manoeuvres(source_entries, &document, texts, &mut out);
    }
    (document, out)
}

/// The most shafts, masses and charges of a model: matrices over all of them, of doubles and of fractions, then take about 1.5 GB.
const MOST_COORDINATES: usize = 1500;

/// Rejects a model whose matrices would need too much memory.
fn check_size(document: &Document, out: &mut Vec<Diagnostic>) {
    let coordinates = document.elements.iter().flat_map(|element| {
        let charges = element.kind.charges(&element.name).len();
        std::iter::repeat_n(element, charges + usize::from(element.body().is_some()))
    });
    let count = coordinates.clone().count();
    if let Some(first) = coordinates.clone().nth(MOST_COORDINATES) {
        let message = format!("the model has {count} shafts, masses and charges, more than {MOST_COORDINATES}");
        let diagnostic = Diagnostic::error("model::large", message).at(&first.place, "the first above the limit");
        out.push(diagnostic.help("kardan computes with full matrices over all of them: combine bodies that rotate together, or analyse parts of the model"));
    }
}

/// Warns of unused parameters: a change of them has no effect.
fn unused_parameters((entries, source_entries): (&Entries, &Entries), document: &Document, out: &mut Vec<Diagnostic>) {
    let Some(own) = source_entries.table("parameters") else { return };
    let mut named = BTreeSet::new();
    let used_entries = entries.iter().filter(|found| !matches!(found.key.as_str(), "parameters" | "plot"));
    used_entries.for_each(|found| texts(&found.entry.value, &mut named));
    let following = document.parameters.iter().filter_map(|parameter| parameter.expression.as_ref());
    named.extend(following.flat_map(Expression::names).map(str::to_string));
    let unused =
        |parameter: &&Parameter| !named.contains(parameter.name.as_str()) && own.get(&parameter.name).is_some();
    for parameter in document.parameters.iter().filter(unused) {
        let varied = if document.is_varied(&parameter.name) { ": all its variants are the same" } else { "" };
        let message = format!("nothing uses the parameter `{}`{varied}", shortened(&parameter.name));
        let help = format!("write its name as a value, such as `inertia = \"{}\"`, or remove it", parameter.name);
        out.push(Diagnostic::warning("parameter::unused", message).at(&parameter.place, "not used").help(help));
    }
}

/// Warns of unused tables: empty groups, springs without a law, and, in a model that has events and no
/// bench, motors and disturbances that are never set.
fn unused_tables(entries: &Entries, document: &Document, out: &mut Vec<Diagnostic>) {
    let warning = |message: String, place: &Place, label: &str, help: &str| {
        Diagnostic::warning("table::unused", message).at(place, label).help(help)
    };
    let is_empty = |found: &&KeyedEntry| found.entry.value.as_table().is_some_and(Entries::is_empty);
    for found in entries.iter().filter(is_empty) {
        let named =
            element::find(&found.key).is_some() || matches!(found.key.as_str(), "control" | "log" | "signal" | "table");
        let (name, dot) = (&found.key, if named { ".NAME" } else { "" });
        let help = format!("write its keys below `[{name}{dot}]`, or remove it");
        out.push(warning(format!("the table `[{name}]` is empty"), &found.place, "empty", &help));
    }
    let laws = ["stiffness", "damping", "friction", "breakaway"];
    for spring in document.elements.iter().filter(|element| element.kind.keyword == "spring_damper") {
        if !laws.iter().any(|key| spring.table.values.contains_key(key)) {
            let message = format!("spring_damper `{}` does nothing", spring.name);
            let help = "give it `stiffness`, `damping` or `friction`, or remove it";
            out.push(warning(message, &spring.place, "no law", help));
        }
    }
    let has_events = ["event", "signals"].iter().any(|key| document.scenario.values.contains_key(key));
    if !has_events || !document.bench.values.is_empty() {
        return;
    }
    let mut named = BTreeSet::new();
    let inputs = ["motor", "disturbance", "voltage_source", "plot", "requirement", "figure"];
    let used_entries = entries.iter().filter(|found| !inputs.contains(&found.key.as_str()));
    used_entries.for_each(|found| texts(&found.entry.value, &mut named));
    if let Some(signals) = entries.table("scenario").and_then(|scenario| scenario.table("signals")) {
        named.extend(signals.iter().map(|found| found.key.clone()));
    }
    let commands = entries.tables_of("control").flat_map(|(_, control)| control.entries_of("commands"));
    named.extend(commands.map(|found| found.key.clone()));
    let moved: BTreeSet<&str> = named.iter().map(|text| SignalName::new(text).element).collect();
    for input in document.elements.iter().filter(|element| inputs[..3].contains(&element.kind.keyword)) {
        if !moved.contains(input.name.as_str()) {
            let (kind, name) = (input.kind.keyword, &input.name);
            let message = format!("the model never sets the {kind} `{name}`: it stays at zero in every run");
            let signal = match kind {
                "motor" => format!("{name}.tau"),
                "voltage_source" => format!("{name}.v"),
                _ => name.clone(),
            };
            let help = format!("set it by `[[scenario.event]]` with `signal = \"{signal}\"`, or remove it");
            out.push(warning(message, &input.place, "not used", &help));
        }
    }
}

/// All texts within a value, and the names in those that are expressions.
fn texts(value: &RawValue, out: &mut BTreeSet<String>) {
    value.each_text(&mut |text: &str| {
        out.insert(text.trim().to_string());
        if let Ok(read) = Expression::parse(text).or_else(|_| Expression::parse_law(text)) {
            out.extend(read.names().into_iter().map(str::to_string));
        }
    });
}

/// `[scenario]`, with its values that have a tolerance.
fn scenario(root: &Node<'_>, out: &mut Vec<Diagnostic>) -> (Table, NamedList<Parameter>) {
    let mut scenario = plain(root, "scenario", tables::Scenario::FIELDS, out);
    let of_runs = implicit_nested("scenario", &mut scenario, false).into_iter().collect();
    refuse_tolerances(&mut scenario, "`[scenario]`", REMOVE_TOLERANCE, out);
    (scenario, of_runs)
}

/// The table `[key]`.
fn single(root: &Node<'_>, key: &str, fields: &'static [Field], out: &mut Vec<Diagnostic>) -> Table {
    let mut table = plain(root, key, fields, out);
    refuse_tolerances(&mut table, &format!("`[{key}]`"), REMOVE_TOLERANCE, out);
    table
}

/// The same with the tolerances that are in it.
fn plain(root: &Node<'_>, key: &str, fields: &'static [Field], out: &mut Vec<Diagnostic>) -> Table {
    let what = format!("`[{key}]`");
    let empty = || Table { fields, ..Table::default() };
    root.child(key, out).map_or_else(empty, |node| table(fields, &node.like(example_of(key)), &what, out))
}

/// The tables `[[key]]`.
fn several(root: &Node<'_>, key: &str, fields: &'static [Field], out: &mut Vec<Diagnostic>) -> Vec<Table> {
    let mut tables = Vec::new();
    for node in root.list(key, out) {
        let node = node.like(example_of(key));
        let named = node.table.iter().find(|found| {
            matches!(found.entry.value, RawValue::Table(_)) && fields.iter().all(|field| field.name != found.key)
        });
        if let Some(found) = named {
            let message = format!("`{key}` is a list of tables without a name, found the table `{key}.{}`", found.key);
            out.push(
                Diagnostic::error("type::wrong", message)
                    .at(&found.place, "a name")
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
}

/// A table that has no tolerances.
fn without_tolerances(
    fields: &'static [Field],
    node: &Node<'_>,
    example: &'static str,
    (what, help): (&str, &str),
    out: &mut Vec<Diagnostic>,
) -> Table {
    let mut table = table(fields, &node.clone().like(example), what, out);
    refuse_tolerances(&mut table, what, help, out);
    table
}

/// The remedy if a key cannot have a tolerance, but may name a parameter.
const DECLARE: &str = "declare a parameter with it under `[parameters]`, and write its name here";

fn read_elements(root: &Node<'_>, document: &mut Document, out: &mut Vec<Diagnostic>) {
    for kind in element::REGISTRY {
        for node in named_tables(root, kind.keyword, kind.fields, &mut document.suppressed, out) {
            let what = format!("{} `{}`", kind.keyword, shortened(node.name));
            let before = out.len();
            let mut table = table(kind.fields, &node.clone().like(kind.example), &what, out);
            let implicit = implicit_parameters(node.name, &mut table);
            refuse_tolerances(&mut table, &what, DECLARE, out);
            if out.len() > before {
                document.suppressed.names.insert(node.name.to_string());
            }
            document.implicit.extend(implicit);
            // Blocks read these by name only.
            let standalone = ["sensor", "disturbance"].contains(&kind.keyword);
            if let Some(reason) =
                reserved(node.name, document).filter(|_| standalone && ["t", "pi"].contains(&node.name))
            {
                out.push(reserved_name(node.name, &node.name_place, kind.keyword, reason));
            }
            document.elements.push(Instance {
                kind,
                name: node.name.to_string(),
                place: node.name_place.clone(),
                table,
            });
        }
    }
}

fn read_controls(root: &Node<'_>, document: &mut Document, out: &mut Vec<Diagnostic>) {
    for node in named_tables(root, "control", CONTROL, &mut document.suppressed, out) {
        let what = format!("control `{}`", shortened(node.name));
        let Some(number) = number_of_kind(&node, CONTROL, &what, out) else {
            document.suppressed.references = true;
            document.suppressed.equations = true;
            continue;
        };
        let before = out.len();
        let (fields, example) = &LAW_KEYS[number];
        let table = without_tolerances(fields, &node, example, (&what, DECLARE), out);
        document.suppressed.references |= out.len() > before;
        let (name, place) = (node.name.to_string(), node.name_place.clone());
        document.controls.push(Control { kind: &kardan_synthesis::REGISTRY[number], name, place, table });
    }
}

/// The tables `[keyword.NAME]` of one shape, each with whether it has no error; `take` takes the tolerances that it may have.
fn read_named(
    root: &Node<'_>,
    keyword: &str,
    fields: &'static [Field],
    mut take: impl FnMut(&str, &mut Table),
    out: &mut Vec<Diagnostic>,
) -> Vec<(Placed<String>, Table, bool)> {
    let mut read = Vec::new();
    for node in named_tables(root, keyword, fields, &mut SuppressedChecks::default(), out) {
        let (what, before) = (format!("{keyword} `{}`", shortened(node.name)), out.len());
        let mut table = table(fields, &node.clone().like(example_of(keyword)), &what, out);
        take(node.name, &mut table);
        refuse_tolerances(&mut table, &what, REMOVE_TOLERANCE, out);
        let name = Placed { value: node.name.to_string(), place: node.name_place.clone() };
        read.push((name, table, out.len() == before));
    }
    read
}

fn read_tables(root: &Node<'_>, document: &mut Document, out: &mut Vec<Diagnostic>) {
    for (Placed { value: name, .. }, table, sound) in
        read_named(root, "table", tables::LookupTable::FIELDS, |_, _| {}, out)
    {
        if !sound {
            document.suppressed.names.insert(name.clone());
        }
        document.tables.push((name, table));
    }
}

/// Checks manoeuvres and paths, which have become other tables already.
fn read_manoeuvres(
    root: &Node<'_>,
    variants: &[Table],
    document: &mut Document,
    (out, study): (&mut Vec<Diagnostic>, &mut Vec<Diagnostic>),
) {
    let mut diagnostics = Vec::new();
    let [manoeuvres, paths] = [("manoeuvre", Manoeuvre::FIELDS), ("path", Path::FIELDS)].map(|(keyword, fields)| {
        named_tables(root, keyword, fields, &mut SuppressedChecks::default(), &mut diagnostics)
    });
    let wrong = check_manoeuvres([&manoeuvres, &paths], variants, document, &mut diagnostics);
    document.suppressed.durations |= diagnostics.iter().any(Diagnostic::is_error);
    let nodes = [manoeuvres, paths].concat();
    leave_made_out(&nodes, &wrong, document, [out, &mut *study]);
    study.extend(diagnostics);
}

fn read_signals(root: &Node<'_>, document: &mut Document, out: &mut Vec<Diagnostic>) {
    for node in named_tables(root, "signal", SIGNAL, &mut SuppressedChecks::default(), out) {
        let read = table_of_kind(&node, "signal", (SIGNAL, &SIGNAL_KEYS), &mut document.suppressed, out);
        let Some((number, table)) = read else { continue };
        let (kind, name, place) = (&signal::REGISTRY[number], node.name.to_string(), node.name_place.clone());
        if let Some(reason) = reserved(&name, document) {
            out.push(reserved_name(&name, &place, "signal", reason));
        }
        document.signals.push(SignalTable { kind, name, place, table, formula: None });
    }
}

fn read_blocks(root: &Node<'_>, document: &mut Document, out: &mut Vec<Diagnostic>) {
    for node in named_tables(root, "block", BLOCK, &mut SuppressedChecks::default(), out) {
        let read = table_of_kind(&node, "block", (BLOCK, &BLOCK_KEYS), &mut document.suppressed, out);
        let Some((number, table)) = read else { continue };
        let (kind, name, place) = (&block::REGISTRY[number], node.name.to_string(), node.name_place.clone());
        let of_signal = document.signals.has(&name).then_some("a signal has it");
        if let Some(reason) = of_signal.or_else(|| reserved(&name, document)) {
            out.push(reserved_name(&name, &place, "block", reason));
        }
        document.blocks.push(BlockTable { kind, name, place, table });
    }
}

/// The number of the kind that a table names by the first key of its group. An error there is the only one to report: the other keys
/// depend on it.
fn number_of_kind(node: &Node<'_>, head: &'static [Field], what: &str, out: &mut Vec<Diagnostic>) -> Option<usize> {
    let (key, Kind::Choice(keywords)) = (head[0].name, head[0].kind) else { return None };
    let Some(found) = node.table.keyed(key) else {
        table(&head[..1], &Node { table: &Entries::default(), ..node.clone() }, what, out);
        return None;
    };
    value(&head[0].kind, &format!("`{key}` of {what}"), &found.entry, out)?;
    keywords.iter().position(|keyword| found.entry.value.as_text() == Some(*keyword))
}

/// The number of the kind of a signal or a block, and its table; `None` after a reported error, which leaves its name doubtful.
fn table_of_kind(
    node: &Node<'_>,
    group: &str,
    (head, kinds): (&'static [Field], &'static [KindKeys]),
    suppressed: &mut SuppressedChecks,
    out: &mut Vec<Diagnostic>,
) -> Option<(usize, Table)> {
    let what = format!("{group} `{}`", shortened(node.name));
    let before = out.len();
    let read = number_of_kind(node, head, &what, out).map(|number| {
        let (fields, example) = &kinds[number];
        (number, without_tolerances(fields, node, example, (&what, REMOVE_TOLERANCE), out))
    });
    let sound = read.filter(|_| out.len() == before);
    if sound.is_none() {
        suppressed.names.insert(node.name.to_string());
    }
    sound
}

/// Why a signal or a block cannot have that name.
fn reserved(name: &str, document: &Document) -> Option<&'static str> {
    match name {
        "t" => Some("it means the time"),
        "pi" => Some("it means a number"),
        name if document.parameters.has(name) => Some("a parameter has it"),
        _ => None,
    }
}

/// The tables of the study; all others define the equations.
const STUDY: [&str; 14] = [
    "scenario",
    "signal",
    "manoeuvre",
    "path",
    "fault",
    "safety",
    "sweep",
    "requirement",
    "figure",
    "plot",
    "analysis",
    "bench",
    "identification",
    "log",
];

/// Reports tables that a model file does not have.
fn check_tables(
    root: &Node<'_>,
    suppressed: &mut SuppressedChecks,
    out: &mut Vec<Diagnostic>,
    study: &mut Vec<Diagnostic>,
) {
    let mut table_names = vec!["model", "parameters", "variants", "variant", "control", "block", "table"];
    table_names.extend(STUDY);
    table_names.extend(element::REGISTRY.iter().map(|kind| kind.keyword));
    for found in root.table.iter() {
        let (name, value) = (found.key.as_str(), &found.entry.value);
        if table_names.contains(&name) {
            continue;
        }
        let nearest_name = nearest_or_similar(name, table_names.iter().copied());
        let is_table = matches!(value, RawValue::Table(_) | RawValue::List(_));
        let help = match (nearest_name, name) {
            (Some(nearest_name), _) => format!("did you mean `{nearest_name}`?"),
            (None, "event" | "events") => "write each as `[[scenario.event]]`".to_string(),
            (None, "faults") => {
                "write each as `[[scenario.fault]]`, or, where it happens in some runs only, as `[fault.NAME]`"
                    .to_string()
            }
            (None, "extra" | "candidate") => format!("write each as `[[identification.{name}]]`"),
            (None, "channel" | "channels") => "write each as `[[log.NAME.channel]]`".to_string(),
            (None, "actuator" | "actuators") => "write each as `[[analysis.actuator]]`".to_string(),
            (None, "tolerance" | "tolerances") => "write a tolerance after its value: \"1 N m ± 10 %\"".to_string(),
            (None, word) if is_fixed_name(word) => how_to_fix_shaft("SHAFT"),
            (None, "sources" | "source" | "input" | "inputs") => {
                "torques come from `motor` and `disturbance`".to_string()
            }
            (None, _) => format!(
                "known tables are {}",
                table_names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
            ),
        };
        let (what, label) = if is_table { ("table", "unknown table") } else { ("key", "unknown key") };
        let diagnostic =
            Diagnostic::error("key::unknown", format!("a model file has no {what} `{}` at the top", shortened(name)))
                .at(&found.place, label)
                .help(help);
        if !is_table || nearest_name.is_some_and(|nearest_name| STUDY.contains(&nearest_name)) {
            study.push(diagnostic);
            continue;
        }
        out.push(diagnostic);
        suppressed.references |= nearest_name.is_none_or(|nearest_name| nearest_name == "control");
        suppressed.variants |= nearest_name.is_none_or(|nearest_name| nearest_name == "variants");
        suppressed.all |= !suppress_names(value, suppressed);
    }
}

/// The names that a table of tables or a list of tables would have introduced; false if it is neither.
fn suppress_names(value: &RawValue, suppressed: &mut SuppressedChecks) -> bool {
    match value {
        RawValue::Table(table) => suppressed.names.extend(table.iter().map(|found| found.key.clone())),
        RawValue::List(list) => {
            for entry in list {
                let RawValue::Table(table) = &entry.value else { return false };
                let Some(RawValue::Text(name)) = table.get("name") else { return false };
                suppressed.names.insert(name.clone());
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
    suppressed: &mut SuppressedChecks,
    out: &mut Vec<Diagnostic>,
) -> Vec<Node<'t>> {
    let Some(found) = root.table.keyed(keyword) else { return Vec::new() };
    let entry = &found.entry.value;
    let RawValue::Table(_) = entry else {
        suppressed.all |= !suppress_names(entry, suppressed);
        suppressed.references |= keyword == "control";
        let what = if matches!(entry, RawValue::List(_)) { "a list" } else { "a value" };
        out.push(
            Diagnostic::error("type::wrong", format!("`{keyword}`: expected tables with a name each, found {what}"))
                .at(&found.place, "not a table")
                .help(format!("write each as `[{keyword}.NAME]` with its keys below")),
        );
        return Vec::new();
    };
    let Some(mut group) = root.child(keyword, out) else { return Vec::new() };
    let is_table = |found: &&KeyedEntry| matches!(found.entry.value, RawValue::Table(_));
    let loose = group.table.iter().find(|found| !is_table(found) && fields.iter().any(|f| f.name == found.key));
    if let Some(found) = loose {
        suppressed.all = true;
        let message = format!("a {keyword} needs a name: `{}` is in `[{keyword}]` itself", found.key);
        out.push(
            Diagnostic::error("name::missing", message)
                .at(&group.place, "no name")
                .help(format!("write `[{keyword}.NAME]` with a name of your choice")),
        );
    }
    suppressed.names.extend(group.table.iter().filter(|found| !is_table(found)).map(|found| found.key.clone()));
    group.name = if loose.is_some() { "" } else { group.name };
    let nodes = if loose.is_some() { group.children(&mut Vec::new()) } else { group.children(out) };
    let own = |place: &Place| {
        let is_part = |found: &KeyedEntry| found.place == *place;
        let of = |kind: &&element::Element| root.table.table(kind.keyword).is_some_and(|all| all.iter().any(is_part));
        !element::COMPOSITES.iter().any(of) || element::is_composite(keyword)
    };
    for node in nodes.iter().filter(|node| own(&node.name_place)) {
        check_name(node.name, node.name_place.clone(), keyword, out);
    }
    nodes
}

fn check_unique(document: &Document, out: &mut Vec<Diagnostic>) {
    let mut first_uses: HashMap<&str, (&str, &Place)> = HashMap::new();
    let elements = document.elements.iter().map(|e| (e.name.as_str(), e.kind.keyword, &e.place));
    let controls = document.controls.iter().map(|c| (c.name.as_str(), "control", &c.place));
    let blocks = document.blocks.iter().map(|b| (b.name.as_str(), "block", &b.place));
    for (name, kind, place) in elements.chain(controls).chain(blocks) {
        match first_uses.get(name) {
            Some((other_kind, first)) => {
                let message = format!("the name `{name}` has two uses, for {other_kind} and {kind}");
                let diagnostic = Diagnostic::duplicate("name::duplicate", message, place, *first);
                out.push(diagnostic.help("give each element, controller and block a name of its own"));
            }
            None => drop(first_uses.insert(name, (kind, place))),
        }
    }
}

/// All keys of a kind, those of its group first, and its example.
type KindKeys = (Vec<Field>, &'static str);

fn with_head(head: &[Field], kinds: impl Iterator<Item = (&'static [Field], &'static str)>) -> Vec<KindKeys> {
    kinds.map(|(fields, example)| ([head, fields].concat(), example)).collect()
}

static LAW_KEYS: LazyLock<Vec<KindKeys>> =
    LazyLock::new(|| with_head(CONTROL, kardan_synthesis::REGISTRY.iter().map(|law| (law.fields, law.example))));

static SIGNAL_KEYS: LazyLock<Vec<KindKeys>> =
    LazyLock::new(|| with_head(SIGNAL, signal::REGISTRY.iter().map(|kind| (kind.fields, kind.example))));

static BLOCK_KEYS: LazyLock<Vec<KindKeys>> =
    LazyLock::new(|| with_head(BLOCK, block::REGISTRY.iter().map(|kind| (kind.fields, kind.example))));

#[cfg(test)]
#[path = "../tests/unit/reading.rs"]
mod tests;

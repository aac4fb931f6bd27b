//! A model as typed tables; names are not looked up yet.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::sync::Arc;

use kardan_elements::block::BlockKind;
use kardan_elements::element::Element;
use kardan_elements::manoeuvre::Cones;
use kardan_elements::signal::SignalKind;
use kardan_math::names::{HasName, NamedList};
use kardan_math::units::{Dimension, Exact, Expression, Spread};
use kardan_mechanics::equations::Domain;
use kardan_results::signal_name::SignalName;
use kardan_schema::entries::Place;
use kardan_schema::schema::{Field, Placed, Scalar, Table, Value};
use kardan_synthesis::LawKind;

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
    /// Its tolerance, if one is written after it.
    pub spread: Option<Spread>,
    /// How it is computed from other parameters, which precede it in the document; its value is that for theirs.
    pub expression: Option<Expression>,
    /// Zero, or above the ranks of all its inputs.
    pub(crate) rank: usize,
}

/// A parameter with the interval that it may lie in; `lower <= nominal <= upper` and `lower < upper`.
#[derive(Debug, Clone, PartialEq)]
pub struct Tolerance {
    /// The parameter: an entry of `[parameters]`, or `<element>.<key>` for a key written with a tolerance.
    pub parameter: String,
    /// Its value, SI.
    pub nominal: Exact,
    /// Lower end, SI.
    pub lower: Exact,
    /// Upper end, SI.
    pub upper: Exact,
    /// The confidence of the interval (0.95 for `95 %`), if it is given.
    pub confidence: Option<Exact>,
    /// The dimension of all of them.
    pub dimension: Dimension,
    /// Place of the value in the file.
    pub place: Place,
}

impl Tolerance {
    /// The interval for a message.
    pub(crate) fn shown(&self) -> String {
        format!("[{}, {}]", shown(&self.lower, self.dimension), shown(&self.upper, self.dimension))
    }
}

/// A value for a message; angles in degrees.
pub(crate) fn shown(value: &Exact, dimension: Dimension) -> String {
    let (value, unit) = match dimension {
        Dimension::ANGLE => (value.to_f64().to_degrees(), "deg".to_string()),
        _ => (value.to_f64(), dimension.si()),
    };
    let rounded: f64 = format!("{value:.6e}").parse().unwrap_or(value);
    let size = rounded.abs();
    let number =
        if size != 0.0 && !(1e-5..1e16).contains(&size) { format!("{rounded:e}") } else { rounded.to_string() };
    format!("{number} {unit}").trim_end().to_string()
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
    /// The faults that happen in it.
    pub faults: Vec<Placed<String>>,
}

/// A parameter value that replaces the file's. The parameter may be an implicit one: `wg.inertia` for a key of an element
/// that is written with a tolerance.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Parameter.
    pub name: String,
    /// SI value.
    pub value: Exact,
    /// As written.
    pub text: String,
}

/// The settings of a variant.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct VariantSettings {
    /// Its name; empty if the file has no variants.
    pub name: String,
    /// Parameter values.
    pub settings: Vec<Setting>,
    /// The controllers in the loop; `None`: all.
    pub controls: Option<Vec<String>>,
    /// The faults that happen in it.
    pub faults: Vec<String>,
}

/// A table with a name, of a kind that is in a registry.
#[derive(Debug, Clone)]
pub struct KindTable<K: 'static> {
    /// Its kind.
    pub kind: &'static K,
    /// Its name.
    pub name: String,
    /// Place of the header.
    pub place: Place,
    /// Its keys.
    pub table: Table,
}

/// An element's table.
pub type Instance = KindTable<Element>;
/// A controller's table.
pub type Control = KindTable<LawKind>;
/// A block's table.
pub type BlockTable = KindTable<BlockKind>;

impl Instance {
    /// Its domain if it is a body itself, which others name.
    pub fn body(&self) -> Option<Domain> {
        match self.kind.keyword {
            "shaft" => Some(Domain::Rotation),
            "mass" => Some(Domain::Translation),
            "state" => Some(Domain::Number),
            _ => None,
        }
    }

    /// Of a sensor of a signal its name, the signal that it names and where.
    fn measured_signal(&self) -> Option<(&str, &str, &Place)> {
        let (signal, place) = self.table.placed_word("signal").filter(|_| self.kind.keyword == "sensor")?;
        Some((&self.name, signal, place))
    }
}

/// A signal's table.
#[derive(Debug, Clone)]
pub struct SignalTable {
    /// Its kind.
    pub kind: &'static SignalKind,
    /// Its name.
    pub name: String,
    /// Place of the header.
    pub place: Place,
    /// Its keys.
    pub table: Table,
    /// Its expression, if that depends on coordinates, measurements or a block, itself or through other signals; none for a function of time.
    pub formula: Option<Arc<Placed<Expression>>>,
}

impl HasName for Parameter {
    fn name(&self) -> &str {
        &self.name
    }
}

impl HasName for Variants {
    fn name(&self) -> &str {
        &self.parameter.value
    }
}

impl HasName for NamedVariant {
    fn name(&self) -> &str {
        &self.name.value
    }
}

impl HasName for SignalTable {
    fn name(&self) -> &str {
        &self.name
    }
}

impl<K: 'static> HasName for KindTable<K> {
    fn name(&self) -> &str {
        &self.name
    }
}

/// The content of a file that a model names, or why it could not be read.
pub type FileBytes = Result<Arc<[u8]>, String>;

/// A model file as typed tables.
#[derive(Debug, Clone, Default)]
pub struct Document {
    /// `[model]`
    pub model: Table,
    /// `[parameters]`
    pub parameters: NamedList<Parameter>,
    /// Keys of elements that are written with a tolerance: parameters of the names `<element>.<key>`.
    pub implicit: NamedList<Parameter>,
    /// The same of `[scenario]` and of faults, `scenario.initial.a.phi`, `scenario.event.1.at`, `fault.NAME.at`: the model itself does not depend on them.
    pub of_runs: NamedList<Parameter>,
    /// Keys of elements that expressions name, `<element>.<key>`: their values are in the tables of the elements, these are to be looked up.
    pub keys: NamedList<Parameter>,
    /// `[variants]`
    pub variants: NamedList<Variants>,
    /// `[[variant]]`
    pub named_variants: NamedList<NamedVariant>,
    /// All elements.
    pub elements: NamedList<Instance>,
    /// All controllers.
    pub controls: NamedList<Control>,
    /// Names of the tables of lanes, which manoeuvres and paths make.
    pub lanes: BTreeSet<String>,
    /// Cones of manoeuvres.
    pub cones: Vec<Cones>,
    /// `[scenario]`
    pub scenario: Table,
    /// `[signal.<name>]`
    pub signals: NamedList<SignalTable>,
    /// `[block.<name>]`
    pub blocks: NamedList<BlockTable>,
    /// `[table.<name>]`: names and tables.
    pub tables: NamedList<(String, Table)>,
    /// Files that the model names, by their names, as far as they were handed over.
    pub files: BTreeMap<String, FileBytes>,
    /// `[analysis]`
    pub analysis: Table,
    /// `[bench]`
    pub bench: Table,
    /// `[fault.<name>]`: names and tables.
    pub faults: NamedList<(Placed<String>, Table)>,
    /// `[safety]`
    pub safety: Table,
    /// `[sweep]`
    pub sweep: Table,
    /// `[[requirement]]`
    pub requirements: Vec<Table>,
    /// `[[figure]]`
    pub figures: Vec<Table>,
    /// `[[plot]]`
    pub plots: Vec<Table>,
    /// `[identification]`
    pub identification: Table,
    /// `[log.<name>]`: names and tables.
    pub logs: NamedList<(String, Table)>,
    /// The unreadable parts.
    pub suppressed: SuppressedChecks,
}

/// Suppressed checks: content that a document may have beyond what could be read. A reported error must not lead to further ones:
/// checks on doubtful names are skipped.
#[derive(Debug, Clone, Default)]
pub struct SuppressedChecks {
    /// Any name may exist: a header was broken.
    pub all: bool,
    /// Names of unknown meaning: of elements, controllers, parameters.
    pub names: BTreeSet<String>,
    /// There may be further references, and motors that they command.
    pub references: bool,
    /// There may be further variants.
    pub variants: bool,
    /// Runs may end later than the readable entries state: a manoeuvre was broken.
    pub durations: bool,
    /// The equations are not those of the file: an element, a controller, a parameter or the choice of coordinates is
    /// wrong.
    pub equations: bool,
}

impl SuppressedChecks {
    /// Whether a name may exist that was not read.
    pub fn has(&self, name: &str) -> bool {
        self.all || self.names.contains(name)
    }

    /// Whether a name in an expression may be that of a value that was not read: a parameter, or the key of an element.
    pub fn has_key(&self, name: &str) -> bool {
        self.has(name) || kardan_results::signal_name::parameter(name).is_some_and(|(element, _)| self.has(element))
    }
}

impl Document {
    /// The expression of a value that is a function of time: of the time, of a signal or of a table.
    pub(crate) fn function_of_time(&self, scalar: &Scalar) -> Option<Expression> {
        let is_signal = |name: &str| self.signals.has(name);
        match scalar {
            Scalar::Expression(read) => {
                let of_time =
                    !read.tables().is_empty() || read.names().iter().any(|name| *name == "t" || is_signal(name));
                of_time.then(|| (**read).clone())
            }
            Scalar::Parameter(name) if is_signal(name) => Expression::parse_law(&format!("'{name}'")).ok(),
            _ => None,
        }
    }

    /// The sensors of signals, each with the signal that it names and where.
    pub fn signal_sensors(&self) -> impl Iterator<Item = (&str, &str, &Place)> {
        self.elements.iter().filter_map(Instance::measured_signal)
    }

    /// The references that blocks introduce: otherwise unused names that they give as `reference`, each with its block.
    pub(crate) fn references_of_blocks(&self) -> impl Iterator<Item = (&str, &BlockTable)> {
        self.blocks.iter().filter_map(|block| match &block.table.values.get("reference")?.value {
            Value::Scalar(Scalar::Expression(read)) => match read.names()[..] {
                [name] if read.text().trim().trim_matches('\'') == name && self.is_new(name) => Some((name, block)),
                _ => None,
            },
            _ => None,
        })
    }

    /// Whether the table of a law or a block introduces a reference of a name, which may have an error of its own.
    pub fn introduces(&self, name: &str) -> bool {
        let by_law = |control: &Control| introduced(&control.table).any(|candidate| candidate == name);
        self.controls.iter().any(by_law) || self.references_of_blocks().any(|(candidate, _)| candidate == name)
    }

    /// Whether a name is none of the file, beside those of references.
    fn is_new(&self, name: &str) -> bool {
        let head = SignalName::new(name).element;
        let is_used = [name, head].iter().any(|name| {
            self.blocks.has(name) || self.elements.has(name) || self.controls.has(name) || self.suppressed.has(name)
        });
        !is_used && name != "t" && !self.signals.has(name) && self.parameter(name).is_none()
    }

    /// Whether a name is a block, or a signal that is a formula of what moves.
    pub fn moves(&self, name: &str) -> bool {
        self.blocks.has(name) || self.signals.get(name).is_some_and(|signal| signal.formula.is_some())
    }

    /// A sensor of a signal, with the signal that it names and where.
    pub(crate) fn signal_sensor(&self, name: &str) -> Option<(&str, &str, &Place)> {
        self.elements.all(name).find_map(Instance::measured_signal)
    }

    /// Records which signals are formulas of coordinates, in one pass over their names.
    pub(super) fn mark_formulas(&mut self) {
        let mut references: HashSet<&str> =
            self.controls.iter().flat_map(|control| introduced(&control.table)).collect();
        references.extend(self.references_of_blocks().map(|(name, _)| name));
        let moves = |name: &str| {
            let head = SignalName::new(name).element;
            let is_element = head != name && (self.elements.has(head) || self.controls.has(head));
            let is_sensor = self.elements.all(name).any(|one| one.kind.keyword == "sensor");
            is_element || is_sensor || self.blocks.has(head) || references.contains(name)
        };
        let read = |signal: &SignalTable| {
            let (text, place) = signal.table.placed_word("value")?;
            Some(Placed { value: Expression::parse_law(text).ok()?, place: place.clone() })
        };
        let formulas: Vec<Option<Placed<Expression>>> = self.signals.iter().map(read).collect();
        // The users of each signal, and the formulas, from which these follow.
        let (mut named_by, mut open) = (vec![Vec::new(); formulas.len()], Vec::new());
        for (number, found) in formulas.iter().enumerate() {
            for name in found.iter().flat_map(|found| found.value.names()) {
                match self.signals.position(name) {
                    _ if moves(name) => open.push(number),
                    Some(other) => named_by[other].push(number),
                    None => {}
                }
            }
        }
        let mut is_formula = vec![false; formulas.len()];
        while let Some(number) = open.pop() {
            if !std::mem::replace(&mut is_formula[number], true) {
                open.extend(&named_by[number]);
            }
        }
        for ((signal, found), is_formula) in self.signals.iter_mut().zip(formulas).zip(is_formula) {
            signal.formula = found.filter(|_| is_formula).map(Arc::new);
        }
    }

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

    /// The entries of `[parameters]` and the implicit parameters.
    pub fn all_parameters(&self) -> impl Iterator<Item = &Parameter> {
        self.parameters.iter().chain(&self.implicit).chain(&self.of_runs)
    }

    /// The one of these that has a name.
    pub fn declared(&self, name: &str) -> Option<&Parameter> {
        [&self.parameters, &self.implicit, &self.of_runs].into_iter().find_map(|list| list.get(name))
    }

    /// The entry that an expression names: the first of that name in [`Self::in_order`].
    pub(crate) fn parameter(&self, name: &str) -> Option<&Parameter> {
        let lists = [&self.parameters, &self.implicit, &self.of_runs, &self.keys];
        lists.into_iter().filter_map(|list| list.get(name)).min_by_key(|parameter| parameter.rank)
    }

    /// Names of the files that the model needs.
    pub fn file_names(&self) -> impl Iterator<Item = &str> {
        let tables = self.signals.iter().map(|signal| &signal.table).chain(self.tables.iter().map(|(_, table)| table));
        tables.chain(self.sweep.tables("correlated")).filter_map(|table| table.word("file"))
    }

    /// The tables of elements and controllers, with keyword and name.
    pub(crate) fn model_tables(&self) -> impl Iterator<Item = (&'static str, &str, &Table)> {
        let elements = self.elements.iter().map(|one| (one.kind.keyword, one.name.as_str(), &one.table));
        elements.chain(self.controls.iter().map(|one| ("control", one.name.as_str(), &one.table)))
    }

    /// All names available to an expression, each after its inputs.
    pub(crate) fn in_order(&self) -> Vec<&Parameter> {
        let mut all: Vec<&Parameter> = self.all_parameters().chain(&self.keys).collect();
        all.sort_by_key(|parameter| parameter.rank);
        all
    }

    /// The charges that the elements introduce as coordinates.
    pub fn charges(&self) -> Vec<String> {
        self.elements.iter().flat_map(|e| e.kind.charges(&e.name)).collect()
    }
}

/// The references and loads that a controller's table introduces.
fn introduced(table: &Table) -> impl Iterator<Item = &str> {
    let of_channels = std::iter::once(table).chain(table.tables("channels"));
    let of_channels = of_channels.flat_map(|table| ["reference", "load"].map(|key| table.word(key)));
    of_channels.chain(table.tables("references").iter().map(|table| table.word("name"))).flatten()
}

/// The keys of a law, without the values of its design model and its operating point, which are read with the parameters and coordinates.
pub(super) fn keys_of(law: &LawKind) -> Vec<Field> {
    law.fields.iter().filter(|field| field.name != "design" && field.name != "at").copied().collect()
}

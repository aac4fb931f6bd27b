//! A model as typed tables; names are not looked up yet.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::block::BlockKind;
use crate::element::Element;
use crate::entries::Place;
use crate::equations::Domain;
use crate::manoeuvre::Cones;
use crate::names::SignalName;
use crate::schema::{Field, Placed, Scalar, Table, Value};
use crate::signal::SignalKind;
use crate::synthesis::LawKind;
use crate::units::{Dimension, Exact, Expression, Spread};

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
    /// How it follows from other parameters, which stand before it in the document; its value is that for theirs.
    pub expression: Option<Expression>,
    /// Zero, or above the ranks of all that it follows from.
    pub(crate) rank: usize,
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

/// What makes a variant.
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

impl Instance {
    /// What it is if it is a body of its own, which others name.
    pub fn body(&self) -> Option<Domain> {
        match self.kind.keyword {
            "shaft" => Some(Domain::Rotation),
            "mass" => Some(Domain::Translation),
            "state" => Some(Domain::Number),
            _ => None,
        }
    }
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
}

/// A block's table.
#[derive(Debug, Clone)]
pub struct BlockTable {
    /// Its kind.
    pub kind: &'static BlockKind,
    /// Its name.
    pub name: String,
    /// Place of the header.
    pub place: Place,
    /// Its keys.
    pub table: Table,
}

/// What is in a file that a model names; why it could not be read, else.
pub type FileBytes = Result<Arc<[u8]>, String>;

/// A model file as typed tables.
#[derive(Debug, Clone, Default)]
pub struct Document {
    /// `[model]`
    pub model: Table,
    /// `[parameters]`
    pub parameters: Vec<Parameter>,
    /// Keys of elements that are written with a tolerance: parameters of the names `<element>.<key>`.
    pub implicit: Vec<Parameter>,
    /// The same of `[scenario]` and of faults, `scenario.initial.a.phi`, `scenario.event.1.at`, `fault.NAME.at`: what the model is does not follow from them.
    pub of_runs: Vec<Parameter>,
    /// Keys of elements that expressions name, `<element>.<key>`: their values are in the tables of the elements, these are to be looked up.
    pub keys: Vec<Parameter>,
    /// `[variants]`
    pub variants: Vec<Variants>,
    /// `[[variant]]`
    pub named_variants: Vec<NamedVariant>,
    /// All elements.
    pub elements: Vec<Instance>,
    /// All controllers.
    pub controls: Vec<Control>,
    /// Names of the tables of lanes, which manoeuvres and paths make.
    pub lanes: BTreeSet<String>,
    /// Cones of manoeuvres.
    pub cones: Vec<Cones>,
    /// `[scenario]`
    pub scenario: Table,
    /// `[signal.<name>]`
    pub signals: Vec<SignalTable>,
    /// `[block.<name>]`
    pub blocks: Vec<BlockTable>,
    /// `[table.<name>]`: names and tables.
    pub tables: Vec<(String, Table)>,
    /// Files that the model names, by their names, as far as they were handed over.
    pub files: BTreeMap<String, FileBytes>,
    /// `[analysis]`
    pub analysis: Table,
    /// `[bench]`
    pub bench: Table,
    /// `[fault.<name>]`: names and tables.
    pub faults: Vec<(Placed<String>, Table)>,
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
    /// Runs may end later than what was read says: a manoeuvre was broken.
    pub durations: bool,
    /// The equations are not those of the file: an element, a controller, a parameter or the choice of coordinates is
    /// wrong.
    pub equations: bool,
}

impl Doubts {
    /// Whether a name may exist that was not read.
    pub fn has(&self, name: &str) -> bool {
        self.all || self.names.contains(name)
    }

    /// Whether a name in an expression may be that of a value that was not read: a parameter, or the key of an element.
    pub(crate) fn has_key(&self, name: &str) -> bool {
        self.has(name) || crate::names::parameter(name).is_some_and(|(element, _)| self.has(element))
    }
}

impl Document {
    /// The expression of a value that is a function of time: of the time, of a signal or of a table.
    pub(crate) fn function_of_time(&self, scalar: &Scalar) -> Option<Expression> {
        let is_signal = |name: &str| self.signals.iter().any(|signal| signal.name == name);
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
    pub(crate) fn signal_sensors(&self) -> impl Iterator<Item = (&str, &str, &Place)> {
        let sensors = self.elements.iter().filter(|element| element.kind.keyword == "sensor");
        sensors.filter_map(|sensor| match sensor.table.values.get("signal")? {
            Placed { value: Value::Word(signal), place } => Some((sensor.name.as_str(), signal.as_str(), place)),
            _ => None,
        })
    }

    /// Whether a name is a block, or a signal that is a formula of what moves.
    pub(crate) fn moves(&self, name: &str) -> bool {
        self.blocks.iter().any(|block| block.name == name)
            || self.signals.iter().any(|signal| signal.name == name && self.program_of(signal).is_some())
    }

    /// The expression of a signal that names what moves, what is measured, or a block; none of a function of time.
    pub(crate) fn program_of(&self, signal: &SignalTable) -> Option<Placed<Expression>> {
        self.program_beside(signal, &mut Vec::new())
    }

    fn program_beside<'a>(&'a self, signal: &'a SignalTable, seen: &mut Vec<&'a str>) -> Option<Placed<Expression>> {
        let Placed { value: Value::Word(text), place } = signal.table.values.get("value")? else { return None };
        let read = Expression::parse_law(text).ok()?;
        seen.push(&signal.name);
        let moves = |name: &str| {
            let head = SignalName::new(name).element;
            let of_element = || self.elements.iter().any(|element| element.name == head);
            let is_element = head != name && (of_element() || self.controls.iter().any(|law| law.name == head));
            let is_sensor = self.elements.iter().any(|one| one.name == name && one.kind.keyword == "sensor");
            is_element || is_sensor || self.blocks.iter().any(|block| block.name == head) || self.is_reference(name)
        };
        let names = read.names();
        let other = |name: &&str| {
            self.signals.iter().find(|other| other.name == **name && !seen.contains(&other.name.as_str()))
        };
        let others: Vec<&SignalTable> = names.iter().filter_map(other).collect();
        let is_program = names.iter().any(|name| moves(name))
            || others.into_iter().any(|other| self.program_beside(other, seen).is_some());
        is_program.then(|| Placed { value: read, place: place.clone() })
    }

    /// Whether a controller introduces a reference of that name.
    fn is_reference(&self, name: &str) -> bool {
        let is = |table: &Table, key: &str| matches!(table.values.get(key), Some(Placed { value: Value::Word(word), .. }) if word == name);
        let introduces = |table: &Table| is(table, "reference") || is(table, "load");
        let channels = |table: &Table| match table.values.get("channels") {
            Some(Placed { value: Value::Tables(tables), .. }) => tables.iter().any(introduces),
            _ => false,
        };
        self.controls.iter().any(|control| introduces(&control.table) || channels(&control.table))
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
    pub(crate) fn all_parameters(&self) -> impl Iterator<Item = &Parameter> {
        self.parameters.iter().chain(&self.implicit).chain(&self.of_runs)
    }

    /// Names of the files that the model needs.
    pub fn file_names(&self) -> impl Iterator<Item = &str> {
        let tables = self.signals.iter().map(|signal| &signal.table).chain(self.tables.iter().map(|(_, table)| table));
        let together = match self.sweep.values.get("together").map(|found| &found.value) {
            Some(Value::Tables(tables)) => &tables[..],
            _ => &[],
        };
        tables.chain(together).filter_map(|table| match &table.values.get("file")?.value {
            Value::Word(name) => Some(name.as_str()),
            _ => None,
        })
    }

    /// All that an expression may name, each behind what it follows from.
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

/// The keys of a law, without the values of its design model and its operating point, which are read with the parameters and coordinates.
pub(super) fn keys_of(law: &LawKind) -> Vec<Field> {
    law.fields.iter().filter(|field| field.name != "design" && field.name != "at").copied().collect()
}

//! Keys of tables, their types, and tables as read.

use kardan_math::names::HasName;
use std::collections::BTreeMap;

use crate::entries::Place;
use kardan_math::units::{Dimension, Exact, Expression, Tolerated, parse_number, parse_quantity};

/// The numbers that a field accepts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// Any finite number.
    Any,
    /// Zero or more.
    NonNegative,
    /// More than zero.
    Positive,
    /// Anything but zero.
    NonZero,
    /// A period, s: at least [`SHORTEST_PERIOD`].
    Period,
}

/// Shortest period, s: a run computes every sample, a million per second.
pub const SHORTEST_PERIOD: f64 = 1e-6;

/// The type of a field of a table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// The name of a shaft.
    Shaft,
    /// The name of a mass.
    Mass,
    /// The name of a shaft or of a mass. The key may be written with `mass` in place of `shaft`.
    Body,
    /// The name of a node of a circuit; its name declares it.
    Node,
    /// Two or more different shaft names; the number requested (0: any number from one up).
    Shafts(usize),
    /// A number with a unit, as text: `"130 kg mm^2"`; or the name of a parameter.
    Quantity(Dimension, Sign),
    /// The same for an element along shafts; for masses their quantity: a force for a torque.
    Mechanical(Dimension, Sign),
    /// A number without a unit (a TOML number or its text, also `"51/50"`); or the name of a parameter.
    Number(Sign),
    /// A table from names of shafts and masses to coefficients: `{ wg = 1, cs = -51, fs = 50 }`.
    Coefficients,
    /// One of these: a number, or a length for each angle.
    Coefficient,
    /// One of a few words.
    Choice(&'static [&'static str]),
    /// The name of an element of one of the kinds listed.
    Element(&'static [&'static str]),
    /// One or more names of elements of the kinds listed.
    Elements(&'static [&'static str]),
    /// The name of a signal: `rk.phi`, `driver.tau`, a reference or a disturbance.
    Signal,
    /// A list of signal names.
    Signals,
    /// A list of names of variants.
    Names,
    /// A new name that this table introduces (a reference such as `ref_rk`).
    Name,
    /// Free text.
    Text,
    /// A quantity of any dimension; the reader checks the dimension against the signal it belongs to.
    AnyQuantity,
    /// A table from parameter names to quantities: `{ beta = "0 deg" }`.
    Overrides,
    /// An operating point: a table from signals to quantities, or such entries in one text: `"t = 3.2 s"`.
    Point,
    /// A table from names to lists of quantities: `{ wg = ["20 rad/s", "60 rad/s"] }`.
    Lists,
    /// A table from names to functions of time: `{ load = "2 N m * sin(2 pi t / 1 s)" }`.
    Functions,
    /// An expression of coordinates, rates, the time, parameters, signals and tables, of a quantity; for masses of theirs.
    Formula(Dimension),
    /// An expression of measurements, signals, blocks, parameters and the time; its dimension follows from its user.
    Expression,
    /// A table from names of inputs to such expressions: `{ assist = "boost - 0.02 N m s/rad * rotor.w" }`.
    Expressions,
    /// A quantity, or a function of time of that dimension; for masses of theirs.
    OfTime(Dimension),
    /// A table from names of shafts and masses to expressions of angles and positions.
    Formulas,
    /// An expression of angles and positions that must be zero, of any unit.
    Surface,
    /// A list of tables, each of the given shape.
    Tables(&'static [Field]),
    /// One table of the given shape.
    Table(&'static [Field]),
    /// An output of the linear model: `rk.phi`, `rk.w` or the name of a sensor.
    Output,
    /// A list of outputs.
    Outputs,
    /// Poles in 1/s: numbers, or texts such as `"-14 + 14.3j"` and, for a pair, `"-14 ± 14.3j"`.
    Poles,
}

impl Kind {
    /// Whether it contains expressions of coordinates, which are read last: they use functions of time.
    pub fn is_formula(self) -> bool {
        matches!(self, Self::Formula(_) | Self::Formulas | Self::Surface | Self::Expression | Self::Expressions)
    }

    /// Its type for an element on shafts or on masses.
    #[must_use]
    pub fn for_translation(self, masses: bool) -> Self {
        match self {
            Self::Mechanical(dimension, sign) if masses => Self::Quantity(dimension.translational(), sign),
            Self::Mechanical(dimension, sign) => Self::Quantity(dimension, sign),
            Self::Formula(dimension) if masses => Self::Formula(dimension.translational()),
            Self::OfTime(dimension) if masses => Self::OfTime(dimension.translational()),
            other => other,
        }
    }
}

/// A complex number with exact parts, 1/s.
pub type ExactPole = (Exact, Exact);

/// One key of a table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    /// The key.
    pub name: &'static str,
    /// Its value.
    pub kind: Kind,
    /// Whether the table is incomplete without it.
    pub required: bool,
    /// The default as written, if it is one value.
    pub default: Option<&'static str>,
    /// One sentence for the manual; states the default if that is not a value.
    pub doc: &'static str,
}

impl Field {
    /// A key that must be there.
    pub const fn required(name: &'static str, kind: Kind, doc: &'static str) -> Self {
        Self { name, kind, required: true, default: None, doc }
    }

    /// A key that may be left out.
    pub const fn optional(name: &'static str, kind: Kind, doc: &'static str) -> Self {
        Self { name, kind, required: false, default: None, doc }
    }

    /// The default, if it is a number; a test reads that of each field.
    pub fn default_number(&self) -> Option<Exact> {
        match self.kind {
            Kind::Quantity(..) | Kind::Mechanical(..) => {
                self.default.and_then(|text| parse_quantity(text).ok()).map(|(value, _)| value)
            }
            Kind::Number(_) => self.default.and_then(|text| parse_number(text).ok()),
            _ => None,
        }
    }

    /// The default, if it is a word.
    pub fn default_word(&self) -> Option<&'static str> {
        self.default.filter(|_| matches!(self.kind, Kind::Choice(_) | Kind::Text))
    }

    /// The other name of a key: that of a body may have `mass` in place of `shaft`.
    pub fn alias(&self) -> Option<String> {
        let rest = self.name.strip_prefix("shaft").filter(|_| self.kind == Kind::Body);
        rest.map(|rest| format!("mass{rest}"))
    }

    /// An optional key with this default.
    pub const fn with_default(name: &'static str, kind: Kind, default: &'static str, doc: &'static str) -> Self {
        Self { name, kind, required: false, default: Some(default), doc }
    }
}

/// A value with its place in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Placed<T> {
    /// The value.
    pub value: T,
    /// Byte range in the source text.
    pub place: Place,
}

impl HasName for Placed<String> {
    fn name(&self) -> &str {
        &self.value
    }
}

/// A quantity or number as written: a literal, or the name of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub enum Scalar {
    /// A literal in SI units, with its dimension.
    Literal(Exact, Dimension),
    /// A literal with a tolerance or an interval.
    Tolerated(Box<Tolerated>),
    /// The name of an entry of `[parameters]`, or of an implicit parameter such as `wg.inertia`.
    Parameter(String),
    /// An expression with such names in it.
    Expression(Box<Expression>),
}

/// The value read for a [`Field`].
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// For `Shaft`, `Node`, `Element`, `Signal`, `Output`, `Choice`, `Name` and `Text`.
    Word(String),
    /// For `Shafts`, `Elements`, `Signals`, `Outputs` and `Names`.
    Names(Vec<Placed<String>>),
    /// For `Quantity`, `AnyQuantity`, `Number` and `Formula` (an expression).
    Scalar(Scalar),
    /// For `Coefficients` (numbers), `Overrides` and `Point` (quantities), `Functions` (expressions) and `Lists` (an entry for each quantity of a list).
    Map(Vec<(Placed<String>, Placed<Scalar>)>),
    /// For `Tables`, and the one of `Table`.
    Tables(Vec<Table>),
    /// For `Poles`.
    Poles(Vec<ExactPole>),
}

/// A table as read: known keys with typed values; errors have been reported already.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// The keys that it may have.
    pub fields: &'static [Field],
    /// Byte range of the table's header (or of the inline table).
    pub place: Place,
    /// The values by key.
    pub values: BTreeMap<&'static str, Placed<Value>>,
    /// Quantities as they are written, `179 deg`, by key.
    pub source_text: BTreeMap<&'static str, String>,
    /// Whether its element acts on masses.
    pub translational: bool,
    /// Keys that are in the file but could not be read, misspelt ones included; each has been reported.
    pub unread: Vec<&'static str>,
}

impl Value {
    /// The numbers, quantities and expressions in it, those of the tables within included.
    pub fn scalars(&self) -> Vec<&Scalar> {
        match self {
            Self::Scalar(scalar) => vec![scalar],
            Self::Map(entries) => entries.iter().map(|(_, scalar)| &scalar.value).collect(),
            Self::Tables(tables) => {
                tables.iter().flat_map(|table| table.values.values()).flat_map(|entry| entry.value.scalars()).collect()
            }
            Self::Word(_) | Self::Names(_) | Self::Poles(_) => Vec::new(),
        }
    }
}

impl Placed<Value> {
    /// The number, quantity or expression that it is, with its place.
    pub fn scalar(&self) -> Option<Placed<Scalar>> {
        let Value::Scalar(scalar) = &self.value else { return None };
        Some(Placed { value: scalar.clone(), place: self.place.clone() })
    }
}

impl Table {
    /// The place of a key's value; of the header if the key is absent.
    pub fn place_of(&self, key: &str) -> &Place {
        self.values.get(key).map_or(&self.place, |entry| &entry.place)
    }

    /// The word of a key with its place.
    pub fn placed_word(&self, key: &str) -> Option<(&str, &Place)> {
        let Placed { value: Value::Word(word), place } = self.values.get(key)? else { return None };
        Some((word, place))
    }

    /// The word of a key.
    pub fn word(&self, key: &str) -> Option<&str> {
        Some(self.placed_word(key)?.0)
    }

    /// The names of a key.
    pub fn names(&self, key: &str) -> Option<&[Placed<String>]> {
        let Value::Names(names) = &self.values.get(key)?.value else { return None };
        Some(names)
    }

    /// The names of a key without their places; none if the key is absent.
    pub fn words(&self, key: &str) -> Vec<String> {
        self.names(key).unwrap_or_default().iter().map(|name| name.value.clone()).collect()
    }

    /// The entries of a key by their names.
    pub fn map(&self, key: &str) -> Option<&[(Placed<String>, Placed<Scalar>)]> {
        let Value::Map(entries) = &self.values.get(key)?.value else { return None };
        Some(entries)
    }

    /// The tables of a key; empty if the key is absent.
    pub fn tables(&self, key: &str) -> &[Table] {
        let Some(Placed { value: Value::Tables(tables), .. }) = self.values.get(key) else { return &[] };
        tables
    }

    /// The number, quantity or expression of a key, or its default at a place.
    pub fn scalar_or_default(&self, key: &str, place: &Place) -> Option<Placed<Scalar>> {
        match self.values.get(key) {
            Some(entry) => entry.scalar(),
            None => Some(Placed { value: self.default_scalar(key)?, place: place.clone() }),
        }
    }

    fn default_of(&self, key: &str) -> Option<&'static Field> {
        self.fields.iter().find(|field| field.name == key).filter(|_| !self.unread.contains(&key))
    }

    /// The default number of a key.
    pub fn default_scalar(&self, key: &str) -> Option<Scalar> {
        let field = self.default_of(key)?;
        let kind = field.kind.for_translation(self.translational);
        let dimension = if let Kind::Quantity(dimension, _) = kind { dimension } else { Dimension::NONE };
        Some(Scalar::Literal(field.default_number()?, dimension))
    }

    /// The default word of a key.
    pub fn default_word(&self, key: &str) -> Option<&'static str> {
        self.default_of(key)?.default_word()
    }
}

//! The manual of the model file, from the registries.

use std::fmt::Write;

use super::examples::example_of;
use super::reading::{BLOCK, CONTROL, SIGNAL};
use super::tables;
use kardan_elements::manoeuvre::{self, Manoeuvre, Need, Path};
use kardan_elements::{block, element, signal};
use kardan_math::units::Dimension;
use kardan_results::{ManualKey, ManualTable};
use kardan_schema::schema::{Field, Keys, Kind, Sign};

/// A kind of element, law, signal or block, as the manual shows it.
pub(super) struct KindPage {
    pub(super) keyword: &'static str,
    /// `element`, `law`, `signal` or `block`.
    pub(super) group: &'static str,
    pub(super) summary: &'static str,
    /// Paragraphs between the summary and the keys.
    about: Vec<&'static str>,
    pub(super) fields: Vec<Field>,
    example: &'static str,
}

impl KindPage {
    /// The header of its table.
    fn header(&self) -> String {
        match self.group {
            "element" => format!("[{}.NAME]", self.keyword),
            "law" => "[control.NAME]".into(),
            group => format!("[{group}.NAME]"),
        }
    }

    /// The same with the word that selects it.
    fn title(&self) -> String {
        match self.group {
            "element" => self.header(),
            "law" => format!("{} with law = \"{}\"", self.header(), self.keyword),
            _ => format!("{} with kind = \"{}\"", self.header(), self.keyword),
        }
    }

    fn page(&self) -> String {
        let mut out = format!("{}\n\n{}\n\n", self.title(), self.summary);
        for paragraph in &self.about {
            let _ = write!(out, "{paragraph}\n\n");
        }
        out.push_str("Keys\n");
        keys(&self.fields, &mut out);
        let _ = write!(out, "\nExample\n\n{}", self.example);
        out
    }
}

/// All kinds, in the order of their registries.
pub(super) fn kind_pages() -> Vec<KindPage> {
    let page =
        |group, keyword, summary, about, fields, example| KindPage { keyword, group, summary, about, fields, example };
    let elements = element::REGISTRY.iter().map(|kind| {
        let about = vec![kind.sketch.trim_start_matches('\n'), kind.signs];
        page("element", kind.keyword, kind.summary, about, kind.fields.to_vec(), kind.example)
    });
    let laws = kardan_synthesis::REGISTRY
        .iter()
        .map(|law| page("law", law.keyword, law.summary, Vec::new(), [CONTROL, law.fields].concat(), law.example));
    let signals = signal::REGISTRY.iter().map(|kind| {
        let fields = [SIGNAL, kind.fields].concat();
        page("signal", kind.keyword, kind.summary, vec![kind.formula], fields, kind.example)
    });
    let blocks = block::REGISTRY.iter().map(|kind| {
        let fields = [BLOCK, kind.fields].concat();
        page("block", kind.keyword, kind.summary, vec![kind.formula], fields, kind.example)
    });
    elements.chain(laws).chain(signals).chain(blocks).collect()
}

/// An overview of all tables that a model file may have.
pub fn manual() -> String {
    let mut out = String::from("Tables of a model file (`kardan elements NAME` shows one in full):\n");
    let pages = kind_pages();
    for (group, title) in [("element", "Elements"), ("law", "Control laws"), ("signal", "Signals"), ("block", "Blocks")]
    {
        let _ = writeln!(out, "\n{title}");
        for page in pages.iter().filter(|page| page.group == group) {
            let _ = writeln!(out, "  {}\n      {}", page.title(), page.summary);
        }
    }
    out.push_str("\nStudy\n");
    for (_, header, what) in STUDY {
        let _ = writeln!(out, "  {header}\n      {what}");
    }
    out
}

/// The tables that are neither an element nor a law: page, header, summary.
const STUDY: &[(&str, &str, &str)] = &[
    ("model", "[model]", "Name, description, reduced coordinates."),
    (
        "parameters",
        "[parameters]",
        "Named quantities, with tolerances if you like; elements use them by name: angle = \"beta\".",
    ),
    ("variants", "[variants]", "Lists of parameter values, one run for each: beta = \"[0, 10, 20, 30] deg\"."),
    ("variant", "[[variant]]", "A run with parameter values and a name of its own."),
    ("scenario", "[scenario]", "Duration, output step, initial state."),
    ("event", "[[scenario.event]]", "A step or ramp of a reference, a disturbance or a motor torque."),
    (
        "signal",
        "[signal.NAME]",
        "A named function of time: sine, chirp, pulses, ramp, smooth_step, sine_with_dwell, multisine, noise, table, expression.",
    ),
    (
        "block",
        "[block.NAME]",
        "What a control unit computes beside its laws: filters, controllers, limits, switches, monitors, state machines.",
    ),
    (
        "fault",
        "[[scenario.fault]]",
        "A fault of a sensor, a motor, a control unit, a bar or gear teeth, temporary or permanent. As \
         `[fault.NAME]`: in the variants that name it, with `kardan run --fault NAME`, and in `kardan safety`.",
    ),
    (
        "safety",
        "[safety]",
        "Faults, variants and values that `kardan safety` tries, the condition for detection, and bounds on effects.",
    ),
    ("sweep", "[sweep]", "What varies in `kardan sweep`, how it is distributed, and how many samples there are."),
    (
        "manoeuvre",
        "[manoeuvre.NAME]",
        "Standard steering tests: steady circle, step, sine, weave, double lane change, sine with dwell, parking, with figures and criteria.",
    ),
    (
        "path",
        "[path.NAME]",
        "Lanes between cones, as tables over x: NAME the middle, NAME_left and NAME_right the limits.",
    ),
    (
        "requirement",
        "[[requirement]]",
        "A bound on a signal; `kardan run` ends with exit code 1 if it is not satisfied.",
    ),
    (
        "figure",
        "[[figure]]",
        "A number of each run, measured from a signal or computed from others: the report lists it beside the requirements.",
    ),
    ("plot", "[[plot]]", "A plot of the report; without any, angles, speeds and motor torques are drawn."),
    (
        "table",
        "[table.NAME]",
        "A curve or a surface through points, which expressions call by its name: `engine(crank.w, 0.5)`.",
    ),
    ("log", "[log.NAME]", "Contents of a measured log: which column is which signal."),
    (
        "identification",
        "[identification]",
        "What to identify from logs, and how; extra friction terms, models to compare.",
    ),
    (
        "analysis",
        "[analysis]",
        "Inputs, outputs and operating point of the structure analysis; candidate locations of motors and sensors.",
    ),
    (
        "bench",
        "[bench]",
        "The virtual test bench of `kardan bench`: true values that the model does not know, excitation, log.",
    ),
];

/// The keys of the tables that are neither an element nor a law, by their pages; `[parameters]` and `[variants]` have names instead.
pub(super) const STUDY_TABLES: &[(&str, &[Field])] = &[
    ("model", tables::Header::FIELDS),
    ("variant", tables::Variant::FIELDS),
    ("scenario", tables::Scenario::FIELDS),
    ("event", tables::Event::FIELDS),
    ("fault", tables::Fault::FIELDS),
    ("safety", tables::Safety::FIELDS),
    ("sweep", tables::Sweep::FIELDS),
    ("requirement", tables::Requirement::FIELDS),
    ("manoeuvre", Manoeuvre::FIELDS),
    ("path", Path::FIELDS),
    ("figure", tables::Figure::FIELDS),
    ("plot", tables::Plot::FIELDS),
    ("analysis", tables::Analysis::FIELDS),
    ("table", tables::LookupTable::FIELDS),
    ("log", tables::Log::FIELDS),
    ("identification", tables::Identification::FIELDS),
    ("bench", tables::Bench::FIELDS),
];

/// Header and summary of such a table.
pub(super) fn study_table(page: &str) -> (&'static str, &'static str) {
    STUDY.iter().find(|(name, ..)| *name == page).map_or(("", ""), |(_, header, what)| (header, what))
}

/// The names of the manual pages that are neither an element nor a law.
pub fn study_pages() -> impl Iterator<Item = &'static str> + Clone {
    STUDY.iter().map(|(page, ..)| *page)
}

const VARIANTS: &str = "\
[variants]

Lists of parameter values, one run for each combination: `NAME = \"[0, 10, 20, 30] deg\"` or
`NAME = [\"0 deg\", \"10 deg\"]`; NAME is declared under [parameters]. Runs that are no grid: `kardan elements variant`.
";

const SIGNALS: &str = "[signal.NAME]

A function of time with a name. `signals` of [scenario] adds functions of time \
to sources (references, disturbances, torques of motors
without a law, voltages): expressions of the time `t`, \
parameters and signals, `\"knocks + 2 N m * sin(2 pi t / 1 s)\"`. A source
is then the sum of its events and that \
function. A law whose `reference` is the name of a signal follows it. Signals may name each
other in expressions; \
`kardan elements KIND` shows the keys.
A signal of the kind expression that depends on coordinates, a sensor or a \
block is not a function of time, but a formula that blocks share.
The integrator ends a step at the exact time of \
each jump and kink of a signal; all signals of a run have at most 100000 such times.
Before its start and after its \
end a signal follows its formula. Such times add no rows of their own: choose
`output_step` so that pulses are \
visible. A Simulation that continues past `duration` gets no further pulses, draws and points there.

Kinds
";

const BLOCKS: &str = "[block.NAME]

What a control unit computes beside its laws. A key that takes an expression may \
name angles and speeds (`rack.s`, `column.w`), sensors with their readings (`encoder.phi`), references, disturbances, \
signals, other blocks, parameters and the time `t`; a signal whose expression names any of these is a formula that \
blocks share, and has its own column (there with ideal sensors). With `sample_time` a block reads its sensors then \
(resolution, noise, faults), computes once and
holds its output, as in firmware: it is the block of kardan-rt. \
Without it, it is a differential equation of the loop.

The output of a block has the name of the block: it is a \
column of the results, and a name in the `reference` of a law, in torques as laws, in the torque of a
clutch or what \
engages a lock, and in the commands of a `law = \"program\"`. Blocks of one sample time compute in the order in which \
they need
each other; `kardan check` lists it. kardan reports algebraic loops: a delay or a forward integrator breaks \
them. Blocks of shorter sample times compute
first; a block reads another sample time through a block of the kind \
hold.

Kinds
";

const PARAMETERS: &str = "[parameters]

Named quantities: `NAME = \"130 kg mm^2\"`. Elements, laws and the study use \
them by name: `inertia = \"NAME\"`.

Expressions
  A quantity or number, here and in every key that takes one, may be \
computed from parameters:
    `m_rack * r_pinion^2`, `200 N * 7.5 mm`, `sqrt(c / J)`, `if(z > 20, 2, 3)`, `2 pi / 60 \
s * 3000`
  There are + - * / ^, parentheses, pi, sqrt sin cos tan asin acos atan atan2 exp ln abs min max sign, and \
if(a < b,
  x, y) with < <= > >= == !=, joined by `and`, `or` and `not`. A condition is a number, 1 where it is true, \
else 0;
  any other number counts as a condition where it is above 0.5. Units follow a number and bind closer than *
  \
and /; a fraction without spaces is one number: 1/2 s. Units are checked; angles are not counted in what is
  \
computed. Values stay exact as fractions and powers of pi; roots and functions are rounded once, to the nearest
  \
number of floating point. Variants recompute them; `kardan check` and `kardan analyze` report what was rounded.
  \
Keys of elements are names too, everywhere: `2 * wheel.inertia`. Quote a name with `-` in it:
  `'my-shaft.inertia'`.

\
Tolerances
  A quantity here, or in the key of an element, may state how far it can be from its value:
      \"0.0081 \
N m s/rad ± 10 %\"                    a fraction of the value (also +- or +/-)
      \"0.0081 N m s/rad ± 0.0004 N m \
s/rad\"        a quantity
      \"(0.0081 ± 0.0004) N m s/rad\"                the same
      \"0.0081 N m s/rad \
[0.0077, 0.0090]\"          bounds in the unit before the bracket
      \"0.0081 N m s/rad [0.0077, 0.0090] 95 %\"     \
a confidence interval
  Everything is computed with the value itself; the structure analysis varies it within its \
tolerance. A tolerance
  in a key of an element makes that key a parameter, `wg.inertia`. Where a parameter is varied \
under [variants], `±`  moves with it.

Example

[parameters]
s = \"100 N m/rad ± 10 %\"

[spring_damper.torsion_bar]
\
shaft_1 = \"rk\"
stiffness = \"s\"
damping = \"0.02 N m s/rad ± 50 %\"
";

/// The manual page of one table: an element, a law, or one of [`study_pages`].
pub fn manual_of(name: &str) -> Option<String> {
    let name = name.trim_start_matches("scenario.");
    let pages = kind_pages();
    let of_group = |group: &str| pages.iter().find(|page| page.group == group && page.keyword == name);
    if let Some(page) = of_group("element").or_else(|| of_group("law")) {
        return Some(page.page());
    }
    let block = of_group("block").map(KindPage::page);
    if let Some(signal) = of_group("signal").map(KindPage::page) {
        // A kind of signal, a kind of block and a table of the model may have one name.
        let study = STUDY_TABLES.iter().any(|(page, _)| *page == name).then(|| study_page(name)).flatten();
        return Some(study.into_iter().chain([signal]).chain(block).collect::<Vec<_>>().join("\n"));
    }
    block.or_else(|| match name {
        "block" => Some(group_page(BLOCKS, name, &pages)),
        "signal" => Some(group_page(SIGNALS, name, &pages)),
        "manoeuvre" => manoeuvre_page(),
        "variants" => Some(VARIANTS.into()),
        "parameters" => Some(PARAMETERS.into()),
        _ => study_page(name),
    })
}

/// The page of a group of kinds: its text, then each kind.
fn group_page(text: &str, group: &str, pages: &[KindPage]) -> String {
    let mut out = String::from(text);
    for page in pages.iter().filter(|page| page.group == group) {
        let _ = writeln!(out, "  kind = \"{}\": {}", page.keyword, page.summary);
    }
    let _ = write!(out, "\nExample\n\n{}", example_of(group));
    out
}

/// The page of manoeuvres: the keys, then each kind with the keys that it accepts.
fn manoeuvre_page() -> Option<String> {
    let mut out = study_page("manoeuvre")?;
    out.push_str("\nKinds\n");
    for kind in manoeuvre::REGISTRY {
        let key = |(name, need): &(&str, Need)| match need {
            Need::Required => format!("{name} (required)"),
            Need::Optional => (*name).to_string(),
            Need::Default(value) => format!("{name} (left out: {value})"),
        };
        let keys: Vec<String> = kind.keys.iter().map(key).collect();
        let (word, summary) = (kind.keyword, kind.summary);
        let _ = writeln!(
            out,
            "  kind = \"{word}\": {summary}\n      Keys: {}.\n      Measures: {}",
            keys.join(", "),
            kind.measures
        );
    }
    Some(out)
}

/// The page of a table that is neither an element nor a law.
fn study_page(name: &str) -> Option<String> {
    let mut out = String::new();
    let (page, fields) = STUDY_TABLES.iter().find(|(page, _)| *page == name)?;
    let (header, _) = study_table(page);
    let _ = writeln!(out, "{header}\n\nKeys");
    keys(fields, &mut out);
    let example = example_of(name);
    if !example.is_empty() {
        let _ = write!(out, "\nExample\n\n{example}");
    }
    Some(out)
}

/// The tables of a model file as data: elements, laws, and the rest.
pub fn manual_tables() -> Vec<ManualTable> {
    let table = |name: &str, header: String, group: &str, summary: &str, fields: &[Field], example: &str| ManualTable {
        name: name.into(),
        header,
        group: group.into(),
        summary: summary.into(),
        keys: manual_keys(fields),
        example: example.into(),
    };
    let kinds = kind_pages()
        .into_iter()
        .map(|page| table(page.keyword, page.header(), page.group, page.summary, &page.fields, page.example));
    let study = STUDY.iter().map(|(page, header, summary)| {
        let fields = STUDY_TABLES.iter().find(|(name, _)| name == page).map_or(&[][..], |(_, fields)| *fields);
        table(page, (*header).into(), "study", summary, fields, example_of(page))
    });
    kinds.chain(study).collect()
}

fn manual_keys(fields: &[Field]) -> Vec<ManualKey> {
    let key = |field: &Field| ManualKey {
        name: field.name.into(),
        value_type: value_kind(field),
        required: field.required,
        default: field.default.map(Into::into),
        summary: field.doc.into(),
        keys: match field.kind {
            Kind::Tables(inner) | Kind::Table(inner) => manual_keys(inner),
            _ => Vec::new(),
        },
    };
    fields.iter().map(key).collect()
}

fn keys(fields: &[Field], out: &mut String) {
    for field in fields {
        let _ = writeln!(out, "  {} ({}, {})\n      {}", field.name, value_kind(field), need(field), field.doc);
        if let Kind::Tables(inner) | Kind::Table(inner) = field.kind {
            for field in inner {
                let (kind, need) = (value_kind(field), need(field));
                let _ = writeln!(out, "      {} ({kind}, {need})\n          {}", field.name, field.doc);
            }
        }
    }
}

/// Whether a key is required, or its default.
pub(super) fn need(field: &Field) -> String {
    match (field.required, field.default) {
        (true, _) => "required".into(),
        (_, Some(default)) => format!("left out: {default}"),
        (_, None) => "optional".into(),
    }
}

/// The type of a key, and its alias.
pub(super) fn value_kind(field: &Field) -> String {
    match field.alias() {
        Some(alias) => format!("{}; also `{alias}`", describe(&field.kind)),
        None => describe(&field.kind),
    }
}

fn describe(kind: &Kind) -> String {
    let sign = |sign: &Sign| match sign {
        Sign::Any => "",
        Sign::NonNegative => ", zero or more",
        Sign::Positive => ", above zero",
        Sign::NonZero => ", not zero",
        Sign::Period => ", at least 1 us",
    };
    match kind {
        Kind::Shaft => "shaft".into(),
        Kind::Mass => "mass".into(),
        Kind::Body => "shaft or mass".into(),
        Kind::Node => "node".into(),
        Kind::Shafts(_) => "list of shafts".into(),
        Kind::Quantity(dimension, s) => format!("{}{}", dimension.si(), sign(s)),
        Kind::Mechanical(dimension, s) => {
            format!("{}; for masses {}{}", dimension.si(), dimension.translational().si(), sign(s))
        }
        Kind::Number(s) => format!("number{}", sign(s)),
        Kind::Coefficients => "numbers by shaft or mass".into(),
        Kind::Coefficient => "number or length".into(),
        Kind::Choice(choices) => choices.join(" | "),
        Kind::Element(kinds) => format!("name of a {}", kinds.join(" or ")),
        Kind::Elements(kinds) => format!("list of {} names", kinds.join(" or ")),
        Kind::Signal => "signal".into(),
        Kind::Signals => "list of signals".into(),
        Kind::Names => "list of names".into(),
        Kind::Name => "new name".into(),
        Kind::Text => "text".into(),
        Kind::AnyQuantity => "quantity".into(),
        Kind::Overrides => "quantities by name".into(),
        Kind::Point => "quantities by signal, or a text such as \"t = 3.2 s\"".into(),
        Kind::Lists => "lists of quantities by name".into(),
        Kind::Functions => "functions of time by name".into(),
        Kind::Expressions => "expressions by name".into(),
        Kind::Expression => "expression of measurements, signals and blocks".into(),
        Kind::Surface => "expression of angles and positions".into(),
        Kind::Formulas => "expressions by shaft or mass".into(),
        Kind::Formula(Dimension::NONE) => "expression of a number".into(),
        Kind::Formula(dimension) => {
            format!("expression of {}; for masses {}", dimension.si(), dimension.translational().si())
        }
        Kind::OfTime(dimension) if *dimension == dimension.translational() => {
            format!("{} or a function of time", dimension.si())
        }
        Kind::OfTime(dimension) => {
            format!("{} or a function of time; for masses {}", dimension.si(), dimension.translational().si())
        }
        Kind::Tables(_) => "list of tables".into(),
        Kind::Table(_) => "table".into(),
        Kind::Output => "angle, speed or sensor".into(),
        Kind::Outputs => "list of angles, speeds and sensors".into(),
        Kind::Poles => "poles, 1/s".into(),
    }
}

#[cfg(test)]
#[path = "../tests/unit/manual.rs"]
mod tests;

//! What a study asks for: requirements, plots, accuracy.

use super::Requirement;
use super::computed::{Asked, POWER, asked, reference};
use super::known::Known;
use super::measure::Band;
use super::read::{physical_dimension, quantity, read_scalar, read_word, read_words};
use super::requirement::motor_of;
use super::spectrum::LEAST_ROWS;
use crate::diagnostics::{Diagnostic, nearest, quoted, shortened};
use crate::entries::Place;
use crate::model::tables::Measure;
use crate::model::{Document, TableReader, wrong_dimension};
use crate::results::{DisplayUnit, Physical, Plot, PlotUnit, PlottedReference, Span};
use crate::schema::{Placed, Scalar as Written, Sign, Table};
use crate::simulate::Tolerance;
use crate::units::{Dimension, Exact, unit_as_written};

pub(super) fn known_variants(
    table: &Table,
    names: &[String],
    known: &Known<'_>,
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Vec<String> {
    let words = read_words(table, "variants");
    let doubts = &known.document.doubts;
    for word in words.iter().filter(|word| !names.contains(&word.value) && !doubts.variants && !doubts.all) {
        let there: Vec<&str> = names.iter().map(String::as_str).filter(|name| !name.is_empty()).collect();
        let help = match nearest(&word.value, there.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None if there.is_empty() => "the model has no `[variants]`; leave this key out".to_string(),
            None => format!("there are {}", quoted(there)),
        };
        let message = format!("{what}: there is no variant `{}`", shortened(&word.value));
        out.push(Diagnostic::error("name::unknown", message).at(word.place.clone(), "no such variant").help(help));
    }
    words.iter().map(|word| word.value.clone()).collect()
}

pub(super) fn requirements(known: &Known<'_>, variants: &[String], out: &mut Vec<Diagnostic>) -> Vec<Requirement> {
    let reader = &TableReader::new(known.document, &[]);
    let duration = quantity(reader, &known.document.scenario, "duration", TIME, "", &mut Vec::new());
    let end = duration.map_or(f64::INFINITY, |x| x.to_f64());
    let asked = Requirements { known, reader, variants, end, what: REQUIREMENT.into() };
    known.document.requirements.iter().filter_map(|table| asked.read(table, out)).collect()
}

/// A time that is zero or more.
const TIME: (Dimension, Sign) = (Dimension::TIME, Sign::NonNegative);
/// The table of a requirement in messages.
const REQUIREMENT: &str = "`[[requirement]]`";

/// What the tables of requirements are read with.
pub(super) struct Requirements<'a> {
    pub(super) known: &'a Known<'a>,
    pub(super) reader: &'a TableReader<'a>,
    pub(super) variants: &'a [String],
    /// The end of a run, s.
    pub(super) end: f64,
    /// What the table is called in messages.
    pub(super) what: String,
}

impl Requirements<'_> {
    fn read(&self, table: &Table, out: &mut Vec<Diagnostic>) -> Option<Requirement> {
        let (known, document) = (self.known, self.known.document);
        let variants = known_variants(table, self.variants, known, REQUIREMENT, out);
        check_keys(table, document, out);
        let signal = read_word(table, "signal");
        let place = TableReader::place(table, "signal");
        let found = signal.and_then(|name| asked(name, &place, known, REQUIREMENT, out));
        let (from, until) = (self.number(table, "from", TIME, out), self.number(table, "until", TIME, out));
        let measure = read_word(table, "measure").and_then(Measure::of);
        if let (Some(Measure::TimeAtLimit), Some(name), Some(_)) = (measure, signal, &found) {
            check_limited(name, &place, document, out);
        }
        check_measure_keys(table, measure, out);
        let dimension = found.as_ref().zip(measure).and_then(|(found, measure)| {
            check_power(found, measure, &place, out);
            measured_dimension(measure, found.dimension)
        });
        let bounds = dimension.map(|dimension| ["below", "above"].map(|key| self.like(table, key, dimension, out)));
        let target = found.as_ref().and_then(|found| self.like(table, "target", found.dimension, out));
        let band = found.as_ref().and_then(|found| self.band(table, found.dimension, out));
        self.check_window(table, from.unwrap_or_default(), until, out);
        if let Some([Some(below), Some(above)]) = bounds
            && above >= below
        {
            let message = format!("{REQUIREMENT}: nothing is above {above} and below {below}");
            out.push(
                Diagnostic::error("requirement::bounds", message)
                    .at(TableReader::place(table, "below"), "not above `above`")
                    .help("let `above` be less than `below`, or write two requirements"),
            );
        }
        let ([below, above], signal, measure) = (bounds?, signal?.into(), measure?);
        let (from, until) = (from.unwrap_or_default(), until.unwrap_or(f64::INFINITY));
        let (found, dimension) = (found?, dimension?);
        let own = dimension == found.dimension;
        let display = own.then(|| self.unit_of_bounds(table, found.physical)).flatten();
        let unit = if own { found.physical.unit().to_string() } else { unit_of(measure, dimension) };
        Some(Requirement { signal, measure, unit, target, band, display, below, above, from, until, variants })
    }

    /// A value of a dimension; of one without a name angles are not counted.
    pub(super) fn like(&self, table: &Table, key: &str, expected: Dimension, out: &mut Vec<Diagnostic>) -> Option<f64> {
        if expected.word().is_some() {
            return self.number(table, key, (expected, Sign::Any), out);
        }
        let scalar = read_scalar(table, key)?;
        let label = format!("`{key}` of {}", self.what);
        let (value, found) = self.reader.scalar(&scalar, None, &label, out)?;
        if !expected.is_like(&found) {
            out.push(wrong_dimension(&label, expected, found, scalar.place));
            return None;
        }
        Some(value.to_f64())
    }

    /// How near to its target a signal must stay: in its unit, or a part of its way.
    fn band(&self, table: &Table, dimension: Dimension, out: &mut Vec<Diagnostic>) -> Option<Band> {
        let scalar = read_scalar(table, "band")?;
        let label = format!("`band` of {REQUIREMENT}");
        let (value, found) = self.reader.scalar(&scalar, None, &label, out)?;
        if value.signum() <= 0 {
            let message = format!("{label} must be more than zero");
            out.push(Diagnostic::error("number::sign", message).at(scalar.place, "not above zero").help(BAND_HELP));
            return None;
        }
        match found {
            Dimension::NONE if dimension != Dimension::NONE => Some(Band::Part(value.to_f64())),
            _ if found == dimension || dimension.word().is_none() && dimension.is_like(&found) => {
                Some(Band::Size(value.to_f64()))
            }
            _ => {
                out.push(wrong_dimension(&label, dimension, found, scalar.place));
                None
            }
        }
    }

    /// The unit of the bounds as the file writes it, `None` if it is the SI unit.
    pub(super) fn unit_of_bounds(&self, table: &Table, physical: Physical) -> Option<DisplayUnit> {
        let text = ["below", "above"].into_iter().find_map(|key| table.written.get(key))?;
        let named = || self.known.document.all_parameters().find(|parameter| &parameter.name == text);
        let text = named().map_or(text, |parameter| &parameter.text);
        display_unit(unit_as_written(text)?, physical)
    }

    fn number(&self, table: &Table, key: &str, expected: (Dimension, Sign), out: &mut Vec<Diagnostic>) -> Option<f64> {
        quantity(self.reader, table, key, expected, &self.what, out).map(|x| x.to_f64())
    }

    /// Tells of a window in which no time is left.
    fn check_window(&self, table: &Table, begin: f64, until: Option<f64>, out: &mut Vec<Diagnostic>) {
        let end = until.unwrap_or(f64::INFINITY).min(self.end);
        if begin > end {
            let (key, other) = if until.is_some_and(|until| until <= end) { ("until", end) } else { ("from", end) };
            let message = format!("{REQUIREMENT}: the window is empty: it begins at {begin} s and ends at {other} s");
            out.push(
                Diagnostic::error("requirement::window", message)
                    .at(TableReader::place(table, key), "no time is left")
                    .help("let `from` come before `until`, and both before the end of the run (`duration`)"),
            );
        }
    }
}

const BAND_HELP: &str = "write a part of the way to the target, `band = 0.02`, or a size in the unit of the signal";

/// The dimension of a measure; nothing of a power that is none.
fn measured_dimension(measure: Measure, signal: Dimension) -> Option<Dimension> {
    match measure {
        Measure::TimeAtLimit | Measure::SettlingTime => Some(Dimension::TIME),
        Measure::Overshoot | Measure::Events => Some(Dimension::NONE),
        Measure::Iae => signal.times(&Dimension::TIME, 1),
        Measure::Energy => POWER.is_like(&signal).then_some(Dimension::TORQUE),
        Measure::Max | Measure::Min | Measure::MaxAbs | Measure::Final | Measure::Rms | Measure::Ripple => Some(signal),
    }
}

fn unit_of(measure: Measure, dimension: Dimension) -> String {
    if measure == Measure::Energy { Physical::Energy.unit().to_string() } else { dimension.si() }
}

/// Tells of an energy that is asked of what is no power.
fn check_power(found: &Asked, measure: Measure, place: &Place, out: &mut Vec<Diagnostic>) {
    if measure == Measure::Energy && !POWER.is_like(&found.dimension) {
        let message = format!(
            "{REQUIREMENT}: an energy is the integral of a power, and `{}` is {}",
            shortened(&found.name),
            found.dimension.noun()
        );
        out.push(
            Diagnostic::error("unit::dimension", message)
                .at(place.clone(), "no power")
                .help("multiply a torque by an angular velocity: `signal = \"motor.tau * motor_shaft.w\"`"),
        );
    }
}

/// Tells of keys that a measure needs, and of those that say nothing for it.
fn check_measure_keys(table: &Table, measure: Option<Measure>, out: &mut Vec<Diagnostic>) {
    let Some(measure) = measure else { return };
    let word = measure.word();
    let here = |key: &str| table.values.contains_key(key) || table.unread.contains(&key);
    if measure == Measure::SettlingTime && !here("band") {
        let message = format!("{REQUIREMENT}: `{word}` needs the key `band`");
        let place = TableReader::place(table, "measure");
        out.push(Diagnostic::error("key::missing", message).at(place, "`band` is missing").help(BAND_HELP));
    }
    let takes = |key: &str| match key {
        "target" => matches!(measure, Measure::Overshoot | Measure::SettlingTime | Measure::Iae),
        _ => measure == Measure::SettlingTime,
    };
    for key in ["target", "band"].into_iter().filter(|key| here(key) && !takes(key)) {
        let message = format!("{REQUIREMENT}: `{key}` says nothing for the measure `{word}`");
        let help = match key {
            "target" => "remove it, or measure `overshoot`, `settling_time` or `iae`",
            _ => "remove it, or measure `settling_time`",
        };
        let place = TableReader::place(table, key);
        out.push(Diagnostic::error("requirement::key", message).at(place, "not used").help(help));
    }
}

/// Tells of a requirement without a bound, and of one that differs between the variants.
fn check_keys(table: &Table, document: &Document, out: &mut Vec<Diagnostic>) {
    let here = |key: &str| table.values.contains_key(key) || table.unread.contains(&key);
    if !here("below") && !here("above") {
        out.push(
            Diagnostic::error("key::missing", format!("{REQUIREMENT}: a bound is missing"))
                .at(table.place.clone(), "neither `below` nor `above`")
                .help("add `below = \"...\"`, `above = \"...\"` or both"),
        );
    }
    for key in ["below", "above", "target", "band", "from", "until"] {
        if let Some(Placed { value: Written::Parameter(name), place }) = read_scalar(table, key)
            && document.is_varied(&name)
        {
            let message = format!("`{key}` of {REQUIREMENT}: `{name}` differs between the variants");
            out.push(
                Diagnostic::error("requirement::varied", message)
                    .at(place, "a varied parameter")
                    .help("write a number, and one requirement for each variant: `variants = [...]`"),
            );
        }
    }
}

/// Tells of a requirement on the time at a limit that the signal is not what a motor or a source with a limit gives.
fn check_limited(signal: &str, place: &Place, document: &Document, out: &mut Vec<Diagnostic>) {
    let limit = |keyword: &str| match keyword {
        "motor" => Some("torque_limit"),
        "voltage_source" => Some("voltage_limit"),
        _ => None,
    };
    let named = |name: &str| {
        let motor = document.elements.iter().find(|e| e.name == name)?;
        Some((motor, limit(motor.kind.keyword)?))
    };
    let problem = match motor_of(signal).and_then(named) {
        None => (
            format!("`{signal}` is not what a motor or a voltage source gives, and these alone have a limit"),
            "name the torque of a motor, `signal = \"MOTOR.tau\"`, or the voltage of a source, `signal = \"SOURCE.v\"`"
                .to_string(),
        ),
        Some((motor, limit)) if !motor.table.values.contains_key(limit) && !motor.table.unread.contains(&limit) => {
            let (kind, name) = (motor.kind.keyword, &motor.name);
            (
                format!(
                    "the {} `{name}` has no {}, so it is never there",
                    kind.replace('_', " "),
                    limit.replace('_', " ")
                ),
                format!("add `{limit} = \"...\"` to `[{kind}.{name}]`, or ask for another measure"),
            )
        }
        Some(_) => return,
    };
    let message = format!("`[[requirement]]`: {}", problem.0);
    out.push(Diagnostic::error("requirement::limit", message).at(place.clone(), "no limit").help(problem.1));
}

/// A unit for signals of a kind; `None` if it is the SI unit or one of something else.
fn display_unit((unit, size, dimension): (&str, Exact, Dimension), physical: Physical) -> Option<DisplayUnit> {
    let size = size.to_f64();
    (dimension == physical_dimension(physical) && size != 1.0).then(|| DisplayUnit { unit: unit.into(), size })
}

/// The unit in which signals of a plot are drawn; a text that is no unit of one of them is reported.
fn display(table: &Table, kinds: &[Physical], what: &str, out: &mut Vec<Diagnostic>) -> Option<PlotUnit> {
    let text = read_word(table, "display")?.trim();
    let written = format!("1 {text}");
    let mistake = |code: &'static str, message: String, help: String| {
        Diagnostic::error(code, message).at(TableReader::place(table, "display"), "no unit of what is drawn").help(help)
    };
    let units: Vec<String> = kinds.iter().map(|kind| format!("`{}`", kind.unit())).collect();
    let drawn = units.join(", ");
    let Some(unit @ (_, _, dimension)) = unit_as_written(&written) else {
        let message = format!("{what}: `{}` is no unit", shortened(text));
        out.push(mistake("unit::unknown", message, "write a unit such as `deg`, `rpm` or `mN m`".into()));
        return None;
    };
    let Some(&physical) = kinds.iter().find(|kind| physical_dimension(**kind) == dimension) else {
        // Signals that were not found are reported already.
        if !kinds.is_empty() {
            let message = format!("{what}: `{}` is {}, and no such signal is drawn", shortened(text), dimension.noun());
            out.push(mistake(
                "unit::dimension",
                message,
                format!("the signals drawn are in {drawn}: write a unit of one of these"),
            ));
        }
        return None;
    };
    display_unit(unit, physical).map(|unit| PlotUnit { physical, unit })
}

/// The time that a plot shows; one that is empty is reported.
fn window(table: &Table, known: &Known<'_>, what: &str, out: &mut Vec<Diagnostic>) -> Option<Span> {
    let reader = &TableReader::new(known.document, &[]);
    let [from, until] = ["from", "until"].map(|key| quantity(reader, table, key, TIME, what, out).map(|x| x.to_f64()));
    let duration = quantity(reader, &known.document.scenario, "duration", TIME, "", &mut Vec::new());
    let end = duration.map_or(f64::INFINITY, |x| x.to_f64());
    let begin = from.unwrap_or_default();
    let last = until.unwrap_or(f64::INFINITY);
    if begin >= last {
        let message = format!("{what}: no time is left to draw: it begins at {begin} s and ends at {last} s");
        out.push(
            Diagnostic::error("plot::window", message)
                .at(TableReader::place(table, "from"), "no time is left")
                .help("let `from` come before `until`"),
        );
    } else if begin >= end {
        let message = format!("{what}: no time is left to draw: it begins at {begin} s and the run ends at {end} s");
        out.push(
            Diagnostic::warning("plot::window", message)
                .at(TableReader::place(table, "from"), "after the end")
                .help("lengthen `duration` or let `from` come before its end"),
        );
    }
    (from.is_some() || until.is_some()).then_some(Span { from: begin, until: until.unwrap_or(f64::INFINITY) })
}

pub(super) fn plots(known: &Known<'_>, variants: &[String], out: &mut Vec<Diagnostic>) -> Vec<Plot> {
    let mut plots: Vec<Plot> = Vec::new();
    let mut places: Vec<Place> = Vec::new();
    for table in &known.document.plots {
        let id = read_word(table, "name").unwrap_or_default().to_string();
        let what = if id.is_empty() { "`[[plot]]`".to_string() } else { format!("plot `{id}`") };
        let place = TableReader::place(table, "name");
        if let Some(other) = plots.iter().position(|plot| plot.id.eq_ignore_ascii_case(&id) && !id.is_empty()) {
            out.push(
                Diagnostic::error("name::duplicate", format!("there are two plots named `{id}`"))
                    .at(place.clone(), "again here")
                    .at(places[other].clone(), "first here")
                    .help("give each plot a name of its own; it becomes a file name"),
            );
        }
        let variants = known_variants(table, variants, known, &what, out);
        let mut kinds = Vec::new();
        let drawn: Vec<String> = read_words(table, "signals").iter().map(|word| word.value.clone()).collect();
        for word in read_words(table, "signals") {
            kinds.extend(asked(&word.value, &word.place, known, &what, out).map(|found| found.physical));
        }
        let mut drawn_beside = |word: &Placed<String>| {
            let reference = reference(&word.value, known);
            asked(&reference.signal, &word.place, known, &what, out);
            reference
        };
        let references: Vec<PlottedReference> = read_words(table, "references").iter().map(&mut drawn_beside).collect();
        let labels: Vec<String> = read_words(table, "labels").iter().map(|word| word.value.clone()).collect();
        let curves = drawn.len() + references.len();
        if labels.len() > curves && !table.unread.contains(&"signals") && !table.unread.contains(&"references") {
            let message = format!("{what}: {} labels for {curves} signals and references", labels.len());
            out.push(
                Diagnostic::error("list::length", message)
                    .at(TableReader::place(table, "labels"), "too many")
                    .help("write one for each of `signals`, then one for each of `references`"),
            );
        }
        if drawn.is_empty() && table.values.contains_key("signals") {
            out.push(
                Diagnostic::error("list::length", format!("{what}: there is nothing to draw"))
                    .at(TableReader::place(table, "signals"), "no signal")
                    .help("list one or more signals: `signals = [\"rk.phi\"]`"),
            );
        }
        let over = read_word(table, "over").and_then(|text| {
            let found = asked(text, &TableReader::place(table, "over"), known, &what, out)?;
            kinds.push(found.physical);
            Some(found.name)
        });
        let (display, window) = (display(table, &kinds, &what, out), window(table, known, &what, out));
        let spectrum = read_word(table, "shows") == Some("spectrum");
        if spectrum {
            check_spectrum(table, known, (window, &what), out);
        }
        let log = |key: &str| read_word(table, key) == Some("log");
        places.push(place);
        plots.push(Plot {
            id,
            title: read_word(table, "title").unwrap_or_default().into(),
            caption: read_word(table, "caption").unwrap_or_default().into(),
            signals: drawn,
            references,
            labels,
            variants,
            display,
            window,
            over,
            log_x: log("x_scale"),
            log_y: log("y_scale"),
            spectrum,
        });
    }
    plots
}

/// Tells of a spectrum over something else than the frequency, and of one of too few rows.
fn check_spectrum(table: &Table, known: &Known<'_>, (window, what): (Option<Span>, &str), out: &mut Vec<Diagnostic>) {
    if table.values.contains_key("over") {
        let message = format!("{what}: a spectrum has the frequency on its horizontal axis, not a signal");
        let place = TableReader::place(table, "over");
        out.push(
            Diagnostic::error("plot::spectrum", message)
                .at(place, "not the frequency")
                .help("remove `over`, or draw values: `shows = \"values\"`"),
        );
    }
    let reader = &TableReader::new(known.document, &[]);
    let scenario = &known.document.scenario;
    let [duration, step] = ["duration", "output_step"]
        .map(|key| quantity(reader, scenario, key, TIME, "", &mut Vec::new()).map(|value| value.to_f64()));
    let (Some(duration), Some(step)) = (duration, step.filter(|step| *step > 0.0)) else { return };
    let Span { from, until } = window.unwrap_or(Span { from: 0.0, until: f64::INFINITY });
    let rows = ((until.min(duration) - from) / step).max(0.0).floor();
    if rows < LEAST_ROWS as f64 {
        let message = format!(
            "{what}: a spectrum takes more than {LEAST_ROWS} rows, and {rows} steps of {step} s lie in the time that is drawn"
        );
        out.push(
            Diagnostic::error("plot::spectrum", message)
                .at(TableReader::place(table, "shows"), "too few rows")
                .help("draw a longer time, or shorten `output_step` of `[scenario]`"),
        );
    }
}

/// Relative tolerances that make sense: below the first there is nothing but rounding.
pub const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-13..=1e-3;

pub(super) fn tolerance(document: &Document, out: &mut Vec<Diagnostic>) -> Tolerance {
    let reader = TableReader::new(document, &[]);
    let relative = quantity(
        &reader,
        &document.scenario,
        "relative_tolerance",
        (Dimension::NONE, Sign::Positive),
        "`[scenario]`",
        out,
    );
    let Some(relative) = relative.map(|x| x.to_f64()) else { return Tolerance::default() };
    if !TOLERANCES.contains(&relative) {
        out.push(
            Diagnostic::error("scenario::tolerance", format!("a relative tolerance of {relative:e} is out of range"))
                .at(TableReader::place(&document.scenario, "relative_tolerance"), "from 1e-13 to 1e-3")
                .help("leave it out for 1e-10, which suits almost every study"),
        );
    }
    Tolerance::relative(relative)
}

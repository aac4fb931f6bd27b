//! Requirements as a model file writes them: signal, measure, window and bounds of each, with their errors.

use crate::study::Requirement;
use crate::study::measure::computed_signals::{POWER, ResolvedSignal, kind_of, resolve_signal};
use crate::study::measure::figure::Figure;
use crate::study::measure::measures::Band;
use crate::study::measure::requirement_verdict::motor_of;
use crate::study::read::locations::unknown_name_or;
use crate::study::read::read_values::{is_given, quantity, read_word};
use crate::study::read::signal_table::SignalContext;
use kardan_math::names::NamedList;
use kardan_math::units::{Dimension, split_unit};
use kardan_model::tables::Measure;
use kardan_model::{Document, TableReader, wrong_dimension};
use kardan_results::{DisplayUnit, Physical};
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::entries::Place;
use kardan_schema::schema::{Placed, Scalar as SchemaScalar, Sign, Table};

use super::selected_variants::selected_variants;

/// A nonnegative time.
pub(super) const TIME: (Dimension, Sign) = (Dimension::TIME, Sign::NonNegative);
/// The name of the table of a requirement in messages.
const REQUIREMENT: &str = "`[[requirement]]`";

/// The context for reading the tables of requirements and figures.
pub(in crate::study) struct Measuring<'a> {
    pub(in crate::study) context: &'a SignalContext<'a>,
    pub(in crate::study) reader: &'a TableReader<'a>,
    pub(in crate::study) variants: &'a [String],
    /// The ends of the runs, s, by their names.
    pub(in crate::study) ends: &'a [(String, f64)],
}

impl Measuring<'_> {
    /// A requirement.
    pub(super) fn bounded(
        &self,
        table: &Table,
        figures: &NamedList<Figure>,
        out: &mut Vec<Diagnostic>,
    ) -> Option<Requirement> {
        let (context, document) = (self.context, self.context.document);
        let variants = selected_variants(table, self.variants, context, REQUIREMENT, out);
        check_bounds(table, out);
        let judged = match is_given(table, "figure") {
            true => self.figure(table, figures, out),
            false => self.measure(table, &variants, REQUIREMENT, out),
        };
        let bounds = judged
            .as_ref()
            .map(|(_, dimension)| ["below", "above"].map(|key| self.like(table, key, *dimension, REQUIREMENT, out)));
        check_varied(table, document, &["below", "above"], REQUIREMENT, out);
        if let Some([Some(below), Some(above)]) = bounds
            && above >= below
        {
            let message = format!("{REQUIREMENT}: no value is above {above} and below {below}");
            out.push(
                Diagnostic::error("requirement::bounds", message)
                    .at(TableReader::place(table, "below"), "not above `above`")
                    .help("let `above` be less than `below`, or write two requirements"),
            );
        }
        let ((measure, dimension), [below, above]) = (judged?, bounds?);
        let same_unit = measure.figure.is_some() || dimension == measure.dimension;
        let display = same_unit.then(|| self.unit_of_bounds(table, dimension)).flatten().or(measure.display.clone());
        Some(Requirement { below, above, display, variants, ..measure })
    }

    /// The figure of a requirement on a figure.
    fn figure(
        &self,
        table: &Table,
        figures: &NamedList<Figure>,
        out: &mut Vec<Diagnostic>,
    ) -> Option<(Requirement, Dimension)> {
        self.reject_other_keys(table, "figure", REQUIREMENT, out);
        let name = read_word(table, "figure")?;
        let Some(found) = figures.get(name) else {
            if self.context.document.figures.iter().any(|table| read_word(table, "name") == Some(name)) {
                return None;
            }
            let names = figures.iter().map(|figure| figure.name.as_str());
            let help = unknown_name_or(name, names, "the model has no `[[figure]]`");
            let message = format!("{REQUIREMENT}: there is no figure `{}`", shortened(name));
            let place = TableReader::place(table, "figure");
            out.push(Diagnostic::error("name::unknown", message).at(place, "no such figure").help(help));
            return None;
        };
        let judged = Requirement {
            figure: Some(name.into()),
            unit: found.unit.clone(),
            display: found.display.clone(),
            dimension: found.dimension,
            ..Requirement::default()
        };
        Some((judged, found.dimension))
    }

    /// Reports keys without meaning next to a sufficient key.
    pub(super) fn reject_other_keys(&self, table: &Table, key: &'static str, what: &str, out: &mut Vec<Diagnostic>) {
        let measuring = ["signal", "measure", "over", "at", "frequency", "target", "band", "from", "until"];
        for surplus_key in measuring.into_iter().filter(|key| table.values.contains_key(key)) {
            let message = format!("{what}: `{surplus_key}` has no meaning with `{key}`");
            let place = TableReader::place(table, surplus_key);
            let help = format!("remove it, or write `signal` and `measure` in place of `{key}`");
            out.push(Diagnostic::error("requirement::key", message).at(place, "not used").help(help));
        }
    }

    /// The measured signal, and its dimension.
    pub(super) fn measure(
        &self,
        table: &Table,
        variants: &[String],
        what: &str,
        out: &mut Vec<Diagnostic>,
    ) -> Option<(Requirement, Dimension)> {
        let (context, document) = (self.context, self.context.document);
        check_named(table, what, out);
        check_varied(table, document, &["target", "band", "at", "frequency", "from", "until"], what, out);
        let signal_of = |key: &str, out: &mut Vec<Diagnostic>| {
            let place = TableReader::place(table, key);
            read_word(table, key).and_then(|name| resolve_signal(name, &place, context, what, out))
        };
        let signal = read_word(table, "signal");
        let place = TableReader::place(table, "signal");
        let (found, over) = (signal_of("signal", out), signal_of("over", out));
        let (from, until) = (self.number(table, "from", TIME, what, out), self.number(table, "until", TIME, what, out));
        let at = self.number(table, "at", TIME, what, out);
        let frequency = self.number(table, "frequency", (Dimension::FREQUENCY, Sign::Positive), what, out);
        let measure = read_word(table, "measure").and_then(Measure::of);
        if let (Some(Measure::TimeAtLimit), Some(name), Some(_)) = (measure, signal, &found) {
            check_limited(name, &place, document, what, out);
        }
        check_measure_keys(table, measure, what, out);
        let dimension = found.as_ref().zip(measure).and_then(|(found, measure)| {
            check_power(found, measure, &place, what, out);
            measured_dimension(measure, found.dimension, over.as_ref().map(|over| over.dimension))
        });
        let target = found.as_ref().and_then(|found| self.like(table, "target", found.dimension, what, out));
        let band = found.as_ref().and_then(|found| self.band(table, found.dimension, what, out));
        self.check_window(table, (from.unwrap_or_default(), until, at), (variants, what), out);
        let (signal, measure, found, dimension) = (signal?.into(), measure?, found?, dimension?);
        let (from, until) = (from.unwrap_or_default(), until.unwrap_or(f64::INFINITY));
        let own = dimension == found.dimension;
        let own_unit = own && dimension != Dimension::FREQUENCY;
        let unit = if own_unit { found.physical.unit().to_string() } else { unit_of(measure, dimension) };
        let over = over.map(|over| over.name);
        let (dimension_of_signal, none) = (found.dimension, Requirement::default());
        let measured = Requirement { signal, measure, over, at, frequency, unit, target, band, from, until, ..none };
        Some((Requirement { dimension: dimension_of_signal, ..measured }, dimension))
    }

    /// A value of a dimension; if the dimension has no name, angles are not counted.
    pub(in crate::study) fn like(
        &self,
        table: &Table,
        key: &str,
        expected: Dimension,
        what: &str,
        out: &mut Vec<Diagnostic>,
    ) -> Option<f64> {
        if expected.word().is_some() {
            return self.number(table, key, (expected, Sign::Any), what, out);
        }
        let scalar = table.scalar_or_default(key, &table.place)?;
        let label = format!("`{key}` of {what}");
        let (value, found) = self.reader.scalar(&scalar, None, &label, out)?;
        if !expected.is_like(&found) {
            out.push(wrong_dimension(&label, expected, found, scalar.place));
            return None;
        }
        Some(value.to_f64())
    }

    /// The tolerance of a signal around its target: in its unit, or a fraction of its way.
    fn band(&self, table: &Table, dimension: Dimension, what: &str, out: &mut Vec<Diagnostic>) -> Option<Band> {
        let scalar = table.scalar_or_default("band", &table.place)?;
        let label = format!("`band` of {what}");
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

    /// The unit of the bounds in the file, `None` if it is the SI unit.
    pub(in crate::study) fn unit_of_bounds(&self, table: &Table, dimension: Dimension) -> Option<DisplayUnit> {
        let text = ["below", "above"].into_iter().find_map(|key| table.source_text.get(key))?;
        let named = || self.context.document.declared(text);
        let text = named().map_or(text, |parameter| &parameter.text);
        let (unit, size, found) = split_unit(text)?;
        let size = size.to_f64();
        (dimension.is_like(&found) && size != 1.0).then(|| DisplayUnit { unit: unit.into(), size })
    }

    fn number(
        &self,
        table: &Table,
        key: &str,
        expected: (Dimension, Sign),
        what: &str,
        out: &mut Vec<Diagnostic>,
    ) -> Option<f64> {
        quantity(self.reader, table, key, expected, what, out).map(|x| x.to_f64())
    }

    /// Reports a window that is empty in one of its runs.
    fn check_window(
        &self,
        table: &Table,
        (begin, until, at): (f64, Option<f64>, Option<f64>),
        (variants, what): (&[String], &str),
        out: &mut Vec<Diagnostic>,
    ) {
        let own = self.ends.iter().filter(|(name, _)| variants.is_empty() || variants.contains(name));
        let last = own.map(|(_, end)| *end).reduce(f64::max).unwrap_or(f64::INFINITY);
        let end = until.unwrap_or(f64::INFINITY).min(last);
        if let Some(at) = at.filter(|at| *at > last) {
            let message = format!("{what}: `at` is {at} s, and the run ends at {last} s");
            out.push(
                Diagnostic::error("requirement::window", message)
                    .at(TableReader::place(table, "at"), "after the end")
                    .help("let `at` come before the end of the run (`duration`)"),
            );
        }
        if begin > end {
            let (key, bound_end) = if until.is_some_and(|until| until <= end) { ("until", end) } else { ("from", end) };
            let message = format!("{what}: the window is empty: it begins at {begin} s and ends at {bound_end} s");
            out.push(
                Diagnostic::error("requirement::window", message)
                    .at(TableReader::place(table, key), "no time is left")
                    .help("let `from` come before `until`, and both before the end of the run (`duration`)"),
            );
        }
    }
}

const BAND_HELP: &str = "write a part of the way to the target, `band = 0.02`, or a size in the unit of the signal";

/// The dimension of a measure; none for an energy of a signal that is no power, and for a measure without its other signal.
fn measured_dimension(measure: Measure, signal: Dimension, over: Option<Dimension>) -> Option<Dimension> {
    match measure {
        Measure::TimeAtLimit | Measure::RiseTime | Measure::SettlingTime | Measure::TimeOfMax | Measure::TimeOfMin => {
            Some(Dimension::TIME)
        }
        Measure::Lag => over.map(|_| Dimension::TIME),
        Measure::PhaseLag => over.map(|_| Dimension::ANGLE),
        Measure::Overshoot | Measure::Events => Some(Dimension::NONE),
        Measure::Iae => signal.times(&Dimension::TIME, 1),
        Measure::Energy => POWER.is_like(&signal).then_some(Dimension::TORQUE),
        Measure::Gradient | Measure::Slope | Measure::Gain => {
            signal.times(&over?, -1).map(|quotient| kind_of(quotient).1)
        }
        Measure::Hysteresis => over.map(|_| signal),
        Measure::Max
        | Measure::Min
        | Measure::MaxAbs
        | Measure::Final
        | Measure::Rms
        | Measure::Ripple
        | Measure::At
        | Measure::Mean
        | Measure::PeakToPeak => Some(signal),
    }
}

pub(super) fn unit_of(measure: Measure, dimension: Dimension) -> String {
    match measure {
        Measure::Energy => Physical::Energy.unit().to_string(),
        // A quantity divided by a time is no frequency.
        _ if dimension == Dimension::FREQUENCY => "1/s".to_string(),
        _ => dimension.si(),
    }
}

/// Reports an energy of a signal that is no power.
fn check_power(found: &ResolvedSignal, measure: Measure, place: &Place, what: &str, out: &mut Vec<Diagnostic>) {
    if measure == Measure::Energy && !POWER.is_like(&found.dimension) {
        let message = format!(
            "{what}: an energy is the integral of a power, and `{}` is {}",
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

/// Additional keys of measures of one signal over another one.
fn needs(measure: Measure) -> &'static [(&'static str, &'static str)] {
    const OVER: (&str, &str) = ("over", "name the other signal, `over = \"car.a_y\"`");
    const FREQUENCY: (&str, &str) = ("frequency", "write that of the wave, `frequency = \"0.2 Hz\"`");
    match measure {
        Measure::RiseTime | Measure::SettlingTime => &[("band", BAND_HELP)],
        Measure::At => &[("at", "write the time, `at = \"1.5 s\"`")],
        Measure::Gradient | Measure::Slope | Measure::Hysteresis => &[OVER],
        Measure::Gain | Measure::Lag | Measure::PhaseLag => &[OVER, FREQUENCY],
        _ => &[],
    }
}

/// Reports missing keys of a measure, and keys without meaning for it.
fn check_measure_keys(table: &Table, measure: Option<Measure>, what: &str, out: &mut Vec<Diagnostic>) {
    let Some(measure) = measure else { return };
    let word = measure.word();
    for (key, help) in needs(measure).iter().filter(|(key, _)| !is_given(table, key)) {
        let message = format!("{what}: `{word}` needs the key `{key}`");
        let place = TableReader::place(table, "measure");
        out.push(
            Diagnostic::error("key::missing", message).at(place, format!("`{key}` is missing")).help(help.to_string()),
        );
    }
    let takes = |key: &str| match key {
        "target" => matches!(measure, Measure::Overshoot | Measure::RiseTime | Measure::SettlingTime | Measure::Iae),
        "from" | "until" => measure != Measure::At,
        _ => needs(measure).iter().any(|(needed, _)| *needed == key),
    };
    let all = ["target", "band", "over", "at", "frequency", "from", "until"];
    for key in all.into_iter().filter(|key| is_given(table, key) && !takes(key)) {
        let message = format!("{what}: `{key}` has no meaning for the measure `{word}`");
        let help = match key {
            "target" => "remove it, or measure `overshoot`, `rise_time`, `settling_time` or `iae`",
            "band" => "remove it, or measure `rise_time` or `settling_time`",
            "at" => "remove it, or measure `at`",
            "over" => "remove it, or measure `gradient`, `slope`, `hysteresis`, `gain`, `lag` or `phase_lag`",
            "frequency" => "remove it, or measure `gain`, `lag` or `phase_lag`",
            _ => "remove it: the value at a time has no window",
        };
        let place = TableReader::place(table, key);
        out.push(Diagnostic::error("requirement::key", message).at(place, "not used").help(help));
    }
}

/// Reports a table without a measure.
fn check_named(table: &Table, what: &str, out: &mut Vec<Diagnostic>) {
    let alternative = if what == REQUIREMENT { "figure" } else { "value" };
    let keys = [("signal", "rk.phi"), ("measure", "max_abs")];
    for (key, example) in keys.into_iter().filter(|(key, _)| !is_given(table, key)) {
        out.push(
            Diagnostic::error("key::missing", format!("{what} needs the key `{key}`"))
                .at(table.place.clone(), format!("`{key}` is missing"))
                .help(format!("add `{key} = \"{example}\"`, or `{alternative}` in place of `signal` and `measure`")),
        );
    }
}

/// Reports a requirement without a bound.
fn check_bounds(table: &Table, out: &mut Vec<Diagnostic>) {
    if !is_given(table, "below") && !is_given(table, "above") {
        out.push(
            Diagnostic::error("key::missing", format!("{REQUIREMENT}: a bound is missing"))
                .at(table.place.clone(), "neither `below` nor `above`")
                .help("add `below = \"...\"`, `above = \"...\"` or both"),
        );
    }
}

/// Reports values that differ between the variants.
fn check_varied(table: &Table, document: &Document, keys: &[&str], what: &str, out: &mut Vec<Diagnostic>) {
    for key in keys {
        let Some(Placed { value, place }) = table.scalar_or_default(key, &table.place) else { continue };
        let names: Vec<String> = match value {
            SchemaScalar::Parameter(name) => vec![name],
            SchemaScalar::Expression(read) => read.names().into_iter().map(str::to_string).collect(),
            _ => Vec::new(),
        };
        if let Some(name) = names.into_iter().find(|name| document.is_varied(name)) {
            out.push(
                Diagnostic::error(
                    "requirement::set-by-variant",
                    format!("`{key}` of {what}: `{name}` differs between the variants"),
                )
                .at(place, "a varied parameter")
                .help("write a number, and one requirement for each variant: `variants = [...]`"),
            );
        }
    }
}

/// Reports a requirement on the time at a limit if the signal is no output of a motor or source with a limit.
fn check_limited(signal: &str, place: &Place, document: &Document, what: &str, out: &mut Vec<Diagnostic>) {
    let limit = |keyword: &str| match keyword {
        "motor" => Some("torque_limit"),
        "voltage_source" => Some("voltage_limit"),
        _ => None,
    };
    let named = |name: &str| {
        let motor = document.elements.get(name)?;
        Some((motor, limit(motor.kind.keyword)?))
    };
    let problem = match motor_of(signal).and_then(named) {
        None => (
            format!("`{signal}` is no output of a motor or voltage source, and only these have a limit"),
            "name the torque of a motor, `signal = \"MOTOR.tau\"`, or the voltage of a source, `signal = \"SOURCE.v\"`"
                .to_string(),
        ),
        Some((motor, limit)) if !is_given(&motor.table, limit) => {
            let (kind, name) = (motor.kind.keyword, &motor.name);
            (
                format!(
                    "the {} `{name}` has no {}, so it never reaches one",
                    kind.replace('_', " "),
                    limit.replace('_', " ")
                ),
                format!("add `{limit} = \"...\"` to `[{kind}.{name}]`, or choose another measure"),
            )
        }
        Some(_) => return,
    };
    let message = format!("{what}: {}", problem.0);
    out.push(Diagnostic::error("requirement::limit", message).at(place.clone(), "no limit").help(problem.1));
}

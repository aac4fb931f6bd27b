//! Requirements as a model file writes them: signal, measure, window and bounds of each, with their errors.

use crate::study::Requirement;
use crate::study::measure::computed_signals::{POWER, ResolvedSignal, kind_of, resolve_signal};
use crate::study::measure::figure::Figure;
use crate::study::measure::measures::Band;
use crate::study::measure::requirement_verdict::motor_of;
use crate::study::read::locations::unknown_name_or;
use crate::study::read::read_values::{has_key, key_error, quantity, read_word, varied_name};
use crate::study::read::signal_table::SignalContext;
use kardan_math::names::NamedList;
use kardan_math::units::{Dimension, split_unit};
use kardan_model::tables::Measure;
use kardan_model::{Document, TableReader};
use kardan_results::{DisplayUnit, Physical};
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::entries::Place;
use kardan_schema::schema::{Placed, Sign, Table};

use super::selected_variants::{selected_variants, selects};

/// A nonnegative time.
pub(super) const TIME: (Dimension, Sign) = (Dimension::TIME, Sign::NonNegative);
/// The name of the table of a requirement in messages.
pub(super) const REQUIREMENT: &str = "`[[requirement]]`";

/// The context for reading the tables of requirements and figures.
pub(in crate::study) struct Measuring<'a> {
    pub(in crate::study) context: &'a SignalContext<'a>,
    pub(in crate::study) reader: &'a TableReader<'a>,
    pub(in crate::study) variants: &'a [String],
    /// The ends of the runs, s, by their names.
    pub(in crate::study) ends: &'a [(String, f64)],
}

/// A table of a requirement or a figure.
pub(in crate::study) struct MeasureTable<'a, 'm> {
    pub(in crate::study) measuring: &'a Measuring<'m>,
    pub(in crate::study) table: &'a Table,
    /// Its name in messages.
    pub(in crate::study) what: &'a str,
}

impl MeasureTable<'_, '_> {
    /// A requirement.
    pub(super) fn bounded(&self, figures: &NamedList<Figure>, out: &mut Vec<Diagnostic>) -> Option<Requirement> {
        let (context, table) = (self.measuring.context, self.table);
        let variants = selected_variants(table, self.measuring.variants, context, REQUIREMENT, out);
        check_bounds(table, out);
        let judged = match has_key(table, "figure") {
            true => self.figure(figures, out),
            false => self.measure(&variants, out),
        };
        let bounds =
            judged.as_ref().map(|(_, dimension)| ["below", "above"].map(|key| self.like(key, *dimension, out)));
        self.check_varied(&["below", "above"], out);
        if let Some([Some(below), Some(above)]) = bounds
            && above >= below
        {
            let message = format!("{REQUIREMENT}: no value is above {above} and below {below}");
            let help = "let `above` be less than `below`, or write two requirements";
            out.push(key_error("requirement::bounds", message, (table, "below", "not above `above`"), help));
        }
        let ((measure, dimension), [below, above]) = (judged?, bounds?);
        let same_unit = measure.figure.is_some() || dimension == measure.dimension;
        let display = same_unit.then(|| self.unit_of_bounds(dimension)).flatten().or(measure.display.clone());
        Some(Requirement { below, above, display, variants, ..measure })
    }

    /// The figure of a requirement on a figure.
    fn figure(&self, figures: &NamedList<Figure>, out: &mut Vec<Diagnostic>) -> Option<(Requirement, Dimension)> {
        self.reject_other_keys("figure", out);
        let name = read_word(self.table, "figure")?;
        let Some(found) = figures.get(name) else {
            if self.measuring.context.document.figures.iter().any(|table| read_word(table, "name") == Some(name)) {
                return None;
            }
            let names = figures.iter().map(|figure| figure.name.as_str());
            let help = unknown_name_or(name, names, "the model has no `[[figure]]`");
            out.push(Diagnostic::no_such(REQUIREMENT, "figure", name, self.table.place_of("figure")).help(help));
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
    pub(super) fn reject_other_keys(&self, key: &str, out: &mut Vec<Diagnostic>) {
        let Self { table, what, .. } = *self;
        let measuring = ["signal", "measure", "over", "at", "frequency", "target", "band", "from", "until"];
        for surplus_key in measuring.into_iter().filter(|key| table.values.contains_key(key)) {
            let message = format!("{what}: `{surplus_key}` has no meaning with `{key}`");
            let help = format!("remove it, or write `signal` and `measure` in place of `{key}`");
            out.push(key_error("requirement::key", message, (table, surplus_key, "not used"), help));
        }
    }

    /// The measured signal, and its dimension.
    pub(super) fn measure(&self, variants: &[String], out: &mut Vec<Diagnostic>) -> Option<(Requirement, Dimension)> {
        let Self { measuring: Measuring { context, .. }, table, what } = *self;
        check_named(table, what, out);
        self.check_varied(&["target", "band", "at", "frequency", "from", "until"], out);
        let signal_of = |key: &str, out: &mut Vec<Diagnostic>| {
            read_word(table, key).and_then(|name| resolve_signal(name, table.place_of(key), context, what, out))
        };
        let signal = read_word(table, "signal");
        let place = table.place_of("signal");
        let (found, over) = (signal_of("signal", out), signal_of("over", out));
        let [from, until, at] = ["from", "until", "at"].map(|key| self.number(key, TIME, out));
        let frequency = self.number("frequency", (Dimension::FREQUENCY, Sign::Positive), out);
        let measure = read_word(table, "measure").and_then(Measure::of);
        if let (Some(Measure::TimeAtLimit), Some(name), Some(_)) = (measure, signal, &found) {
            check_limited(name, place, context.document, what, out);
        }
        check_measure_keys(table, measure, what, out);
        let dimension = found.as_ref().zip(measure).and_then(|(found, measure)| {
            check_power(found, measure, place, what, out);
            measured_dimension(measure, found.dimension, over.as_ref().map(|over| over.dimension))
        });
        let target = found.as_ref().and_then(|found| self.like("target", found.dimension, out));
        let band = found.as_ref().and_then(|found| self.band(found.dimension, out));
        self.check_window((from.unwrap_or_default(), until, at), variants, out);
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
    pub(in crate::study) fn like(&self, key: &str, expected: Dimension, out: &mut Vec<Diagnostic>) -> Option<f64> {
        if expected.word().is_some() {
            return self.number(key, (expected, Sign::Any), out);
        }
        let scalar = self.table.scalar_or_default(key, &self.table.place)?;
        let label = format!("`{key}` of {}", self.what);
        let (value, found) = self.measuring.reader.scalar(&scalar, None, &label, out)?;
        if !expected.is_like(&found) {
            out.push(Diagnostic::wrong_dimension(&label, [expected, found], scalar.place));
            return None;
        }
        Some(value.to_f64())
    }

    /// The tolerance of a signal around its target: in its unit, or a fraction of its way.
    fn band(&self, dimension: Dimension, out: &mut Vec<Diagnostic>) -> Option<Band> {
        let scalar = self.table.scalar_or_default("band", &self.table.place)?;
        let label = format!("`band` of {}", self.what);
        let (value, found) = self.measuring.reader.scalar(&scalar, None, &label, out)?;
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
                out.push(Diagnostic::wrong_dimension(&label, [dimension, found], scalar.place));
                None
            }
        }
    }

    /// The unit of the bounds in the file, `None` if it is the SI unit.
    pub(in crate::study) fn unit_of_bounds(&self, dimension: Dimension) -> Option<DisplayUnit> {
        let text = ["below", "above"].into_iter().find_map(|key| self.table.source_text.get(key))?;
        let named = || self.measuring.context.document.declared(text);
        let text = named().map_or(text, |parameter| &parameter.text);
        let (unit, size, found) = split_unit(text)?;
        let size = size.to_f64();
        (dimension.is_like(&found) && size != 1.0).then(|| DisplayUnit { unit: unit.into(), size })
    }

    fn number(&self, key: &str, expected: (Dimension, Sign), out: &mut Vec<Diagnostic>) -> Option<f64> {
        quantity(self.measuring.reader, self.table, key, expected, self.what, out).map(|x| x.to_f64())
    }

    /// Reports a window that is empty in one of its runs.
    fn check_window(
        &self,
        (begin, until, at): (f64, Option<f64>, Option<f64>),
        variants: &[String],
        out: &mut Vec<Diagnostic>,
    ) {
        let Self { measuring, table, what } = *self;
        let own = measuring.ends.iter().filter(|(name, _)| selects(variants, name));
        let last = own.map(|(_, end)| *end).reduce(f64::max).unwrap_or(f64::INFINITY);
        let end = until.unwrap_or(f64::INFINITY).min(last);
        if let Some(at) = at.filter(|at| *at > last) {
            let message = format!("{what}: `at` is {at} s, and the run ends at {last} s");
            let help = "let `at` come before the end of the run (`duration`)";
            out.push(key_error("requirement::window", message, (table, "at", "after the end"), help));
        }
        if begin > end {
            let (key, bound_end) = if until.is_some_and(|until| until <= end) { ("until", end) } else { ("from", end) };
            let message = format!("{what}: the window is empty: it begins at {begin} s and ends at {bound_end} s");
            let help = "let `from` come before `until`, and both before the end of the run (`duration`)";
            out.push(key_error("requirement::window", message, (table, key, "no time is left"), help));
        }
    }

    /// Reports values that differ between the variants.
    fn check_varied(&self, keys: &[&str], out: &mut Vec<Diagnostic>) {
        for key in keys {
            let Some(Placed { value, place }) = self.table.scalar_or_default(key, &self.table.place) else { continue };
            if let Some(name) = varied_name(self.measuring.context.document, &value) {
                let message = format!("`{key}` of {}: `{name}` differs between the variants", self.what);
                let help = "write a number, and one requirement for each variant: `variants = [...]`";
                let varied = Diagnostic::error("requirement::set-by-variant", message).at(place, "a varied parameter");
                out.push(varied.help(help));
            }
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
        let help = "multiply a torque by an angular velocity: `signal = \"motor.tau * motor_shaft.w\"`";
        out.push(Diagnostic::error("unit::dimension", message).at(place, "no power").help(help));
    }
}

/// Further keys, the measures that have them, and help for a missing one, unless it may be omitted.
const KEYS: [(&str, &[Measure], Option<&str>); 5] = {
    use Measure::{At, Gain, Gradient, Hysteresis, Iae, Lag, Overshoot, PhaseLag, RiseTime, SettlingTime, Slope};
    const OVER: &str = "name the other signal, `over = \"car.a_y\"`";
    [
        ("target", &[Overshoot, RiseTime, SettlingTime, Iae], None),
        ("band", &[RiseTime, SettlingTime], Some(BAND_HELP)),
        ("over", &[Gradient, Slope, Hysteresis, Gain, Lag, PhaseLag], Some(OVER)),
        ("at", &[At], Some("write the time, `at = \"1.5 s\"`")),
        ("frequency", &[Gain, Lag, PhaseLag], Some("write that of the wave, `frequency = \"0.2 Hz\"`")),
    ]
};

/// Reports missing keys of a measure, and keys without meaning for it.
fn check_measure_keys(table: &Table, measure: Option<Measure>, what: &str, out: &mut Vec<Diagnostic>) {
    let Some(measure) = measure else { return };
    let word = measure.word();
    for (key, _, help) in KEYS.iter().filter(|(key, of, _)| of.contains(&measure) && !has_key(table, key)) {
        let Some(help) = help else { continue };
        let message = format!("{what}: `{word}` needs the key `{key}`");
        let label = format!("`{key}` is missing");
        out.push(key_error("key::missing", message, (table, "measure", &label), *help));
    }
    let mut refuse = |key: &str, help: String| {
        let message = format!("{what}: `{key}` has no meaning for the measure `{word}`");
        out.push(key_error("requirement::key", message, (table, key, "not used"), help));
    };
    for (key, of, _) in KEYS.iter().filter(|(key, of, _)| has_key(table, key) && !of.contains(&measure)) {
        let words: Vec<String> = of.iter().map(|measure| format!("`{}`", measure.word())).collect();
        let [earlier @ .., last] = &words[..] else { continue };
        let others = if earlier.is_empty() { String::new() } else { format!("{} or ", earlier.join(", ")) };
        refuse(key, format!("remove it, or measure {others}{last}"));
    }
    for key in ["from", "until"].into_iter().filter(|key| has_key(table, key) && measure == Measure::At) {
        refuse(key, "remove it: the value at a time has no window".into());
    }
}

/// Reports a table without a measure.
fn check_named(table: &Table, what: &str, out: &mut Vec<Diagnostic>) {
    let alternative = if what == REQUIREMENT { "figure" } else { "value" };
    let keys = [("signal", "rk.phi"), ("measure", "max_abs")];
    for (key, example) in keys.into_iter().filter(|(key, _)| !has_key(table, key)) {
        let message = format!("{what} needs the key `{key}`");
        let help = format!("add `{key} = \"{example}\"`, or `{alternative}` in place of `signal` and `measure`");
        out.push(Diagnostic::error("key::missing", message).at(&table.place, format!("`{key}` is missing")).help(help));
    }
}

/// Reports a requirement without a bound.
fn check_bounds(table: &Table, out: &mut Vec<Diagnostic>) {
    if !has_key(table, "below") && !has_key(table, "above") {
        let message = format!("{REQUIREMENT}: a bound is missing");
        let help = "add `below = \"...\"`, `above = \"...\"` or both";
        out.push(Diagnostic::error("key::missing", message).at(&table.place, "neither `below` nor `above`").help(help));
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
        Some((motor, limit)) if !has_key(&motor.table, limit) => {
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
    out.push(Diagnostic::error("requirement::limit", message).at(place, "no limit").help(problem.1));
}

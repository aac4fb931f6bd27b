//! The requests of a study: requirements, plots, accuracy.

use std::collections::HashMap;

use crate::diagnostics::{Diagnostic, nearest, quoted, shortened};
use crate::entries::Place;
use crate::model::tables::Measure;
use crate::model::{Document, TableReader, VariantSettings, wrong_dimension};
use crate::names::{NamedList, unknown_name};
use crate::results::{DisplayUnit, Physical, Plot, PlotUnit, PlottedReference, Span};
use crate::schema::{Placed, Scalar as SchemaScalar, Sign, Table};
use crate::simulate::Tolerance;
use crate::study::Requirement;
use crate::study::measure::computed_signals::{POWER, ResolvedSignal, kind_of, reference, resolve_signal};
use crate::study::measure::figure::{Figure, FigureOf, figure_dimension};
use crate::study::measure::measures::Band;
use crate::study::measure::requirement::motor_of;
use crate::study::measure::spectrum::LEAST_ROWS;
use crate::study::prepare::read_values::{quantity, read_names, read_scalar, read_word};
use crate::study::prepare::signal_table::SignalContext;
use crate::units::{Dimension, Exact, Expression, UnitError, split_unit};

pub(in crate::study) fn selected_variants(
    table: &Table,
    names: &[String],
    context: &SignalContext<'_>,
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Vec<String> {
    let chosen = read_names(table, "variants");
    let suppressed = &context.document.suppressed;
    let named = |word: &str| context.document.named_variants.iter().any(|variant| variant.name.value == word);
    let declared = |word: &str| names.iter().any(|name| name == word) || named(word);
    for word in chosen.iter().filter(|word| !declared(&word.value) && !suppressed.variants && !suppressed.all) {
        let declared: Vec<&str> = names.iter().map(String::as_str).filter(|name| !name.is_empty()).collect();
        let help = match nearest(&word.value, declared.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None if declared.is_empty() => "the model has no `[variants]`; leave this key out".to_string(),
            None => format!("there are {}", quoted(declared)),
        };
        let message = format!("{what}: there is no variant `{}`", shortened(&word.value));
        out.push(Diagnostic::error("name::unknown", message).at(word.place.clone(), "no such variant").help(help));
    }
    // A `[[variant]]` stands for its runs with all values of `[variants]`.
    let runs = |word: &Placed<String>| -> Vec<String> {
        let begins = |name: &str, of: &str| name.strip_prefix(of).is_some_and(|rest| rest.starts_with('_'));
        // `step_wet_v-10mps` is one of `step_wet`, not of `step`.
        let longer = |name: &str| {
            let variant_names = context.document.named_variants.iter().map(|variant| variant.name.value.as_str());
            variant_names
                .into_iter()
                .any(|candidate| begins(candidate, &word.value) && (begins(name, candidate) || name == candidate))
        };
        let own = |name: &&String| begins(name, &word.value) && !longer(name);
        match names.contains(&word.value) || !named(&word.value) {
            true => vec![word.value.clone()],
            false => names.iter().filter(own).cloned().collect(),
        }
    };
    chosen.iter().flat_map(runs).collect()
}

/// Figures and requirements, each in the order of the file.
pub(in crate::study) fn figures_and_requirements(
    context: &SignalContext<'_>,
    variants: &[VariantSettings],
    out: &mut Vec<Diagnostic>,
) -> (Vec<Figure>, Vec<Requirement>) {
    let duration = |variant: &VariantSettings| {
        let reader = TableReader::new(context.document, &variant.settings);
        let duration = quantity(&reader, &context.document.scenario, "duration", TIME, "", &mut Vec::new());
        let context = duration.filter(|_| !context.document.suppressed.durations);
        (variant.name.clone(), context.map_or(f64::INFINITY, |x| x.to_f64()))
    };
    let ends: Vec<(String, f64)> = variants.iter().map(duration).collect();
    let names: Vec<String> = ends.iter().map(|(name, _)| name.clone()).collect();
    let reader = &TableReader::new(context.document, &[]);
    let reading = Measuring { context, reader, variants: &names, ends: &ends };
    let mut figures: NamedList<Figure> = NamedList::default();
    for number in 0..context.document.figures.len() {
        let found = figure(&reading, number, &figures, out);
        figures.extend(found);
    }
    let requirements = context.document.requirements.iter().filter_map(|table| reading.bounded(table, &figures, out));
    let requirements = requirements.collect();
    (figures.into_vec(), requirements)
}

/// A number of each run that a table requests; errors are reported.
fn figure(
    reading: &Measuring<'_>,
    number: usize,
    before: &NamedList<Figure>,
    out: &mut Vec<Diagnostic>,
) -> Option<Figure> {
    let (earlier, rest) = reading.context.document.figures.split_at(number);
    let table = rest.first()?;
    let name = read_word(table, "name")?.to_string();
    let what = format!("figure `{name}`");
    let place = TableReader::place(table, "name");
    if let Some(reason) = name_conflict(&name, before, reading.context) {
        let message = format!("there is {reason} `{name}` already");
        let help = "give each figure a name of its own: expressions of figures name parameters too";
        out.push(Diagnostic::error("name::duplicate", message).at(place.clone(), "again here").help(help));
    }
    let variants = selected_variants(table, reading.variants, reading.context, &what, out);
    let here = |key: &str| table.values.contains_key(key) || table.unread.contains(&key);
    if !here("value") {
        let found = reading.measure(table, &variants, &what, out)?;
        let (measure, dimension) = found;
        let display = read_display_unit(table, dimension, &what, out);
        let unit = measure.unit.clone();
        return Some(Figure { name, of: FigureOf::Measure(Box::new(measure)), dimension, unit, display, variants });
    }
    reading.reject_other_keys(table, "value", &what, out);
    let text = read_word(table, "value")?.to_string();
    let place = TableReader::place(table, "value");
    let dimension = dimension_of(&text, (before, earlier), reading, (&what, &place), out)?;
    let display = read_display_unit(table, dimension, &what, out);
    Some(Figure {
        name,
        of: FigureOf::Value(text),
        dimension,
        unit: unit_of(Measure::Final, dimension),
        display,
        variants,
    })
}

/// Other uses of the name of a figure.
fn name_conflict(name: &str, before: &NamedList<Figure>, context: &SignalContext<'_>) -> Option<&'static str> {
    let is_parameter = || context.document.parameters.has(name);
    match name {
        _ if before.has(name) => Some("a figure"),
        "pi" => Some("a number"),
        _ => is_parameter().then_some("a parameter"),
    }
}

/// The dimension of an expression of figures and parameters; errors are reported.
fn dimension_of(
    text: &str,
    (before, earlier): (&NamedList<Figure>, &[Table]),
    &Measuring { context, reader, .. }: &Measuring<'_>,
    (what, place): (&str, &Place),
    out: &mut Vec<Diagnostic>,
) -> Option<Dimension> {
    let diagnostic = |error: UnitError| {
        let at = place.part(text, error.span);
        let diagnostic = Diagnostic::error(error.code, format!("{what}: {}", error.message)).at(at, "");
        Diagnostic { help: error.help, ..diagnostic }
    };
    let law = Expression::parse_law(text).map_err(|error| out.push(diagnostic(error))).ok()?;
    let is_defined = |name: &str| before.has(name) || reader.exact_value(name).is_some();
    if let Some(name) = law.names().into_iter().find(|name| !is_defined(name)) {
        let named = |table: &Table| read_word(table, "name") == Some(name);
        // A preceding one has an error of its own.
        if context.document.suppressed.has_key(name) || earlier.iter().any(named) {
            return None;
        }
        let help = match context.document.figures.iter().any(named) {
            true => format!("write `[[figure]]` of `{name}` above it"),
            false => match nearest(name, before.iter().map(|figure| figure.name.as_str())) {
                Some(near) => format!("did you mean `{near}`?"),
                None => {
                    "name preceding figures, and parameters; write a figure of its own to measure a signal".to_string()
                }
            },
        };
        let at = place.part(text, law.place_of(name).unwrap_or(0..text.len()));
        let message = format!("{what}: no figure before it and no parameter has the name `{}`", shortened(name));
        out.push(Diagnostic::error("name::unknown", message).at(at, "no such figure").help(help));
        return None;
    }
    match figure_dimension(&law, before, &|name| reader.exact_value(name)) {
        Ok(dimension) => Some(dimension),
        Err(error) => {
            out.push(diagnostic(error));
            None
        }
    }
}

/// The display unit of a figure.
fn read_display_unit(
    table: &Table,
    dimension: Dimension,
    what: &str,
    out: &mut Vec<Diagnostic>,
) -> Option<DisplayUnit> {
    let text = read_word(table, "display_unit")?.trim();
    let place = TableReader::place(table, "display_unit");
    let Some((unit, size, found)) = split_unit(&format!("1 {text}")).map(|(_, size, found)| (text, size, found)) else {
        let message = format!("{what}: `{}` is no unit", shortened(text));
        let help = "write a unit such as `deg`, `deg/s` or `mN m`";
        out.push(Diagnostic::error("unit::unknown", message).at(place, "no unit").help(help));
        return None;
    };
    if !dimension.is_like(&found) {
        let message = format!("{what}: `{}` is {}, and it is {}", shortened(text), found.noun(), dimension.noun());
        let help = format!("write a unit such as {}", dimension.example());
        out.push(Diagnostic::error("unit::dimension", message).at(place, "another quantity").help(help));
        return None;
    }
    let size = size.to_f64();
    (size != 1.0 || unit != dimension.si()).then(|| DisplayUnit { unit: unit.into(), size })
}

/// A nonnegative time.
const TIME: (Dimension, Sign) = (Dimension::TIME, Sign::NonNegative);
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
    fn bounded(&self, table: &Table, figures: &NamedList<Figure>, out: &mut Vec<Diagnostic>) -> Option<Requirement> {
        let (context, document) = (self.context, self.context.document);
        let variants = selected_variants(table, self.variants, context, REQUIREMENT, out);
        check_bounds(table, out);
        let here = |key: &str| table.values.contains_key(key) || table.unread.contains(&key);
        let judged = match here("figure") {
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
            let help = match figures[..] {
                [] => "the model has no `[[figure]]`".to_string(),
                _ => unknown_name(name, names),
            };
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
    fn reject_other_keys(&self, table: &Table, key: &'static str, what: &str, out: &mut Vec<Diagnostic>) {
        let measuring = ["signal", "measure", "over", "at", "frequency", "target", "band", "from", "until"];
        for surplus_key in measuring.into_iter().filter(|key| table.values.contains_key(key)) {
            let message = format!("{what}: `{surplus_key}` has no meaning with `{key}`");
            let place = TableReader::place(table, surplus_key);
            let help = format!("remove it, or write `signal` and `measure` in place of `{key}`");
            out.push(Diagnostic::error("requirement::key", message).at(place, "not used").help(help));
        }
    }

    /// The measured signal, and its dimension.
    fn measure(
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
        let scalar = read_scalar(table, key)?;
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
        let scalar = read_scalar(table, "band")?;
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

fn unit_of(measure: Measure, dimension: Dimension) -> String {
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
    let here = |key: &str| table.values.contains_key(key) || table.unread.contains(&key);
    for (key, help) in needs(measure).iter().filter(|(key, _)| !here(key)) {
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
    for key in all.into_iter().filter(|key| here(key) && !takes(key)) {
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
    let here = |key: &str| table.values.contains_key(key) || table.unread.contains(&key);
    let alternative = if what == REQUIREMENT { "figure" } else { "value" };
    for (key, example) in [("signal", "rk.phi"), ("measure", "max_abs")].into_iter().filter(|(key, _)| !here(key)) {
        out.push(
            Diagnostic::error("key::missing", format!("{what} needs the key `{key}`"))
                .at(table.place.clone(), format!("`{key}` is missing"))
                .help(format!("add `{key} = \"{example}\"`, or `{alternative}` in place of `signal` and `measure`")),
        );
    }
}

/// Reports a requirement without a bound.
fn check_bounds(table: &Table, out: &mut Vec<Diagnostic>) {
    let here = |key: &str| table.values.contains_key(key) || table.unread.contains(&key);
    if !here("below") && !here("above") {
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
        let Some(Placed { value, place }) = read_scalar(table, key) else { continue };
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
        Some((motor, limit)) if !motor.table.values.contains_key(limit) && !motor.table.unread.contains(&limit) => {
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

/// A unit for signals of a kind; `None` if it is the SI unit or one of something else.
fn display_unit((unit, size, dimension): (&str, Exact, Dimension), physical: Physical) -> Option<DisplayUnit> {
    let size = size.to_f64();
    (dimension == physical.dimension() && size != 1.0).then(|| DisplayUnit { unit: unit.into(), size })
}

/// The unit in which signals of a plot are drawn; a text that is no unit of one of them is reported.
fn display(table: &Table, kinds: &[Physical], what: &str, out: &mut Vec<Diagnostic>) -> Option<PlotUnit> {
    let text = read_word(table, "display_unit")?.trim();
    let quantity_text = format!("1 {text}");
    let diagnostic = |code: &'static str, message: String, help: String| {
        Diagnostic::error(code, message)
            .at(TableReader::place(table, "display_unit"), "no unit of a drawn signal")
            .help(help)
    };
    let units: Vec<String> = kinds.iter().map(|kind| format!("`{}`", kind.unit())).collect();
    let drawn = units.join(", ");
    let Some(unit @ (_, _, dimension)) = split_unit(&quantity_text) else {
        let message = format!("{what}: `{}` is no unit", shortened(text));
        out.push(diagnostic("unit::unknown", message, "write a unit such as `deg`, `rpm` or `mN m`".into()));
        return None;
    };
    let Some(&physical) = kinds.iter().find(|kind| kind.dimension() == dimension) else {
        // Signals that were not found have been reported.
        if !kinds.is_empty() {
            let message = format!("{what}: `{}` is {}, and no such signal is drawn", shortened(text), dimension.noun());
            out.push(diagnostic(
                "unit::dimension",
                message,
                format!("the signals drawn are in {drawn}: write a unit of one of these"),
            ));
        }
        return None;
    };
    display_unit(unit, physical).map(|unit| PlotUnit { physical, unit })
}

/// The time range of a plot; an empty one is reported.
fn window(table: &Table, context: &SignalContext<'_>, what: &str, out: &mut Vec<Diagnostic>) -> Option<Span> {
    let reader = &TableReader::new(context.document, &[]);
    let [from, until] = ["from", "until"].map(|key| quantity(reader, table, key, TIME, what, out).map(|x| x.to_f64()));
    let duration = quantity(reader, &context.document.scenario, "duration", TIME, "", &mut Vec::new());
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
    (from.is_some() || until.is_some()).then_some(Span { start: begin, end: until.unwrap_or(f64::INFINITY) })
}

pub(in crate::study) fn plots(
    context: &SignalContext<'_>,
    variants: &[String],
    out: &mut Vec<Diagnostic>,
) -> Vec<Plot> {
    let mut plots: Vec<Plot> = Vec::new();
    let mut places: HashMap<String, Place> = HashMap::new();
    for table in &context.document.plots {
        let id = read_word(table, "name").unwrap_or_default().to_string();
        let what = if id.is_empty() { "`[[plot]]`".to_string() } else { format!("plot `{id}`") };
        let place = TableReader::place(table, "name");
        if let Some(first) = places.get(&id.to_ascii_lowercase()).filter(|_| !id.is_empty()) {
            out.push(
                Diagnostic::error("name::duplicate", format!("there are two plots named `{id}`"))
                    .at(place.clone(), "again here")
                    .at(first.clone(), "first here")
                    .help("give each plot a name of its own; it becomes a file name"),
            );
        }
        let variants = selected_variants(table, variants, context, &what, out);
        let mut kinds = Vec::new();
        let drawn: Vec<String> = read_names(table, "signals").iter().map(|word| word.value.clone()).collect();
        for word in read_names(table, "signals") {
            kinds.extend(resolve_signal(&word.value, &word.place, context, &what, out).map(|found| found.physical));
        }
        let mut drawn_beside = |word: &Placed<String>| {
            let reference = reference(&word.value, context);
            resolve_signal(&reference.signal, &word.place, context, &what, out);
            reference
        };
        let references: Vec<PlottedReference> = read_names(table, "references").iter().map(&mut drawn_beside).collect();
        let labels: Vec<String> = read_names(table, "labels").iter().map(|word| word.value.clone()).collect();
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
            let found = resolve_signal(text, &TableReader::place(table, "over"), context, &what, out)?;
            kinds.push(found.physical);
            Some(found.name)
        });
        let (display, window) = (display(table, &kinds, &what, out), window(table, context, &what, out));
        let spectrum = read_word(table, "kind") == Some("spectrum");
        if spectrum {
            check_spectrum(table, context, (window, &what), out);
        }
        let log = |key: &str| read_word(table, key) == Some("log");
        places.entry(id.to_ascii_lowercase()).or_insert(place);
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

/// Reports a spectrum over a signal other than the frequency, and a spectrum of too few rows.
fn check_spectrum(
    table: &Table,
    context: &SignalContext<'_>,
    (window, what): (Option<Span>, &str),
    out: &mut Vec<Diagnostic>,
) {
    if table.values.contains_key("over") {
        let message = format!("{what}: a spectrum has the frequency on its horizontal axis, not a signal");
        let place = TableReader::place(table, "over");
        out.push(
            Diagnostic::error("plot::spectrum", message)
                .at(place, "not the frequency")
                .help("remove `over`, or draw values: `kind = \"values\"`"),
        );
    }
    let reader = &TableReader::new(context.document, &[]);
    let scenario = &context.document.scenario;
    let [duration, step] = ["duration", "output_step"]
        .map(|key| quantity(reader, scenario, key, TIME, "", &mut Vec::new()).map(|value| value.to_f64()));
    let (Some(duration), Some(step)) = (duration, step.filter(|step| *step > 0.0)) else { return };
    let Span { start: from, end: until } = window.unwrap_or(Span { start: 0.0, end: f64::INFINITY });
    let rows = ((until.min(duration) - from) / step).max(0.0).floor();
    if rows < LEAST_ROWS as f64 {
        let message = format!(
            "{what}: a spectrum takes more than {LEAST_ROWS} rows, and {rows} steps of {step} s lie in the time that is drawn"
        );
        out.push(
            Diagnostic::error("plot::spectrum", message)
                .at(TableReader::place(table, "kind"), "too few rows")
                .help("draw a longer time, or shorten `output_step` of `[scenario]`"),
        );
    }
}

/// Sensible relative tolerances: below the first only rounding remains.
pub const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-13..=1e-3;

pub(in crate::study) fn tolerance(document: &Document, out: &mut Vec<Diagnostic>) -> Tolerance {
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

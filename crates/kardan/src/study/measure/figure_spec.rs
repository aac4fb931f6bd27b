//! Figures as a model file writes them: measures of runs, and expressions of other figures. They are listed with the requirements,
//! which may be on figures.

use std::collections::HashMap;

use crate::study::Requirement;
use crate::study::measure::computed_signals::{kind_of, lowered};
use crate::study::measure::figure::{Figure, FigureOf};
use crate::study::read::read_values::{has_key, key_error, quantity, read_word};
use crate::study::read::signal_table::SignalContext;
use kardan_expr::expr::Graph;
use kardan_math::names::NamedList;
use kardan_math::units::{Dimension, Expression, UnitError, split_unit};
use kardan_model::tables::Measure;
use kardan_model::{TableReader, VariantSettings};
use kardan_results::DisplayUnit;
use kardan_schema::diagnostics::{Diagnostic, nearest, shortened};
use kardan_schema::entries::Place;

use super::requirement_spec::{MeasureTable, Measuring, REQUIREMENT, TIME, unit_of};
use super::selected_variants::selected_variants;

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
    let names = context.document.figures.iter().map(|table| read_word(table, "name"));
    let mut places: HashMap<&str, usize> = HashMap::new();
    for (number, name) in names.enumerate() {
        name.map(|name| places.entry(name).or_insert(number));
    }
    for number in 0..context.document.figures.len() {
        let found = figure(&reading, (number, &places), &figures, out);
        figures.extend(found);
    }
    let table = |table| MeasureTable { measuring: &reading, table, what: REQUIREMENT };
    let tables = context.document.requirements.iter().map(table);
    let requirements = tables.filter_map(|table| table.bounded(&figures, out)).collect();
    (figures.into_vec(), requirements)
}

/// A number of each run that a table requests; errors are reported.
fn figure(
    reading: &Measuring<'_>,
    (number, places): (usize, &HashMap<&str, usize>),
    before: &NamedList<Figure>,
    out: &mut Vec<Diagnostic>,
) -> Option<Figure> {
    let table = reading.context.document.figures.get(number)?;
    let name = read_word(table, "name")?.to_string();
    let what = format!("figure `{name}`");
    if let Some(reason) = name_conflict(&name, before, reading.context) {
        let message = format!("there is {reason} `{name}` already");
        let help = "give each figure a name of its own: expressions of figures name parameters too";
        out.push(key_error("name::duplicate", message, (table, "name", "again here"), help));
    }
    let variants = selected_variants(table, reading.variants, reading.context, &what, out);
    let own = MeasureTable { measuring: reading, table, what: &what };
    if !has_key(table, "value") {
        let (measure, dimension) = own.measure(&variants, out)?;
        let display = read_display_unit(&own, dimension, out);
        let unit = measure.unit.clone();
        return Some(Figure { name, of: FigureOf::Measure(Box::new(measure)), dimension, unit, display, variants });
    }
    own.reject_other_keys("value", out);
    let text = read_word(table, "value")?.to_string();
    let dimension = dimension_of(&text, (before, places, number), reading, (&what, table.place_of("value")), out)?;
    let display = read_display_unit(&own, dimension, out);
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
    (before, places, number): (&NamedList<Figure>, &HashMap<&str, usize>, usize),
    &Measuring { context, reader, .. }: &Measuring<'_>,
    (what, place): (&str, &Place),
    out: &mut Vec<Diagnostic>,
) -> Option<Dimension> {
    let diagnostic = |error: UnitError| Diagnostic::of_unit_error(what, error, text, place);
    let law = Expression::parse_law(text).map_err(|error| out.push(diagnostic(error))).ok()?;
    let is_defined = |name: &str| before.has(name) || reader.exact_value(name).is_some();
    if let Some(name) = law.names().into_iter().find(|name| !is_defined(name)) {
        // A preceding one has an error of its own.
        if context.document.suppressed.has_key(name) || places.get(name).is_some_and(|place| *place < number) {
            return None;
        }
        let help = match places.contains_key(name) {
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
    let varying = |name: &str| before.get(name).map(|figure| figure.dimension);
    let found = lowered(&mut Graph::default(), &law, &varying, &|name| reader.exact_value(name));
    found.map(|(_, dimension)| kind_of(dimension).1).map_err(|error| out.push(diagnostic(error))).ok()
}

/// The display unit of a figure.
fn read_display_unit(
    &MeasureTable { table, what, .. }: &MeasureTable<'_, '_>,
    dimension: Dimension,
    out: &mut Vec<Diagnostic>,
) -> Option<DisplayUnit> {
    let unit = read_word(table, "display_unit")?.trim();
    let Some((size, found)) = split_unit(&format!("1 {unit}")).map(|(_, size, found)| (size, found)) else {
        let message = format!("{what}: `{}` is no unit", shortened(unit));
        let help = "write a unit such as `deg`, `deg/s` or `mN m`";
        out.push(key_error("unit::unknown", message, (table, "display_unit", "no unit"), help));
        return None;
    };
    if !dimension.is_like(&found) {
        let message = format!("{what}: `{}` is {}, and it is {}", shortened(unit), found.noun(), dimension.noun());
        let help = format!("write a unit such as {}", dimension.example());
        out.push(key_error("unit::dimension", message, (table, "display_unit", "another quantity"), help));
        return None;
    }
    let size = size.to_f64();
    (size != 1.0 || unit != dimension.si()).then(|| DisplayUnit { unit: unit.into(), size })
}

//! The curves of a plot: signals of runs, with their names and styles.

use super::groups::distinct;
use super::text::Clock;
use super::ticks::extent;
use kardan_results::{Physical, Plot, PlottedReference, Run, Signal, Spectrum, Study};
use std::borrow::Cow;

/// The colours of curves on white: hues of Okabe and Ito, with a contrast to the paper of 3 or more;
/// no two look the same for any kind of colour blindness.
pub(super) const ON_WHITE: [&str; 7] = ["#006aa9", "#ba4700", "#0e9e72", "#af6290", "#ca8300", "#7a92c6", "#645e5b"];
/// The same hues, lighter, on a dark page.
pub(super) const ON_DARK: [&str; 7] = ["#3595d0", "#f07e36", "#11c28e", "#be80ab", "#fbbf40", "#91d2fa", "#bec1c6"];
/// Dash patterns (px) of a plot's first, second, … signal where colour already tells the variants apart.
const DASHES: [&[f64]; 4] = [&[], &[1.5, 2.5], &[9.0, 3.0, 1.5, 3.0], &[14.0, 4.0]];
/// The dash pattern (px) of references.
const REFERENCE_DASH: &[f64] = &[6.0, 4.0];

/// Widths of curves and references, px; extra width of each curve below another one, and their largest number.
const WIDTH: f64 = 1.5;
const REFERENCE_WIDTH: f64 = 1.2;
const STEP: f64 = 1.4;
const MOST: usize = 4;
/// Part of an axis that a line covers.
const LINE: f64 = 0.003;
/// Longer names of curves are not repeated.
const NAME: usize = 28;

/// The unit of time of all plots and tables.
pub(super) fn clock(study: &Study) -> Clock {
    let ends = study.runs.iter().filter_map(|run| run.series.time.last());
    Clock::until(ends.copied().filter(|end| end.is_finite()).fold(0.0, f64::max))
}

/// One curve of a plot.
#[derive(Clone)]
pub(super) struct Curve<'a> {
    /// Its name in the legend.
    pub(super) label: String,
    /// Index into the palette, not yet reduced; `None` for a reference of all variants, drawn in the colour of the text.
    pub(super) colour: Option<usize>,
    /// Dash pattern, px; empty: solid.
    pub(super) dash: &'static [f64],
    /// Width, px: of curves that coincide the lower ones are wider.
    pub(super) width: f64,
    /// The quantity of the values.
    pub(super) physical: Physical,
    /// Their unit.
    pub(super) unit: &'a str,
    /// Time, s, or the quantity of the horizontal axis.
    pub(super) time: Cow<'a, [f64]>,
    /// Values, one for each time.
    pub(super) values: Cow<'a, [f64]>,
}

/// The content of a plot.
pub(super) struct Curves<'a> {
    /// Its curves, references last (drawn on top). Signals that a run lacks are left out.
    pub(super) all: Vec<Curve<'a>>,
    /// The least span of the value axis: smaller changes are rounding.
    pub(super) least_span: f64,
    /// How to read the plot, if that is not obvious.
    pub(super) note: String,
}

/// The curves of a plot.
pub(super) fn curves<'a>(study: &'a Study, plot: &'a Plot) -> Curves<'a> {
    let runs = runs(study, plot);
    let mut all = Vec::new();
    for (signal_index, signal) in plot.signals.iter().enumerate() {
        let name = label(plot, signal_index, signal);
        for (run_index, run) in runs.iter().enumerate() {
            let Some(signal) = run.series.signal(signal) else { continue };
            let (label, colour, dash) = match (plot.signals.len() > 1, runs.len() > 1) {
                (true, true) => {
                    let label = format!("{name}, {}", variant_label(study, run));
                    (label, run_index, dash(signal_index, run_index))
                }
                (false, true) => (variant_label(study, run), run_index, dash(0, run_index)),
                (_, false) => (name.to_string(), signal_index, dash(0, signal_index)),
            };
            all.push(curve((study, plot), run, signal, label, Some(colour), dash));
        }
    }
    let least_span = rounding(study, plot, &all);
    let coincident = !still(plot) && mark_coincident(&mut all, least_span);
    for (number, reference) in plot.references.iter().enumerate() {
        let name = format!("{}{}", if reference.opposite { "−" } else { "" }, reference.signal);
        let name = label(plot, plot.signals.len() + number, &name).to_string();
        all.extend(references(study, plot, &runs, reference, &name));
    }
    let mut notes = on_axes(study, plot, &mut all);
    if coincident {
        notes.push(
            "Curves that coincide within a line width are drawn over each other, the first one widest; the legend \
             names them."
                .into(),
        );
    }
    let moves = all.iter().any(|curve| span(&curve.values).is_some_and(|(low, high)| high > low));
    if least_span > 0.0
        && moves
        && all.iter().all(|curve| span(&curve.values).is_some_and(|(low, high)| high - low < least_span))
    {
        notes
            .push("The changes here are less than a billionth of these signals' range in other runs: rounding.".into());
    }
    Curves { all, least_span, note: notes.join(" ") }
}

/// Whether a plot is not over time, and so drawn once.
pub(super) fn still(plot: &Plot) -> bool {
    plot.over.is_some() || plot.spectrum || plot.log_x || plot.log_y
}

/// The label of the horizontal axis, with the scale of its numbers.
pub(super) fn x_axis(study: &Study, plot: &Plot) -> (String, f64) {
    let Clock { per_second, unit } = clock(study);
    match &plot.over {
        _ if plot.spectrum => ("frequency [Hz]".into(), 1.0),
        Some(name) => {
            let found = study.runs.iter().find_map(|run| run.series.signal(name));
            let kind = found.map(|signal| (signal.physical.word(), in_unit(plot, signal).1));
            let (word, unit) = kind.unwrap_or(("", ""));
            (label_of(word, name, unit), 1.0)
        }
        None => (format!("time [{unit}]"), per_second),
    }
}

fn label_of(word: &str, name: &str, unit: &str) -> String {
    let unit = if unit.is_empty() { String::new() } else { format!("[{unit}]") };
    [word, name, &unit].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ")
}

/// How a value of a signal is drawn, and its unit.
fn in_unit<'a>(plot: &'a Plot, signal: &Signal) -> (f64, &'a str) {
    let display = plot.display.as_ref().filter(|display| display.physical == signal.physical);
    display.map_or((1.0, signal.physical.unit()), |display| (display.unit.size, display.unit.unit.as_str()))
}

/// Takes values that have no logarithm from the curves over a logarithmic axis; gives notes for the reader.
fn on_axes(study: &Study, plot: &Plot, curves: &mut [Curve]) -> Vec<String> {
    let mut notes = Vec::new();
    if plot.spectrum {
        notes.push("Amplitudes with a Hann window, mean removed: a sine shows its amplitude.".to_string());
        let missing = study.spectra.iter().filter(|spectrum| spectrum.plot == plot.id);
        for (name, why) in missing.filter_map(|spectrum| Some((&spectrum.signal, spectrum.missing.as_ref()?))) {
            notes.push(format!("No spectrum of {name}: {why}."));
        }
    }
    let mut excluded = 0;
    for curve in curves.iter_mut().filter(|_| plot.log_x || plot.log_y) {
        let outside = |x: f64, y: f64| plot.log_x && x <= 0.0 || plot.log_y && y <= 0.0;
        let clipped = |(x, y): (&f64, &f64)| if outside(*x, *y) { f64::NAN } else { *y };
        let values: Vec<f64> = curve.time.iter().zip(curve.values.iter()).map(clipped).collect();
        excluded += values.iter().zip(curve.values.iter()).filter(|(a, b)| a.is_nan() && !b.is_nan()).count();
        let first = curve.time.iter().position(|x| !plot.log_x || *x > 0.0).unwrap_or(curve.time.len());
        curve.time = curve.time[first..].to_vec().into();
        curve.values = values[first..].to_vec().into();
    }
    if excluded > 0 {
        notes.push(format!("{excluded} points are not above zero; a logarithmic axis cannot show them."));
    }
    notes
}

/// The name of a curve in the legend, by its number among signals and references.
fn label<'a>(plot: &'a Plot, number: usize, name: &'a str) -> &'a str {
    plot.labels.get(number).map_or(name, String::as_str)
}

/// The curves of a reference: one where it is the same for all variants, else that of each variant in its colour.
fn references<'a>(
    study: &'a Study,
    plot: &'a Plot,
    runs: &[&'a Run],
    reference: &'a PlottedReference,
    name: &str,
) -> Vec<Curve<'a>> {
    let mut kinds: Vec<(Curve, Vec<String>)> = Vec::new();
    let mut drawn = 0;
    for (index, run) in runs.iter().enumerate() {
        let Some(signal) = run.series.signal(&reference.signal) else { continue };
        let mut own = curve((study, plot), run, signal, String::new(), Some(index), REFERENCE_DASH);
        if reference.opposite {
            // Zeros have no sign.
            own.values = own.values.iter().map(|value| 0.0 - value).collect();
        }
        drawn += 1;
        let accuracy = accuracy([&own.values[..]], 0.0);
        // References of runs that ended early are equal up to their end.
        let same = |candidate: &Curve| coincide(&as_far_as(candidate, &own), &as_far_as(&own, candidate), accuracy);
        match kinds.iter_mut().find(|(candidate, _)| same(candidate)) {
            Some((longest, variants)) => {
                variants.push(variant_label(study, run));
                if own.time.len() > longest.time.len() && own.time.last() > longest.time.last() {
                    *longest = own;
                }
            }
            None => kinds.push((own, vec![variant_label(study, run)])),
        }
    }
    let several = kinds.len() > 1;
    let named = |(mut curve, variants): (Curve<'a>, Vec<String>)| {
        curve.label = match several {
            true if variants.len() == drawn => name.to_string(),
            true => format!("{name}, {}", variants.join("; ")),
            false => name.to_string(),
        };
        curve.colour = curve.colour.filter(|_| several);
        curve.width = REFERENCE_WIDTH;
        curve
    };
    kinds.into_iter().map(named).collect()
}

/// The part of a curve up to the first sample at or after the end of another one.
fn as_far_as<'a>(curve: &Curve<'a>, other: &Curve) -> Curve<'a> {
    let end = other.time.last().copied().unwrap_or(f64::NEG_INFINITY);
    let count = (curve.time.partition_point(|&time| time < end) + 1).min(curve.time.len());
    let time = curve.time[..count].to_vec().into();
    Curve { time, values: curve.values[..count].to_vec().into(), ..curve.clone() }
}

/// The dash pattern of a signal in a colour; where the palette starts over, the next pattern.
fn dash(signal_index: usize, colour: usize) -> &'static [f64] {
    DASHES[(signal_index + colour / ON_WHITE.len()) % DASHES.len()]
}

/// The part of a signal that the plot shows, in its unit.
fn curve<'a>(
    (study, plot): (&'a Study, &'a Plot),
    run: &'a Run,
    signal: &'a Signal,
    label: String,
    colour: Option<usize>,
    dash: &'static [f64],
) -> Curve<'a> {
    let same = |one: &&Spectrum| one.plot == plot.id && one.run == run.name && one.signal == signal.name;
    let spectrum = if plot.spectrum { study.spectra.iter().find(same) } else { None };
    let count = run.series.time.len().min(signal.values.len());
    let time = &run.series.time[..count];
    let (from, until) = plot.window.map_or((0, count), |window| {
        (time.partition_point(|&t| t < window.start), time.partition_point(|&t| t <= window.end))
    });
    let shown = from.min(until)..until;
    let (size, unit) = in_unit(plot, signal);
    let scaled = |values: &'a [f64], size: f64| match size {
        1.0 => Cow::Borrowed(values),
        size => values.iter().map(|&value| value / size).collect(),
    };
    let mut values = scaled(&signal.values[shown.clone()], size);
    let mut time = Cow::Borrowed(&time[shown.clone()]);
    if let Some(over) = plot.over.as_ref().and_then(|name| run.series.signal(name)) {
        time = scaled(over.values.get(shown).unwrap_or_default(), in_unit(plot, over).0);
    }
    if let Some(spectrum) = spectrum {
        (time, values) = (Cow::Borrowed(&spectrum.frequency[..]), scaled(&spectrum.amplitude, size));
    }
    Curve { label, colour, dash, width: WIDTH, physical: signal.physical, unit, time, values }
}

fn runs<'a>(study: &'a Study, plot: &Plot) -> Vec<&'a Run> {
    study.runs.iter().filter(|run| plot.variants.is_empty() || plot.variants.contains(&run.name)).collect()
}

/// Least and greatest of the values that are finite.
fn span(values: &[f64]) -> Option<(f64, f64)> {
    Some(extent(values.iter().copied().filter(|value| value.is_finite()))).filter(|(low, high)| low <= high)
}

/// A billionth of the largest value that the signals of a plot have in any run, in the unit of the plot.
fn rounding(study: &Study, plot: &Plot, curves: &[Curve]) -> f64 {
    let mut largest = 0.0_f64;
    for name in &plot.signals {
        let Some(signal) = study.runs.iter().find_map(|run| run.series.signal(name)) else { continue };
        let (size, _) = in_unit(plot, signal);
        let all = study.runs.iter().filter_map(|run| run.series.signal(name));
        let ends = all.filter_map(|signal| span(&signal.values)).flat_map(|(low, high)| [low.abs(), high.abs()]);
        largest = largest.max(ends.fold(0.0, f64::max) / size);
    }
    // Signals of different kinds have no common least span.
    let one = curves.windows(2).all(|pair| pair[0].physical == pair[1].physical);
    if one { 1e-9 * largest } else { 0.0 }
}

/// Differences that no reader can see: in value, on an axis that shows all these curves, and in time, as a fraction.
fn accuracy<'v>(values: impl IntoIterator<Item = &'v [f64]>, least_span: f64) -> f64 {
    let (low, high) = extent(values.into_iter().flatten().copied().filter(|value| value.is_finite()));
    LINE * (high - low).max(least_span).max(0.0)
}

/// Whether two drawn curves coincide: everywhere within a line width of each other.
fn coincide(one: &Curve, other: &Curve, accuracy: f64) -> bool {
    let (Some(first), Some(last)) = (one.time.first(), one.time.last()) else { return other.time.is_empty() };
    let near = LINE * (last - first);
    let ends =
        |curve: &Curve| [curve.time.first().copied(), curve.time.last().copied()].map(|end| end.unwrap_or(f64::NAN));
    let same_ends = ends(one).iter().zip(ends(other)).all(|(a, b)| (a - b).abs() <= near);
    one.unit == other.unit && same_ends && follows(one, other, near, accuracy) && follows(other, one, near, accuracy)
}

/// Whether every value of a curve lies between the values of another one around that time.
fn follows(one: &Curve, other: &Curve, near: f64, accuracy: f64) -> bool {
    let (mut from, mut until, mut next) = (0, 0, 0);
    one.time.iter().zip(one.values.iter()).all(|(&time, &value)| {
        // Usually a sample at that time exists and is close enough.
        while next < other.time.len() && other.time[next] < time {
            next += 1;
        }
        let on_reference = other.time.get(next).is_some_and(|at| *at == time);
        if on_reference && (value - other.values[next]).abs() <= accuracy {
            return true;
        }
        while until < other.time.len() && other.time[until] <= time + near {
            until += 1;
        }
        while from < until && other.time[from] < time - near {
            from += 1;
        }
        let about = &other.values[from..until];
        if !value.is_finite() {
            return about.iter().any(|value| !value.is_finite());
        }
        // Usually the sample in the middle is close enough.
        if about.get(about.len() / 2).is_some_and(|middle| (value - middle).abs() <= accuracy) {
            return true;
        }
        let ends = [(from, time - near), (until, time + near)].map(|(next, time)| straight(other, next, time));
        let inside = about.iter().copied().filter(|value| value.is_finite());
        let (low, high) = extent(ends.into_iter().flatten().chain(inside));
        (low - accuracy..=high + accuracy).contains(&value)
    })
}

/// The value of a curve at a time between the sample before `next` and that one, on the straight line between them.
fn straight(curve: &Curve, next: usize, time: f64) -> Option<f64> {
    let before = next.checked_sub(1)?;
    let (t, x) = (curve.time.get(before..=next)?, curve.values.get(before..=next)?);
    let value = x[0] + (x[1] - x[0]) * (time - t[0]) / (t[1] - t[0]);
    value.is_finite().then_some(value)
}

/// Widens the lower ones of coinciding curves and names their partner in the legend; returns whether any coincide.
fn mark_coincident(curves: &mut [Curve], least_span: f64) -> bool {
    let accuracy = accuracy(curves.iter().map(|curve| &curve.values[..]), least_span);
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (index, curve) in curves.iter().enumerate() {
        let coincident = |group: &&mut Vec<usize>| coincide(&curves[group[0]], curve, accuracy);
        match groups.iter_mut().find(coincident) {
            Some(group) => group.push(index),
            None => groups.push(vec![index]),
        }
    }
    groups.retain(|group| group.len() > 1);
    for group in &groups {
        let first = &curves[group[0]].label;
        let name = if first.chars().count() > NAME { format!("curve {}", group[0] + 1) } else { first.clone() };
        for (place, &index) in group.iter().enumerate() {
            curves[index].width = WIDTH + STEP * (group.len() - 1 - place).min(MOST) as f64;
            if place > 0 {
                curves[index].label += &format!(" (same as {name})");
            }
        }
    }
    !groups.is_empty()
}

/// The axis label: `angle rk.phi [rad]` for one signal, `angle [rad]` for several, both units if they differ.
pub(super) fn axis_label(plot: &Plot, curves: &[Curve]) -> String {
    let kinds = distinct(curves.iter().map(|curve| (curve.physical, curve.unit)));
    let of = if plot.spectrum { "amplitude of " } else { "" };
    match (&kinds[..], &plot.signals[..]) {
        ([(kind, unit)], [signal]) => format!("{of}{}", label_of(kind.word(), signal, unit)),
        _ => {
            let labels: Vec<String> = kinds.iter().map(|(kind, unit)| label_of(kind.word(), "", unit)).collect();
            format!("{of}{}", labels.join(", "))
        }
    }
}

/// Longest name of a variant from its parameters.
const BRIEF: usize = 40;

/// The name of a variant for the reader, `beta = 10 deg`: the parameters in which the study's variants differ. Where
/// these do not distinguish them briefly, the name in the file.
pub(super) fn variant_label(study: &Study, run: &Run) -> String {
    let differs = |name: &str| study.runs.iter().any(|candidate| text_of(candidate, name) != text_of(run, name));
    let describe = |run: &Run| -> Vec<String> {
        let shown = run.parameters.iter().filter(|parameter| differs(&parameter.name));
        shown.map(|parameter| format!("{} = {}", parameter.name, parameter.text)).collect()
    };
    let descriptions: Vec<Vec<String>> = study.runs.iter().map(describe).collect();
    let briefly = |one: &Vec<String>| (1..=3).contains(&one.len()) && one.join(", ").chars().count() <= BRIEF;
    let unique = |one: &Vec<String>| descriptions.iter().filter(|candidate| *candidate == one).count() == 1;
    if !study.named && descriptions.iter().all(|one| briefly(one) && unique(one)) {
        describe(run).join(", ")
    } else {
        run.name.clone()
    }
}

fn text_of<'a>(run: &'a Run, parameter: &str) -> Option<&'a str> {
    run.parameters.iter().find(|value| value.name == parameter).map(|value| value.text.as_str())
}

/// The names of the plots' files and anchors: the id with everything but letters, digits, `-`, `_` and inner `.`
/// replaced, made unique by a number.
pub(super) fn stems(study: &Study) -> Vec<String> {
    let mut stems: Vec<String> = Vec::new();
    for plot in &study.plots {
        let safe = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '-' };
        let stem: String = plot.id.chars().map(safe).collect();
        let stem = stem.trim_matches('.');
        let stem = if stem.is_empty() { "plot" } else { stem };
        let mut unique = stem.to_owned();
        let mut number = 2;
        while stems.contains(&unique) {
            unique = format!("{stem}-{number}");
            number += 1;
        }
        stems.push(unique);
    }
    stems
}

#[cfg(test)]
#[path = "../tests/unit/curves.rs"]
mod tests;

//! What a plot shows: which signals of which runs, under which name, in which style.

use super::text::Clock;
use kardan::results::{Physical, Plot, Run, Signal, Study};

/// The colours of curves on white: Okabe and Ito's, chosen to stay apart for colour-blind readers.
pub(super) const ON_WHITE: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f"];
/// The same hues, lighter, on a dark page.
pub(super) const ON_DARK: [&str; 7] = ["#4da6e0", "#ff8a3d", "#2cc79a", "#e59ac4", "#f2b83d", "#8fd0f7", "#b0b0b0"];
/// Dash patterns (px) of a plot's first, second, … signal where colour already tells the variants apart.
const DASHES: [&[f64]; 4] = [&[], &[1.5, 2.5], &[9.0, 3.0, 1.5, 3.0], &[14.0, 4.0]];
/// The dash pattern (px) of references.
const REFERENCE_DASH: &[f64] = &[6.0, 4.0];

/// The unit of time of all plots and tables.
pub(super) fn clock(study: &Study) -> Clock {
    let ends = study.runs.iter().filter_map(|run| run.series.time.last());
    Clock::until(ends.copied().filter(|end| end.is_finite()).fold(0.0, f64::max))
}

/// One curve of a plot.
pub(super) struct Curve<'a> {
    /// Its name in the legend.
    pub(super) label: String,
    /// Index into the palette, not yet reduced; `None` for a reference, drawn in the colour of the text.
    pub(super) colour: Option<usize>,
    /// Dash pattern, px; empty: solid.
    pub(super) dash: &'static [f64],
    /// What the values are.
    pub(super) physical: Physical,
    /// Time, s.
    pub(super) time: &'a [f64],
    /// As many values, SI.
    pub(super) values: &'a [f64],
}

/// The curves of a plot, references last (they lie on top). Signals that a run does not have are left out.
pub(super) fn curves<'a>(study: &'a Study, plot: &Plot) -> Vec<Curve<'a>> {
    let runs = runs(study, plot);
    let mut curves = Vec::new();
    for (signal_index, name) in plot.signals.iter().enumerate() {
        for (run_index, run) in runs.iter().enumerate() {
            let Some(signal) = run.series.signal(name) else { continue };
            let (label, colour, dash) = match (plot.signals.len() > 1, runs.len() > 1) {
                (true, true) => {
                    let label = format!("{name}, {}", variant_label(study, run));
                    (label, run_index, dash(signal_index, run_index))
                }
                (false, true) => (variant_label(study, run), run_index, dash(0, run_index)),
                (_, false) => (name.clone(), signal_index, dash(0, signal_index)),
            };
            curves.push(curve(run, signal, label, Some(colour), dash));
        }
    }
    for name in &plot.references {
        let found = runs.iter().find_map(|run| Some((run, run.series.signal(name)?)));
        if let Some((run, signal)) = found {
            curves.push(curve(run, signal, name.clone(), None, REFERENCE_DASH));
        }
    }
    curves
}

/// The dash pattern of a signal in a colour; where the palette starts over, the next pattern.
fn dash(signal_index: usize, colour: usize) -> &'static [f64] {
    DASHES[(signal_index + colour / ON_WHITE.len()) % DASHES.len()]
}

fn curve<'a>(
    run: &'a Run,
    signal: &'a Signal,
    label: String,
    colour: Option<usize>,
    dash: &'static [f64],
) -> Curve<'a> {
    let count = run.series.time.len().min(signal.values.len());
    let (time, values) = (&run.series.time[..count], &signal.values[..count]);
    Curve { label, colour, dash, physical: signal.physical, time, values }
}

fn runs<'a>(study: &'a Study, plot: &Plot) -> Vec<&'a Run> {
    study.runs.iter().filter(|run| plot.variants.is_empty() || plot.variants.contains(&run.name)).collect()
}

/// The axis label: `angle rk.phi [rad]` for one signal, `angle [rad]` for several, both units if they differ.
pub(super) fn axis_label(plot: &Plot, curves: &[Curve]) -> String {
    let mut kinds: Vec<Physical> = Vec::new();
    for curve in curves {
        if !kinds.contains(&curve.physical) {
            kinds.push(curve.physical);
        }
    }
    match (&kinds[..], &plot.signals[..]) {
        ([kind], [signal]) => format!("{} {signal} [{}]", kind.word(), kind.unit()),
        _ => kinds.iter().map(|kind| format!("{} [{}]", kind.word(), kind.unit())).collect::<Vec<_>>().join(", "),
    }
}

/// The name of a variant for the reader, `beta = 10 deg`: the parameters in which the study's variants differ. Where
/// that does not tell them apart briefly, the name in the file.
pub(super) fn variant_label(study: &Study, run: &Run) -> String {
    let differs = |name: &str| study.runs.iter().any(|other| text_of(other, name) != text_of(run, name));
    let describe = |run: &Run| -> Vec<String> {
        let shown = run.parameters.iter().filter(|parameter| differs(&parameter.name));
        shown.map(|parameter| format!("{} = {}", parameter.name, parameter.text)).collect()
    };
    let described = describe(run);
    let unique = study.runs.iter().filter(|other| describe(other) == described).count() == 1;
    if (1..=3).contains(&described.len()) && unique { described.join(", ") } else { run.name.clone() }
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
mod tests {
    use super::*;

    #[test]
    fn file_names_are_safe_and_unique() {
        let plot = |id: &str| Plot { id: id.into(), ..Plot::default() };
        let plots = ["../../etc/passwd", "a", "a", "", "rack angle"].map(plot).to_vec();
        let study = Study { plots, ..Study::default() };
        assert_eq!(stems(&study), ["-..-etc-passwd", "a", "a-2", "plot", "rack-angle"]);
    }
}

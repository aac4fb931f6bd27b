//! Runs as a page: charts, key figures, requirements, motors, energy, events, the model with its laws.

use crate::charts;
use crate::curves::{clock, variant_label};
use crate::groups::{distinct, grouped};
use crate::model::{Alert, Block, Body, Cell, Page, Section, row};
use crate::phrases;
use crate::svg::{self, PlotFile};
use crate::text::{Clock, DIGITS, figure, shown, with_unit};
use kardan_results::{
    self, Accuracy, Design, DisplayUnit, Energy, Event, Extreme, ModelSummary, MotorLoad, Outcome, Plot,
    RequirementResult, Run, RunVerdict, Signal, Structure, Study, Verdict,
};

use super::{analysis, design};

/// Requirements, runs and loops that the first sentence names; more are counted.
const NAMED: usize = 3;
/// More events of one variant are counted, not listed.
const EVENTS: usize = 300;

/// The page of a study.
pub fn page(study: &Study) -> Page {
    let (data, plots) = rayon::join(|| charts::data(study), || svg::plots(study));
    Page { data: Some(data), ..with_plots(study, &plots) }
}

/// The page of a study as text only: without drawings, which take most of the time.
pub fn text_page(study: &Study) -> Page {
    with_plots(study, &[])
}

fn with_plots(study: &Study, drawn: &[PlotFile]) -> Page {
    let new = Body::default;
    let mut sections = Page::sections([
        super::mechanism(&study.model.mechanism),
        ("signals", "Signals and blocks", crate::signal_graph::body(&study.model.signals)),
        ("plots", "Plots", plots(study, drawn)),
        ("figures", "Key figures", key_figures(study)),
        ("measured", "Figures", figures(study)),
        ("requirements", "Requirements", requirements(study)),
        ("motors", "Motors and their limits", motors(study)),
        ("energy", "Energy balance", energy(study)),
        ("accuracy", "Accuracy", accuracy(study)),
        ("events", "Events", new().detail(events(study))),
        ("notes", "Notes", new().list(notes(study))),
        ("warnings", "Warnings", study.warnings.iter().fold(new(), |body, text| body.judge(false, text))),
        ("model", "Model", new().detail(model(&study.model))),
    ]);
    sections.extend(study.designs.iter().enumerate().map(|(k, found)| {
        design::page(found).into_section(&format!("design-{}", k + 1), &format!("Design of {}", found.controller), "")
    }));
    let analysis = study.analysis.as_ref();
    sections.extend(
        analysis.map(|found| analysis::page(found).into_section("analysis", "Structure analysis", &whose(study))),
    );
    sections.extend(Page::sections([("variants", "Variants and effort", variants(study))]));
    Page {
        name: if study.model.name.is_empty() { "Study".into() } else { study.model.name.clone() },
        description: study.model.description.clone(),
        verdict: Some(verdict(study)),
        alerts: alerts(study),
        sections,
        ..Page::default()
    }
}

/// Controllability from the inputs and observability from the outputs.
fn structure(structure: &Structure) -> String {
    let states = structure.states.len();
    let part = |satisfied: bool, what: &str, rank: usize, names: &[String], none: &str| match (satisfied, names) {
        (_, []) => none.to_owned(),
        (true, names) => format!("{what} {}", phrases::list(names, 4)),
        (false, names) => format!("NOT {what} {} (rank {rank} of {states})", phrases::list(names, 4)),
    };
    let Structure { inputs, outputs, controllable_rank, observable_rank, .. } = structure;
    let none = "without inputs, so nothing in it can be controlled";
    let controllable = part(structure.controllable(), "controllable by", *controllable_rank, inputs, none);
    let none = "without outputs, so nothing in it can be observed";
    let observable = part(structure.observable(), "observable from", *observable_rank, outputs, none);
    format!("structure: {controllable}; {observable}")
}

/// The variant of the analysis in the report, and its contents.
fn whose(study: &Study) -> String {
    let found = study.analysis.as_ref().map_or(String::new(), |found| structure(&found.structure));
    let open = format!("Without the laws, linearised at the operating point; {found}.");
    match &study.runs[..] {
        [] | [_] => open,
        [first, ..] => {
            format!("{open} Variant {}; `kardan analyze --variant NAME` shows another.", variant_label(study, first))
        }
    }
}

/// One sentence: did all variants complete, are the requirements met? `true` if so.
pub(super) fn verdict(study: &Study) -> Verdict {
    if study.runs.is_empty() {
        return Verdict { sound: true, text: "No runs.".into() };
    }
    let judged: Vec<bool> = study.runs.iter().flat_map(|run| &run.requirements).map(|judged| judged.passed).collect();
    let passed = judged.iter().filter(|&&passed| passed).count();
    let requirements = match (passed, judged.len()) {
        (_, 0) => "no requirements are stated".into(),
        (1, 1) => "the requirement is met".into(),
        (0, 1) => "the requirement is not met".into(),
        (passed, all) if passed == all => format!("all {all} requirements are met"),
        (passed, all) => {
            let failed = all - passed;
            let (verb, are) = (if passed == 1 { "is" } else { "are" }, if failed == 1 { "is" } else { "are" });
            format!("{passed} of {all} requirements {verb} met, {failed} {are} not")
        }
    };
    let at_limit = study.runs.iter().filter(|run| run.motor_loads.iter().any(MotorLoad::at_limit)).count();
    let at_limit = match at_limit {
        0 => String::new(),
        some if some == study.runs.len() => "; a motor is at its limit for some time".into(),
        some => format!("; in {some} of {} variants a motor is at its limit for some time", study.runs.len()),
    };
    let completed = study.runs.iter().all(|run| run.verdict() == RunVerdict::Completed);
    let weak =
        |design: &Design| design.margins.as_ref().is_some_and(|found| found.stable == Some(false) || found.low_margins);
    let sound = completed && passed == judged.len() && !study.designs.iter().any(weak);
    let loops = loops(study);
    let (failed, doubtful_runs) = (failed(study), doubtful_runs(study));
    Verdict { sound, text: format!("{}{doubtful_runs}; {requirements}{failed}{loops}{at_limit}.", ended(study)) }
}

/// Names after a sentence: `: first; second; and 3 more`.
fn behind(names: &[String]) -> String {
    let listed: Vec<&str> = names.iter().take(NAMED).map(String::as_str).collect();
    match (names.len(), names.len().saturating_sub(NAMED)) {
        (0, _) => String::new(),
        (_, 0) => format!(": {}", listed.join("; ")),
        (_, more) => format!(": {}; and {more} more", listed.join("; ")),
    }
}

/// A part of a sentence with the runs that it is about, where there are several.
fn about(study: &Study, text: &str, runs: &[&Run]) -> String {
    let labels: Vec<String> = runs.iter().map(|run| variant_label(study, run)).collect();
    if study.runs.len() < 2 { text.into() } else { format!("{text} ({})", phrases::list(&labels, NAMED)) }
}

/// Each requirement with its verdicts in all runs.
pub(super) fn judged(study: &Study) -> Vec<(&String, Vec<(&Run, &RequirementResult)>)> {
    grouped(study.runs.iter().flat_map(|run| run.requirements.iter().map(move |one| (&one.text, (run, one)))))
}

/// The requirements that are not met.
fn failed(study: &Study) -> String {
    let judged = study.runs.iter().flat_map(|run| run.requirements.iter().map(move |judged| (judged, run)));
    let failed = judged.filter(|(judged, _)| !judged.passed).map(|(judged, run)| (&judged.text, run));
    behind(&grouped(failed).iter().map(|(text, runs)| about(study, text, runs)).collect::<Vec<_>>())
}

/// Doubts about numbers from the comparison with a second run.
fn doubtful_runs(study: &Study) -> String {
    let reason = |run: &Run| {
        let found = run.accuracy.as_ref()?;
        let text = match (&found.unreliable, &found.quantisation_ambiguity) {
            (Some(one), _) => format!("the estimated error of {} is a tenth of the signal or more", one.signal),
            (None, Some(first)) => {
                format!("the quantisation of `{}` decides from {} on", first.sensor, clock(study).time(first.time))
            }
            (None, None) if !found.same_events => "a second run has other events".into(),
            _ => return None,
        };
        Some(about(study, &text, &[run]))
    };
    let all: Vec<String> = study.runs.iter().filter_map(reason).collect();
    if all.is_empty() { String::new() } else { format!("; accuracy{}", behind(&all)) }
}

/// Loops that are unstable or have low margins.
fn loops(study: &Study) -> String {
    let one = |design: &Design| {
        let margins = design.margins.as_ref()?;
        let name = &design.controller;
        match (margins.stable, margins.low()) {
            (Some(false), _) => Some(format!("`{name}` is not stable")),
            (_, Some(low)) => Some(format!("`{name}` has the disk margin {} at `{}`", figure(low.disk, 2), low.name)),
            _ => None,
        }
    };
    let all: Vec<String> = study.designs.iter().filter_map(one).collect();
    if all.is_empty() { String::new() } else { format!("; low margins{}", behind(&all)) }
}

/// How all runs ended, and whether their numbers may be used.
fn ended(study: &Study) -> String {
    if let [run] = &study.runs[..] {
        let text = match run.verdict() {
            RunVerdict::Completed => "The run completed",
            RunVerdict::Doubtful => "The run completed, but its numbers are doubtful",
            RunVerdict::Unbalanced => {
                "The run completed, but its energy balance does not close, so that its numbers are wrong"
            }
            RunVerdict::Failed => "The run did not complete",
        };
        return text.into();
    }
    let all = study.runs.len();
    let count = |verdict| study.runs.iter().filter(|run| run.verdict() == verdict).count();
    let completed = count(RunVerdict::Completed);
    if completed == all {
        return format!("All {all} variants completed");
    }
    let mut text = format!("{completed} of {all} variants completed");
    for verdict in [RunVerdict::Failed, RunVerdict::Unbalanced, RunVerdict::Doubtful] {
        text += &match (count(verdict), verdict) {
            (0, _) => String::new(),
            (some, RunVerdict::Failed) => format!(", {some} failed"),
            (some, RunVerdict::Unbalanced) => format!(
                ", the energy balance of {some} of {all} variants does not close, so that their numbers are wrong"
            ),
            (some, _) => format!(", the numbers of {some} of {all} variants are doubtful"),
        };
    }
    text
}

/// An alert for each run with incomplete numbers, and for each warning.
pub(super) fn alerts(study: &Study) -> Vec<Alert> {
    let name = |run: &Run| {
        let label = variant_label(study, run);
        if label == run.name { label } else { format!("{} ({label})", run.name) }
    };
    let alert = |run: &Run| match &run.outcome {
        Outcome::Completed => None,
        Outcome::Unbalanced { cause } => {
            Some(Alert { kind: "Wrong numbers".into(), text: format!("{}: {cause}.", name(run)) })
        }
        Outcome::Failed { time, cause } => {
            let (at, cause) = (clock(study).time(*time), cause.trim_end_matches('.'));
            let text = format!("{} stopped at {at}: {cause}. All results up to that time are shown.", name(run));
            Some(Alert { kind: "Ended early".into(), text })
        }
    };
    let warned = study.runs.iter().flat_map(|run| run.warnings.iter().map(move |text| (run, text)));
    let warning = |(run, text): (&Run, &String)| Alert {
        kind: "Warning".into(),
        text: format!("{}: {text}.", variant_label(study, run)),
    };
    study.runs.iter().filter_map(alert).chain(warned.map(warning)).collect()
}

/// The note that there are none.
fn or_none(body: Body, none: &str) -> Body {
    if body.0.is_empty() { body.paragraph(none) } else { body }
}

fn plots(study: &Study, drawn: &[PlotFile]) -> Body {
    let charts = study.plots.iter().zip(drawn).enumerate();
    let charts: Vec<Block> = charts.map(|(k, (plot, picture))| Block::Chart(charts::chart(k, plot, picture))).collect();
    if study.plots.is_empty() {
        return Body::default().paragraph("The model file requests no plots.");
    }
    Body(charts)
}

/// The variants with their parameters, outcome and effort.
fn variants(study: &Study) -> Body {
    let rows = study.runs.iter().map(|run| {
        let parameters: Vec<String> =
            run.parameters.iter().map(|value| format!("{} = {}", value.name, value.text)).collect();
        let outcome = match (run.verdict(), &run.outcome) {
            (_, Outcome::Failed { time, .. }) => Cell::Mark(false, format!("stopped at {}", clock(study).time(*time))),
            (_, Outcome::Unbalanced { .. }) => Cell::Mark(false, "energy balance does not close".into()),
            (RunVerdict::Doubtful, _) => Cell::Mark(false, "completed, doubtful".into()),
            _ => Cell::Mark(true, "completed".into()),
        };
        let effort = run.effort;
        row![
            &run.name,
            parameters.join(", "),
            outcome,
            effort.method.to_string(),
            effort.steps,
            effort.rejected,
            effort.evaluations,
            effort.events
        ]
    });
    let headers =
        ["variant", "parameters", "outcome", "method", "#steps", "#rejected", "#evaluations", "#located events"];
    or_none(Body::default().table(&headers, rows), "There are no runs.")
}

/// A row for each of several things; their name represents all of these rows.
fn spanned<T>(name: &str, all: &[T], row: impl Fn(&T) -> Vec<Cell>) -> Vec<Vec<Cell>> {
    let first = std::iter::once(Cell::Span(name.into(), all.len())).chain(std::iter::repeat(Cell::Under));
    first.zip(all).map(|(first, one)| std::iter::once(first).chain(row(one)).collect()).collect()
}

/// Extremes and last values of every signal plotted for a variant; of all signals if there are no plots.
pub(super) fn key_figures(study: &Study) -> Body {
    let all = study.runs.iter().filter(|_| study.plots.is_empty()).flat_map(|run| &run.series.signals);
    let plotted_signals = study.plots.iter().flat_map(|plot| &plot.signals);
    let names = distinct(plotted_signals.chain(all.map(|signal| &signal.name)));
    let plotted = |run: &Run, name: &String| {
        let of = |plot: &Plot| plot.variants.is_empty() || plot.variants.contains(&run.name);
        study.plots.is_empty() || study.plots.iter().any(|plot| of(plot) && plot.signals.contains(name))
    };
    let mut rows = Vec::new();
    for name in names {
        let runs = study.runs.iter().filter(|run| plotted(run, name));
        let found = runs.filter_map(|run| Some((run, run.series.signal(name)?)));
        let found: Vec<(&Run, &Signal)> = found.collect();
        let Some((_, first)) = found.first() else { continue };
        let unit = |signal: &Signal| display_unit(study, name, signal);
        let label = format!("{name} [{}]", unit(first).map_or(first.physical.unit(), |unit| &unit.unit));
        rows.extend(spanned(&label, &found, |(run, signal)| {
            let numbers = extremes(&run.series.time, &signal.values, unit(signal), clock(study));
            row![variant_label(study, run)].into_iter().chain(numbers).collect()
        }));
    }
    let headers = ["signal", "variant", "#minimum", "#at", "#maximum", "#at", "#final"];
    or_none(Body::default().table_of(usize::MAX, &headers, rows), "No signals are plotted.")
}

/// The unit in which a plot shows a signal, where that is not the SI unit.
fn display_unit<'a>(study: &'a Study, name: &String, signal: &Signal) -> Option<&'a DisplayUnit> {
    let plots = study.plots.iter().filter(|plot| plot.signals.contains(name));
    let units = plots.filter_map(|plot| plot.display.as_ref());
    units.filter(|display| display.physical == signal.physical).map(|display| &display.unit).next()
}

/// Least and greatest value with their times, and the last value that is finite.
fn extremes(time: &[f64], values: &[f64], unit: Option<&DisplayUnit>, clock: Clock) -> [Cell; 5] {
    let found = kardan_results::extremes(time, values);
    let in_unit = |value: f64| unit.map_or(value, |unit| unit.of(value));
    let cells = |found: Option<Extreme>| match found {
        Some(at) => [Cell::from(in_unit(at.value)), Cell::Text(clock.time(at.time))],
        None => ["–".into(), "–".into()],
    };
    let [[low, low_time], [high, high_time]] = [cells(found.min), cells(found.max)];
    let last = values.iter().rev().find(|value| value.is_finite());
    [low, low_time, high, high_time, last.copied().map(in_unit).into()]
}

/// Motors with limits: the requested torques, and the time at the limit. Empty if there are none.
fn motors(study: &Study) -> Body {
    let motor_loads = study.runs.iter().flat_map(|run| run.motor_loads.iter().map(move |motor_load| (run, motor_load)));
    super::margins::motor_loads(
        motor_loads.map(|(run, motor_load)| (variant_label(study, run), motor_load, run.length())),
    )
}

/// The figures, each for every variant.
fn figures(study: &Study) -> Body {
    let all = study.runs.iter().flat_map(|run| run.figures.iter().map(move |figure| (&figure.name, (run, figure))));
    let rows = grouped(all).into_iter().flat_map(|(name, all)| {
        spanned(&format!("{name}: {}", all[0].1.text), &all, |(run, figure)| {
            row![variant_label(study, run), measured(figure.value, figure.display.as_ref(), &figure.unit)]
        })
    });
    Body::default().table(&["figure", "variant", "#value"], rows)
}

/// A number in the requested unit, if there is one.
pub(super) fn measured(value: Option<f64>, display: Option<&DisplayUnit>, unit: &str) -> String {
    let value = value.filter(|value| value.is_finite());
    value.map_or("not measured".into(), |value| shown(value, DIGITS, unit, display))
}

/// The requirements, each for every variant.
fn requirements(study: &Study) -> Body {
    let rows = judged(study).into_iter().flat_map(|(text, all)| {
        spanned(text, &all, |(run, judged)| {
            let measured = measured(judged.measured, judged.display.as_ref(), &judged.unit);
            row![variant_label(study, run), measured, Cell::judged(judged.passed, ["passed", "failed"])]
        })
    });
    let headers = ["requirement", "variant", "#measured", "verdict"];
    or_none(Body::default().table(&headers, rows), "The model file states no requirements.")
}

/// The energy balance of every run.
fn energy(study: &Study) -> Body {
    let rows = study.runs.iter().map(|run| {
        let Energy { input, stored, dissipated, residual, exchanged } = run.energy;
        let relative = run.energy.residual_share().map_or("–".into(), |part| format!("{part:.1e}").replace('-', "−"));
        row![variant_label(study, run), input, stored, dissipated, exchanged, figure(residual, 2), relative]
    });
    let headers = [
        "variant",
        "#input [J]",
        "#stored [J]",
        "#dissipated [J]",
        "#exchanged [J]",
        "#residual [J]",
        "#residual / exchanged",
    ];
    or_none(Body::default().table(&headers, rows), "There are no runs.").hint(
        "input = stored + dissipated + residual. Exchanged: the energy stored at the start plus the amounts that \
         inputs supplied and took. Residual: the energy that the integration did not account for; its ratio to the \
         exchanged energy certifies the run.",
    )
}

/// The estimated integration error, if known.
fn accuracy(study: &Study) -> Body {
    let estimated = || study.runs.iter().filter_map(|run| Some((run, run.accuracy.as_ref()?)));
    let Some((_, first)) = estimated().next() else { return Body::default() };
    let row_of = |(run, found): (&Run, &Accuracy)| {
        let mut row = row![variant_label(study, run)];
        row.extend(first.errors.iter().map(|own| {
            let error = found.errors.iter().find(|error| error.unit == own.unit);
            Cell::from(error.map_or("–".into(), |error| format!("{} ({})", figure(error.error, 2), error.signal)))
        }));
        row
    };
    let titles = first.errors.iter().map(|own| with_unit("#error", own.unit.unit()));
    let headers: Vec<String> = std::iter::once("variant".to_string()).chain(titles).collect();
    let those = |which: &dyn Fn(&Accuracy) -> bool| -> String {
        let those = estimated().filter(|(_, found)| which(found)).map(|(run, _)| variant_label(study, run));
        those.collect::<Vec<String>>().join(", ")
    };
    let rounded = those(&|found| found.limited_by_rounding && found.quantisation_ambiguity.is_none());
    let rounded = match rounded.is_empty() {
        true => String::new(),
        false => format!(
            " Three times the difference where rounding dominates the error, or samples set the steps of both runs: {rounded}."
        ),
    };
    let body = Body::default().table(&headers, estimated().map(row_of)).hint(format!(
        "Estimated integration error over all rows, in the signal with the largest one (readings of sensors are not \
         compared). Not proven: a third of the difference to a second run at the tolerance {} instead of \
         {}.{rounded}",
        figure(first.comparison_tolerance, 2),
        figure(first.tolerance, 2)
    ));
    let body = counts(body, study);
    let changed_events = those(&|found| !found.same_events && found.quantisation_ambiguity.is_none());
    if changed_events.is_empty() {
        return body;
    }
    body.judge(
        false,
        format!(
            "{changed_events}: the second run had other events, or another order; a smaller `tolerance` shows which are right"
        ),
    )
}

/// Runs in which sensor quantisation decides, and from which time on.
fn counts(body: Body, study: &Study) -> Body {
    let undecided =
        study.runs.iter().filter_map(|run| Some((run, run.accuracy.as_ref()?.quantisation_ambiguity.as_ref()?)));
    let clock = clock(study);
    let rows: Vec<_> = undecided
        .map(|(run, first)| {
            row![variant_label(study, run), format!("{:.6}", first.time * clock.per_second), &first.sensor]
        })
        .collect();
    if rows.is_empty() {
        return body;
    }
    body.table(&["variant", &format!("#from [{}] on", clock.unit), "sensor"], rows).hint(
        "In these runs a controller reads a sensor closer to a quantisation boundary than the accuracy of the run, \
         first at the time given. Until then the errors are far smaller. From then on a reading may be one count \
         more or less, and the trajectory changes with it; no `tolerance` shows which one is right, and the order of \
         events may change. The error given is ten times the difference to runs on other trajectories: an estimate \
         of their spread, not a bound.",
    )
}

/// Events of each run, folded.
fn events(study: &Study) -> Body {
    let body = study.runs.iter().fold(Body::default(), |body, run| {
        let name = variant_label(study, run);
        match run.events.len() {
            0 => body.paragraph(format!("{name}: no events")),
            1 => body.fold(&format!("{name}: 1 event"), listed(&run.events, clock(study))),
            count => body.fold(&format!("{name}: {count} events"), listed(&run.events, clock(study))),
        }
    });
    or_none(body, "There are no runs.")
}

fn listed(events: &[Event], clock: Clock) -> Body {
    let rows = events
        .iter()
        .take(EVENTS)
        .map(|event| row![format!("{:.6}", event.time * clock.per_second), &event.description]);
    let hint = match events.len().saturating_sub(EVENTS) {
        0 => String::new(),
        rest => format!("The first {EVENTS} are listed; {rest} later ones are in the exported data."),
    };
    Body::default().table_of(EVENTS, &[&format!("#time [{}]", clock.unit), "event"], rows).hint(hint)
}

/// Notes of the runs, each text once with the variants it concerns.
fn notes(study: &Study) -> Vec<String> {
    let notes = study.runs.iter().flat_map(|run| run.notes.iter().map(move |note| (note, variant_label(study, run))));
    let item = |(text, variants): (&String, Vec<String>)| {
        let whom = if variants.len() == study.runs.len() { "all variants".into() } else { variants.join("; ") };
        format!("{text} ({whom})")
    };
    grouped(notes).into_iter().map(item).collect()
}

/// Elements, coordinates, matrices, laws and poles.
fn model(model: &ModelSummary) -> Body {
    let elements = model.elements.iter().map(|one| row![&one.name, &one.kind, &one.values]);
    let coordinates = match model.coordinates.is_empty() {
        true => Body::default(),
        false => Body::default().names("Reduced coordinates", &model.coordinates),
    };
    let poles = super::poles(&model.closed_loop_poles);
    let hint = match poles.0.is_empty() {
        true => "",
        false => "Linearised at the initial position, first variant, without Coulomb friction, in floating point.",
    };
    let matrices = match model.matrices.is_empty() && !model.coordinates.is_empty() {
        true => Body::default().hint(format!(
            "Matrices and poles of {} coordinates are too large to show here: `kardan linearise` writes the matrices, `kardan analyze` the \
             poles.",
            model.coordinates.len()
        )),
        false => Body::default().matrices(&model.matrices),
    };
    let body = Body::default()
        .part("Elements", Body::default().table(&["name", "kind", "values"], elements))
        .and(coordinates)
        .part("Reduced matrices at the initial position", matrices);
    let body = model.laws.iter().fold(body, |mut body, law| {
        let law_body = Body::default().list(law.notes.iter().cloned()).matrices(&law.gains);
        let title = format!("Law {} ({})", law.name, law.law);
        body.0.push(Block::Part(Section { anchor: String::new(), title, body: law_body }));
        body
    });
    let body = body.part("Closed-loop poles", Body::default().hint(hint).and(poles));
    or_none(body, "No summary of the model is given.")
}

#[cfg(test)]
#[path = "../../tests/unit/present/study.rs"]
mod tests;

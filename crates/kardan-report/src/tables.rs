//! The runs in tables: verdict, variants, key figures, requirements, energy, events, notes.

use super::curves::{clock, variant_label};
use super::table::{Cell, section, table};
use super::text::{Clock, escape, figure, unit};
use super::words;
use kardan::results::{Energy, Event, MotorStrain, Outcome, Run, Signal, Study};

/// More events of one variant are counted, not listed.
const EVENTS: usize = 300;

/// One sentence: did all variants run to the end, do the requirements hold? `true` if nothing is wrong.
pub(super) fn verdict(study: &Study) -> (bool, String) {
    if study.runs.is_empty() {
        return (true, "No runs.".into());
    }
    let completed = study.runs.iter().filter(|run| run.outcome == Outcome::Completed).count();
    let judged: Vec<bool> = study.runs.iter().flat_map(|run| &run.requirements).map(|judged| judged.passed).collect();
    let passed = judged.iter().filter(|&&passed| passed).count();
    let runs = match (completed, study.runs.len()) {
        (1, 1) => "The run completed".into(),
        (0, 1) => "The run did not complete".into(),
        (completed, all) if completed == all => format!("All {all} variants completed"),
        (completed, all) => format!("{completed} of {all} variants completed, {} failed", all - completed),
    };
    let requirements = match (passed, judged.len()) {
        (_, 0) => "no requirements are stated".into(),
        (1, 1) => "the requirement is met".into(),
        (0, 1) => "the requirement is not met".into(),
        (passed, all) if passed == all => format!("all {all} requirements are met"),
        (passed, all) => format!("{passed} of {all} requirements are met, {} are not", all - passed),
    };
    let strained = study.runs.iter().filter(|run| run.strains.iter().any(MotorStrain::strained)).count();
    let strained = match strained {
        0 => String::new(),
        some if some == study.runs.len() => "; a motor is at its limit for some time".into(),
        some => format!("; in {some} of {} variants a motor is at its limit for some time", study.runs.len()),
    };
    (completed == study.runs.len() && passed == judged.len(), format!("{runs}; {requirements}{strained}."))
}

/// A box for each failed run.
pub(super) fn failures(study: &Study) -> String {
    let failed = study.runs.iter().filter_map(|run| match &run.outcome {
        Outcome::Failed { time, cause } => Some((run, time, cause)),
        Outcome::Completed => None,
    });
    failed
        .map(|(run, time, cause)| {
            let label = variant_label(study, run);
            let name = if label == run.name { label } else { format!("{} ({label})", run.name) };
            format!(
                "<div class=\"failure\" role=\"alert\"><strong>{} stopped at {}:</strong> {} <em>Everything up to \
                 that time is shown.</em></div>\n",
                escape(&name),
                clock(study).time(*time),
                escape(cause)
            )
        })
        .collect()
}

/// The variants with their parameters, outcome and effort.
pub(super) fn variants(study: &Study) -> String {
    let rows: Vec<Vec<Cell>> = study
        .runs
        .iter()
        .map(|run| {
            let parameters: Vec<String> =
                run.parameters.iter().map(|value| format!("{} = {}", value.name, value.text)).collect();
            let outcome = match &run.outcome {
                Outcome::Completed => mark(true, "completed"),
                Outcome::Failed { time, .. } => mark(false, &format!("stopped at {}", clock(study).time(*time))),
            };
            let effort = run.effort;
            let count = |count: usize| Cell::Number(count.to_string());
            vec![
                Cell::Head(run.name.clone(), 1),
                Cell::Text(parameters.join(", ")),
                outcome,
                count(effort.steps),
                count(effort.rejected),
                count(effort.evaluations),
                count(effort.events),
            ]
        })
        .collect();
    let headers = ["variant", "parameters", "outcome", "#steps", "#rejected", "#evaluations", "#located events"];
    section("variants", "Variants and effort", &or_none(&headers, rows, "There are no runs."))
}

/// Extremes and last values of every plotted signal.
pub(super) fn key_figures(study: &Study) -> String {
    let mut names: Vec<&String> = Vec::new();
    for name in study.plots.iter().flat_map(|plot| &plot.signals) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let mut rows = Vec::new();
    for name in names {
        let found: Vec<(&Run, &Signal)> =
            study.runs.iter().filter_map(|run| Some((run, run.series.signal(name)?))).collect();
        for (index, (run, signal)) in found.iter().enumerate() {
            let mut row = Vec::new();
            if index == 0 {
                row.push(Cell::Head(format!("{name} [{}]", signal.physical.unit()), found.len()));
            }
            row.push(Cell::text(variant_label(study, run)));
            row.extend(extremes(&run.series.time, &signal.values, clock(study)));
            rows.push(row);
        }
    }
    let headers = ["signal", "variant", "#minimum", "#at", "#maximum", "#at", "#final"];
    section("figures", "Key figures", &or_none(&headers, rows, "No signals are plotted."))
}

fn extremes(time: &[f64], values: &[f64], clock: Clock) -> [Cell; 5] {
    let finite = || time.iter().zip(values).filter(|(_, value)| value.is_finite());
    let cells = |found: Option<(&f64, &f64)>| match found {
        Some((time, value)) => [Cell::figure(*value), Cell::Number(clock.time(*time))],
        None => [Cell::Number("–".into()), Cell::Number("–".into())],
    };
    let [low, low_time] = cells(finite().min_by(|a, b| a.1.total_cmp(b.1)));
    // The first of equal maxima, as for minima.
    let [high, high_time] = cells(finite().min_by(|a, b| b.1.total_cmp(a.1)));
    let [last, _] = cells(finite().next_back());
    [low, low_time, high, high_time, last]
}

/// Motors with limits: what was asked of them, and how long they were there. Empty if there are none.
pub(super) fn motors(study: &Study) -> String {
    let strains = study.runs.iter().flat_map(|run| run.strains.iter().map(move |strain| (run, strain)));
    let rows: Vec<Vec<Cell>> = strains
        .map(|(run, strain)| {
            let [asked, limit, time] = words::design::strain(strain, run.length(), |x| figure(x, 5));
            let time = if strain.strained() { mark(false, &time) } else { Cell::Number(time) };
            let variant = Cell::text(variant_label(study, run));
            vec![Cell::Head(strain.motor.clone(), 1), variant, Cell::Number(asked), Cell::Number(limit), time]
        })
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    let headers = ["motor", "variant", "#largest torque asked", "#limit", "#time at the limit"];
    section("motors", "Motors and their limits", &table(&headers, &rows))
}

/// The requirements, each for every variant.
pub(super) fn requirements(study: &Study) -> String {
    let mut texts: Vec<&String> = Vec::new();
    for judged in study.runs.iter().flat_map(|run| &run.requirements) {
        if !texts.contains(&&judged.text) {
            texts.push(&judged.text);
        }
    }
    let mut rows = Vec::new();
    for text in texts {
        let judged = study.runs.iter().flat_map(|run| run.requirements.iter().map(move |judged| (run, judged)));
        let judged: Vec<_> = judged.filter(|(_, judged)| &judged.text == text).collect();
        for (index, (run, requirement)) in judged.iter().enumerate() {
            let mut row = Vec::new();
            if index == 0 {
                row.push(Cell::Head(text.clone(), judged.len()));
            }
            row.push(Cell::text(variant_label(study, run)));
            row.push(Cell::Number(if requirement.measured.is_finite() {
                format!("{} {}", figure(requirement.measured, 5), unit(&requirement.unit))
            } else {
                "not measured".into()
            }));
            row.push(mark(requirement.passed, if requirement.passed { "passed" } else { "failed" }));
            rows.push(row);
        }
    }
    let headers = ["requirement", "variant", "#measured", "verdict"];
    section("requirements", "Requirements", &or_none(&headers, rows, "The model file states no requirements."))
}

/// A verdict with its sign.
pub(super) fn mark(good: bool, word: &str) -> Cell {
    let (class, sign) = if good { ("good", "✓") } else { ("bad", "✗") };
    Cell::Html(format!("<span class=\"{class}\">{sign} {}</span>", escape(word)))
}

/// The energy balance of every run.
pub(super) fn energy(study: &Study) -> String {
    let rows: Vec<Vec<Cell>> = study
        .runs
        .iter()
        .map(|run| {
            let Energy { input, stored, dissipated, residual } = run.energy;
            let largest = input.abs().max(stored.abs()).max(dissipated.abs());
            let relative = if largest > 0.0 { format!("{:.1e}", (residual / largest).abs()) } else { "–".into() };
            let mut row = vec![Cell::Head(variant_label(study, run), 1)];
            row.extend([input, stored, dissipated].map(Cell::figure));
            row.push(Cell::Number(figure(residual, 2)));
            row.push(Cell::Number(relative.replace('-', "−")));
            row
        })
        .collect();
    let headers =
        ["variant", "#input [J]", "#stored [J]", "#dissipated [J]", "#residual [J]", "#residual / largest term"];
    let body = or_none(&headers, rows, "There are no runs.");
    let note = "<p class=\"hint\">input = stored + dissipated + residual. The residual is what the integration did not \
                account for; its size certifies the run.</p>\n";
    section("energy", "Energy balance", &format!("{body}{note}"))
}

/// What happened, run by run, folded away.
pub(super) fn events(study: &Study) -> String {
    let mut body = String::new();
    for run in &study.runs {
        let name = escape(&variant_label(study, run));
        body += &match run.events.len() {
            0 => format!("<p>{name}: no events</p>\n"),
            1 => format!(
                "<details><summary>{name}: 1 event</summary>\n{}</details>\n",
                event_table(&run.events, clock(study))
            ),
            count => {
                format!(
                    "<details><summary>{name}: {count} events</summary>\n{}</details>\n",
                    event_table(&run.events, clock(study))
                )
            }
        };
    }
    if study.runs.is_empty() {
        body = "<p>There are no runs.</p>\n".into();
    }
    section("events", "Events", &body)
}

fn event_table(events: &[Event], clock: Clock) -> String {
    let listed = &events[..events.len().min(EVENTS)];
    let rows: Vec<Vec<Cell>> = listed
        .iter()
        .map(|event| {
            vec![Cell::Number(format!("{:.6}", event.time * clock.per_second)), Cell::text(event.what.clone())]
        })
        .collect();
    let rest = events.len() - listed.len();
    let note = if rest > 0 {
        format!("<p class=\"hint\">The first {EVENTS} are listed; {rest} later ones are in the exported data.</p>\n")
    } else {
        String::new()
    };
    table(&[&format!("#time [{}]", clock.unit), "event"], &rows) + &note
}

/// Notes of the runs, each text once with the variants it concerns; empty if there are none.
pub(super) fn notes(study: &Study) -> String {
    let mut notes: Vec<(&String, Vec<String>)> = Vec::new();
    for run in &study.runs {
        for note in &run.notes {
            match notes.iter_mut().find(|(text, _)| *text == note) {
                Some((_, variants)) => variants.push(variant_label(study, run)),
                None => notes.push((note, vec![variant_label(study, run)])),
            }
        }
    }
    if notes.is_empty() {
        return String::new();
    }
    let item = |(text, variants): &(&String, Vec<String>)| {
        let whom = if variants.len() == study.runs.len() { "all variants".into() } else { variants.join("; ") };
        format!("<li>{} <span class=\"hint\">({})</span></li>\n", escape(text), escape(&whom))
    };
    let items: String = notes.iter().map(item).collect();
    section("notes", "Notes", &format!("<ul>\n{items}</ul>\n"))
}

/// Warnings of the model file; empty if there are none.
pub(super) fn warnings(study: &Study) -> String {
    if study.warnings.is_empty() {
        return String::new();
    }
    let items: String = study.warnings.iter().map(|warning| format!("<li>{}</li>\n", escape(warning))).collect();
    section("warnings", "Warnings", &format!("<ul class=\"warnings\">\n{items}</ul>\n"))
}

fn or_none(headers: &[&str], rows: Vec<Vec<Cell>>, none: &str) -> String {
    if rows.is_empty() { format!("<p>{none}</p>\n") } else { table(headers, &rows) }
}

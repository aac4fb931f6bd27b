//! An identification as a page.

use crate::groups::distinct;
use crate::identification_pictures as pictures;
use crate::model::{Body, Cell, Page, row, warnings};
use crate::phrases::{list, listed};
use crate::text::number;
use kardan_results::{Identification, Interval, LogRead, NamedMatrix, ResidualTest, Span, Suggestion, Suggestions};

/// More rows are counted where space is limited.
const ROWS: usize = 40;

/// The page of an identification.
pub fn page(found: &Identification) -> Page {
    let new = Body::default;
    Page {
        name: match found.model.as_str() {
            "" => "Identification".into(),
            model => format!("Identification: {model}"),
        },
        description: found.description.clone(),
        verdict: (!found.parameters.is_empty()).then(|| found.verdict()),
        alerts: warnings(&found.warnings),
        sections: Page::sections([
            super::mechanism(&found.mechanism),
            ("parameters", "Parameters", parameters(found)),
            ("fit", "Measured and predicted", new().pictures(pictures::traces(found))),
            ("friction", "Friction over speed", new().pictures(pictures::curves(found))),
            ("undetermined", "Unidentifiable parameters", undetermined(found)),
            ("residuals", "Residuals", tests(&found.tests).pictures(pictures::residuals(found))),
            ("validation", "Validation", validation(found)),
            ("candidates", "Models compared", candidates(found)),
            ("suggestions", "Terms suggested", suggestions(found)),
            ("damping", "Total damping", damping(found)),
            ("logs", "Logs", found.logs.iter().fold(new(), |body, one| body.and(log(one)))),
            ("notes", "Notes", new().list(found.notes.iter().cloned())),
        ]),
        ..Page::default()
    }
}

fn range(interval: Option<Interval>) -> String {
    interval.map_or("–".into(), |it| format!("{} … {}", number(it.lower), number(it.upper)))
}

fn parameters(found: &Identification) -> Body {
    let published = found.parameters.iter().any(|one| one.published.is_some());
    // Why there is no interval; further notes on it are below.
    let reasons = found.parameters.iter().any(|one| one.interval.is_none() && !one.remark.is_empty());
    let rows = found.parameters.iter().map(|one| {
        let name = format!("{}{}", one.name, one.combination);
        let mut row = row![name, &one.unit, one.model_value, one.value, one.standard_error, range(one.interval)];
        row.extend(published.then(|| one.published.into()));
        row.extend(reasons.then(|| if one.interval.is_none() { one.remark.as_str().into() } else { "".into() }));
        row
    });
    let interval = format!("#{} % interval", number(100.0 * found.confidence));
    let mut headers = vec!["parameter", "unit", "#in the file", "#found", "#standard error", &interval];
    headers.extend(published.then_some("#published").into_iter().chain(reasons.then_some("")));
    let remarks = found.parameters.iter().filter(|one| one.interval.is_some() && !one.remark.is_empty());
    let remarks = remarks.map(|one| format!("`{}`: {}.", one.name, one.remark));
    let table = Body::default().list(head(found)).table_of(ROWS, &headers, rows);
    table.list(remarks).pictures(pictures::intervals(found))
}

/// The identification method, a sentence each.
fn head(found: &Identification) -> Vec<String> {
    let windows = &found.windows;
    let method = match found.method.as_str() {
        "steady" => format!("{} segments of constant speed", found.samples),
        _ => format!("{} windows with filtered derivatives", found.samples),
    };
    let mut out = vec![format!(
        "Torque balance of {} at {method}, windows of {} s, by least squares ({}).",
        list(&found.coordinates, 12),
        number(found.window),
        found.loss
    )];
    let omitted = [
        (windows.incomplete, "lack samples of a channel"),
        (windows.sticking, "have a friction at rest or of unknown sign"),
        (windows.unsteady, "are not steady"),
    ];
    let omitted = omitted.into_iter().filter(|(count, _)| *count > 0).map(|(count, why)| format!("{count} {why}"));
    let omitted: Vec<String> = omitted.collect();
    if windows.all > 0 {
        let rest = if omitted.is_empty() { String::new() } else { format!(": {}", omitted.join(", ")) };
        out.push(format!("{} of {} windows are used{rest}.", windows.used, windows.all));
    }
    if !found.eliminated.is_empty() {
        out.push(format!("The torques of {} are not in the logs and were eliminated.", list(&found.eliminated, 12)));
    }
    if found.outliers > 0 {
        out.push(format!("{} outliers have no weight, or less than a tenth.", found.outliers));
    }
    out.push(format!(
        "The residuals are {} times what the sensor noise explains; condition {}, {} degrees of freedom.",
        number(found.scale),
        number(found.condition),
        found.degrees_of_freedom
    ));
    out
}

fn undetermined(found: &Identification) -> Body {
    Body::default()
        .part(
            "By the structure of the model, for any log of these signals",
            Body::default().list(found.unidentifiable.structurally.iter().cloned()),
        )
        .part("By these data", Body::default().list(found.unidentifiable.practically.iter().cloned()))
        .pictures(pictures::correlation(found))
}

/// A probability, however small.
fn likelihood(probability: f64) -> String {
    if probability >= 1e-4 { format!("{probability:.4}") } else { "below 0.0001".into() }
}

/// Residual tests.
fn tests(all: &[ResidualTest]) -> Body {
    let rows = all.iter().map(|test| {
        row![
            &test.hypothesis,
            likelihood(test.probability),
            if test.if_rejected.is_empty() { "passes" } else { &test.if_rejected }
        ]
    });
    Body::default().table_of(ROWS, &["if the model is right", "#probability", "verdict"], rows)
}

fn validation(found: &Identification) -> Body {
    if found.validation.is_empty() {
        return Body::default();
    }
    let rows = found.validation.iter().map(|one| {
        let fit = percent(one.torque, one.cross_validated);
        row![&one.row, &one.unit, one.torque, one.in_sample, one.cross_validated, fit]
    });
    Body::default()
        .hint(
            "A fit without the segment predicted each segment once (five folds). Root mean squares; fit = 1 − \
             residual / torque.",
        )
        .table_of(
            ROWS,
            &["row", "unit", "#torque explained", "#residual, fitted", "#residual, left out", "#fit, left out"],
            rows,
        )
}

fn candidates(found: &Identification) -> Body {
    if found.candidates.is_empty() {
        return Body::default();
    }
    let rows = found.candidates.iter().map(|one| {
        let error = one.error.filter(|error| error.mean.is_finite());
        let error = error.map_or("–".into(), |error| format!("{} ± {}", number(error.mean), number(error.spread)));
        let verdict = if one.chosen { "simplest within one standard error of the best" } else { &one.failure };
        row![&one.name, one.parameters.join(", "), error, verdict]
    });
    Body::default()
        .hint(
            "Errors on segments left out of the fit, in standard deviations of the sensors, with their standard error over five \
             folds. A parameter that a model lacks is zero in it.",
        )
        .table_of(ROWS, &["model", "parameters", "#error", ""], rows)
}

/// `86.47 %`, one minus the residual over the torque.
fn percent(torque: f64, residual: Option<f64>) -> String {
    let explained = residual.filter(|residual| torque > 0.0 && residual.is_finite());
    explained.map_or("–".into(), |residual| format!("{:.2} %", 100.0 * (1.0 - residual / torque)))
}

fn suggestions(found: &Identification) -> Body {
    let Some(suggested) = &found.suggestions else { return Body::default() };
    let [mut body, with_terms] = match suggested.selected_terms.is_empty() {
        true => [nothing_suggested(suggested), Body::default()],
        false => [gain(found, suggested), extended(suggested, found.confidence)],
    };
    let part = |x: Option<f64>| x.map_or("–".into(), |x| format!("{:.2} %", 100.0 * x));
    let is_listed = |one: &&Suggestion| one.gain.is_some() || one.probability.is_none();
    let tried = suggested.tested_terms.iter().filter(is_listed).map(|one| {
        let gain = match one.gain_spread {
            Some(_) => format!("{} ± {}", part(one.gain), part(one.gain_spread)),
            None => "–".into(),
        };
        let probability = one.probability.map_or("–".into(), likelihood);
        row![one.round, &one.term, one.parameters, &one.raised_by, probability, gain, &one.verdict]
    });
    let headers = ["round", "term", "#parameters", "suggested by", "#probability", "#gain", "verdict"];
    body = body.table_of(ROWS, &headers, tried);
    body = body.paragraph(silent(suggested));
    if !suggested.tested_terms.is_empty() {
        body = body.hint(
            "The tests that reject a model suggest terms; each round takes the term with the largest gain per \
             parameter. Probability: of so large a term or a larger one if the true term is zero; terms below 1 %, \
             for all terms of a round together, are significant. Gain: the part of the mean square error on left-out \
             segments that a term removes, with its standard error over five folds; it must be above zero by 2.1 \
             standard errors, and at least 1 %.",
        );
    }
    let lines = suggested.text.lines().map(|line| vec![Cell::Verbatim(line.into())]);
    body.table_of(ROWS, &["what to write into the model file"], lines).part("With the terms taken", with_terms)
}

/// Why no term is suggested.
fn nothing_suggested(suggested: &Suggestions) -> Body {
    let why = match (suggested.tested_terms.is_empty(), suggested.failed_tests()) {
        (_, 0) => "No residual test rejects the model: kardan suggests nothing.",
        (true, _) => "kardan has no term to try for the tests that reject the model.",
        _ => "No term that was tried predicts left-out segments better.",
    };
    Body::default().judge(suggested.failed_tests() == 0, why)
}

/// What the suggested terms improve.
fn gain(found: &Identification, suggested: &Suggestions) -> Body {
    let mut body = Body::default();
    for (now, then) in found.validation.iter().zip(&suggested.validation) {
        body = body.paragraph(format!(
            "With {}, the fit on left-out segments of {} is {} ({} without).",
            list(&suggested.selected_terms, 12),
            now.row,
            percent(then.torque, then.cross_validated),
            percent(now.torque, now.cross_validated),
        ));
    }
    let torque = |row: &str| found.validation.iter().find(|one| one.row == row).map_or(0.0, |one| one.torque);
    for one in &suggested.log_cross_validation {
        let [before, after] = [one.before, one.after].map(|residual| percent(torque(&one.row), Some(residual)));
        body = body.paragraph(format!(
            "Whole logs left out of the fit: {} {after} ({before} without), without terms of single logs.",
            one.row
        ));
    }
    let summary = match suggested.failed_tests() {
        0 => "All residual tests then pass.".to_string(),
        1 => "One residual test still rejects the model.".into(),
        many => format!("{many} residual tests still reject the model."),
    };
    let scale = number(suggested.scale);
    body.judge(suggested.failed_tests() == 0, summary)
        .paragraph(format!("The residuals then are {scale} times what the sensor noise explains."))
}

/// Terms that were tried and are not significantly different from zero.
fn silent(suggested: &Suggestions) -> String {
    let all = &suggested.tested_terms;
    let has_gain = |term: &String| all.iter().any(|other| other.term == *term && other.gain.is_some());
    let silent = all.iter().filter(|one| one.probability.is_some() && !has_gain(&one.term));
    let mut names = distinct(silent.map(|one| one.term.clone()));
    if suggested.insignificant_harmonics > 0 {
        names.push(format!("{} harmonics of angles", suggested.insignificant_harmonics));
    }
    let orders = match suggested.harmonic_orders.as_slice() {
        [] => String::new(),
        orders => {
            let periods: Vec<String> = orders.iter().map(|order| number(*order)).collect();
            format!(" Harmonics were tried with {} periods per revolution, no others.", list(&periods, 40))
        }
    };
    let not_tried: String = suggested.untested_terms.iter().map(|one| format!(" Not tried: {one}.")).collect();
    let silent = listed("Tried, and not significantly different from zero", names, 40).unwrap_or_default();
    format!("{silent}{orders}{not_tried}")
}

/// The identification with the suggested terms, and its residuals.
fn extended(suggested: &Suggestions, confidence: f64) -> Body {
    let rows = suggested.parameters.iter().map(|one| {
        let name = format!("{}{}", one.name, one.combination);
        row![name, &one.unit, one.value, one.standard_error, range(one.interval), &one.remark]
    });
    let interval = format!("#{} % interval", number(100.0 * confidence));
    let headers = ["parameter", "unit", "#found", "#standard error", &interval, ""];
    Body::default().table_of(ROWS, &headers, rows).and(tests(&suggested.tests))
}

fn damping(found: &Identification) -> Body {
    let Some(damping) = &found.damping else { return Body::default() };
    let sentence = if damping.passive {
        "Passive as a whole: every motion loses energy, or none, even where the damping of a single shaft is below zero."
    } else {
        "Not passive: some motion would gain energy."
    };
    let matrix = NamedMatrix {
        title: "identified reduced damping".into(),
        unit: damping.unit.clone(),
        rows: damping.coordinates.clone(),
        columns: damping.coordinates.clone(),
        values: damping.values.clone(),
    };
    Body::default().paragraph(sentence).matrices([&matrix])
}

fn log(log: &LogRead) -> Body {
    let rows = log.channels.iter().map(|one| {
        let noise = format!("{} {}{}", number(one.noise), one.si, if one.stated { " (stated)" } else { "" });
        row![&one.name, &one.unit, &one.signal, format!("{} s", number(one.sample_time)), noise]
    });
    let Span { start: from, end: until } = log.span.unwrap_or(Span { start: f64::NAN, end: f64::NAN });
    let length = format!("{}: {} rows, {} s to {} s", log.name, log.rows, number(from), number(until));
    Body::default().paragraph(length).list(log.remarks.iter().cloned()).table_of(
        ROWS,
        &["channel", "unit", "signal", "#sample time", "#noise of a sample"],
        rows,
    )
}

//! An identification as a page.

use crate::identification_pictures as pictures;
use crate::model::{Body, Page, row, warnings};
use crate::text::number;
use crate::words::list;
use kardan::results::{Identification, LogRead, NamedMatrix, Span};

/// More rows are counted where there is little room.
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
            ("undetermined", "What cannot be told", undetermined(found)),
            ("residuals", "What is left over", residuals(found)),
            ("validation", "Validation", validation(found)),
            ("candidates", "Models compared", candidates(found)),
            ("damping", "Damping as a whole", damping(found)),
            ("logs", "Logs", found.logs.iter().fold(new(), |body, one| body.and(log(one)))),
            ("notes", "Notes", new().list(found.notes.iter().cloned())),
        ]),
        data: None,
    }
}

fn parameters(found: &Identification) -> Body {
    let published = found.parameters.iter().any(|one| one.published.is_some());
    let rows = found.parameters.iter().map(|one| {
        let name = format!("{}{}", one.name, one.combination);
        let interval = one.interval.map_or("–".into(), |it| format!("{} … {}", number(it.lower), number(it.upper)));
        let mut row = row![name, one.unit, one.before, one.value, one.standard_error, interval];
        row.extend(published.then(|| one.published.into()));
        row.push(one.remark.as_str().into());
        row
    });
    let interval = format!("#{} % interval", number(100.0 * found.confidence));
    let mut headers = vec!["parameter", "unit", "#in the file", "#found", "#standard error", &interval];
    headers.extend(published.then_some("#published").into_iter().chain([""]));
    Body::default().list(head(found)).table_of(ROWS, &headers, rows).pictures(pictures::intervals(found))
}

/// How it was found, a sentence each.
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
    let mut left = Vec::new();
    for (count, why) in [
        (windows.incomplete, "lack samples of a channel"),
        (windows.resting, "have a friction at rest or of unknown sign"),
        (windows.moving, "are not steady"),
    ] {
        if count > 0 {
            left.push(format!("{count} {why}"));
        }
    }
    if windows.all > 0 {
        let rest = if left.is_empty() { String::new() } else { format!(": {}", left.join(", ")) };
        out.push(format!("{} of {} windows are used{rest}.", windows.used, windows.all));
    }
    if !found.eliminated.is_empty() {
        out.push(format!("The torques of {} are not in the logs and were eliminated.", list(&found.eliminated, 12)));
    }
    if found.outliers > 0 {
        out.push(format!("{} outliers count for nothing, or for less than a tenth.", found.outliers));
    }
    out.push(format!(
        "What is left over is {} times what the noise of the sensors explains; condition {}, {} degrees of freedom.",
        number(found.scale),
        number(found.condition),
        found.freedom
    ));
    out
}

fn undetermined(found: &Identification) -> Body {
    Body::default()
        .part(
            "By the structure of the model, whatever is logged in this way",
            Body::default().list(found.not_determined.by_structure.iter().cloned()),
        )
        .part("By these data", Body::default().list(found.not_determined.by_data.iter().cloned()))
        .pictures(pictures::correlation(found))
}

fn residuals(found: &Identification) -> Body {
    let rows = found.tests.iter().map(|test| {
        let likely = test.probability >= 1e-4;
        let probability = if likely { format!("{:.4}", test.probability) } else { "below 0.0001".into() };
        row![&test.what, probability, if test.meaning.is_empty() { "holds" } else { &test.meaning }]
    });
    Body::default()
        .table_of(ROWS, &["if the model is right", "#probability", "verdict"], rows)
        .pictures(pictures::residuals(found))
}

fn validation(found: &Identification) -> Body {
    if found.validation.is_empty() {
        return Body::default();
    }
    let rows = found.validation.iter().map(|one| {
        let unseen = one.unseen.filter(|unseen| one.torque > 0.0 && unseen.is_finite());
        let fit = unseen.map_or("–".into(), |unseen| format!("{:.2} %", 100.0 * (1.0 - unseen / one.torque)));
        row![&one.row, one.torque, one.seen, one.unseen, fit]
    });
    Body::default()
        .hint(
            "Every segment was predicted once by a fit that had not seen it (five folds). Root mean squares in N m; the fit is \
             one less the residual over the torque.",
        )
        .table_of(ROWS, &["row", "#torque explained", "#residual, seen", "#residual, unseen", "#fit, unseen"], rows)
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
             folds. Parameters that a model does not have are zero in it.",
        )
        .table_of(ROWS, &["model", "parameters", "#error", ""], rows)
}

fn damping(found: &Identification) -> Body {
    let Some(damping) = &found.damping else { return Body::default() };
    let sentence = if damping.passive {
        "Passive as a whole: every motion loses energy, or none, even where the damping of a single shaft is below zero."
    } else {
        "Not passive: some motion would gain energy."
    };
    let matrix = NamedMatrix {
        title: "reduced damping as found".into(),
        unit: "N m s/rad".into(),
        rows: damping.coordinates.clone(),
        columns: damping.coordinates.clone(),
        values: damping.values.clone(),
    };
    Body::default().say(sentence).matrices([&matrix])
}

fn log(log: &LogRead) -> Body {
    let rows = log.channels.iter().map(|one| {
        let noise = format!("{} {}{}", number(one.noise), one.si, if one.stated { " (stated)" } else { "" });
        row![&one.name, &one.unit, &one.signal, format!("{} s", number(one.sample_time)), noise]
    });
    let Span { from, until } = log.span.unwrap_or(Span { from: f64::NAN, until: f64::NAN });
    let length = format!("{}: {} rows, {} s to {} s", log.name, log.rows, number(from), number(until));
    Body::default().say(length).list(log.remarks.iter().cloned()).table_of(
        ROWS,
        &["channel", "unit", "signal", "#sample time", "#noise of a sample"],
        rows,
    )
}

//! An identification as a page.

use crate::identification_pictures as pictures;
use crate::model::{Body, Cell, Page, cells, row, warnings};
use crate::text::number;
use crate::words::identification as said;
use kardan::results::{FoundDamping, Identification, LogRead};

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
        let [name, unit, before, value, error, interval, elsewhere, remark] = said::parameter(one);
        let row = row![name, unit, before, value, error, interval].into_iter();
        row.chain(published.then_some(elsewhere).into_iter().chain([remark]).map(Cell::Text)).collect()
    });
    let interval = format!("#{} % interval", number(100.0 * found.confidence));
    let mut headers = vec!["parameter", "unit", "#in the file", "#found", "#standard error", &interval];
    headers.extend(published.then_some("#published").into_iter().chain([""]));
    Body::default().list(said::head(found)).table_of(ROWS, &headers, rows).pictures(pictures::intervals(found))
}

fn undetermined(found: &Identification) -> Body {
    Body::default()
        .part(
            "By the structure of the model, whatever is logged in this way",
            Body::default().list(found.structural.iter().cloned()),
        )
        .part("By these data", Body::default().list(found.weak.iter().cloned()))
        .pictures(pictures::correlation(found))
}

fn residuals(found: &Identification) -> Body {
    let rows = found.tests.iter().map(|test| cells(said::test(test)));
    Body::default()
        .table_of(ROWS, &["if the model is right", "#probability", "verdict"], rows)
        .pictures(pictures::residuals(found))
}

fn validation(found: &Identification) -> Body {
    if found.validation.is_empty() {
        return Body::default();
    }
    let rows = found.validation.iter().map(|one| cells(said::validation(one)));
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
    let rows = found.candidates.iter().map(|one| cells(said::candidate(one)));
    Body::default()
        .hint(
            "Errors on segments left out of the fit, in standard deviations of the sensors, with their standard error over five \
             folds. Parameters that a model does not have are zero in it.",
        )
        .table_of(ROWS, &["model", "parameters", "#error", ""], rows)
}

fn damping(found: &Identification) -> Body {
    let Some(FoundDamping { matrix, passive }) = &found.damping else { return Body::default() };
    let sentence = if *passive {
        "Passive as a whole: every motion loses energy, or none, even where the damping of a single shaft is below zero."
    } else {
        "Not passive: some motion would gain energy."
    };
    Body::default().say(sentence).matrices([matrix])
}

fn log(log: &LogRead) -> Body {
    let rows = said::channels(log).into_iter().map(cells);
    Body::default().say(said::log(log)).list(log.remarks.iter().cloned()).table_of(
        ROWS,
        &["channel", "unit", "signal", "#sample time", "#noise of a sample"],
        rows,
    )
}

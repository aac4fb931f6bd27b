//! The page of an identification.

use super::analysis::{items, paragraph, rows_of, titled};
use super::identification_pictures as pictures;
use super::summary::matrices;
use super::table::{Cell, section};
use super::text::{escape, figure, unit};
use super::words::identification as said;
use kardan::results::Identification;

fn number(value: f64) -> String {
    figure(value, 5)
}

/// What stands above the contents: a box for each warning.
pub(super) fn alerts(found: &Identification) -> String {
    let alert = |text: &String| {
        format!("<div class=\"failure\" role=\"alert\"><strong>Warning:</strong> {}</div>\n", escape(text))
    };
    found.warnings.iter().map(alert).collect()
}

/// The sections of the page.
pub(super) fn sections(found: &Identification) -> Vec<String> {
    let all = [
        ("parameters", "Parameters", parameters(found)),
        ("fit", "Measured and predicted", pictures::traces(found)),
        ("friction", "Friction over speed", pictures::curves(found)),
        ("undetermined", "What cannot be told", undetermined(found)),
        ("residuals", "What is left over", residuals(found)),
        ("validation", "Validation", validation(found)),
        ("candidates", "Models compared", candidates(found)),
        ("damping", "Damping as a whole", damping(found)),
        ("logs", "Logs", logs(found)),
        ("notes", "Notes", items(&found.notes)),
    ];
    let there = all.into_iter().filter(|(_, _, body)| !body.is_empty());
    there.map(|(anchor, title, body)| section(anchor, title, &body)).collect()
}

fn parameters(found: &Identification) -> String {
    let rows = found.parameters.iter().map(|one| {
        let [name, units, before, value, error, interval, published, remark] = said::parameter(one, number);
        let mut row = vec![Cell::Head(name, 1), Cell::text(unit(&units))];
        row.extend([before, value, error].map(Cell::Number));
        row.push(Cell::Number(interval));
        row.push(Cell::Number(published));
        row.push(Cell::text(remark));
        row
    });
    let interval = format!("#{} % interval", figure(100.0 * found.confidence, 4));
    let headers = ["parameter", "unit", "#in the file", "#found", "#standard error", &interval, "#published", ""];
    items(&said::head(found, number)) + &rows_of(&headers, rows.collect()) + &pictures::intervals(found)
}

fn undetermined(found: &Identification) -> String {
    titled("By the structure of the model, whatever is logged in this way", &items(&found.structural))
        + &titled("By these data", &items(&found.weak))
        + &pictures::correlation(found)
}

fn residuals(found: &Identification) -> String {
    let rows = found.tests.iter().map(|test| {
        let [what, probability, meaning] = said::test(test);
        vec![Cell::Head(what, 1), Cell::Number(probability), Cell::text(meaning)]
    });
    rows_of(&["if the model is right", "#probability", "verdict"], rows.collect()) + &pictures::residuals(found)
}

fn validation(found: &Identification) -> String {
    let rows: Vec<Vec<Cell>> = found
        .validation
        .iter()
        .map(|one| {
            let [row, torque, seen, unseen, fit] = said::validation(one, number);
            let mut cells = vec![Cell::Head(row, 1)];
            cells.extend([torque, seen, unseen, fit].map(Cell::Number));
            cells
        })
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    paragraph(
        "Every segment was predicted once by a fit that had not seen it (five folds). Root mean squares in N m; the fit is one \
         less the residual over the torque.",
    ) + &rows_of(&["row", "#torque explained", "#residual, seen", "#residual, unseen", "#fit, unseen"], rows)
}

fn candidates(found: &Identification) -> String {
    let rows: Vec<Vec<Cell>> = found
        .candidates
        .iter()
        .map(|one| {
            let [name, parameters, error, verdict] = said::candidate(one, number);
            vec![Cell::Head(name, 1), Cell::text(parameters), Cell::Number(error), Cell::text(verdict)]
        })
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    paragraph(
        "Errors on segments left out of the fit, in standard deviations of the sensors, with their standard error over five \
         folds. Parameters that a model does not have are zero in it.",
    ) + &rows_of(&["model", "parameters", "#error", ""], rows)
}

fn damping(found: &Identification) -> String {
    let Some((matrix, passive)) = &found.damping else { return String::new() };
    let sentence = if *passive {
        "Every motion loses energy, or none: the damping is passive as a whole, even where that of a single shaft is below zero."
    } else {
        "Some motion would gain energy: the damping is not passive."
    };
    paragraph(sentence) + &matrices(std::slice::from_ref(matrix))
}

fn logs(found: &Identification) -> String {
    let one = |log: &kardan::results::LogRead| {
        let rows = said::channels(log, number).into_iter().map(|[name, units, signal, time, noise]| {
            vec![
                Cell::Head(name, 1),
                Cell::text(unit(&units)),
                Cell::text(signal),
                Cell::Number(time),
                Cell::Number(noise),
            ]
        });
        let headers = ["channel", "unit", "signal", "#sample time", "#noise of a sample"];
        paragraph(&said::log(log, number)) + &items(&log.remarks) + &rows_of(&headers, rows.collect())
    };
    found.logs.iter().map(one).collect()
}

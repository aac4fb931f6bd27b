//! A study on a virtual bench, and the plan of its experiment, as pages.

use crate::bench_pictures::response;
use crate::model::{Body, Cell, Page, Section, cells, row, warnings};
use crate::text::figure;
use crate::text::number;
use crate::words::bench as said;
use kardan::results::{BenchPlan, BenchStudy, Experiment};

use super::{design, identification};

/// The page of a study.
pub fn page(study: &BenchStudy) -> Page {
    let closed_loop = &study.closed_loop;
    let experiments = closed_loop.experiments.iter().enumerate().map(|(k, experiment)| {
        (format!("experiment-{}", k + 1), format!("Simulation and bench: {}", experiment.name), pair(study, experiment))
    });
    let notes = study.notes.iter().chain(&closed_loop.notes).cloned();
    let rest = [
        ("differences", "What makes them differ", differences(study)),
        ("truth", "Found and true", truth(study)),
        ("excitation", "Excitation", plan_of(&study.plan)),
        ("bench-notes", "Notes of the bench", Body::default().list(notes)),
    ];
    let rest = rest.map(|(anchor, title, body)| (anchor.to_owned(), title.to_owned(), body));
    let all: Vec<(String, String, Body)> = experiments.chain(rest).collect();
    let all = all.iter().map(|(anchor, title, body)| (anchor.as_str(), title.as_str(), body.clone()));
    let design = &closed_loop.design;
    let mut sections = Page::sections(all);
    sections.extend(identification::page(&study.identification).sections.into_iter().map(Section::detail));
    let title = format!("Design of {}", design.controller);
    sections.push(design::page(design).within("design-1", &title, ""));
    Page {
        name: format!("Bench: {}", study.model),
        description: study.description.clone(),
        verdict: Some(said::verdict(study)),
        alerts: warnings(&[&study.identification.warnings[..], &design.warnings].concat()),
        sections,
        data: None,
    }
}

/// The plan of an experiment, without what the plant has, and what is to be noted.
pub fn plan(model: &str, plan: Option<&BenchPlan>, notes: &[String]) -> Page {
    Page {
        name: format!("Bench of {model}"),
        sections: Page::sections([
            ("excitation", "Excitation", plan.map(plan_of).unwrap_or_default()),
            ("bench-notes", "Notes of the bench", Body::default().list(notes.iter().cloned())),
        ]),
        ..Page::default()
    }
}

/// Each output in the simulation and on the bench, side by side on the same axes.
fn pair(study: &BenchStudy, experiment: &Experiment) -> Body {
    let headers = [
        "output",
        "unit",
        "#settles: simulation",
        "#bench",
        "#farthest from reference: simulation",
        "#bench",
        "#distance",
        "#at s",
    ];
    let rows = experiment.responses.iter().map(|one| cells(said::response(one)));
    Body::default().pictures(experiment.responses.iter().map(|one| response(study, experiment, one))).table_of(
        usize::MAX,
        &headers,
        rows,
    )
}

fn differences(study: &BenchStudy) -> Body {
    let mut body = Body::default().list(said::causes(&study.closed_loop));
    for experiment in &study.closed_loop.experiments {
        let responses = &experiment.responses;
        let Some(first) = responses.first() else { continue };
        let mut headers = vec!["difference".to_string()];
        for one in responses {
            headers.extend([format!("#{}, {}: alone", one.output, one.physical.unit()), "#bench without it".into()]);
        }
        let mut all = row!["all"];
        all.extend(responses.iter().flat_map(|one| row![one.distance, "–"]));
        let rows = first.differences.iter().enumerate().map(|(k, difference)| {
            let both = responses.iter().flat_map(|one| row![one.differences[k].alone, one.differences[k].without]);
            row![&difference.what].into_iter().chain(both).collect()
        });
        let title = format!("Largest distance from the simulation: {}", experiment.name);
        body = body.part(&title, Body::default().table(&headers, std::iter::once(all).chain(rows)));
    }
    if body.0.is_empty() {
        return body;
    }
    let hint = format!(
        "Largest distances from the simulation within {} s after each event. Each number is a run of its own: with this difference \
         alone put into the simulation, and with it alone taken from the bench.",
        number(study.closed_loop.transient)
    );
    Body::default().hint(hint).and(body)
}

fn truth(study: &BenchStudy) -> Body {
    let rows = said::compared(study).into_iter().map(|(found, truth)| {
        let [name, unit, before, value, found_value, interval, _] = said::parameter(found, truth);
        let good = said::inside(found, truth.value);
        let held = Cell::Mark(good, if good { "inside" } else { "outside" }.into());
        row![name, unit, before, value, found_value, interval, held]
    });
    let interval = format!("#{} % interval", number(100.0 * study.identification.confidence));
    let headers = ["parameter", "unit", "#in the file", "#true", "#found", &interval, "the true value is"];
    Body::default().table_of(usize::MAX, &headers, rows)
}

fn plan_of(plan: &BenchPlan) -> Body {
    let parameters = plan.parameters.iter().map(|one| {
        let error = one.standard_error.map_or("–".to_string(), |error| format!("{error:.2e}"));
        row![&one.name, format!("{:.4e}", one.nominal), error, one.unit.to_string()]
    });
    let unknown = plan.parameters.iter().any(|one| one.standard_error.is_none());
    let unknown = if unknown {
        "No noise of the torques is stated (`torque_noise`), so no standard errors can be promised."
    } else {
        ""
    };
    let speeds = plan.shafts.iter().map(|name| format!("#{name}.w"));
    let torques = plan.motors.iter().map(|name| format!("#{name}.tau"));
    let headers: Vec<String> =
        ["#from s", "#until s"].map(String::from).into_iter().chain(speeds).chain(torques).collect();
    let points = plan.points.iter().map(|point| {
        let numbers = [point.from, point.until].into_iter().chain(point.speeds.iter().chain(&point.torques).copied());
        numbers.map(|x| Cell::Text(figure(x, 6))).collect()
    });
    let dwell = match plan.kind.as_str() {
        "constant_speeds" => "Other seeds hold each speed for other times, never for less than the dwell.",
        _ => "",
    };
    let parameters = Body::default()
        .table_of(usize::MAX, &["parameter", "#of the model", "#standard error", "unit"], parameters)
        .say(unknown);
    let points = Body::default().table_of(usize::MAX, &headers, points);
    let hint = if points.0.is_empty() { "" } else { "Speeds in rad/s; torques in N m as the model expects them." };
    Body::default()
        .list(said::plan(plan))
        .part("What the log is to tell", parameters)
        .part("Points", points.hint(hint).hint(dwell))
}

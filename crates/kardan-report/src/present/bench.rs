//! A study on a virtual bench, and the plan of its experiment, as pages.

use crate::bench_pictures::pictured;
use crate::charts;
use crate::model::{Block, Body, Cell, Page, Section, row, warnings};
use crate::phrases::listed;
use crate::text::{figure, number};
use kardan_results::{
    BenchPlan, BenchStudy, ClosedLoop, Experiment, IdentifiedParameter, Interval, Response, TrueValue, Verdict,
};

use super::{design, identification};

/// Differences with less than this fraction of the largest effect are not named in a sentence.
const SMALL: f64 = 0.1;
/// Distances below this fraction of the output's size elsewhere are rounding.
const ROUNDING: f64 = 1e-6;

/// The page of a study.
pub fn page(study: &BenchStudy) -> Page {
    let closed_loop = &study.closed_loop;
    let pictured = pictured(study);
    let (data, drawn) = rayon::join(|| charts::data(&pictured), || crate::svg::plots(&pictured));
    let all = pictured.plots.iter().zip(&drawn).enumerate();
    let mut charts = all.map(|(k, (plot, picture))| Block::Chart(charts::chart(k, plot, picture)));
    let experiments = closed_loop.experiments.iter().enumerate().map(|(k, experiment)| {
        let own = Body(charts.by_ref().take(experiment.responses.len()).collect());
        let title = format!("Simulation and bench: {}", experiment.name);
        (format!("experiment-{}", k + 1), title, own.and(pair(experiment)))
    });
    let notes = study.notes.iter().chain(&closed_loop.notes).cloned();
    let rest = [
        ("differences", "Causes of the differences", differences(study)),
        ("truth", "Identified and true values", truth(study)),
        ("excitation", "Excitation", plan_of(&study.plan)),
        ("bench-notes", "Notes of the bench", Body::default().list(notes)),
    ];
    let design = &closed_loop.design;
    let mut sections = Page::sections([super::mechanism(&design.mechanism)]);
    sections.extend(Page::sections(experiments));
    sections.extend(Page::sections(rest));
    let found = identification::page(&study.identification).sections.into_iter();
    sections.extend(found.filter(|one| one.anchor != Section::MECHANISM).map(Section::detail));
    let title = format!("Design of {}", design.controller);
    sections.push(design::page(design).into_section("design-1", &title, ""));
    Page {
        name: format!("Bench: {}", study.model),
        description: study.description.clone(),
        verdict: Some(verdict(study)),
        alerts: warnings(&[&study.identification.warnings[..], &design.warnings].concat()),
        sections,
        data: Some(data),
        ..Page::default()
    }
}

/// The plan of an experiment, without the true plant, and notes.
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

/// The result in one sentence; `true` if every run completed and every interval contains the true value.
fn verdict(study: &BenchStudy) -> Verdict {
    let compared = compared(study);
    let covered = compared.iter().filter(|(found, truth)| inside(found, truth.value)).count();
    let whole = study.closed_loop.notes.is_empty();
    let ran = if whole { "every run completed" } else { "some runs ended early" };
    let text = format!(
        "{covered} of {} intervals contain the true value; under `{}` {ran}.",
        compared.len(),
        study.closed_loop.design.controller
    );
    Verdict { sound: whole && covered == compared.len(), text }
}

/// Identified parameters with known true values.
fn compared(study: &BenchStudy) -> Vec<(&IdentifiedParameter, &TrueValue)> {
    let truth = |found: &IdentifiedParameter| {
        study.truth.iter().find(|one| one.name == found.name && found.combination.is_empty())
    };
    study.identification.parameters.iter().filter_map(|found| Some((found, truth(found)?))).collect()
}

/// Whether the interval of a parameter contains a value.
fn inside(found: &IdentifiedParameter, value: f64) -> bool {
    found.interval.is_some_and(|it| (it.lower..=it.upper).contains(&value))
}

/// Each output in the simulation and on the bench.
fn pair(experiment: &Experiment) -> Body {
    let headers = [
        "output",
        "unit",
        "#settles: simulation",
        "#bench",
        "#largest deviation from reference: simulation",
        "#bench",
        "#distance",
        "#at s",
    ];
    let rows = experiment.responses.iter().map(|one| {
        let Response { steady_state, max_deviation, .. } = one;
        row![
            &one.output,
            one.physical.unit(),
            steady_state.simulation,
            steady_state.bench,
            max_deviation.simulation,
            max_deviation.bench,
            one.max_difference,
            one.distance_at,
        ]
    });
    Body::default().table_of(usize::MAX, &headers, rows)
}

/// Causes of the differences between bench and simulation, a sentence for each output that differs.
fn causes(found: &ClosedLoop) -> Vec<String> {
    let mut out = Vec::new();
    let everywhere = || found.experiments.iter().flat_map(|experiment| &experiment.responses);
    let size = |output: &str| {
        everywhere().filter(|one| one.output == output).map(|one| one.max_deviation.bench).fold(0.0_f64, f64::max)
    };
    for experiment in &found.experiments {
        let differs = |one: &&Response| one.max_difference > ROUNDING * size(&one.output);
        for one in experiment.responses.iter().filter(differs) {
            let unit = one.physical.unit();
            let mut by: Vec<_> =
                one.differences.iter().filter_map(|by| Some((&by.source, by.added_to_simulation?))).collect();
            by.sort_by(|a, b| b.1.total_cmp(&a.1));
            let least = by.first().map_or(0.0, |first| SMALL * first.1);
            by.retain(|by| by.1 > least);
            let by: Vec<String> = by.iter().map(|(what, added)| format!("{what} ({})", number(*added))).collect();
            let by = match by.is_empty() {
                true => "no single difference causes any of it".to_string(),
                false => format!("single causes: {}", by.join("; ")),
            };
            out.push(format!(
                "{}, {}: the bench is up to {} {unit} from the simulation; {by}.",
                experiment.name,
                one.output,
                number(one.max_difference)
            ));
        }
    }
    out
}
fn differences(study: &BenchStudy) -> Body {
    let mut body = Body::default().list(causes(&study.closed_loop));
    for experiment in &study.closed_loop.experiments {
        let responses = &experiment.responses;
        let Some(first) = responses.first() else { continue };
        let mut headers = vec!["difference".to_string()];
        for one in responses {
            headers.extend([format!("#{}, {}: alone", one.output, one.physical.unit()), "#bench without it".into()]);
        }
        let mut all = row!["all"];
        all.extend(responses.iter().flat_map(|one| row![one.max_difference, "–"]));
        let rows = first.differences.iter().enumerate().map(|(k, difference)| {
            let both = responses
                .iter()
                .flat_map(|one| row![one.differences[k].added_to_simulation, one.differences[k].removed_from_bench]);
            row![&difference.source].into_iter().chain(both).collect()
        });
        let title = format!("Largest deviation from the simulation: {}", experiment.name);
        body = body.part(&title, Body::default().table(&headers, std::iter::once(all).chain(rows)));
    }
    if body.0.is_empty() {
        return body;
    }
    let hint = format!(
        "Largest deviations from the simulation within {} s after each event. Each number is from a separate run: \
         with only this difference added to the simulation, or only it removed from the bench.",
        number(study.closed_loop.transient)
    );
    Body::default().hint(hint).and(body)
}

fn truth(study: &BenchStudy) -> Body {
    let rows = compared(study).into_iter().map(|(found, truth)| {
        let Interval { lower, upper } = found.interval.unwrap_or(Interval { lower: f64::NAN, upper: f64::NAN });
        let interval = format!("{} … {}", number(lower), number(upper));
        let covered = Cell::judged(inside(found, truth.value), ["inside", "outside"]);
        row![&found.name, &found.unit, found.model_value, truth.value, found.value, interval, covered]
    });
    let interval = format!("#{} % interval", number(100.0 * study.identification.confidence));
    let headers = ["parameter", "unit", "#in the file", "#true", "#found", &interval, "the true value is"];
    Body::default().table_of(usize::MAX, &headers, rows)
}

/// The plan in sentences.
fn plan_sentences(plan: &BenchPlan) -> Vec<String> {
    let mut out = vec![
        format!(
            "{}: {} points of {} within the limits, {} s in total.",
            plan.kind.replace('_', " "),
            plan.points.len(),
            plan.candidates,
            number(plan.duration)
        ),
        format!(
            "ln det(XᵀX) = {}; as many points spread evenly over all candidates have {}: for the same precision that \
             plan takes {} times as long.",
            number(plan.log_det),
            number(plan.undesigned_log_det),
            number(plan.gain)
        ),
    ];
    out.extend(listed("Taken from the model", &plan.fixed, usize::MAX));
    out
}

fn plan_of(plan: &BenchPlan) -> Body {
    let parameters = plan.parameters.iter().map(|one| {
        let error = one.standard_error.map_or("–".to_string(), |error| format!("{error:.2e}"));
        row![&one.name, format!("{:.4e}", one.nominal), error, one.unit.to_string()]
    });
    let unknown = plan.parameters.iter().any(|one| one.standard_error.is_none());
    let unknown = if unknown {
        "The torque noise (`torque_noise`) is not stated, so kardan cannot predict standard errors."
    } else {
        ""
    };
    let first = plan.points.first();
    let speeds = first.into_iter().flat_map(|point| &point.speeds).map(|one| format!("#{}.w", one.name));
    let torques = first.into_iter().flat_map(|point| &point.torques).map(|one| format!("#{}.tau", one.name));
    let headers: Vec<String> =
        ["#from s", "#until s"].map(String::from).into_iter().chain(speeds).chain(torques).collect();
    let points = plan.points.iter().map(|point| {
        let motion = point.speeds.iter().chain(&point.torques).map(|one| one.value);
        let numbers = [point.from, point.until].into_iter().chain(motion);
        numbers.map(|x| Cell::Text(figure(x, 6))).collect()
    });
    let dwell = match plan.kind.as_str() {
        "constant_speeds" => "Other seeds change how long each speed lasts, never to less than the dwell.",
        _ => "",
    };
    let parameters = Body::default()
        .table_of(usize::MAX, &["parameter", "#of the model", "#standard error", "unit"], parameters)
        .paragraph(unknown);
    let points = Body::default().table_of(usize::MAX, &headers, points);
    let hint = if points.0.is_empty() { "" } else { "Speeds in rad/s; torques in N m as the model expects them." };
    Body::default()
        .list(plan_sentences(plan))
        .part("Predicted standard errors", parameters)
        .part("Points", points.hint(hint).hint(dwell))
}

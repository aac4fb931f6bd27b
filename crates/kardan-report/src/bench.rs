//! The page of a study on a virtual bench.

use super::analysis::{items, number, paragraph, rows_of, titled};
use super::analysis_pictures::{drawing, figure_of};
use super::frame::{Frame, LEFT, legend};
use super::table::{Cell, section};
use super::tables::mark;
use super::text::{escape, unit};
use super::thin::thin;
use super::words::bench as said;
use super::{design, identification};
use kardan::results::{BenchStudy, Experiment, Response, Run};

const WIDTH: f64 = 272.0;
const HEIGHT: f64 = 190.0;
/// Between the first frame and the room of the second one.
const BETWEEN: f64 = 8.0;
/// Points of a curve.
const POINTS: usize = 1500;

/// The sections of the page.
pub(super) fn sections(study: &BenchStudy) -> Vec<String> {
    let mut all: Vec<(String, String, String)> = Vec::new();
    for (k, experiment) in study.closed_loop.experiments.iter().enumerate() {
        let title = format!("Simulation and bench: {}", experiment.name);
        all.push((format!("experiment-{}", k + 1), title, pair(study, experiment)));
    }
    all.push(("differences".into(), "What makes them differ".into(), differences(study)));
    all.push(("truth".into(), "Found and true".into(), truth(study)));
    all.push(("excitation".into(), "Excitation".into(), excitation(study)));
    let mut notes = study.notes.clone();
    notes.extend(study.closed_loop.notes.iter().cloned());
    all.push(("bench-notes".into(), "Notes of the bench".into(), items(&notes)));
    let there = all.into_iter().filter(|(_, _, body)| !body.is_empty());
    let mut out: Vec<String> = there.map(|(anchor, title, body)| section(&anchor, &title, &body)).collect();
    out.extend(identification::sections(&study.identification));
    out.push(design::section(&study.closed_loop.design, 0));
    out
}

/// Each output in the simulation and on the bench, side by side on the same axes.
fn pair(study: &BenchStudy, experiment: &Experiment) -> String {
    let mut out: String = experiment.responses.iter().map(|response| picture(study, experiment, response)).collect();
    let rows = experiment.responses.iter().map(|one| {
        let [output, units, rest @ ..] = said::response(one, number);
        let mut row = vec![Cell::Head(output, 1), Cell::text(unit(&units))];
        row.extend(rest.map(Cell::Number));
        row
    });
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
    out += &rows_of(&headers, rows.collect());
    out
}

/// The axes are those of this output in all experiments: what does not move looks so.
fn picture(study: &BenchStudy, experiment: &Experiment, response: &Response) -> String {
    let points = |run: &Run, signal: &str| -> Vec<(f64, f64)> {
        let Some(found) = run.series.signal(signal) else { return Vec::new() };
        let kept = thin(&run.series.time, &found.values, POINTS);
        kept.into_iter().map(|k| (run.series.time[k], found.values[k])).collect()
    };
    let runs = [("simulation", &experiment.simulated), ("bench", &experiment.measured)];
    let curves = runs.map(|(_, run)| points(run, &response.signal));
    let reference = points(&experiment.simulated, &response.reference);
    let mut shown = Vec::new();
    for other in &study.closed_loop.experiments {
        for run in [&other.simulated, &other.measured] {
            let values = run.series.signal(&response.signal).map(|found| found.values.as_slice()).unwrap_or_default();
            let finite = || values.iter().copied().filter(|x| x.is_finite());
            let begin = run.series.time.first().copied().unwrap_or(0.0);
            shown.extend(
                [finite().reduce(f64::min), finite().reduce(f64::max)].into_iter().flatten().map(|x| (begin, x)),
            );
        }
    }
    let every = || curves.iter().flatten().chain(&reference).chain(&shown).copied();
    let mut body = String::new();
    let mut below = 0.0;
    for (k, ((name, _), curve)) in runs.iter().zip(&curves).enumerate() {
        let mut frame = Frame::new(every(), WIDTH, HEIGHT);
        frame.left += k as f64 * (WIDTH + LEFT + BETWEEN);
        let up = format!("{}, {}", response.signal, response.physical.unit());
        body += &frame.drawn("time, s", &up);
        body += &frame.curve(reference.iter().copied(), 2, |_, _| false);
        body += &frame.curve(curve.iter().copied(), k, |_, _| false);
        below = frame.end() + 10.0;
        body += &legend(frame.left, below, &[(k, name), (2, &response.reference)]);
    }
    let width = 2.0 * (LEFT + WIDTH) + BETWEEN + 16.0;
    let title = format!("{}: {}", experiment.name, response.output);
    let drawn = drawing(width, below + 12.0, &title, &body);
    figure_of(
        &escape(&title),
        &drawn,
        "Left the controller in continuous time on the model that it was designed on, without friction; right as it runs on the \
         plant of the bench. Noise of sensors is not drawn.",
    )
}

fn differences(study: &BenchStudy) -> String {
    let mut out = items(&said::causes(&study.closed_loop, number));
    for experiment in &study.closed_loop.experiments {
        let responses = &experiment.responses;
        let Some(first) = responses.first() else { continue };
        let mut headers = vec!["difference".to_string()];
        for one in responses {
            let unit = one.physical.unit();
            headers.extend([format!("#{}, {unit}: alone", one.output), "#bench without it".into()]);
        }
        let mut rows = vec![vec![Cell::Head("all".into(), 1)]];
        rows[0].extend(responses.iter().flat_map(|one| [number(one.distance.0), "–".into()]).map(Cell::Number));
        for (k, difference) in first.differences.iter().enumerate() {
            let mut row = vec![Cell::Head(difference.what.clone(), 1)];
            let both = responses.iter().flat_map(|one| [one.differences[k].alone, one.differences[k].without]);
            row.extend(both.map(|x| Cell::Number(number(x))));
            rows.push(row);
        }
        out += &titled(
            &format!("Largest distance from the simulation: {}", escape(&experiment.name)),
            &rows_of(&headers, rows),
        );
    }
    if out.is_empty() {
        return out;
    }
    let transient = number(study.closed_loop.transient);
    paragraph(&format!(
        "Largest distances from the simulation within {transient} s after each event. Each number is a run of its own: with this \
         difference alone put into the simulation, and with it alone taken from the bench."
    )) + &out
}

fn truth(study: &BenchStudy) -> String {
    let rows = said::compared(study).into_iter().map(|(found, truth)| {
        let [name, units, before, value, found_value, interval, _] = said::parameter(found, truth, number);
        let mut row = vec![Cell::Head(name, 1), Cell::text(unit(&units))];
        row.extend([before, value, found_value, interval].map(Cell::Number));
        let good = said::inside(found, truth.value);
        row.push(mark(good, if good { "inside" } else { "outside" }));
        row
    });
    let interval = format!("#{} % interval", number(100.0 * study.identification.confidence));
    rows_of(&["parameter", "unit", "#in the file", "#true", "#found", &interval, "the true value is"], rows.collect())
}

fn excitation(study: &BenchStudy) -> String {
    let plan = &study.plan;
    let mut headers: Vec<String> = ["#from s", "#until s"].map(String::from).to_vec();
    headers.extend(plan.shafts.iter().map(|name| format!("#{name}, rad/s")));
    headers.extend(plan.motors.iter().map(|name| format!("#{name}, N m")));
    let rows = plan.points.iter().map(|point| {
        let numbers = [point.from, point.until].into_iter().chain(point.speeds.iter().copied());
        numbers.chain(point.torques.iter().copied()).map(|x| Cell::Number(number(x))).collect()
    });
    let points = rows_of(&headers, rows.collect());
    items(&said::plan(plan, number)) + &titled("Points, with the torques that the model expects", &points)
}

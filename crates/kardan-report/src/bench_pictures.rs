//! What outputs did in the simulation and on the bench.

use super::analysis_pictures::{drawing, figure_of};
use super::frame::{Frame, LEFT, legend};
use super::model::Picture;
use super::thin::thin;
use kardan::results::{BenchStudy, Experiment, Response, Run};

const WIDTH: f64 = 272.0;
const HEIGHT: f64 = 190.0;
/// Between the first frame and the room of the second one.
const BETWEEN: f64 = 8.0;
/// Points of a curve.
const POINTS: usize = 1500;

/// The axes are those of this output in all experiments: what does not move looks so.
pub(super) fn response(study: &BenchStudy, experiment: &Experiment, response: &Response) -> Picture {
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
        &title,
        &drawn,
        "Left the controller in continuous time on the model that it was designed on, without friction; right as it runs on the \
         plant of the bench. Noise of sensors is not drawn.",
    )
}

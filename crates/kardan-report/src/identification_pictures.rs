//! The pictures of an identification.

use super::drawing::{CHARACTER, CROSS, cut, text};
use super::frame::{Frame, LEFT, TOP, legend};
use super::model::Picture;
use super::text::{escape, figure};
use kardan_results::{FrictionPoint, Identification, IdentifiedParameter, Interval};

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 240.0;
/// Width with the room beside the frame.
const OUTER: f64 = LEFT + WIDTH + 16.0;
/// Logs that are drawn separately.
const LOGS: usize = 6;
/// Parameters in the picture of correlations.
const CELLS: usize = 24;

/// The quantity of such a unit.
fn effort(unit: &str) -> &'static str {
    if unit == "N" { "force" } else { "torque" }
}

/// Torque measured, and predicted by a fit without it, over time, for each row and the first logs.
pub(super) fn traces(found: &Identification) -> Vec<Picture> {
    let mut out = Vec::new();
    let several = found.logs.len() > 1;
    for trace in &found.traces {
        let mut logs: Vec<usize> = trace.points.iter().map(|point| point.log).collect();
        logs.dedup();
        for &log in logs.iter().take(LOGS) {
            let own: Vec<_> = trace.points.iter().filter(|point| point.log == log).collect();
            let both = own.iter().flat_map(|point| [(point.time, point.measured), (point.time, point.predicted)]);
            let frame = Frame::new(both, WIDTH, HEIGHT);
            let mut body = frame.drawn("time, s", &format!("{}, {}", effort(&trace.unit), trace.unit));
            body += &frame.dots(own.iter().map(|point| (point.time, point.measured)), 0, 4.0);
            body += &frame.dots(own.iter().map(|point| (point.time, point.predicted)), 1, 2.0);
            body += &legend(LEFT, frame.end() + 10.0, &["measured", "predicted by a fit without it"]);
            let title = if several {
                let name = found.logs.get(log).map_or("", |log| log.name.as_str());
                format!("{}, {}", trace.row, name.rsplit(['/', '\\']).next().unwrap_or(name))
            } else {
                trace.row.clone()
            };
            let caption = "Torque that the requested parameters explain: the measured torque minus all terms taken from the file.";
            out.push(Picture::drawn(&title, [OUTER, frame.end() + 22.0], &title, &body, caption));
        }
        if let (true, Some(last)) = (logs.len() > LOGS, out.last_mut()) {
            last.caption += &format!(" The fit uses {} more logs.", logs.len() - LOGS);
        }
    }
    out
}

/// Friction over speed.
pub(super) fn curves(found: &Identification) -> Vec<Picture> {
    let one = |curve: &kardan_results::FrictionCurve| {
        let places =
            |points: &[FrictionPoint]| points.iter().map(|point| (point.speed, point.torque)).collect::<Vec<_>>();
        let (points, line) = (places(&curve.points), places(&curve.line));
        let [speed, unit] = curve.units;
        let frame = Frame::new(points.iter().chain(&line).copied(), WIDTH, HEIGHT);
        let mut body = frame.drawn(&format!("speed, {speed}"), &format!("friction {}, {unit}", effort(unit)));
        body += &frame.dots(points.into_iter(), 0, 3.4);
        body += &frame.curve(line.into_iter(), 1);
        body += &legend(LEFT, frame.end() + 10.0, &["measured, minus all other terms", "identified"]);
        let caption = "Damping and friction of this element over its speed.";
        Picture::drawn(&curve.element, [OUTER, frame.end() + 22.0], &curve.element, &body, caption)
    };
    found.curves.iter().filter(|curve| !curve.points.is_empty()).map(one).collect()
}

/// The residuals over time.
pub(super) fn residuals(found: &Identification) -> Vec<Picture> {
    let one = |trace: &kardan_results::Trace| {
        let points: Vec<(f64, f64)> =
            trace.points.iter().map(|point| (point.time, point.measured - point.predicted)).collect();
        if points.iter().all(|point| !point.1.is_finite()) {
            return None;
        }
        let frame = Frame::new(points.iter().copied(), WIDTH, 0.6 * HEIGHT);
        let mut body = frame.drawn("time, s", &format!("residual, {}", trace.unit));
        body += &frame.dots(points.iter().copied(), 0, 3.4);
        let caption = "Measured minus predicted by a fit without it, all logs overlaid.";
        Some(Picture::drawn(&trace.row, [OUTER, frame.end()], &trace.row, &body, caption))
    };
    found.traces.iter().filter_map(one).collect()
}

/// The intervals, each relative to the identified value; marks for the file's and the published value.
pub(super) fn intervals(found: &Identification) -> Option<Picture> {
    let drawn = |one: &'_ IdentifiedParameter| one.value.filter(|value| *value != 0.0).zip(one.interval);
    let rows: Vec<(&IdentifiedParameter, f64, Interval)> =
        found.parameters.iter().filter_map(|one| drawn(one).map(|(value, interval)| (one, value, interval))).collect();
    if rows.is_empty() {
        return None;
    }
    let part = |value: f64, x: f64| 100.0 * (x / value - 1.0) * value.signum().abs();
    let longest = rows.iter().map(|(one, ..)| one.name.chars().count()).max().unwrap_or(0).min(32);
    let left = 20.0 + CHARACTER * longest as f64;
    let ends = rows.iter().flat_map(|(one, value, interval)| {
        let relative = |x: Option<f64>| x.map(|x| part(*value, x)).filter(|x| x.abs() < 100.0);
        [
            Some(part(*value, interval.lower)),
            Some(part(*value, interval.upper)),
            relative(one.model_value),
            relative(one.published),
        ]
    });
    let ends: Vec<(f64, f64)> = ends.flatten().map(|x| (x.clamp(-200.0, 200.0), 0.0)).collect();
    let height = 26.0 * rows.len() as f64;
    let mut frame = Frame::new(ends.into_iter().chain([(0.0, 1.0)]), WIDTH, height);
    (frame.area.left, frame.area.width) = (left, LEFT + WIDTH - left);
    let bottom = TOP + height;
    let mut body = frame.grid_across();
    body +=
        &text(left + frame.area.width / 2.0, bottom + 38.0, "middle", "difference from the identified value, % of it");
    for (k, (one, value, interval)) in rows.into_iter().enumerate() {
        let y = TOP + 26.0 * k as f64 + 13.0;
        let at = |x: f64| frame.place((part(value, x), 0.0)).0;
        let (a, b) = (at(interval.lower), at(interval.upper));
        let title = format!(
            "{}: {} ({} … {}) {}",
            one.name,
            figure(value, 6),
            figure(interval.lower, 6),
            figure(interval.upper, 6),
            one.unit
        );
        body += &text(left - 10.0, y + 4.0, "end", &cut(&one.name, 32));
        body += &format!(
            "<g><title>{}</title><path d=\"M{a:.1} {y:.1}H{b:.1}M{a:.1} {:.1}v10M{b:.1} {:.1}v10\" fill=\"none\" \
             stroke=\"var(--curve-0)\" stroke-width=\"2\"/><circle cx=\"{:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"var(--curve-0)\"/></g>\n",
            escape(&title),
            y - 5.0,
            y - 5.0,
            at(value)
        );
        let mark = |x: Option<f64>, colour: usize, shape: &str| match x.filter(|x| part(value, *x).abs() < 100.0) {
            Some(x) => format!(
                "<path transform=\"translate({:.1} {y:.1})\" d=\"{shape}\" fill=\"none\" stroke=\"var(--curve-{colour})\" \
                 stroke-width=\"2\"/>\n",
                at(x)
            ),
            None => String::new(),
        };
        body += &mark(one.model_value, 1, "M0 -7L6 0L0 7L-6 0Z");
        body += &mark(one.published, 2, CROSS);
    }
    let below = bottom + 58.0;
    body += &legend(left, below, &["identified, with its interval", "◇ in the file", "× published"]);
    let caption = format!(
        "Intervals of {} % confidence. Marks further than 100 % away are in the table only.",
        figure(100.0 * found.confidence, 4)
    );
    Some(Picture::drawn("Intervals", [OUTER, below + 12.0], "intervals of the parameters", &body, &caption))
}

/// The correlations of the errors as cells.
pub(super) fn correlation(found: &Identification) -> Option<Picture> {
    let names = &found.correlation.names;
    let n = names.len();
    if !(2..=CELLS).contains(&n) {
        return None;
    }
    let size = 34.0;
    let longest = names.iter().map(|name| name.chars().count()).max().unwrap_or(0).min(28);
    let left = 16.0 + CHARACTER * longest as f64;
    let top = 20.0 + CHARACTER * longest as f64 * 0.75;
    let mut body = String::new();
    for (i, name) in names.iter().enumerate() {
        let y = top + size * i as f64;
        body += &text(left - 8.0, y + size / 2.0 + 4.0, "end", &cut(name, 28));
        let x = left + size * (i as f64 + 0.5);
        body += &format!(
            "<text x=\"{x:.1}\" y=\"{:.1}\" transform=\"rotate(-45 {x:.1} {:.1})\">{}</text>\n",
            top - 6.0,
            top - 6.0,
            escape(&cut(name, 28))
        );
        for j in 0..=i {
            let value = found.correlation.values[i][j];
            let x = left + size * j as f64;
            let colour = if value < 0.0 { 1 } else { 0 };
            body += &format!(
                "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{size}\" height=\"{size}\" fill=\"var(--curve-{colour})\" \
                 fill-opacity=\"{:.2}\"><title>{} and {}: {value:.4}</title></rect>\n",
                0.75 * value.abs().min(1.0),
                escape(&names[i]),
                escape(&names[j])
            );
            if i != j {
                body += &text(x + size / 2.0, y + size / 2.0 + 4.0, "middle", &format!("{value:.2}").replace('-', "−"));
            }
        }
    }
    let width = left + size * n as f64 + CHARACTER * longest as f64 * 0.75 + 16.0;
    let (title, size) = ("Correlations of the errors", [width, top + size * n as f64 + 12.0]);
    let caption = "Close to one: these data barely distinguish the two.";
    Some(Picture::drawn(title, size, "correlations of the errors", &body, caption))
}

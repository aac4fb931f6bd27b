//! The trade-off of designs as a picture: interaction over torque, both logarithmic.

use super::drawing::{Area, text};
use super::model::Picture;
use super::text::{escape, figure, unit};
use kardan_results::{Alternative, Exploration};
use kardan_rt::functions::{log10, powi};

const AREA: Area = Area { left: 92.0, top: 14.0, width: 600.0, height: 340.0 };
/// Number of curve colours.
const COLOURS: usize = 6;

/// A logarithmic axis over whole powers of ten, or parts of one.
struct Axis {
    low: f64,
    high: f64,
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>) -> Option<Self> {
        let logs: Vec<f64> = values.filter(|x| *x > 0.0 && x.is_finite()).map(log10).collect();
        let (low, high) =
            (logs.iter().copied().fold(f64::MAX, f64::min), logs.iter().copied().fold(f64::MIN, f64::max));
        let margin = (0.05 * (high - low)).max(0.05);
        (!logs.is_empty()).then_some(Self { low: low - margin, high: high + margin })
    }

    /// Part of the axis, 0 to 1.
    fn place(&self, value: f64) -> f64 {
        ((log10(value) - self.low) / (self.high - self.low)).clamp(0.0, 1.0)
    }

    /// 1, 2, 5 times powers of ten, at their parts of the axis; over many decades the powers only.
    fn ticks(&self) -> Vec<(f64, String)> {
        let steps: &[f64] = if self.high - self.low > 3.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let first = self.low.floor() as i32;
        let last = self.high.ceil() as i32;
        let all = (first..=last).flat_map(|power| steps.iter().map(move |step| step * powi(10.0, power)));
        let inside = all.filter(|tick| (self.low..=self.high).contains(&log10(*tick)));
        inside.map(|tick| (self.place(tick), figure(tick, 3))).collect()
    }
}

/// Grid lines with their numbers, and the title of the axis of torques.
fn axes_lines(across: &Axis, up: &Axis, relative_to_limits: bool) -> String {
    let grid = AREA.grid_across(across.ticks(), Some(18.0)) + &AREA.grid_up(up.ticks(), 8.0);
    let over = if relative_to_limits { "over the motor's limit" } else { "N m" };
    let title = format!("largest requested torque, {over}");
    grid + &text(AREA.left + AREA.width / 2.0, AREA.bottom() + 38.0, "middle", &title)
}

/// The colours of the sample times.
fn sample_times(times: &[f64], below: f64) -> String {
    let mut body = String::new();
    for (k, time) in times.iter().enumerate() {
        let x = AREA.left + 130.0 * k as f64;
        body += &format!(
            "<circle cx=\"{x:.1}\" cy=\"{:.1}\" r=\"4\" fill=\"var(--curve-{})\"/>\n",
            below - 4.0,
            k % COLOURS
        );
        body += &text(x + 10.0, below, "", &format!("{} Hz", figure(1.0 / time, 4)));
    }
    body
}

/// The picture; empty without designs that can be drawn.
pub(super) fn pareto(found: &Exploration) -> Option<Picture> {
    let drawn = |one: &&Alternative| one.interaction > 0.0 && one.torque > 0.0;
    let all: Vec<&Alternative> = found.designs.iter().filter(drawn).collect();
    let axes = (Axis::new(all.iter().map(|one| one.torque)), Axis::new(all.iter().map(|one| one.interaction)));
    let (Some(across), Some(up)) = axes else { return None };
    let place = |one: &Alternative| AREA.at(across.place(one.torque), up.place(one.interaction));
    let mut body = axes_lines(&across, &up, found.relative_to_limits);
    let mut times: Vec<f64> = all.iter().map(|one| one.sample_time).collect();
    times.sort_by(|a, b| b.total_cmp(a));
    times.dedup();
    let colour = |one: &Alternative| {
        let number = times.iter().position(|time| *time == one.sample_time).unwrap_or(0);
        format!("var(--curve-{})", number % COLOURS)
    };
    // Designs that differ only in effort lie on one curve.
    let mut sorted = all.clone();
    sorted.sort_by(|a, b| a.effort.total_cmp(&b.effort));
    while let Some(first) = sorted.first().copied() {
        let same_setup = |one: &&Alternative| {
            one.sample_time == first.sample_time && one.bandwidth == first.bandwidth && one.sensors == first.sensors
        };
        let (curve, rest): (Vec<&Alternative>, Vec<&Alternative>) = sorted.into_iter().partition(same_setup);
        for pair in curve.windows(2) {
            let ((x, y), (to_x, to_y)) = (place(pair[0]), place(pair[1]));
            body += &format!(
                "<path class=\"front\" stroke=\"{}\" d=\"M{x:.1} {y:.1}L{to_x:.1} {to_y:.1}\"/>\n",
                colour(first)
            );
        }
        sorted = rest;
    }
    for (k, one) in all.iter().enumerate().rev() {
        let (x, y) = place(one);
        let title = format!(
            "{} s, bandwidth × {}, effort × {}, {}: interaction {} {}, torque {}, noise {} rms",
            one.sample_time,
            one.bandwidth,
            one.effort,
            one.sensors,
            figure(one.interaction, 3),
            found.unit,
            found.amount(one.torque, 1),
            found.amount(one.noise, 2)
        );
        let fill = if one.best { colour(one) } else { "none".into() };
        let own = if k == 0 { "<circle r=\"10\" fill=\"none\" class=\"own\"/>" } else { "" };
        body += &format!(
            "<g transform=\"translate({x:.1} {y:.1})\"><title>{}</title>{own}<circle r=\"4\" fill=\"{fill}\" stroke=\"{}\"/></g>\n",
            escape(&title),
            colour(one)
        );
    }
    let below = AREA.bottom() + 60.0;
    body += &sample_times(&times, below);
    let label = format!("{} over torque", found.interaction);
    let caption = format!(
        "{} in {}, over the largest torque. Lines join designs with the same rate, bandwidth and sensors; the effort \
         grows from the upper end to the lower. Filled: no design with the same sensors, at no higher rate and no smaller bandwidth, is better in both. \
         Ringed: the design of the file. Point at a design for its data.",
        escape(&found.interaction),
        unit(&found.unit)
    );
    let size = [AREA.right() + 16.0, below + 12.0];
    Some(Picture::drawn("Interaction against torque", size, &label, &body, &caption))
}

#[cfg(test)]
#[path = "../tests/unit/pareto.rs"]
mod tests;

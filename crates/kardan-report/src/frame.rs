//! A frame with axes, and its contents.

use super::analysis_pictures::{CHARACTER, line, text, upward};
use super::ticks::{Axis, axis};

/// Room for the labels left of a frame, and above it.
pub(super) const LEFT: f64 = 92.0;
pub(super) const TOP: f64 = 14.0;
/// Room for a label below a frame.
const ACROSS: f64 = 80.0;
/// Fewer points are drawn twice as large.
const SPARSE_POINTS: usize = 100;

fn ticks(axis: &Axis) -> impl Iterator<Item = f64> {
    let Axis { low, high, step } = *axis;
    let first = (low / step).ceil();
    (0..40).map(move |k| (first + f64::from(k)) * step).take_while(move |tick| *tick <= high)
}

/// A frame with two axes.
pub(super) struct Frame {
    pub(super) across: Axis,
    pub(super) up: Axis,
    pub(super) left: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

impl Frame {
    pub(super) fn new(points: impl Iterator<Item = (f64, f64)> + Clone, width: f64, height: f64) -> Self {
        let across = axis(points.clone().map(|point| point.0), 0.02, (width / ACROSS) as usize);
        let up = axis(points.map(|point| point.1), 0.06, 5);
        Self { across, up, left: LEFT, width, height }
    }

    pub(super) fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let part = |axis: &Axis, value: f64| ((value - axis.low) / (axis.high - axis.low)).clamp(0.0, 1.0);
        (self.left + self.width * part(&self.across, x), TOP + self.height * (1.0 - part(&self.up, y)))
    }

    pub(super) fn drawn(&self, x: &str, y: &str) -> String {
        let bottom = TOP + self.height;
        let mut body = self.grid_across();
        for tick in ticks(&self.up) {
            let (_, at) = self.place((self.across.low, tick));
            body += &line((self.left, at), (self.left + self.width, at), "grid");
            body += &text(self.left - 8.0, at + 4.0, "end", &self.up.label(tick));
        }
        body += &text(self.left + self.width / 2.0, bottom + 38.0, "middle", x);
        body + &upward(&format!("{:.0}", self.left - LEFT + 16.0), TOP + self.height / 2.0, "middle", y)
    }

    /// The grid lines across, with their numbers.
    pub(super) fn grid_across(&self) -> String {
        let bottom = TOP + self.height;
        let mut body = String::new();
        for tick in ticks(&self.across) {
            let (at, _) = self.place((tick, self.up.low));
            body += &line((at, TOP), (at, bottom), "grid");
            body += &text(at, bottom + 18.0, "middle", &self.across.label(tick));
        }
        body
    }

    pub(super) fn end(&self) -> f64 {
        TOP + self.height + 46.0
    }

    /// Points as dots in one path.
    pub(super) fn dots(&self, points: impl Iterator<Item = (f64, f64)>, colour: usize, size: f64) -> String {
        let points: Vec<(f64, f64)> = points.collect();
        let size = if points.len() < SPARSE_POINTS { 2.0 * size } else { size };
        let path: String = points
            .into_iter()
            .filter(|(x, y)| x.is_finite() && y.is_finite())
            .map(|point| {
                let (x, y) = self.place(point);
                format!("M{x:.1} {y:.1}h0")
            })
            .collect();
        format!(
            "<path d=\"{path}\" fill=\"none\" stroke=\"var(--curve-{colour})\" stroke-width=\"{size}\" stroke-linecap=\"round\"/>\n"
        )
    }

    /// Points joined by lines, but from below zero to above it.
    pub(super) fn curve(&self, points: impl Iterator<Item = (f64, f64)>, colour: usize) -> String {
        let mut path = String::new();
        let mut last: Option<f64> = None;
        for point in points.filter(|(x, y)| x.is_finite() && y.is_finite()) {
            let (x, y) = self.place(point);
            let start = last.is_none_or(|before| before < 0.0 && point.0 > 0.0);
            path += &format!("{}{x:.1} {y:.1}", if start { "M" } else { "L" });
            last = Some(point.0);
        }
        format!("<path d=\"{path}\" fill=\"none\" stroke=\"var(--curve-{colour})\" stroke-width=\"1.6\"/>\n")
    }
}

pub(super) fn legend(x: f64, y: f64, entries: &[(usize, &str)]) -> String {
    let mut at = x;
    let mut out = String::new();
    for (colour, name) in entries {
        out += &format!(
            "<rect x=\"{at:.1}\" y=\"{:.1}\" width=\"14\" height=\"4\" fill=\"var(--curve-{colour})\"/>\n",
            y - 6.0
        );
        out += &text(at + 20.0, y, "", name);
        at += 44.0 + CHARACTER * name.chars().count() as f64;
    }
    out
}

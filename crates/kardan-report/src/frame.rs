//! A plot with linear axes, and its contents.

use super::drawing::{Area, CHARACTER, text, upward};
use super::ticks::{Axis, axis};

/// Room for the labels left of a frame, and above it.
pub(super) const LEFT: f64 = 92.0;
pub(super) const TOP: f64 = 14.0;
/// Room for a label below a frame.
const ACROSS: f64 = 80.0;
/// Fewer points are drawn twice as large.
const SPARSE_POINTS: usize = 100;

/// A frame with two axes.
pub(super) struct Frame {
    pub(super) across: Axis,
    pub(super) up: Axis,
    pub(super) area: Area,
}

impl Frame {
    pub(super) fn new(points: impl Iterator<Item = (f64, f64)> + Clone, width: f64, height: f64) -> Self {
        let across = axis(points.clone().map(|point| point.0), 0.02, (width / ACROSS) as usize);
        let up = axis(points.map(|point| point.1), 0.06, 5);
        Self { across, up, area: Area { left: LEFT, top: TOP, width, height } }
    }

    pub(super) fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        self.area.at(self.across.place(x).clamp(0.0, 1.0), self.up.place(y).clamp(0.0, 1.0))
    }

    pub(super) fn drawn(&self, x: &str, y: &str) -> String {
        let Area { left, top, width, height } = self.area;
        let mut body = self.grid_across() + &self.area.grid_up(self.up.placed_ticks(), 8.0);
        body += &text(left + width / 2.0, self.area.bottom() + 38.0, "middle", x);
        body + &upward(&format!("{:.0}", left - LEFT + 16.0), top + height / 2.0, "middle", y)
    }

    /// The grid lines across, with their numbers.
    pub(super) fn grid_across(&self) -> String {
        self.area.grid_across(self.across.placed_ticks(), Some(18.0))
    }

    pub(super) fn end(&self) -> f64 {
        self.area.bottom() + 46.0
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

/// Names of colours, from the first on.
pub(super) fn legend(x: f64, y: f64, names: &[&str]) -> String {
    let mut at = x;
    let mut out = String::new();
    for (colour, name) in names.iter().enumerate() {
        out += &format!(
            "<rect x=\"{at:.1}\" y=\"{:.1}\" width=\"14\" height=\"4\" fill=\"var(--curve-{colour})\"/>\n",
            y - 6.0
        );
        out += &text(at + 20.0, y, "", name);
        at += 44.0 + CHARACTER * name.chars().count() as f64;
    }
    out
}

//! A panel with its axes: grid, labels, curves that end at the frame, and marks; the sizes and colours of all panels.

use crate::drawing::{Area, text, upward};
use crate::model::Picture;
use crate::text::{escape, figure};
use crate::ticks::Axis;

pub(super) const LEFT: f64 = 64.0;
pub(super) const TOP: f64 = 12.0;
const WIDTH: f64 = 620.0;
/// Free space to the right of a plot.
const RIGHT: f64 = 22.0;
/// Height of a panel.
pub(super) const HEIGHT: f64 = 190.0;
/// Space between two panels.
pub(super) const BETWEEN: f64 = 18.0;
/// Style of the lines from which margins are measured.
pub(super) const HEAVY: &str = "stroke=\"var(--ink)\" stroke-width=\"1\" stroke-dasharray=\"2 3\"";
/// Number of curve colours.
const COLOURS: usize = 7;

/// A panel with its axes.
#[derive(Clone, Copy)]
pub(super) struct Panel {
    pub(super) area: Area,
    pub(super) across: Axis,
    pub(super) up: Axis,
}

impl Panel {
    /// A panel as wide as most of them.
    pub(super) fn new(top: f64, height: f64, across: Axis, up: Axis) -> Self {
        Self { area: Area { left: LEFT, top, width: WIDTH, height }, across, up }
    }

    pub(super) fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        self.area.at(self.across.place(x), self.up.place(y))
    }

    /// A picture that ends with this panel.
    pub(super) fn picture(&self, title: &str, label: &str, body: &str, caption: &str) -> Picture {
        Picture::drawn(title, [self.area.right() + RIGHT, self.area.bottom() + 44.0], label, body, caption)
    }

    /// Grid and labels; those of the horizontal axis only where it is named.
    pub(super) fn frame(&self, across: &str, up: &str) -> String {
        let Area { left, top, width, height } = self.area;
        let (right, below) = (self.area.right(), self.area.bottom());
        let named = (!across.is_empty()).then_some(17.0);
        let mut out = self.area.grid_across(self.across.placed_ticks(), named);
        out += &self.area.grid_up(self.up.placed_ticks(), 7.0);
        out += &format!(
            "<path class=\"axis\" fill=\"none\" d=\"M{left:.1} {top:.1}H{right:.1}V{below:.1}H{left:.1}Z\"/>\n"
        );
        if !across.is_empty() {
            out += &text(left + 0.5 * width, below + 35.0, "middle", across);
        }
        out + &upward("14.0", top + 0.5 * height, "middle", up)
    }

    /// A curve through points, cut off at the frame.
    pub(super) fn curve(&self, points: impl Iterator<Item = (f64, f64)>, style: &str) -> String {
        let mut path = String::new();
        let mut last: Option<(f64, f64)> = None;
        let mut end: Option<(f64, f64)> = None;
        for point in points {
            let here = Some(self.place(point)).filter(|(x, y)| x.is_finite() && y.is_finite());
            if let Some((from, to)) = last.zip(here).and_then(|(from, to)| self.cut(from, to)) {
                if end != Some(from) {
                    path += &format!("M{:.1} {:.1}", from.0, from.1);
                }
                path += &format!("L{:.1} {:.1}", to.0, to.1);
                end = Some(to);
            }
            last = here;
        }
        if path.is_empty() {
            path
        } else {
            format!("<path fill=\"none\" stroke-linejoin=\"round\" {style} d=\"{path}\"/>\n")
        }
    }

    /// A horizontal line at this value.
    pub(super) fn across_at(&self, value: f64, style: &str) -> String {
        self.curve([(self.across.low, value), (self.across.high, value)].into_iter(), style)
    }

    /// The part of a segment inside the frame (Liang and Barsky).
    pub(super) fn cut(&self, from: (f64, f64), to: (f64, f64)) -> Option<((f64, f64), (f64, f64))> {
        let (mut first, mut last) = (0.0f64, 1.0f64);
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let edges = [
            (-dx, from.0 - self.area.left),
            (dx, self.area.right() - from.0),
            (-dy, from.1 - self.area.top),
            (dy, self.area.bottom() - from.1),
        ];
        for (slope, room) in edges {
            if slope == 0.0 {
                if room < 0.0 {
                    return None;
                }
            } else if slope < 0.0 {
                first = first.max(room / slope);
            } else {
                last = last.min(room / slope);
            }
        }
        let at = |part: f64| (from.0 + part * dx, from.1 + part * dy);
        (first <= last).then(|| (at(first), at(last)))
    }

    pub(super) fn contains(&self, (x, y): (f64, f64)) -> bool {
        (self.area.left - 0.5..=self.area.right() + 0.5).contains(&x)
            && (self.area.top - 0.5..=self.area.bottom() + 0.5).contains(&y)
    }

    /// A dot with a title, if it is within the frame.
    pub(super) fn dot(&self, at: (f64, f64), colour: usize, title: &str) -> String {
        let (x, y) = self.place(at);
        if !self.contains((x, y)) {
            return String::new();
        }
        format!(
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.6\" fill=\"{}\" stroke=\"var(--paper)\"><title>{}</title></circle>\n",
            shade(colour),
            escape(title)
        )
    }

    /// A red cross where L is −1, if it is within the frame.
    pub(super) fn critical(&self, at: (f64, f64)) -> String {
        let (x, y) = self.place(at);
        if !self.contains((x, y)) {
            return String::new();
        }
        format!(
            "<path stroke=\"var(--bad)\" stroke-width=\"2\" d=\"M{:.1} {:.1}l10 10m0 -10l-10 10\"><title>-1</title></path>\n",
            x - 5.0,
            y - 5.0
        )
    }

    /// The Nyquist frequency.
    pub(super) fn sampled(&self, nyquist: Option<f64>, named: bool) -> String {
        let Some(nyquist) = nyquist else { return String::new() };
        let x = self.place((nyquist, self.up.low)).0;
        let mut out = format!(
            "<path fill=\"none\" stroke=\"var(--faint)\" stroke-dasharray=\"6 4\" d=\"M{x:.1} {:.1}V{:.1}\"/>\n",
            self.area.top,
            self.area.bottom()
        );
        if named {
            out += &text(x - 6.0, self.area.top + 14.0, "end faint", &format!("Nyquist {} rad/s", figure(nyquist, 4)));
        }
        out
    }
}

fn shade(colour: usize) -> String {
    format!("var(--curve-{})", colour % COLOURS)
}

pub(super) fn solid(colour: usize) -> String {
    format!("stroke=\"{}\" stroke-width=\"1.7\"", shade(colour))
}

pub(super) fn thin(colour: usize) -> String {
    format!("stroke=\"{}\" stroke-width=\"1\" stroke-opacity=\".55\"", shade(colour))
}

/// Curves with their colours, one a line.
pub(super) fn legend(entries: impl Iterator<Item = (usize, String)>) -> String {
    entries
        .map(|(colour, what)| format!("<span class=\"swatch c{}\"></span>{}<br>", colour % COLOURS, escape(&what)))
        .collect()
}

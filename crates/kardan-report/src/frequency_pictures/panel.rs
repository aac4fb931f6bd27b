//! A panel with its axes: grid, labels, curves that end at the frame, and marks; the sizes and colours of all panels.

use kardan_rt::functions::{log10, powi};

use crate::analysis_pictures::{line, text, upward};
use crate::text::{escape, figure};
use crate::ticks;

pub(super) const LEFT: f64 = 64.0;
pub(super) const TOP: f64 = 12.0;
pub(super) const WIDTH: f64 = 620.0;
/// Free space to the right of a plot.
pub(super) const RIGHT: f64 = 22.0;
/// Height of a panel.
pub(super) const HEIGHT: f64 = 190.0;
/// Space between two panels.
pub(super) const BETWEEN: f64 = 18.0;
/// Number of curve colours.
const COLOURS: usize = 7;

/// One axis of a plot.
#[derive(Clone, Copy)]
pub(super) struct Axis {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) logarithmic: bool,
    /// Distance of ticks; unused for a logarithmic axis.
    pub(super) step: f64,
}

impl Axis {
    pub(super) fn logarithmic(low: f64, high: f64) -> Self {
        Self { low, high, logarithmic: true, step: 0.0 }
    }

    /// About this number of ticks, at multiples of one of these steps.
    pub(super) fn by(steps: &[f64], low: f64, high: f64, most: f64) -> Self {
        let step = steps.iter().copied().find(|step| (high - low) / step <= most);
        let step = step.unwrap_or_else(|| steps.last().copied().unwrap_or(1.0));
        let (low, high) = ((low / step).floor() * step, (high / step).ceil() * step);
        let high = if high > low { high } else { low + step };
        Self { low, high, logarithmic: false, step }
    }

    pub(super) fn fitting(values: impl Iterator<Item = f64>, margin: f64, count: usize) -> Self {
        let found = ticks::axis(values, margin, count);
        Self { low: found.low, high: found.high, logarithmic: false, step: found.step }
    }

    /// Part of the axis, 0 to 1 within it.
    fn place(&self, value: f64) -> f64 {
        if self.logarithmic {
            log10(value / self.low) / log10(self.high / self.low)
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    /// Ticks with their labels; those without one are between two others.
    pub(super) fn ticks(&self) -> Vec<(f64, String)> {
        if self.logarithmic {
            let (first, last) = (log10(self.low).floor() as i32, log10(self.high).ceil() as i32);
            let fine = log10(self.high / self.low) <= 4.0;
            let decades = (first..=last).flat_map(|power| (1..10).map(move |step| (power, step)));
            let named = |(power, step): (i32, i32)| {
                let label = if step == 1 { figure(powi(10.0, power), 3) } else { String::new() };
                (f64::from(step) * powi(10.0, power), label)
            };
            let all = decades.filter(|(_, step)| fine || *step == 1).map(named);
            return all.filter(|(at, _)| (self.low * 0.999..=self.high * 1.001).contains(at)).collect();
        }
        let axis = ticks::Axis { low: self.low, high: self.high, step: self.step };
        let (first, last) =
            ((self.low / self.step - 1e-6).ceil() as i64, (self.high / self.step + 1e-6).floor() as i64);
        (first..=last).map(|k| k as f64 * self.step).map(|at| (at, axis.label(at))).collect()
    }
}

/// A panel with its axes.
pub(super) struct Panel {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) width: f64,
    pub(super) height: f64,
    pub(super) across: Axis,
    pub(super) up: Axis,
}

impl Panel {
    pub(super) fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (self.x + self.width * self.across.place(x), self.y + self.height * (1.0 - self.up.place(y)))
    }

    /// Grid and labels; those of the horizontal axis only where it is named.
    pub(super) fn frame(&self, across: &str, up: &str) -> String {
        let mut out = String::new();
        let (right, below) = (self.x + self.width, self.y + self.height);
        for (at, label) in self.across.ticks() {
            let x = self.place((at, self.up.low)).0;
            let class = if label.is_empty() { "grid minor" } else { "grid" };
            out += &line((x, self.y), (x, below), class);
            if !across.is_empty() && !label.is_empty() {
                out += &text(x, below + 17.0, "middle", &label);
            }
        }
        for (at, label) in self.up.ticks() {
            let y = self.place((self.across.low, at)).1;
            out += &line((self.x, y), (right, y), "grid");
            out += &text(self.x - 7.0, y + 4.0, "end", &label);
        }
        out += &format!(
            "<path class=\"axis\" fill=\"none\" d=\"M{:.1} {:.1}H{right:.1}V{below:.1}H{:.1}Z\"/>\n",
            self.x, self.y, self.x
        );
        if !across.is_empty() {
            out += &text(self.x + 0.5 * self.width, below + 35.0, "middle", across);
        }
        out + &upward("14.0", self.y + 0.5 * self.height, "middle", up)
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

    /// The part of a segment inside the frame (Liang and Barsky).
    pub(super) fn cut(&self, from: (f64, f64), to: (f64, f64)) -> Option<((f64, f64), (f64, f64))> {
        let (mut first, mut last) = (0.0f64, 1.0f64);
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let edges = [
            (-dx, from.0 - self.x),
            (dx, self.x + self.width - from.0),
            (-dy, from.1 - self.y),
            (dy, self.y + self.height - from.1),
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
        (self.x - 0.5..=self.x + self.width + 0.5).contains(&x)
            && (self.y - 0.5..=self.y + self.height + 0.5).contains(&y)
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
            self.y,
            self.y + self.height
        );
        if named {
            out += &text(x - 6.0, self.y + 14.0, "end faint", &format!("Nyquist {} rad/s", figure(nyquist, 4)));
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

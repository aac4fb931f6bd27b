//! What pictures are made of: lines, texts, bars and marks, and the area inside the axes of a plot.

use super::model::Picture;
use super::text::escape;

/// Width of a character of the labels, px, generously.
pub(super) const CHARACTER: f64 = 7.0;
/// Smallest scale of pictures: letters of 12 px shrink to 9 px.
const SMALLEST: f64 = 0.75;
/// A cross as a path around (0, 0).
pub(super) const CROSS: &str = "M-5 -5L5 5M-5 5L5 -5";

/// A picture drawn at this size. On a narrow page it shrinks until letters are hard to read ([`SMALLEST`]), and scrolls from there.
pub(super) fn drawing(width: f64, height: f64, label: &str, body: &str) -> String {
    format!(
        "<div class=\"drawing\"><svg viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" \
         height=\"{height:.0}\" style=\"min-width:{:.0}px\" role=\"img\" aria-label=\"{}\">\n{body}</svg></div>\n",
        SMALLEST * width,
        escape(label)
    )
}

pub(super) fn text(x: f64, y: f64, class: &str, text: &str) -> String {
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" class=\"{class}\">{}</text>\n", escape(text))
}

/// A text that runs upwards at `x`, which is written as it is.
pub(super) fn upward(x: &str, y: f64, class: &str, text: &str) -> String {
    format!(
        "<text x=\"{x}\" y=\"{y:.1}\" class=\"{class}\" transform=\"rotate(-90 {x} {y:.1})\">{}</text>\n",
        escape(text)
    )
}

pub(super) fn line(from: (f64, f64), to: (f64, f64), class: &str) -> String {
    format!("<path class=\"{class}\" d=\"M{:.1} {:.1}L{:.1} {:.1}\"/>\n", from.0, from.1, to.0, to.1)
}

pub(super) fn bar(x: f64, y: f64, width: f64, height: f64, class: &str, title: &str) -> String {
    format!(
        "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"{height:.1}\"><title>{}</title>\
         </rect>\n",
        width.max(0.0),
        escape(title)
    )
}

pub(super) fn cut(text: &str, length: usize) -> String {
    if text.chars().count() <= length {
        return text.to_owned();
    }
    text.chars().take(length.saturating_sub(1)).chain(['…']).collect()
}

/// An entry of a legend: a coloured field with its meaning, as HTML.
pub(super) fn entry(swatch: &str, meaning: &str) -> String {
    format!("<span class=\"entry\"><span class=\"swatch {swatch}\"></span>{meaning}</span>")
}

/// A shape with a title, red where something fails.
pub(super) fn mark((x, y): (f64, f64), kind: &str, fails: bool, title: &str, shape: &str) -> String {
    let failing = if fails { " failing" } else { "" };
    format!(
        "<g class=\"{kind}{failing}\" transform=\"translate({x:.1} {y:.1})\"><title>{}</title>{shape}</g>\n",
        escape(title)
    )
}

impl Picture {
    /// A drawing of this size with its title, its label for readers who do not see it, and how to read it.
    pub(super) fn drawn(title: &str, [width, height]: [f64; 2], label: &str, body: &str, caption: &str) -> Self {
        Self { title: title.into(), drawing: drawing(width, height, label, body), caption: caption.into() }
    }

    /// The same with another class for its style.
    pub(super) fn of_class(self, class: &str) -> Self {
        let drawing = self.drawing.replacen("class=\"drawing\"", &format!("class=\"drawing {class}\""), 1);
        Self { drawing, ..self }
    }
}

/// The area inside the axes of a plot, px.
#[derive(Clone, Copy)]
pub(super) struct Area {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

impl Area {
    pub(super) fn right(&self) -> f64 {
        self.left + self.width
    }

    pub(super) fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// The point at these parts of its width and height, from the lower left corner.
    pub(super) fn at(&self, across: f64, up: f64) -> (f64, f64) {
        (self.left + self.width * across, self.top + self.height * (1.0 - up))
    }

    /// Vertical lines at parts of the width, with their labels this far below, if at all; lines without a label are fainter.
    pub(super) fn grid_across(&self, ticks: impl IntoIterator<Item = (f64, String)>, gap: Option<f64>) -> String {
        let mut body = String::new();
        for (part, label) in ticks {
            let (x, _) = self.at(part, 0.0);
            let class = if label.is_empty() { "grid minor" } else { "grid" };
            body += &line((x, self.top), (x, self.bottom()), class);
            if let (Some(gap), false) = (gap, label.is_empty()) {
                body += &text(x, self.bottom() + gap, "middle", &label);
            }
        }
        body
    }

    /// Horizontal lines at parts of the height, with their labels this far to the left.
    pub(super) fn grid_up(&self, ticks: impl IntoIterator<Item = (f64, String)>, gap: f64) -> String {
        let mut body = String::new();
        for (part, label) in ticks {
            let (_, y) = self.at(0.0, part);
            body += &line((self.left, y), (self.right(), y), "grid");
            body += &text(self.left - gap, y + 4.0, "end", &label);
        }
        body
    }
}

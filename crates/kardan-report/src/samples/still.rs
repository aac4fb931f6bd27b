//! The runs of a sweep as a static picture, for pages without scripts.

use super::{Samples, display_of_figure, fails, lot, shown};
use crate::drawing::{drawing, entry, line};
use crate::frame::Frame;
use crate::model::Picture;
use crate::text::{escape, powers, with_unit};
use kardan_results::{Sweep, SweepHead, SweepRow};

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 320.0;
/// Room right of the frame.
const RIGHT: f64 = 24.0;
/// More runs are not drawn.
const POINTS: usize = 500;

impl Samples {
    /// Some runs as points in the axes drawn first; empty where none has both numbers.
    pub(crate) fn still(&self, found: &Sweep) -> Option<Picture> {
        let (across, up) = self.first(found);
        let mut order: Vec<&SweepRow> = self.drawn_rows.iter().collect();
        order.sort_by_key(|row| (lot(self.head.seed, row.sample), row.sample, row.variant));
        order.truncate(POINTS);
        let SweepHead { varied, requirements, figures, .. } = &self.head;
        let requirement = up.checked_sub(varied.len()).and_then(|k| requirements.get(k));
        let figure = up.checked_sub(varied.len() + requirements.len()).and_then(|k| figures.get(k));
        let (name, unit, display) = match (requirement, figure) {
            (Some(one), _) => (self.name(one), &one.unit, one.display.as_ref()),
            (_, Some((name, unit))) => (name.as_str(), unit, display_of_figure(found, name)),
            _ => (varied[up].name.as_str(), &varied[up].unit, None),
        };
        let value = |row: &SweepRow| {
            row.values.iter().chain(&row.measured).chain(&row.figures).nth(up).copied().unwrap_or(f64::NAN)
        };
        // A requirement on the axis up is the one that a run fails or not.
        let failed = |row: &SweepRow| match up.checked_sub(varied.len()).and_then(|k| row.passed.get(k)) {
            Some(&passed) => passed < 0.5,
            None => fails(&row.reason, &row.passed),
        };
        let points = order.iter().map(|row| (row.values[across], shown(value(row), display), failed(row)));
        let points: Vec<(f64, f64, bool)> = points.filter(|(x, y, _)| x.is_finite() && y.is_finite()).collect();
        let bounds = requirement.iter().flat_map(|one| [one.below, one.above]).flatten();
        let bounds: Vec<f64> = bounds.map(|bound| shown(bound, display)).collect();
        let across = powers(&with_unit(&varied[across].name, &varied[across].unit));
        let up = powers(&with_unit(name, display.map_or(unit, |display| &display.unit)));

        let first = points.first()?.0;
        let places = points.iter().map(|&(x, y, _)| (x, y)).chain(bounds.iter().map(|&y| (first, y)));
        let frame = Frame::new(places, WIDTH, HEIGHT);
        let mut body = frame.drawn(&across, &up);
        for colour in [0, 1] {
            let own = points.iter().filter(|(_, _, fails)| *fails == (colour == 1)).map(|&(x, y, _)| (x, y));
            body += &frame.dots(own, colour, 4.0);
        }
        for &bound in &bounds {
            body += &line(frame.place((frame.across.low, bound)), frame.place((frame.across.high, bound)), "bound");
        }
        let fails = requirement.map(|one| format!("fails {}", escape(&powers(&one.text))));
        let fails = fails.unwrap_or_else(|| "fails a requirement or did not complete".into());
        let mut caption = format!("{} {} ", entry("c0", "passes"), entry("c1", &fails));
        if !bounds.is_empty() {
            caption += "<span class=\"entry\">– – bound</span> ";
        }
        if points.len() < self.all {
            caption += &format!("{} of {} runs.", points.len(), self.all);
        }
        let title = format!("{up} over {across}");
        let svg = drawing(frame.area.left + WIDTH + RIGHT, frame.end(), &title, &body);
        let drawing = format!(
            "<div class=\"unscripted\">\n<figure class=\"analysis\">\n<h3>{}</h3>\n{svg}<figcaption>{caption}</figcaption>\n</figure>\n</div>\n",
            escape(&title)
        );
        Some(Picture { drawing, ..Picture::default() })
    }
}

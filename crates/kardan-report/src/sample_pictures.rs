//! The runs of a sweep as a static picture, for pages without scripts.

use super::analysis_pictures::{drawing, entry, line};
use super::frame::Frame;
use super::model::Picture;
use super::samples::Samples;
use super::text::{escape, powers};
use kardan_results::Sweep;

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 320.0;
/// Room right of the frame.
const RIGHT: f64 = 24.0;
/// More runs are not drawn.
const POINTS: usize = 500;

/// Some runs as points; empty where none has both numbers.
pub(super) fn still(samples: &Samples, found: &Sweep) -> Option<Picture> {
    let static_samples = samples.static_samples(POINTS, found);
    let points: Vec<(f64, f64, bool)> =
        static_samples.points.into_iter().filter(|(x, y, _)| x.is_finite() && y.is_finite()).collect();
    let first = points.first()?.0;
    let places = points.iter().map(|&(x, y, _)| (x, y)).chain(static_samples.bounds.iter().map(|&y| (first, y)));
    let frame = Frame::new(places, WIDTH, HEIGHT);
    let mut body = frame.drawn(&static_samples.across, &static_samples.up);
    for colour in [0, 1] {
        let own = points.iter().filter(|(_, _, fails)| *fails == (colour == 1)).map(|&(x, y, _)| (x, y));
        body += &frame.dots(own, colour, 4.0);
    }
    for &bound in &static_samples.bounds {
        body += &line(frame.place((frame.across.low, bound)), frame.place((frame.across.high, bound)), "bound");
    }
    let fails = static_samples.requirement.map(|text| format!("fails {}", escape(&powers(text))));
    let fails = fails.unwrap_or_else(|| "fails a requirement or did not complete".into());
    let mut caption = format!("{} {} ", entry("c0", "passes"), entry("c1", &fails));
    if !static_samples.bounds.is_empty() {
        caption += "<span class=\"entry\">– – bound</span> ";
    }
    if points.len() < static_samples.all {
        caption += &format!("{} of {} runs.", points.len(), static_samples.all);
    }
    let title = format!("{} over {}", static_samples.up, static_samples.across);
    let svg = drawing(frame.left + WIDTH + RIGHT, frame.end(), &title, &body);
    Some(Picture {
        title: String::new(),
        drawing: format!(
            "<div class=\"unscripted\">\n<figure class=\"analysis\">\n<h3>{}</h3>\n{svg}<figcaption>{caption}</figcaption>\n</figure>\n</div>\n",
            escape(&title)
        ),
        caption: String::new(),
    })
}

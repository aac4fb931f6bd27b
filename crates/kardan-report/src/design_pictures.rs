//! The pictures of a design: poles of the closed loop, and coupling of steps between channels.

use super::analysis_pictures::Plane;
use super::drawing::{CHARACTER, CROSS, cut, entry, mark, text};
use super::groups::distinct;
use super::model::Picture;
use super::phrases::{self, design as design_phrases};
use super::text::{escape, figure, quantity, unit};
use kardan_results::{Complex, CrossCoupling, Design, Pole};
use kardan_rt::functions::log10;

/// Characters of a name beside or above the grid.
const NAME: usize = 24;
/// More rows or columns are in the table only.
const CELLS: usize = 10;
/// Coupling below this share of the own step is drawn as none.
const FAINTEST: f64 = 1e-6;

fn finite(pole: Pole) -> bool {
    pole.re.is_finite() && pole.im.is_finite()
}

/// The poles of the closed loop; those of the zero dynamics are ringed.
pub(super) fn plane(design: &Design) -> Option<Picture> {
    let poles: Vec<(Pole, usize)> =
        phrases::joined(&design.closed_loop_poles).into_iter().filter(|(pole, _)| finite(*pole)).collect();
    let zeros: Vec<Pole> = design.zero_dynamics.modes.iter().map(|mode| mode.pole).filter(|&p| finite(p)).collect();
    if poles.is_empty() && zeros.is_empty() {
        return None;
    }
    let all = poles.iter().map(|(pole, _)| *pole).chain(zeros.iter().copied());
    let plane = Plane::new(all);
    let mut body = plane.frame();
    let both =
        |pole: Pole| [Some(pole), (pole.im != 0.0).then_some(Complex::new(pole.re, -pole.im))].into_iter().flatten();
    for &(pole, times) in &poles {
        let owner = design_phrases::owner(pole, design);
        let of = if owner.is_empty() { owner } else { format!(" ({owner})") };
        let title = format!("pole {}{of}", phrases::pair(pole));
        // The two counts of a pair close to the real axis would overlap.
        for (at, times) in both(pole).zip([times, 1]) {
            body += &cross(plane.place(at), at.re < 0.0, times, &title);
        }
    }
    for &pole in &zeros {
        let title = format!("zero dynamics {}", phrases::pair(pole));
        for at in both(pole) {
            body += &ring(plane.place(at), at.re < 0.0, &title);
        }
    }
    let below = plane.below();
    let (left, next) = (Plane::LEFT + 8.0, Plane::LEFT + 208.0);
    body += &cross((left, below - 4.0), true, 1, "pole");
    body += &text(left + 20.0, below, "", "pole of the closed loop");
    if !zeros.is_empty() {
        body += &ring((next, below - 4.0), true, "zero dynamics");
        body += &text(next + 20.0, below, "", "zero dynamics: not observable");
    }
    let size = [Plane::FULL_WIDTH, below + 12.0];
    let caption =
        format!("{} Modes in the shaded half-plane are unstable; modes that do not decay are red.", plane.caption());
    Some(Picture::drawn("Pole map", size, "poles of the closed loop in the complex plane", &body, &caption))
}

fn cross(at: (f64, f64), decays: bool, times: usize, title: &str) -> String {
    let times = if times > 1 { format!("<text x=\"12\" y=\"-9\">{times}×</text>") } else { String::new() };
    mark(at, "pole", !decays, title, &format!("<path d=\"{CROSS}\"/>{times}"))
}

fn ring(at: (f64, f64), decays: bool, title: &str) -> String {
    mark(at, "zero", !decays, title, "<circle r=\"9\"/>")
}

/// The effect of a step of each reference (column) on each output (row).
pub(super) fn couplings(design: &Design) -> Option<Picture> {
    let found = &design.cross_coupling;
    if found.is_empty() {
        return None;
    }
    let rows = distinct(found.iter().map(|c| c.output.as_str()));
    let columns = distinct(found.iter().map(|c| c.reference.as_str()));
    let (outputs, references) = (&rows[..rows.len().min(CELLS)], &columns[..columns.len().min(CELLS)]);
    let longest = outputs.iter().map(|name| name.chars().count()).max().unwrap_or(0).min(NAME);
    let (left, top, width, height) = (CHARACTER * longest as f64 + 16.0, 40.0, 150.0, 52.0);
    let middle = |column: usize| left + width * (column as f64 + 0.5);
    let mut body = String::new();
    for (j, reference) in references.iter().enumerate() {
        let step = found.iter().find(|c| c.reference == *reference);
        let step = step.map_or(String::new(), |c| format!("step {} {}", figure(c.step, 3), unit(&c.step_unit)));
        body += &text(middle(j), 14.0, "middle strong", &cut(reference, NAME - 4));
        body += &text(middle(j), 30.0, "middle faint", &cut(&step, NAME - 2));
    }
    for (i, output) in outputs.iter().enumerate() {
        let y = top + height * i as f64;
        body += &text(left - 10.0, y + 0.5 * height + 4.0, "end", &cut(output, NAME));
        for (j, reference) in references.iter().enumerate() {
            let here = found.iter().find(|c| c.output == *output && c.reference == *reference);
            body += &cell(design, here, (left + width * j as f64, y, width, height));
        }
    }
    let (wide, high) = (left + width * references.len() as f64, top + height * outputs.len() as f64);
    let mut caption = "Largest deviation of each output (row) after a step of each reference (column). ".to_string();
    caption += &entry("c0", "own channel");
    caption += &entry("coupled", "another channel, darker for larger deviations");
    caption += &entry("proven", "framed: exactly zero in the linear loop");
    if rows.len() > CELLS || columns.len() > CELLS {
        caption += &format!(" At most {CELLS} rows and columns are drawn; the table has all.");
    }
    let label = "peaks of the outputs after steps of the references";
    Some(Picture::drawn("Peaks after steps", [wide + 4.0, high + 4.0], label, &body, &caption))
}

fn cell(design: &Design, found: Option<&CrossCoupling>, (x, y, width, height): (f64, f64, f64, f64)) -> String {
    let (kind, opacity, first, second) = match found {
        None => ("empty", 1.0, "–".into(), String::new()),
        Some(CrossCoupling { failure: Some(_), .. }) => ("empty", 1.0, "the run failed".into(), String::new()),
        Some(found) => {
            let peak = quantity(found.peak.unwrap_or(f64::NAN), 3, &unit(&found.unit));
            let share = design_phrases::relative(found, &design.cross_coupling);
            let second =
                share.map_or(String::new(), |share| format!("{} of own step", design_phrases::share(share, 2)));
            match (found.same_channel, share) {
                (true, _) => ("own", 1.0, peak, "own channel".into()),
                (false, Some(share)) => ("coupled", strength(share), peak, second),
                (false, None) => ("coupled", if found.peak == Some(0.0) { 0.0 } else { 0.25 }, peak, second),
            }
        }
    };
    let linear = found.and_then(|c| design_phrases::linear(design, &c.reference, &c.output));
    let proven = linear.is_some_and(|entry| entry.numerator.is_empty());
    let title = match (found, linear) {
        (Some(found), Some(entry)) => {
            format!("{} → {}; linear loop: {}", found.reference, found.output, design_phrases::transfer(entry))
        }
        (Some(found), None) => format!("{} → {}", found.reference, found.output),
        _ => "no step was run".into(),
    };
    let centre = x + 0.5 * width;
    let on = if kind == "own" { " on" } else { "" };
    let framed = if proven {
        format!(
            "<rect class=\"frame\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" rx=\"3\"/>\n",
            x + 4.0,
            y + 4.0,
            width - 8.0,
            height - 8.0
        )
    } else {
        String::new()
    };
    format!(
        "<g><title>{}</title><rect class=\"cell\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" \
         height=\"{height:.1}\"/>\n<rect class=\"{kind}\" fill-opacity=\"{opacity:.3}\" x=\"{x:.1}\" y=\"{y:.1}\" \
         width=\"{width:.1}\" height=\"{height:.1}\"/>\n{framed}{}{}</g>\n",
        escape(&title),
        text(centre, y + 0.5 * height - 3.0, &format!("middle{on}"), &cut(&first, 18)),
        text(centre, y + 0.5 * height + 13.0, &format!("middle light{on}"), &cut(&second, 22)),
    )
}

/// Opacity of the colour of a cell: by powers of ten of the share, from 0 to 0.55.
fn strength(share: f64) -> f64 {
    if share <= FAINTEST { 0.0 } else { 0.05 + 0.5 * (1.0 - log10(share.min(1.0)) / log10(FAINTEST)) }
}

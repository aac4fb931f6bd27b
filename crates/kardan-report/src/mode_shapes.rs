//! Mode shapes as bars whose lengths are shares of energy, so that they can be compared: a radian of a heavy wheel is not one of a
//! light rotor.

use std::collections::HashSet;

use super::analysis_pictures::{MODES, heading};
use super::drawing::{CHARACTER, bar, cut, drawing, line, text};
use super::model::Picture;
use super::phrases;
use super::text::figure;
use kardan_results::{Complex, EnergyKind, Mode};
use kardan_rt::functions::hypot;

/// Modes side by side.
const ACROSS: usize = 8;
/// More shafts, and more springs, are in the exported data only.
const ROWS: usize = 40;
/// Length of a whole, px.
const WHOLE: f64 = 40.0;

/// The share of one shaft or spring in a mode.
#[derive(Debug, Clone, PartialEq)]
struct Bar {
    /// In phase, and a quarter of a period ahead; lengths as parts of the whole, with the sign of the motion.
    parts: [f64; 2],
    /// Of springs.
    potential: bool,
    title: String,
}

/// What a row shows: a coordinate and its kinetic energy, or an element with energy that is no coordinate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Row<'a> {
    name: &'a str,
    potential: bool,
}

fn rows(modes: &[Mode]) -> Vec<Row<'_>> {
    let (mut coordinates, mut further_rows, mut shown) = (Vec::new(), Vec::new(), HashSet::new());
    for part in modes.iter().flat_map(|mode| &mode.shape) {
        let row = Row { name: &part.name, potential: false };
        if shown.insert(row) {
            coordinates.push(row);
        }
    }
    for stored in modes.iter().flat_map(|mode| &mode.stored) {
        let row = Row { name: &stored.element, potential: stored.energy == EnergyKind::Potential };
        if stored.share.abs() > 0.0 && shown.insert(row) {
            further_rows.push(row);
        }
    }
    coordinates.truncate(ROWS);
    further_rows.truncate(ROWS);
    coordinates.into_iter().chain(further_rows).collect()
}

/// The share of the stored energy that a row has in a mode.
fn share(mode: &Mode, row: &Row<'_>) -> f64 {
    let own = mode.stored.iter().filter(|one| one.element == row.name);
    own.filter(|one| (one.energy == EnergyKind::Potential) == row.potential).map(|one| one.share).sum()
}

/// The bar of a row in a mode. Kinetic energy goes with the square of the speed, so its parts in phase and ahead add up to it. Without
/// energies (after an elimination) the motion itself, relative to the largest.
fn bar_of(mode: &Mode, row: &Row<'_>) -> Option<Bar> {
    let motion = mode.shape.iter().filter(|_| !row.potential).find(|part| part.name == row.name).map(|part| part.value);
    let Complex { re, im } = motion.unwrap_or(Complex::new(1.0, 0.0));
    let moved = || format!("motion {} + {} j relative to the largest", figure(re, 3), figure(im, 3));
    if mode.stored.is_empty() {
        let title = format!("{}: {}", row.name, moved());
        return motion.map(|_| Bar { parts: [re, im], potential: false, title });
    }
    let share = share(mode, row);
    let size = hypot(re, im);
    let parts = match size > 0.0 {
        true => [share * re / size * (re / size).abs(), share * im / size * (im / size).abs()],
        false => [share, 0.0],
    };
    let what = if row.potential { "potential" } else { "kinetic" };
    let energy = format!("{}: {} of the energy stored, {what}", row.name, phrases::percent(share));
    let title = if motion.is_some() { format!("{energy}; {}", moved()) } else { energy };
    Some(Bar { parts, potential: row.potential, title })
}

/// Mode shapes as bars: a row for each shaft and each spring, a column for each mode.
pub(super) fn shapes(modes: &[Mode]) -> Option<Picture> {
    let shown = &modes[..modes.len().min(MODES)];
    let rows = rows(shown);
    if rows.is_empty() {
        return None;
    }
    let longest = rows.iter().map(|row| row.name.chars().count()).max().unwrap_or(0).min(24);
    let (left, column, height, top) = (CHARACTER * longest as f64 + 16.0, 96.0, 21.0, 42.0);
    let mut out = String::new();
    for (chunk_index, chunk) in shown.chunks(ACROSS).enumerate() {
        let mut body = String::new();
        let bottom = top + height * rows.len() as f64;
        for (i, row) in rows.iter().enumerate() {
            let class = if row.potential { "end faint" } else { "end" };
            body += &text(left - 10.0, top + height * (i as f64 + 0.5) + 4.0, class, &cut(row.name, 24));
        }
        for (j, mode) in chunk.iter().enumerate() {
            let centre = left + column * (j as f64 + 0.5);
            let class = if mode.controllable && mode.observable { "middle strong" } else { "middle strong failing" };
            body += &text(centre, 14.0, class, &heading(chunk_index * ACROSS + j, mode));
            body += &text(centre, 30.0, "middle faint", &format!("ζ {}", figure(mode.damping_ratio, 3)));
            for (i, row) in rows.iter().enumerate() {
                let middle = top + height * (i as f64 + 0.5);
                body += &bar_of(mode, row).map(|bar| bars(&bar, centre, middle)).unwrap_or_default();
            }
            body += &line((centre, top - 4.0), (centre, bottom), "axis");
        }
        let label = "mode shapes, one row for each shaft and each spring";
        out += &drawing(left + column * chunk.len() as f64 + 8.0, bottom + 6.0, label, &body);
    }
    Some(Picture { title: "Mode shapes".into(), drawing: out, caption: caption(modes, &rows) })
}

fn bars(found: &Bar, centre: f64, middle: f64) -> String {
    let Bar { parts: [re, im], potential, title } = found;
    let classes = if *potential { ["c2 potential", "c2 potential"] } else { ["c0", "c1"] };
    let mut body = String::new();
    for (part, y, high, class) in [(re, -6.0, 8.0, classes[0]), (im, 3.0, 4.0, classes[1])] {
        if part.is_finite() && part.abs() > 1e-3 {
            let length = WHOLE * part.clamp(-1.0, 1.0);
            body += &bar(centre + length.min(0.0), middle + y, length.abs(), high, class, title);
        }
    }
    body
}

fn caption(modes: &[Mode], rows: &[Row<'_>]) -> String {
    let energies = modes.iter().any(|mode| !mode.stored.is_empty());
    let bare = modes.iter().any(|mode| mode.stored.is_empty());
    let mut out = String::new();
    if energies {
        out += "Scaled by energy: the lengths of all bars of a mode add up to the energy stored in it. The bar of a shaft is its \
                share of kinetic energy (inertia times speed squared), in the direction in which it rotates: ";
    }
    if bare && !energies {
        out += "Motion of each shaft relative to the largest: ";
    }
    out += "<span class=\"swatch c0\"></span>in phase, <span class=\"swatch c1\"></span>a quarter of a period ahead. ";
    if rows.iter().any(|row| row.potential) {
        out += "<span class=\"swatch c2 potential\"></span>Springs: their share of potential energy. ";
    }
    if bare && energies {
        out += "In modes without stored energy, bars show the motion relative to the largest. ";
    }
    out += "Modes that are not controllable or not observable are red.";
    let count = |potential: bool| rows.iter().filter(|row| row.potential == potential).count();
    if modes.len() > MODES || count(false) >= ROWS || count(true) >= ROWS {
        out +=
            &format!(" At most {ROWS} shafts, {ROWS} springs and {MODES} modes are drawn; the exported data have all.");
    }
    out
}

#[cfg(test)]
#[path = "../tests/unit/mode_shapes.rs"]
mod tests;

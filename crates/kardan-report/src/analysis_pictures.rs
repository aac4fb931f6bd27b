//! The pictures of an analysis: drawn in the page's colours, so that they adapt to dark mode and paper.

use std::collections::HashMap;

use super::curves::ON_WHITE;
use super::drawing::{self, Area, CHARACTER, CROSS, bar, cut, entry, line, text, upward};
use super::groups::summed;
use super::model::Picture;
use super::phrases;
use super::text::{escape, figure};
use super::ticks;
use kardan_results::{
    Complex, DistanceToUncontrollability, ElementShare, EnergyKind, Mode, PlacementSearch, Pole, Sensitivity,
    StoredShare, Zeros,
};
use kardan_rt::functions::{asinh, hypot, log10, powf, powi};

/// More modes are in the table only.
pub(super) const MODES: usize = 24;
/// Number of elements of one kind with a separate colour; all others share one more colour.
const COLOURS: usize = ON_WHITE.len() - 1;
/// More placements are in the table only.
const SETS: usize = 12;

/// An axis through zero; logarithmic away from zero where the values span more than two powers of ten.
struct Scale {
    low: f64,
    high: f64,
    /// Below this value the axis is linear; `None`: linear everywhere.
    knee: Option<f64>,
    ticks: Vec<(f64, String)>,
}

impl Scale {
    fn new(values: &[f64], count: usize) -> Scale {
        let sizes = || values.iter().map(|value| value.abs()).filter(|size| *size > 0.0 && size.is_finite());
        let largest = sizes().fold(0.0, f64::max);
        let smallest = sizes().fold(f64::INFINITY, f64::min).max(1e-6 * largest);
        let finite = || values.iter().copied().filter(|value| value.is_finite()).chain([0.0]);
        if !(largest > 100.0 * smallest) {
            let axis = ticks::axis(finite(), 0.08, count);
            return Scale { low: axis.low, high: axis.high, knee: None, ticks: axis.ticks() };
        }
        let knee = powf(10.0, log10(smallest).floor());
        let bent = |value: f64| asinh(value / knee);
        let (low, high) = finite().map(bent).fold((0.0, 0.0), |(a, b): (f64, f64), v| (a.min(v), b.max(v)));
        let free = 0.08 * (high - low);
        let (low, high) = (low - free, high + free);
        let (first, last) = (log10(knee).round() as i32, log10(largest).ceil() as i32);
        let every = ((last - first + 1) as f64 / (0.5 * count as f64)).ceil().max(1.0) as usize;
        let powers = (first..=last).rev().step_by(every).map(|power| powi(10.0, power));
        let ticks = powers.flat_map(|size| [size, -size]).chain([0.0]);
        let ticks = ticks.filter(|&at| (low..=high).contains(&bent(at))).map(|at| (at, figure(at, 3))).collect();
        Scale { low, high, knee: Some(knee), ticks }
    }

    /// Position of a value, from 0 to 1.
    fn place(&self, value: f64) -> f64 {
        let bent = self.knee.map_or(value, |knee| asinh(value / knee));
        (bent - self.low) / (self.high - self.low)
    }

    fn placed_ticks(&self) -> impl Iterator<Item = (f64, String)> {
        self.ticks.iter().map(|(at, label)| (self.place(*at), label.clone()))
    }
}

/// Points of the complex plane: value, multiplicity, failing property.
struct Point {
    at: Pole,
    times: usize,
    unreached: bool,
    unobservable: bool,
}

fn gather(points: &mut Vec<Point>, at: Pole, unreached: bool, unobservable: bool) {
    let near = |point: &&mut Point| hypot(point.at.re - at.re, point.at.im - at.im) <= 1e-9 * hypot(at.re, at.im);
    match points.iter_mut().find(near) {
        Some(point) => {
            point.times += 1;
            point.unreached |= unreached;
            point.unobservable |= unobservable;
        }
        None => points.push(Point { at, times: 1, unreached, unobservable }),
    }
}

/// Poles and zeros in the complex plane.
pub(super) fn plane(modes: &[Mode], zeros: &Zeros) -> Option<Picture> {
    let mut poles = Vec::new();
    for mode in modes.iter().filter(|mode| mode.eigenvalue.re.is_finite() && mode.eigenvalue.im.is_finite()) {
        let Complex { re, im } = mode.eigenvalue;
        gather(&mut poles, Complex { re, im }, !mode.controllable, !mode.observable);
        if im != 0.0 {
            gather(&mut poles, Complex { re, im: -im }, !mode.controllable, !mode.observable);
        }
    }
    let mut circles = Vec::new();
    for &Complex { re, im } in zeros.values.iter().filter(|zero| zero.re.is_finite() && zero.im.is_finite()) {
        gather(&mut circles, Complex { re, im }, false, false);
    }
    if poles.is_empty() && circles.is_empty() {
        return None;
    }
    let plane = Plane::new(poles.iter().chain(&circles).map(|point| point.at));
    let mut body = plane.frame();
    for point in &circles {
        let title = format!("zero at {}", phrases::pair(point.at));
        body += &mark(plane.place(point.at), "zero", &title, point);
    }
    for point in &poles {
        let fails = match (point.unreached, point.unobservable) {
            (false, false) => "",
            (true, false) => ", not controllable",
            (false, true) => ", not observable",
            (true, true) => ", neither controllable nor observable",
        };
        let title = format!("eigenvalue {}{fails}", phrases::pair(point.at));
        body += &mark(plane.place(point.at), "pole", &title, point);
    }
    let below = plane.below();
    let sample = |unreached, unobservable| Point { at: Complex::default(), times: 1, unreached, unobservable };
    let mut at = Plane::LEFT;
    for (kind, sample, label) in [
        ("pole", sample(false, false), "eigenvalue"),
        ("zero", sample(false, false), "invariant zero"),
        ("pole", sample(true, false), "not controllable"),
        ("pole", sample(false, true), "not observable"),
    ] {
        body += &mark((at + 8.0, below - 4.0), kind, label, &sample);
        body += &text(at + 28.0, below, "", label);
        at += 50.0 + 6.2 * label.len() as f64;
    }
    let caption = format!("{} Modes in the shaded half-plane are unstable.", plane.caption());
    let size = [Plane::FULL_WIDTH, below + 12.0];
    Some(Picture::drawn("Poles and zeros", size, "poles and zeros in the complex plane", &body, &caption))
}

/// The complex plane with its axes.
pub(super) struct Plane {
    real: Scale,
    imaginary: Scale,
    /// Whether all points are real.
    flat: bool,
    area: Area,
}

impl Plane {
    pub(super) const LEFT: f64 = 84.0;
    const WIDTH: f64 = 600.0;
    /// Full width with margins.
    pub(super) const FULL_WIDTH: f64 = Self::LEFT + Self::WIDTH + 16.0;

    /// Large enough for these points and their conjugates.
    pub(super) fn new(points: impl Iterator<Item = Pole> + Clone) -> Plane {
        let real = Scale::new(&points.clone().map(|point| point.re).collect::<Vec<_>>(), 9);
        let sizes: Vec<f64> = points.flat_map(|point| [point.im, -point.im]).collect();
        let flat = sizes.iter().all(|size| *size == 0.0);
        let mut imaginary = Scale::new(if flat { &[1.0, -1.0] } else { &sizes }, if flat { 3 } else { 9 });
        imaginary.ticks.retain(|(at, _)| !flat || *at == 0.0);
        let height = if flat { 110.0 } else { 380.0 };
        Plane { real, imaginary, flat, area: Area { left: Self::LEFT, top: 12.0, width: Self::WIDTH, height } }
    }

    /// Position of a point in the picture.
    pub(super) fn place(&self, at: Pole) -> (f64, f64) {
        self.area.at(self.real.place(at.re), self.imaginary.place(at.im))
    }

    /// Grid, axes and the unstable half-plane.
    pub(super) fn frame(&self) -> String {
        let Area { left, top, width, height } = self.area;
        let (right, bottom) = (self.area.right(), self.area.bottom());
        let (x, y) = self.place(Complex::default());
        let mut body = bar(x, top, right - x, height, "unstable", "unstable half-plane");
        body += &self.area.grid_across(self.real.placed_ticks(), Some(18.0));
        body += &self.area.grid_up(self.imaginary.placed_ticks(), 8.0);
        body += &line((x, top), (x, bottom), "axis");
        body += &line((left, y), (right, y), "axis");
        body += &text(left + 0.5 * width, bottom + 40.0, "middle faint", "real part [1/s]");
        let title = if self.flat { "imaginary" } else { "imaginary part [1/s]" };
        body + &upward("16", top + 0.5 * height, "middle faint", title)
    }

    /// The base line of a legend below the axes.
    pub(super) fn below(&self) -> f64 {
        self.area.bottom() + 66.0
    }

    /// How to read the axes.
    pub(super) fn caption(&self) -> &'static str {
        if self.real.knee.is_some() || self.imaginary.knee.is_some() {
            "An axis with powers of ten is logarithmic away from zero."
        } else {
            "Both axes are linear."
        }
    }
}

fn mark(at: (f64, f64), kind: &str, title: &str, point: &Point) -> String {
    let mut shape = match kind {
        "zero" => "<circle r=\"5.5\"/>".to_owned(),
        _ => format!("<path d=\"{CROSS}\"/>"),
    };
    if point.unreached {
        shape += "<path class=\"ring\" d=\"M-9 -9H9V9H-9Z\"/>";
    }
    if point.unobservable {
        shape += "<path class=\"ring\" d=\"M0 -13L13 0L0 13L-13 0Z\"/>";
    }
    if point.times > 1 {
        shape += &format!("<text x=\"{}\" y=\"-9\">{}×</text>", if kind == "zero" { 8 } else { 12 }, point.times);
    }
    drawing::mark(at, kind, point.unreached || point.unobservable, title, &shape)
}

pub(super) fn heading(k: usize, mode: &Mode) -> String {
    format!("{}: {} Hz", k + 1, figure(mode.natural_frequency / std::f64::consts::TAU, 3))
}

/// The elements that store energy, in groups by its kind, each sorted from the largest sum of shares.
fn groups(modes: &[Mode]) -> [Vec<String>; 2] {
    let all = modes.iter().flat_map(|mode| {
        let stored = mode.stored.iter().map(|one| (&one.element, one.energy, one.share));
        stored.chain(mode.dissipated.iter().map(|one| (&one.element, EnergyKind::Kinetic, 1e-3 * one.share)))
    });
    let counted = all.filter(|(.., share)| *share >= 0.0 && share.is_finite());
    // Kinetic, potential, and both.
    let mut sums = summed(counted.map(|(element, energy, share)| match energy {
        EnergyKind::Kinetic => (element.as_str(), [share, 0.0, share]),
        EnergyKind::Potential => (element.as_str(), [0.0, share, share]),
    }));
    sums.sort_by(|(_, a), (_, b)| b[2].total_cmp(&a[2]));
    let of = |is_potential: bool| {
        let group =
            sums.iter().filter(|(_, [kinetic, potential, sum])| (potential > kinetic) == is_potential && *sum > 0.0);
        group.map(|(name, _)| name.to_string()).collect::<Vec<_>>()
    };
    [of(false), of(true)]
}

/// Where the energy of each mode is stored and lost, as stacked bars.
pub(super) fn energies(modes: &[Mode]) -> Option<Picture> {
    let groups = groups(modes);
    let shown: Vec<(usize, &Mode)> =
        modes.iter().enumerate().filter(|(_, mode)| !mode.stored.is_empty()).take(MODES).collect();
    if shown.is_empty() || groups.iter().all(Vec::is_empty) {
        return None;
    }
    let (left, width, row) = (110.0, 640.0, 44.0);
    let mut body = String::new();
    for (line, (k, mode)) in shown.iter().enumerate() {
        let y = row * line as f64 + 6.0;
        let class = if mode.controllable && mode.observable { "end" } else { "end failing" };
        body += &text(left - 10.0, y + 15.0, class, &heading(*k, mode));
        let stored = mode.stored.iter().map(|StoredShare { element, share, .. }| (element.as_str(), *share));
        body += &stack((left, y, width, 22.0), &stored.collect::<Vec<_>>(), &groups);
        let lost = mode.dissipated.iter().map(|ElementShare { element, share }| (element.as_str(), *share));
        body += &stack((left, y + 25.0, width, 6.0), &lost.collect::<Vec<_>>(), &groups);
    }
    let height = row * shown.len() as f64 + 2.0;
    let swatch = |group: usize, index: usize, name: &str| {
        let pale = if group == 1 { " potential" } else { "" };
        entry(&format!("c{index}{pale}"), &escape(name)) + " "
    };
    let legend = |group: usize, word: &str| {
        let names = &groups[group];
        let named = names.iter().take(COLOURS).enumerate();
        let mut entries: String = named.map(|(index, name)| swatch(group, index, name)).collect();
        if names.len() > COLOURS {
            entries += &swatch(group, COLOURS, "others");
        }
        if names.is_empty() { String::new() } else { format!("{word}: {entries}<br/>") }
    };
    let caption = format!(
        "{}{}Upper bar: where a mode stores energy; lower bar: where it loses energy.",
        legend(0, "Kinetic"),
        legend(1, "Potential")
    );
    let size = [left + width + 8.0, height];
    Some(Picture::drawn("Energy", size, "shares of the energy of each mode by element", &body, &caption))
}

/// One stacked bar at `(left, top, width, height)`: motion first, then springs, in the same order for every mode.
fn stack((left, y, width, height): (f64, f64, f64, f64), parts: &[(&str, f64)], groups: &[Vec<String>; 2]) -> String {
    let mut shares: HashMap<&str, Vec<f64>> = HashMap::new();
    for (element, share) in parts.iter().filter(|(_, share)| *share > 0.0 && share.is_finite()) {
        shares.entry(element).or_default().push(*share);
    }
    let mut segments: Vec<(String, f64, &str, usize)> = Vec::new();
    for (names, kind) in groups.iter().zip(["kinetic", "potential"]) {
        for (index, name) in names.iter().enumerate() {
            let share: f64 = shares.get(name.as_str()).map_or(&[][..], Vec::as_slice).iter().sum();
            match segments.last_mut() {
                Some(last) if index > COLOURS && last.3 == COLOURS && last.2 == kind => last.1 += share,
                _ if index >= COLOURS => segments.push(("others".into(), share, kind, COLOURS)),
                _ => segments.push((name.clone(), share, kind, index)),
            }
        }
    }
    let mut body = String::new();
    let mut x = left;
    for (name, share, kind, colour) in segments.iter().filter(|segment| segment.1 > 0.0) {
        let length = (width * share).min(left + width - x);
        let label = format!("{name} {}", phrases::percent(*share));
        body += &bar(x, y, length, height, &format!("c{colour} {kind}"), &label);
        let short = [&label, name].into_iter().find(|text| CHARACTER * text.chars().count() as f64 <= length - 8.0);
        if let (true, Some(short)) = (height > 12.0, short) {
            body += &text(x + 6.0, y + 15.0, &format!("on {kind}"), short);
        }
        x += length;
    }
    body
}

/// The scores of the best placements as bars.
pub(super) fn ranking(search: &PlacementSearch) -> Option<Picture> {
    let sets = &search.sets[..search.sets.len().min(SETS)];
    let scores = || sets.iter().map(|set| set.score).filter(|score| *score > 0.0 && score.is_finite());
    let largest = scores().fold(0.0, f64::max);
    if largest <= 0.0 {
        return None;
    }
    let smallest = scores().fold(largest, f64::min);
    let logarithmic = largest > 1000.0 * smallest;
    let length = |score: f64| match logarithmic {
        true => (1.0 + log10(score / smallest)) / (1.0 + log10(largest / smallest)),
        false => score / largest,
    };
    let names: Vec<String> = sets.iter().map(|set| cut(&set.places.join(", "), 36)).collect();
    let longest = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let (left, width, row) = (CHARACTER * longest as f64 + 16.0, 360.0, 26.0);
    let mut body = String::new();
    for (k, (set, name)) in sets.iter().zip(&names).enumerate() {
        let y = row * k as f64 + 4.0;
        body += &text(left - 10.0, y + 14.0, "end", name);
        let drawn = if set.score > 0.0 && set.score.is_finite() { width * length(set.score) } else { 0.0 };
        body += &bar(left, y, drawn, 18.0, if k == 0 { "c0" } else { "c0 later" }, &set.places.join(", "));
        let score = format!("{} {}", figure(set.score, 3), super::text::unit(&search.unit));
        body += &text(left + drawn + 8.0, y + 14.0, "", score.trim_end());
    }
    body += &line((left, 0.0), (left, row * sets.len() as f64), "axis");
    let room = CHARACTER * (10 + search.unit.chars().count()) as f64;
    let size = [left + width + room, row * sets.len() as f64 + 2.0];
    let caption = if logarithmic { "The bars are logarithmic." } else { "" };
    Some(Picture::drawn("", size, "scores of the placements", &body, caption))
}

/// Distance to the nearest loss of structure: proven ranges, undecided ranges, and found losses.
pub(super) fn margins(sensitivity: &Sensitivity) -> Option<Picture> {
    let rows: Vec<(&str, &DistanceToUncontrollability)> =
        [("controllability", &sensitivity.controllability), ("observability", &sensitivity.observability)]
            .into_iter()
            .filter_map(|(what, search)| Some((what, search.as_ref().filter(|search| searched(search))?)))
            .collect();
    if rows.is_empty() {
        return None;
    }
    let found = |search: &DistanceToUncontrollability| {
        search.nearest.as_ref().map(|loss| loss.distance).filter(|d| d.is_finite())
    };
    let farthest = rows.iter().map(|(_, s)| found(s).unwrap_or(0.0).max(s.proven_distance)).fold(1.0, f64::max);
    let end = if rows.iter().any(|(_, s)| found(s).is_none()) { 10.0 } else { (1.2 * farthest).clamp(1.5, 12.0) };
    let (left, width, row, top) = (CHARACTER * 16.0 + 16.0, 460.0, 30.0, 22.0);
    let x = |distance: f64| left + width * (distance / end).clamp(0.0, 1.0);
    let bottom = top + row * rows.len() as f64;
    let mut body = String::new();
    let step = match end {
        end if end > 5.0 => 2.0,
        end if end > 2.0 => 1.0,
        _ => 0.5,
    };
    for k in 0..=(end / step) as usize {
        let at = step * k as f64;
        body += &line((x(at), top), (x(at), bottom), "grid");
        body += &text(x(at), bottom + 16.0, "middle faint", &figure(at, 3));
    }
    for (k, (what, search)) in rows.iter().enumerate() {
        let y = top + row * k as f64 + 6.0;
        body += &text(left - 10.0, y + 14.0, "end", what);
        let proven = search.proven_distance;
        let label = format!("no loss of {what} within {} tolerances: proven", figure(proven, 4));
        body += &bar(left, y, x(proven) - left, 18.0, "safe", &label);
        let until = found(search).unwrap_or(end);
        body += &bar(x(proven), y, x(until) - x(proven), 18.0, "undecided", "neither proven nor found");
        if let Some(distance) = found(search) {
            body += &line((x(distance), y - 4.0), (x(distance), y + 22.0), "loss");
        }
    }
    body += &line((x(1.0), top - 4.0), (x(1.0), bottom), "axis");
    body += &text(x(1.0), top - 8.0, "middle", "tolerances");
    let legend = [("safe", "proven: no loss"), ("undecided", "undecided"), ("loss", "a loss was found")];
    let legend: String = legend.map(|(swatch, meaning)| entry(swatch, meaning)).concat();
    let caption = format!("Largest deviation of a parameter, in tolerances. {legend}");
    let (size, label) = ([left + width + 30.0, bottom + 24.0], "distance to the nearest loss, in tolerances");
    Some(Picture::drawn("Distance to the nearest loss", size, label, &body, &caption))
}

fn searched(search: &DistanceToUncontrollability) -> bool {
    search.nearest.is_some() || search.starts > 0 || search.proven_distance > 0.0
}

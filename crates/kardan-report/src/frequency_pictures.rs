//! Frequency and step responses of a loop as pictures: Bode, Nyquist, Nichols, singular values, steps.

use super::analysis_pictures::{drawing, figure_of, line, text};
use super::model::Picture;
use super::text::{escape, figure, unit};
use super::{phrases, ticks};
use kardan::results::{
    ChannelMargin, LoopFunction, LoopGain, LoopResponses, MarginsOverPositions, PositionMargins, ReferenceResponse,
    SingularValues, StepResponse,
};
use kardan_rt::functions::{atan2, cos, hypot, log10, powf, powi, sin};

const LEFT: f64 = 64.0;
const TOP: f64 = 12.0;
const WIDTH: f64 = 620.0;
/// Free space to the right of a plot.
const RIGHT: f64 = 22.0;
/// Height of a panel.
const HEIGHT: f64 = 190.0;
/// Space between two panels.
const BETWEEN: f64 = 18.0;
/// Side of a square plot.
const SQUARE: f64 = 460.0;
/// Number of curve colours.
const COLOURS: usize = 7;
/// Range of shown gains, dB.
const DEPTH: f64 = 120.0;
/// Range of shown phases, degrees.
const TURNS: f64 = 1080.0;
/// Least and largest half-width of a Nyquist plot.
const NEAR: [f64; 2] = [1.6, 2.6];
/// The middle of a Nyquist plot, on the real axis.
const MIDDLE: f64 = -0.5;
/// Responses below this fraction of the largest one of their output count as zero.
const NONE: f64 = 1e-9;
/// Closed-loop gains with a contour in a Nichols chart, dB.
const CONTOURS: [f64; 8] = [-20.0, -12.0, -6.0, -3.0, 0.0, 3.0, 6.0, 12.0];

/// One axis of a plot.
#[derive(Clone, Copy)]
struct Axis {
    low: f64,
    high: f64,
    logarithmic: bool,
    /// Distance of ticks; unused for a logarithmic axis.
    step: f64,
}

impl Axis {
    fn logarithmic(low: f64, high: f64) -> Self {
        Self { low, high, logarithmic: true, step: 0.0 }
    }

    /// About this number of ticks, at multiples of one of these steps.
    fn by(steps: &[f64], low: f64, high: f64, most: f64) -> Self {
        let step = steps.iter().copied().find(|step| (high - low) / step <= most);
        let step = step.unwrap_or_else(|| steps.last().copied().unwrap_or(1.0));
        let (low, high) = ((low / step).floor() * step, (high / step).ceil() * step);
        let high = if high > low { high } else { low + step };
        Self { low, high, logarithmic: false, step }
    }

    fn fitting(values: impl Iterator<Item = f64>, margin: f64, count: usize) -> Self {
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
    fn ticks(&self) -> Vec<(f64, String)> {
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
struct Panel {
    x: f64,
    y: f64,
    width: f64,
    height: f64,
    across: Axis,
    up: Axis,
}

impl Panel {
    fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (self.x + self.width * self.across.place(x), self.y + self.height * (1.0 - self.up.place(y)))
    }

    /// Grid and labels; those of the horizontal axis only where it is named.
    fn frame(&self, across: &str, up: &str) -> String {
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
        let (x, y) = (14.0, self.y + 0.5 * self.height);
        out + &format!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" class=\"middle\" transform=\"rotate(-90 {x:.1} {y:.1})\">{}</text>\n",
            escape(up)
        )
    }

    /// A curve through points, cut off at the frame.
    fn curve(&self, points: impl Iterator<Item = (f64, f64)>, style: &str) -> String {
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
    fn cut(&self, from: (f64, f64), to: (f64, f64)) -> Option<((f64, f64), (f64, f64))> {
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

    fn contains(&self, (x, y): (f64, f64)) -> bool {
        (self.x - 0.5..=self.x + self.width + 0.5).contains(&x)
            && (self.y - 0.5..=self.y + self.height + 0.5).contains(&y)
    }

    /// A dot with a title, if it is within the frame.
    fn dot(&self, at: (f64, f64), colour: usize, title: &str) -> String {
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

    /// The Nyquist frequency.
    fn sampled(&self, nyquist: Option<f64>, named: bool) -> String {
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

fn solid(colour: usize) -> String {
    format!("stroke=\"{}\" stroke-width=\"1.7\"", shade(colour))
}

fn thin(colour: usize) -> String {
    format!("stroke=\"{}\" stroke-width=\"1\" stroke-opacity=\".55\"", shade(colour))
}

/// Curves with their colours, one a line.
fn legend(entries: impl Iterator<Item = (usize, String)>) -> String {
    entries
        .map(|(colour, what)| format!("<span class=\"swatch c{}\"></span>{}<br>", colour % COLOURS, escape(&what)))
        .collect()
}

fn decibels(size: f64) -> f64 {
    20.0 * log10(size)
}

/// Phases without jumps, degrees, from one next to −90° on.
fn phases(real: &[f64], imaginary: &[f64]) -> Vec<f64> {
    let mut out: Vec<f64> = Vec::with_capacity(real.len());
    for (re, im) in real.iter().zip(imaginary) {
        let here = atan2(*im, *re).to_degrees();
        let before = out.last().copied().filter(|x: &f64| x.is_finite()).unwrap_or(-90.0);
        out.push(here + 360.0 * ((before - here) / 360.0).round());
    }
    out
}

/// A drawn response.
struct Drawn<'a> {
    name: String,
    real: &'a [f64],
    imaginary: &'a [f64],
    colour: usize,
    margin: Option<&'a ChannelMargin>,
}

impl Drawn<'_> {
    fn sizes(&self) -> impl Iterator<Item = f64> {
        self.real.iter().zip(self.imaginary).map(|(re, im)| hypot(*re, *im))
    }

    fn phases(&self) -> Vec<f64> {
        phases(self.real, self.imaginary)
    }

    /// The point of the phase margin: frequency and the phase of L there.
    fn phase_margin(&self, frequencies: &[f64]) -> Option<(f64, f64, f64)> {
        let margin = self.margin?;
        let at = margin.phase_frequency.filter(|_| margin.phase.is_finite())?;
        let phases = self.phases();
        let next = frequencies.partition_point(|frequency| *frequency < at).min(frequencies.len().checked_sub(1)?);
        let near = *phases.get(next)?;
        // At the crossover |L| = 1, the phase is ±180° plus or minus the margin.
        let limit = 360.0 * ((near + 180.0) / 360.0).round() - 180.0;
        let margin = margin.phase.to_degrees();
        let phase = if near >= limit { limit + margin } else { limit - margin };
        Some((at, phase, limit))
    }

    /// The factors at which the loop becomes unstable, with their frequencies.
    fn gain_margins(&self) -> impl Iterator<Item = (f64, f64)> {
        let both = self.margin.map(|margin| margin.gain.into_iter().zip(margin.gain_frequency));
        both.into_iter().flatten().filter_map(|(factor, frequency)| {
            Some((factor, frequency.filter(|at| factor > 0.0 && factor.is_finite() && *at > 0.0)?))
        })
    }

    /// Name and margins.
    fn legend(&self) -> String {
        let Some(margin) = self.margin else { return self.name.clone() };
        let [low, high] = phrases::factors(margin.gain, |_, factor| figure(factor, 3));
        let phase =
            if margin.phase.is_finite() { format!("{}°", figure(margin.phase.to_degrees(), 3)) } else { "any".into() };
        let delay = match margin.delay {
            Some(delay) if delay.is_finite() => format!(", delay {} s", figure(delay, 3)),
            _ => String::new(),
        };
        format!("{}: gain × {low} to {high}, phase {phase}{delay}, disk margin {}", self.name, figure(margin.disk, 3))
    }
}

/// The loop gains that are drawn: those of the motors or those of the readings.
fn drawn<'a>(found: &'a LoopResponses, margins: &'a [ChannelMargin], readings: bool) -> Vec<Drawn<'a>> {
    let all = found.loops.iter().filter(|one| one.is_sensor == readings && !one.open);
    let of = |(colour, one): (usize, &'a LoopGain)| Drawn {
        name: one.name.clone(),
        real: &one.real,
        imaginary: &one.imaginary,
        colour,
        margin: margins.iter().find(|margin| margin.name == one.name && margin.is_sensor == readings),
    };
    all.enumerate().map(of).collect()
}

/// Bode, Nyquist and Nichols plot of the loops broken at the motors, or at the readings.
pub(super) fn loops(found: &LoopResponses, margins: &[ChannelMargin], readings: bool) -> Vec<Picture> {
    let curves = drawn(found, margins, readings);
    if curves.is_empty() || found.frequencies.len() < 2 {
        return Vec::new();
    }
    let at = if readings { "a reading" } else { "a motor" };
    let caption = format!(
        "Loop gain L with the loop broken only at {at}, all others closed. Dots: where a factor (upper plot) or a \
         phase rotation (lower plot) makes the loop unstable, with the margin to it. {}<br>{}",
        if found.nyquist.is_some() { "L includes sampling, hold, delay and lag." } else { "L includes lags." },
        legend(curves.iter().map(|one| (one.colour, one.legend())))
    );
    let title = format!("Bode plot of the loop at {}", if readings { "each reading" } else { "each motor" });
    let bode = figure_of(&title, &bode(found, &curves, "|L| [dB]", "phase of L [°]"), &caption);
    vec![bode, nyquist(found, &curves, at), nichols(found, &curves, at)]
}

fn frequency_axis(found: &LoopResponses) -> Axis {
    let low = found.frequencies.first().copied().unwrap_or(1.0);
    let high = found.frequencies.last().copied().unwrap_or(10.0);
    Axis::logarithmic(low, if found.nyquist.is_some() { 1.08 * high } else { high })
}

/// The range of shown gains, dB.
fn gain_axis(sizes: impl Iterator<Item = f64>) -> Axis {
    let all: Vec<f64> = sizes.map(decibels).filter(|x| x.is_finite()).collect();
    let high = all.iter().copied().fold(f64::MIN, f64::max).max(-DEPTH);
    let low = all.iter().copied().fold(f64::MAX, f64::min).max(high - DEPTH);
    let (low, high) = if all.is_empty() { (-20.0, 20.0) } else { (low, high) };
    Axis::by(&[5.0, 10.0, 20.0, 40.0, 100.0], low - 1.0, high + 1.0, 8.0)
}

/// Gain and phase over the frequency.
fn bode(found: &LoopResponses, curves: &[Drawn<'_>], gain: &str, phase: &str) -> String {
    let across = frequency_axis(found);
    let up = gain_axis(curves.iter().flat_map(Drawn::sizes));
    let phase_curves: Vec<Vec<f64>> = curves.iter().map(Drawn::phases).collect();
    let finite = || phase_curves.iter().flatten().copied().filter(|x| x.is_finite());
    let high = finite().fold(-180.0, f64::max);
    let low = finite().fold(-180.0, f64::min).max(high - TURNS);
    let phases = Axis::by(&[15.0, 30.0, 45.0, 90.0, 180.0, 360.0], low - 1.0, high + 1.0, 7.0);
    let above = Panel { x: LEFT, y: TOP, width: WIDTH, height: HEIGHT, across, up };
    let below = Panel { y: TOP + HEIGHT + BETWEEN, up: phases, ..above };
    let mut body = above.frame("", gain) + &below.frame("frequency [rad/s]", phase);
    body += &(above.sampled(found.nyquist, true) + &below.sampled(found.nyquist, false));
    let heavy = "stroke=\"var(--ink)\" stroke-width=\"1\" stroke-dasharray=\"2 3\"";
    body += &above.curve([(across.low, 0.0), (across.high, 0.0)].into_iter(), heavy);
    if curves.iter().any(|one| one.margin.is_some()) {
        body += &below.curve([(across.low, -180.0), (across.high, -180.0)].into_iter(), heavy);
    }
    for (one, phases) in curves.iter().zip(&phase_curves) {
        let frequencies = || found.frequencies.iter().copied();
        body += &above.curve(frequencies().zip(one.sizes().map(decibels)), &solid(one.colour));
        body += &below.curve(frequencies().zip(phases.iter().copied()), &solid(one.colour));
        for (factor, at) in one.gain_margins() {
            let point = (at, -decibels(factor));
            body += &above.curve([(at, 0.0), point].into_iter(), &thin(one.colour));
            let title = format!("{}: × {} at {} rad/s", one.name, figure(factor, 3), figure(at, 4));
            body += &above.dot(point, one.colour, &title);
        }
        if let Some((at, phase, limit)) = one.phase_margin(&found.frequencies) {
            body += &below.curve([(at, limit), (at, phase)].into_iter(), &thin(one.colour));
            let title = format!("{}: {}° at {} rad/s", one.name, figure((phase - limit).abs(), 3), figure(at, 4));
            body += &below.dot((at, phase), one.colour, &title);
        }
    }
    drawing(LEFT + WIDTH + RIGHT, TOP + 2.0 * HEIGHT + BETWEEN + 44.0, "gain and phase over the frequency", &body)
}

/// The loop gains in the complex plane.
fn nyquist(found: &LoopResponses, curves: &[Drawn<'_>], at: &str) -> Picture {
    let largest = curves.iter().flat_map(Drawn::sizes).filter(|x| x.is_finite()).fold(0.0, f64::max);
    let reach = (1.1 * largest).clamp(NEAR[0], NEAR[1]);
    let axis = |middle: f64| {
        let step = if reach > 2.0 { 1.0 } else { 0.5 };
        Axis { low: middle - reach, high: middle + reach, logarithmic: false, step }
    };
    let panel = Panel { x: LEFT, y: TOP, width: SQUARE, height: SQUARE, across: axis(MIDDLE), up: axis(0.0) };
    let mut body = panel.frame("Re L", "Im L");
    let circle = |middle: f64, radius: f64| {
        (0..=180)
            .map(move |k| f64::from(k) * std::f64::consts::TAU / 180.0)
            .map(move |turn| (middle + radius * cos(turn), radius * sin(turn)))
    };
    let faint = "stroke=\"var(--faint)\" stroke-dasharray=\"4 4\"";
    body += &panel.curve(circle(0.0, 1.0), faint);
    for axis in [[(panel.across.low, 0.0), (panel.across.high, 0.0)], [(0.0, panel.up.low), (0.0, panel.up.high)]] {
        body += &panel.curve(axis.into_iter(), "stroke=\"var(--faint)\"");
    }
    for one in curves {
        let points = || one.real.iter().copied().zip(one.imaginary.iter().copied());
        if let Some(disk) = one.margin.map(|margin| margin.disk).filter(|disk| *disk < 2.0) {
            let factor = (2.0 + disk) / (2.0 - disk);
            let (middle, radius) = (-0.5 * (factor + 1.0 / factor), 0.5 * (factor - 1.0 / factor));
            body += &panel.curve(circle(middle, radius), &format!("{} stroke-dasharray=\"1.5 3\"", solid(one.colour)));
        }
        body += &panel.curve(points().map(|(re, im)| (re, -im)), &thin(one.colour));
        body += &panel.curve(points(), &solid(one.colour));
        body += &decades(&panel, found, one);
    }
    let (x, y) = panel.place((-1.0, 0.0));
    body += &format!(
        "<path stroke=\"var(--bad)\" stroke-width=\"2\" d=\"M{:.1} {:.1}l10 10m0 -10l-10 10\"><title>-1</title></path>\n",
        x - 5.0,
        y - 5.0
    );
    let encirclements = |one: &Drawn<'_>| {
        let gain = found.loops.iter().find(|gain| gain.name == one.name && !gain.open);
        match gain.and_then(|gain| gain.unstable_poles) {
            Some(0) => format!("{}: the broken loop has no unstable pole, so L must not encircle −1", one.name),
            Some(1) => format!("{}: the broken loop has one unstable pole, so L must encircle −1 once", one.name),
            Some(count) => {
                format!("{}: the broken loop has {count} unstable poles, so L must encircle −1 {count} times", one.name)
            }
            None => one.name.clone(),
        }
    };
    let caption = format!(
        "Loop gain L with the loop broken only at {at}, for positive frequencies (numbers: rad/s) and, thin, \
         negative ones; L continues outside the frame. Red cross: −1. Dashed: the unit circle. Dotted: the disk, \
         from the disk margin of the same colour, that L must not enter.<br>{}",
        legend(curves.iter().map(|one| (one.colour, encirclements(one))))
    );
    let drawn = drawing(LEFT + SQUARE + RIGHT, TOP + SQUARE + 44.0, "loop gain in the complex plane", &body);
    figure_of(&format!("Nyquist plot of the loop at {at}"), &drawn, &caption)
}

/// Dots at powers of ten of the frequency, as far as they are apart.
fn decades(panel: &Panel, found: &LoopResponses, one: &Drawn<'_>) -> String {
    let mut out = String::new();
    let mut last = (f64::MAX, f64::MAX);
    for (tick, label) in frequency_axis(found).ticks().into_iter().filter(|(_, label)| !label.is_empty()) {
        let next = found.frequencies.partition_point(|frequency| *frequency < tick * (1.0 - 1e-9));
        let Some(re) = one.real.get(next) else { continue };
        let at = panel.place((*re, one.imaginary[next]));
        let apart = hypot(at.0 - last.0, at.1 - last.1);
        if !panel.contains(at) || apart < 26.0 {
            continue;
        }
        last = at;
        out += &panel.dot((*re, one.imaginary[next]), one.colour, &format!("{}: {label} rad/s", one.name));
        out += &text(at.0 + 6.0, at.1 - 5.0, "faint", &label);
    }
    out
}

/// Gain over phase.
fn nichols(found: &LoopResponses, curves: &[Drawn<'_>], at: &str) -> Picture {
    let phase_curves: Vec<Vec<f64>> = curves.iter().map(Drawn::phases).collect();
    let sizes = || curves.iter().flat_map(Drawn::sizes).map(decibels).filter(|x| x.is_finite());
    let (low, high) = (sizes().fold(0.0, f64::min).max(-40.0), sizes().fold(0.0, f64::max).min(40.0));
    let up = Axis::by(&[5.0, 10.0], low - 1.0, high + 1.0, 9.0);
    // Phases of the curves in the frame.
    let phases = curves.iter().zip(&phase_curves).flat_map(|(one, phases)| {
        one.sizes().map(decibels).zip(phases.iter().copied()).filter(|(size, _)| (up.low..=up.high).contains(size))
    });
    let phases: Vec<f64> = phases.map(|(_, phase)| phase).filter(|x| x.is_finite()).collect();
    let right = phases.iter().copied().fold(-90.0, f64::max).min(180.0);
    let left = phases.iter().copied().fold(-270.0, f64::min).max(right - 720.0);
    let across = Axis::by(&[30.0, 45.0, 90.0], left, right, 9.0);
    let panel = Panel { x: LEFT, y: TOP, width: WIDTH, height: 380.0, across, up };
    let mut body = panel.frame("phase of L [°]", "|L| [dB]");
    let turns = ((across.low / 360.0).floor() as i32 - 1)..=((across.high / 360.0).ceil() as i32 + 1);
    for contour in CONTOURS {
        body += &closed_loop_gain(&panel, contour, turns.clone());
    }
    for turn in turns {
        let (x, y) = panel.place((360.0 * f64::from(turn) - 180.0, 0.0));
        if panel.contains((x, y)) {
            body += &format!(
                "<path stroke=\"var(--bad)\" stroke-width=\"2\" d=\"M{:.1} {:.1}l10 10m0 -10l-10 10\"><title>-1</title></path>\n",
                x - 5.0,
                y - 5.0
            );
        }
    }
    for (one, phases) in curves.iter().zip(&phase_curves) {
        body += &panel.curve(phases.iter().copied().zip(one.sizes().map(decibels)), &solid(one.colour));
        for (factor, frequency) in one.gain_margins() {
            let next =
                found.frequencies.partition_point(|other| *other < frequency).min(phases.len().saturating_sub(1));
            let limit = 360.0 * ((phases.get(next).copied().unwrap_or(-180.0) + 180.0) / 360.0).round() - 180.0;
            let title = format!("{}: × {} at {} rad/s", one.name, figure(factor, 3), figure(frequency, 4));
            body += &panel.dot((limit, -decibels(factor)), one.colour, &title);
        }
        if let Some((frequency, phase, limit)) = one.phase_margin(&found.frequencies) {
            let title =
                format!("{}: {}° at {} rad/s", one.name, figure((phase - limit).abs(), 3), figure(frequency, 4));
            body += &panel.dot((phase, 0.0), one.colour, &title);
        }
    }
    let caption = format!(
        "Loop gain L with the loop broken only at {at}. Grey: |L/(1 + L)| constant, in dB. Red crosses: −1. Dots: gain and \
         phase margins.<br>{}",
        legend(curves.iter().map(|one| (one.colour, one.name.clone())))
    );
    let drawn = drawing(LEFT + WIDTH + RIGHT, TOP + 380.0 + 44.0, "loop gain over its phase", &body);
    figure_of(&format!("Nichols chart of the loop at {at}"), &drawn, &caption)
}

/// Where the closed loop has this gain, with its name where there is room.
fn closed_loop_gain(panel: &Panel, contour: f64, turns: std::ops::RangeInclusive<i32>) -> String {
    let size = powf(10.0, contour / 20.0);
    let points: Vec<(f64, f64)> = (1..720)
        .filter_map(|k| {
            // L = T/(1 − T)
            let turn = f64::from(k) * std::f64::consts::PI / 360.0;
            let (re, im) = (size * cos(turn), size * sin(turn));
            let below = powi(1.0 - re, 2) + im * im;
            let (x, y) = ((re * (1.0 - re) - im * im) / below, im / below);
            let phase = atan2(y, x).to_degrees().rem_euclid(360.0) - 360.0;
            (below > 1e-12).then(|| (phase, decibels(hypot(x, y))))
        })
        .collect();
    let mut out = String::new();
    for turn in turns.clone() {
        // A jump in the phase ends a segment.
        for stretch in points.chunk_by(|a, b| (a.0 - b.0).abs() < 180.0) {
            let moved = stretch.iter().map(|(phase, size)| (phase + 360.0 * f64::from(turn), *size));
            out += &panel.curve(moved, "stroke=\"var(--line)\" stroke-width=\"1\"");
        }
    }
    // The name once: at the top of a closed contour, of another one between two of them, of that of 0 dB beside the upper edge.
    let named = turns.flat_map(|turn| points.iter().map(move |(phase, size)| (phase + 360.0 * f64::from(turn), *size)));
    let inside = named.filter(|at| {
        let (x, y) = panel.place(*at);
        panel.contains((x + 22.0, y))
            && panel.contains((x - 22.0, y))
            && panel.contains((x, y - 14.0))
            && panel.contains((x, y + 6.0))
    });
    let between = |phase: f64| (phase + 330.0).rem_euclid(360.0).min((-phase - 330.0).rem_euclid(360.0));
    let place = inside.min_by(|a, b| match contour {
        0.0.. => b.1.total_cmp(&a.1).then(b.0.total_cmp(&a.0)),
        _ => between(a.0).total_cmp(&between(b.0)).then(b.0.total_cmp(&a.0)),
    });
    if let Some(at) = place {
        let (x, y) = panel.place(at);
        out += &text(x, y - 3.0, "middle faint", &format!("{} dB", figure(contour, 3)));
    }
    out
}

/// The name of a function of the loop.
pub(super) fn name(one: &SingularValues) -> String {
    let at = if one.at_sensors { "readings" } else { "motors" };
    match one.function {
        LoopFunction::S => format!("S at the {at}"),
        LoopFunction::T => format!("T at the {at}"),
        LoopFunction::Ks => "KS from the readings to the motors".into(),
    }
}

/// Singular values over the frequency.
pub(super) fn singular_values(found: &LoopResponses) -> Vec<Picture> {
    let of = |readings: bool, noise: bool| -> Vec<&SingularValues> {
        let all = found.sensitivities.iter();
        all.filter(|one| one.at_sensors == readings && (one.function == LoopFunction::Ks) == noise).collect()
    };
    let titles = [
        ("Singular values of S and T at the motors", of(false, false)),
        ("Singular values of S and T at the readings", of(true, false)),
        ("Singular values of KS", of(true, true)),
    ];
    titles.into_iter().filter_map(|(title, all)| sigma(found, title, &all)).collect()
}

fn sigma(found: &LoopResponses, title: &str, all: &[&SingularValues]) -> Option<Picture> {
    let largest = || all.iter().flat_map(|one| one.values.iter().filter_map(|values| values.first().copied()));
    if found.frequencies.len() < 2 || !largest().any(|x| x > 0.0 && x.is_finite()) {
        return None;
    }
    let top = all.iter().filter_map(|one| Some(one.largest?.value));
    // Small singular values would flatten the large ones.
    let highest = largest().fold(0.0, f64::max);
    let every = all.iter().flat_map(|one| one.values.iter().flatten().copied());
    let up = gain_axis(every.filter(|x| *x > 1e-3 * highest).chain(top));
    let across = frequency_axis(found);
    let panel = Panel { x: LEFT, y: TOP, width: WIDTH, height: 1.5 * HEIGHT, across, up };
    let unit_of = all.first().map_or("", |one| one.unit.as_str());
    let mixed = all.iter().any(|one| one.mixed);
    let label = if mixed {
        "[dB, SI units]".into()
    } else if unit_of.is_empty() {
        "[dB]".into()
    } else {
        format!("[dB over 1 {}]", unit(unit_of))
    };
    let mut body = panel.frame("frequency [rad/s]", &label) + &panel.sampled(found.nyquist, true);
    let heavy = "stroke=\"var(--ink)\" stroke-width=\"1\" stroke-dasharray=\"2 3\"";
    body += &panel.curve([(across.low, 0.0), (across.high, 0.0)].into_iter(), heavy);
    for (colour, one) in all.iter().enumerate() {
        let count = one.values.first().map_or(0, Vec::len);
        for k in (0..count).rev() {
            let values = one.values.iter().map(|values| decibels(values.get(k).copied().unwrap_or(f64::NAN)));
            let style = if k == 0 { solid(colour) } else { thin(colour) };
            body += &panel.curve(found.frequencies.iter().copied().zip(values), &style);
        }
        if let Some((largest, at)) = one.largest.and_then(|largest| Some((largest, largest.frequency?))) {
            let title = format!("{}: {} at {} rad/s", name(one), figure(largest.value, 4), figure(at, 4));
            body += &panel.dot((at.max(across.low), decibels(largest.value)), colour, &title);
        }
    }
    let entry = |(colour, one): (usize, &&SingularValues)| {
        let largest = one.largest.map_or(String::new(), |largest| {
            let at = largest.frequency.map_or("unbounded".into(), |at| format!("at {} rad/s", figure(at, 4)));
            let unit = if one.unit.is_empty() { String::new() } else { format!(" {}", unit(&one.unit)) };
            format!(": at most {}{unit} ({} dB), {at}", figure(largest.value, 4), figure(decibels(largest.value), 3))
        });
        (colour, name(one) + &largest)
    };
    let mixed = if mixed {
        " The readings have different units: these values are in SI units; other units give other values."
    } else {
        ""
    };
    let caption = format!(
        "Thick: the largest singular value; thin: the others; with all channels at once.{mixed}<br>{}",
        legend(all.iter().enumerate().map(entry))
    );
    let drawn = drawing(LEFT + WIDTH + RIGHT, TOP + 1.5 * HEIGHT + 44.0, title, &body);
    Some(figure_of(title, &drawn, &caption))
}

/// From the references to the outputs, over the frequency.
pub(super) fn references(found: &LoopResponses) -> Option<Picture> {
    let size = |one: &ReferenceResponse| {
        one.real
            .iter()
            .zip(&one.imaginary)
            .map(|(re, im)| hypot(*re, *im))
            .filter(|x| x.is_finite())
            .fold(0.0, f64::max)
    };
    let largest =
        |output: &str| found.references.iter().filter(|one| one.output == output).map(size).fold(0.0, f64::max);
    let (shown, none): (Vec<&ReferenceResponse>, Vec<&ReferenceResponse>) =
        found.references.iter().partition(|one| size(one) > NONE * largest(&one.output));
    if shown.is_empty() || found.frequencies.len() < 2 {
        return None;
    }
    let of = |one: &ReferenceResponse| {
        let unit = if one.unit.is_empty() { String::new() } else { format!(" [{}]", unit(&one.unit)) };
        format!("{} → {}{unit}", one.reference, one.output)
    };
    let curves: Vec<Drawn<'_>> = shown
        .iter()
        .enumerate()
        .map(|(colour, one)| Drawn { name: of(one), real: &one.real, imaginary: &one.imaginary, colour, margin: None })
        .collect();
    let none: Vec<String> = none.iter().map(|one| format!("{} → {}", one.reference, one.output)).collect();
    let none = if none.is_empty() {
        String::new()
    } else {
        format!("Not drawn, as the transfer is only rounding: {}. ", escape(&none.join(", ")))
    };
    let caption = format!(
        "Closed loop, in dB relative to one SI unit each. {none}{}<br>{}",
        if found.nyquist.is_some() { "Outputs at the sample instants." } else { "" },
        legend(curves.iter().map(|one| (one.colour, one.name.clone())))
    );
    let drawn = bode(found, &curves, "gain [dB]", "phase [°]");
    Some(figure_of("Bode plot from the references to the outputs", &drawn, &caption))
}

/// Disk margins of the motors over the joint angle.
pub(super) fn over_positions(found: &MarginsOverPositions) -> Option<Picture> {
    let names: Vec<&str> = found
        .positions
        .iter()
        .find(|one| !one.motors.is_empty())?
        .motors
        .iter()
        .map(|motor| motor.name.as_str())
        .collect();
    let angles = found.positions.iter().map(|one| one.angle.to_degrees());
    let (low, high) = angles.clone().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    if !(high > low) {
        return None;
    }
    let disks = found.positions.iter().flat_map(|one| one.motors.iter().map(|motor| motor.disk));
    let across = Axis::by(&[15.0, 30.0, 45.0, 90.0, 180.0, 360.0], low, high, 9.0);
    let panel =
        Panel { x: LEFT, y: TOP, width: WIDTH, height: HEIGHT, across, up: Axis::fitting(disks.chain([0.0]), 0.06, 5) };
    let mut body = panel.frame("joint angle [°]", "disk margin");
    for (colour, name) in names.iter().enumerate() {
        let of = |one: &PositionMargins| {
            let motor = one.motors.iter().find(|motor| motor.name == *name);
            (one.angle.to_degrees(), motor.map_or(f64::NAN, |motor| motor.disk))
        };
        // Where the angle restarts, another motion starts.
        for stretch in found.positions.chunk_by(|a, b| b.angle > a.angle) {
            body += &panel.curve(stretch.iter().map(of), &solid(colour));
        }
    }
    let caption = format!(
        "Linear loop with {} at this angle; a gap is a loop that is not stable.<br>{}",
        escape(&found.rotated_coordinates),
        legend(names.iter().enumerate().map(|(colour, name)| (colour, name.to_string())))
    );
    let drawn = drawing(LEFT + WIDTH + RIGHT, TOP + HEIGHT + 44.0, "disk margins over the joint angle", &body);
    Some(figure_of("Disk margins over the joint angle", &drawn, &caption))
}

/// Responses to a step of each reference.
pub(super) fn steps(found: &LoopResponses) -> Vec<Picture> {
    found.steps.iter().filter_map(step).collect()
}

/// A value for drawing: rounding becomes zero.
fn without_rounding(value: f64) -> f64 {
    if value.abs() < 1e-12 { 0.0 } else { value }
}

fn step(found: &StepResponse) -> Option<Picture> {
    let end = found.time.last().copied().filter(|end| *end > 0.0)?;
    let clock = super::text::Clock::until(end);
    let mut groups: Vec<(&str, bool)> = Vec::new();
    for signal in &found.signals {
        if !groups.contains(&(signal.unit.as_str(), signal.motor)) {
            groups.push((&signal.unit, signal.motor));
        }
    }
    let across = Axis::fitting([0.0, end * clock.per_second].into_iter(), 0.0, 8);
    let (mut body, mut y) = (String::new(), TOP);
    let mut entries = Vec::new();
    let last = groups.len().checked_sub(1)?;
    for (k, (shown, motor)) in groups.iter().enumerate() {
        let own: Vec<_> = found
            .signals
            .iter()
            .enumerate()
            .filter(|(_, one)| (one.unit.as_str(), one.motor) == (*shown, *motor))
            .collect();
        let values =
            own.iter().flat_map(|(_, one)| one.values.iter().map(|value| without_rounding(*value))).chain([0.0]);
        let height = 0.8 * HEIGHT;
        let panel = Panel { x: LEFT, y, width: WIDTH, height, across, up: Axis::fitting(values, 0.06, 5) };
        let what = if *motor { "commanded torques" } else { "outputs" };
        let below = if k == last { format!("time [{}]", clock.unit) } else { String::new() };
        body += &panel.frame(&below, &format!("{what} [{}]", unit(shown)));
        for (colour, one) in own {
            let points = found
                .time
                .iter()
                .map(|time| time * clock.per_second)
                .zip(one.values.iter().map(|value| without_rounding(*value)));
            body += &panel.curve(points, &solid(colour));
            entries.push((colour, one.name.clone()));
        }
        y += height + BETWEEN;
    }
    let rounded =
        found.signals.iter().flat_map(|one| &one.values).any(|value| *value != 0.0 && without_rounding(*value) == 0.0);
    let rounding = if rounded { " Values below 1e-12 are rounding and drawn as zero." } else { "" };
    let caption = format!(
        "The linear loop from rest, without limits and friction, after a step of {} by {} {}.{rounding}<br>{}",
        escape(&found.reference),
        figure(found.size, 3),
        escape(&unit(&found.unit)),
        legend(entries.into_iter())
    );
    let drawn = drawing(LEFT + WIDTH + RIGHT, y - BETWEEN + 44.0, "step responses", &body);
    Some(figure_of(&format!("Step of {}", found.reference), &drawn, &caption))
}

#[cfg(test)]
#[path = "../tests/unit/frequency_pictures.rs"]
mod tests;

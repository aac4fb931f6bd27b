//! Loop gains as Bode plot, as Nyquist plot and as Nichols chart, with their margins.

use kardan_results::{ChannelMargin, LoopGain, LoopResponses};
use kardan_rt::functions::{atan2, cos, hypot, log10, powf, powi, sin};

use crate::drawing::{Area, text};
use crate::model::Picture;
use crate::phrases;
use crate::text::figure;
use crate::ticks::Axis;

use super::panel::{BETWEEN, HEAVY, HEIGHT, LEFT, Panel, TOP, legend, solid, thin};

/// Side of a square plot.
const SQUARE: f64 = 460.0;
/// Range of shown gains, dB.
const DEPTH: f64 = 120.0;
/// Range of shown phases, degrees.
const TURNS: f64 = 1080.0;
/// Least and largest half-width of a Nyquist plot.
const NEAR: [f64; 2] = [1.6, 2.6];
/// The middle of a Nyquist plot, on the real axis.
const MIDDLE: f64 = -0.5;
/// Distances of ticks of angles, degrees.
pub(super) const PHASE_STEPS: [f64; 6] = [15.0, 30.0, 45.0, 90.0, 180.0, 360.0];
/// Closed-loop gains with a contour in a Nichols chart, dB.
const CONTOURS: [f64; 8] = [-20.0, -12.0, -6.0, -3.0, 0.0, 3.0, 6.0, 12.0];

pub(super) fn decibels(size: f64) -> f64 {
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
pub(super) struct Drawn<'a> {
    pub(super) name: String,
    pub(super) real: &'a [f64],
    pub(super) imaginary: &'a [f64],
    pub(super) colour: usize,
    pub(super) margin: Option<&'a ChannelMargin>,
}

impl Drawn<'_> {
    fn sizes(&self) -> impl Iterator<Item = f64> {
        self.real.iter().zip(self.imaginary).map(|(re, im)| hypot(*re, *im))
    }

    pub(super) fn phases(&self) -> Vec<f64> {
        phases(self.real, self.imaginary)
    }

    /// The point of the phase margin: frequency and the phase of L there.
    pub(super) fn phase_margin(&self, frequencies: &[f64]) -> Option<(f64, f64, f64)> {
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

    /// What a dot at a gain margin means.
    fn gain_title(&self, factor: f64, at: f64) -> String {
        format!("{}: × {} at {} rad/s", self.name, figure(factor, 3), figure(at, 4))
    }

    /// What a dot at a phase margin means.
    fn phase_title(&self, at: f64, margin: f64) -> String {
        format!("{}: {}° at {} rad/s", self.name, figure(margin.abs(), 3), figure(at, 4))
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
pub(super) fn drawn<'a>(found: &'a LoopResponses, margins: &'a [ChannelMargin], readings: bool) -> Vec<Drawn<'a>> {
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
pub(crate) fn loops(found: &LoopResponses, margins: &[ChannelMargin], readings: bool) -> Vec<Picture> {
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
    let bode = bode(found, &curves, ["|L| [dB]", "phase of L [°]"], &title, &caption);
    vec![bode, nyquist(found, &curves, at), nichols(found, &curves, at)]
}

pub(super) fn frequency_axis(found: &LoopResponses) -> Axis {
    let low = found.frequencies.first().copied().unwrap_or(1.0);
    let high = found.frequencies.last().copied().unwrap_or(10.0);
    Axis::logarithmic(low, if found.nyquist.is_some() { 1.08 * high } else { high })
}

/// The range of shown gains, dB.
pub(super) fn gain_axis(sizes: impl Iterator<Item = f64>) -> Axis {
    let all: Vec<f64> = sizes.map(decibels).filter(|x| x.is_finite()).collect();
    let high = all.iter().copied().fold(f64::MIN, f64::max).max(-DEPTH);
    let low = all.iter().copied().fold(f64::MAX, f64::min).max(high - DEPTH);
    let (low, high) = if all.is_empty() { (-20.0, 20.0) } else { (low, high) };
    Axis::by(&[5.0, 10.0, 20.0, 40.0, 100.0], low - 1.0, high + 1.0, 8.0)
}

/// Gain and phase over the frequency, with the names of both axes.
pub(super) fn bode(
    found: &LoopResponses,
    curves: &[Drawn<'_>],
    [gain, phase]: [&str; 2],
    title: &str,
    caption: &str,
) -> Picture {
    let across = frequency_axis(found);
    let up = gain_axis(curves.iter().flat_map(Drawn::sizes));
    let phase_curves: Vec<Vec<f64>> = curves.iter().map(Drawn::phases).collect();
    let finite = || phase_curves.iter().flatten().copied().filter(|x| x.is_finite());
    let high = finite().fold(-180.0, f64::max);
    let low = finite().fold(-180.0, f64::min).max(high - TURNS);
    let above = Panel::new(TOP, HEIGHT, across, up);
    let phases = Axis::by(&PHASE_STEPS, low - 1.0, high + 1.0, 7.0);
    let below = Panel::new(TOP + HEIGHT + BETWEEN, HEIGHT, across, phases);
    let mut body = above.frame("", gain) + &below.frame("frequency [rad/s]", phase);
    body += &(above.sampled(found.nyquist, true) + &below.sampled(found.nyquist, false));
    body += &above.across_at(0.0, HEAVY);
    if curves.iter().any(|one| one.margin.is_some()) {
        body += &below.across_at(-180.0, HEAVY);
    }
    for (one, phases) in curves.iter().zip(&phase_curves) {
        let frequencies = || found.frequencies.iter().copied();
        body += &above.curve(frequencies().zip(one.sizes().map(decibels)), &solid(one.colour));
        body += &below.curve(frequencies().zip(phases.iter().copied()), &solid(one.colour));
        for (factor, at) in one.gain_margins() {
            let point = (at, -decibels(factor));
            body += &above.curve([(at, 0.0), point].into_iter(), &thin(one.colour));
            body += &above.dot(point, one.colour, &one.gain_title(factor, at));
        }
        if let Some((at, phase, limit)) = one.phase_margin(&found.frequencies) {
            body += &below.curve([(at, limit), (at, phase)].into_iter(), &thin(one.colour));
            body += &below.dot((at, phase), one.colour, &one.phase_title(at, phase - limit));
        }
    }
    below.picture(title, "gain and phase over the frequency", &body, caption)
}

/// The loop gains in the complex plane.
fn nyquist(found: &LoopResponses, curves: &[Drawn<'_>], at: &str) -> Picture {
    let largest = curves.iter().flat_map(Drawn::sizes).filter(|x| x.is_finite()).fold(0.0, f64::max);
    let reach = (1.1 * largest).clamp(NEAR[0], NEAR[1]);
    let step = if reach > 2.0 { 1.0 } else { 0.5 };
    let axis = |middle: f64| Axis::linear(middle - reach, middle + reach, step);
    let area = Area { left: LEFT, top: TOP, width: SQUARE, height: SQUARE };
    let panel = Panel { area, across: axis(MIDDLE), up: axis(0.0) };
    let mut body = panel.frame("Re L", "Im L");
    let circle = |middle: f64, radius: f64| {
        (0..=180)
            .map(move |k| f64::from(k) * std::f64::consts::TAU / 180.0)
            .map(move |turn| (middle + radius * cos(turn), radius * sin(turn)))
    };
    let faint = "stroke=\"var(--faint)\" stroke-dasharray=\"4 4\"";
    body += &panel.curve(circle(0.0, 1.0), faint);
    body += &panel.across_at(0.0, "stroke=\"var(--faint)\"");
    body += &panel.curve([(0.0, panel.up.low), (0.0, panel.up.high)].into_iter(), "stroke=\"var(--faint)\"");
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
    body += &panel.critical((-1.0, 0.0));
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
    panel.picture(&format!("Nyquist plot of the loop at {at}"), "loop gain in the complex plane", &body, &caption)
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
    let panel = Panel::new(TOP, 380.0, across, up);
    let mut body = panel.frame("phase of L [°]", "|L| [dB]");
    let turns = ((across.low / 360.0).floor() as i32 - 1)..=((across.high / 360.0).ceil() as i32 + 1);
    for contour in CONTOURS {
        body += &closed_loop_gain(&panel, contour, turns.clone());
    }
    for turn in turns {
        body += &panel.critical((360.0 * f64::from(turn) - 180.0, 0.0));
    }
    for (one, phases) in curves.iter().zip(&phase_curves) {
        body += &panel.curve(phases.iter().copied().zip(one.sizes().map(decibels)), &solid(one.colour));
        for (factor, frequency) in one.gain_margins() {
            let next =
                found.frequencies.partition_point(|other| *other < frequency).min(phases.len().saturating_sub(1));
            let limit = 360.0 * ((phases.get(next).copied().unwrap_or(-180.0) + 180.0) / 360.0).round() - 180.0;
            body += &panel.dot((limit, -decibels(factor)), one.colour, &one.gain_title(factor, frequency));
        }
        if let Some((frequency, phase, limit)) = one.phase_margin(&found.frequencies) {
            body += &panel.dot((phase, 0.0), one.colour, &one.phase_title(frequency, phase - limit));
        }
    }
    let caption = format!(
        "Loop gain L with the loop broken only at {at}. Grey: |L/(1 + L)| constant, in dB. Red crosses: −1. Dots: gain and \
         phase margins.<br>{}",
        legend(curves.iter().map(|one| (one.colour, one.name.clone())))
    );
    panel.picture(&format!("Nichols chart of the loop at {at}"), "loop gain over its phase", &body, &caption)
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

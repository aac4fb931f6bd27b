//! Margins as sentences.

use kardan_math::names::quoted;
use kardan_results::{LoopLimit, Margins, MultiloopMargin, RateLimit, Stability, ZeroPoleEvidence};
use kardan_synthesis::LIMIT_STEP;

/// The paragraph on the effect of sampling on this design.
pub(in crate::study) fn verdict(margins: &Margins) -> String {
    let mut out = vec![stability(margins)];
    free_motions(margins, &mut out);
    limits(margins, &mut out);
    channels(margins, &mut out);
    for peak in margins.peaks.iter().filter(|peak| peak.limit.is_some_and(|limit| peak.peak > limit * (1.0 + 1e-9))) {
        let limit = peak.limit.unwrap_or_default();
        out.push(format!(
            "A step of {} by {} {} demands {:.3} N m of {}, whose limit is {limit} N m: filter the reference, or \
             request {:.3} {}.",
            peak.reference,
            peak.step,
            peak.step_unit,
            peak.peak,
            peak.input,
            peak.step * limit / peak.peak,
            peak.step_unit
        ));
    }
    out.join(" ")
}

/// Whether the loop is stable as it is.
fn stability(margins: &Margins) -> String {
    let (when, failed) = match margins.sample_time {
        Some(period) => (
            format!("Sampled every {} with a delay of {}", time(period), time(margins.delay)),
            "not judged: the sample times of all controllers and sensors have no short common period, simulate it",
        ),
        None => ("In continuous time".to_string(), "not judged: its eigenvalues could not be computed, simulate it"),
    };
    let verdict = &margins.stability;
    let state = match verdict.word {
        Stability::Undecided if verdict.why.is_empty() => failed.to_string(),
        _ => verdict.to_string(),
    };
    let radius = match margins.sample_time.and(margins.spectral_radius) {
        Some(radius) => format!(" (spectral radius {radius:.5})"),
        None => String::new(),
    };
    format!("{when} the loop is {state}{radius}.")
}

/// Uncontrolled rigid-body modes, and poles that are only close to zero.
fn free_motions(margins: &Margins, out: &mut Vec<String>) {
    if margins.uncontrolled_poles > 0 {
        let poles = if margins.uncontrolled_poles == 1 { "pole".to_string() } else { "poles".into() };
        let of = if margins.uncontrolled_modes.is_empty() {
            "its own states".into()
        } else {
            list(&margins.uncontrolled_modes)
        };
        let how = match margins.uncontrolled_poles_method {
            ZeroPoleEvidence::Design => {
                "exactly (over the rationals, with the gains before they are rounded)".to_string()
            }
            ZeroPoleEvidence::Rounded => "exactly (over the rationals, with the gains as they are rounded)".into(),
            ZeroPoleEvidence::ToRounding(size) => format!("to the rounding of the loop (below {size:.0e} 1/s)"),
        };
        let what = match margins.uncontrolled_are_integrals {
            true => format!("Charges without effect (integrators of the current) through {of}"),
            false => format!("Uncontrolled rigid-body motion of {of}"),
        };
        out.push(format!(
            "{what}: {} {poles} at zero, {how}, left out of all statements here.",
            margins.uncontrolled_poles
        ));
        if margins.drift > 0.0 && !margins.uncontrolled_are_integrals {
            out.push(format!(
                "At this sample time it is not quite free: without control it grows with {:.2e} 1/s.",
                margins.drift
            ));
        }
    }
    if !margins.near_zero_poles.is_empty() {
        let all: Vec<String> = margins.near_zero_poles.iter().map(|re| format!("{re:.2e}")).collect();
        out.push(format!(
            "Not at zero, but indistinguishable from zero in floating point: {} 1/s; this was decided exactly, and \
             the limits leave it out.",
            all.join(", ")
        ));
    }
}

/// The rate that the loop needs, and the delay, lag and gain that it tolerates.
fn limits(margins: &Margins, out: &mut Vec<String>) {
    let hertz = |rate: f64| {
        if rate >= 1000.0 { format!("{:.2} kHz", rate / 1000.0) } else { format!("{rate:.3} Hz") }
    };
    let rate = |delay: f64| margins.rates.iter().find(|rate| rate.delay == delay);
    if let (Some(undelayed), Some(with)) = (rate(0.0), rate(1.0)) {
        let rate_text = |limit: &RateLimit| match limit.rate {
            Some(0.0) => "any rate".to_string(),
            Some(rate) => hertz(rate),
            None => "more than 1 MHz".into(),
        };
        out.push(format!(
            "It needs {} without delay (or with a predictor for it) and {} with one sample of delay{}: searched from fast to slow rates in \
             steps of {:.0} %, and where the loop comes closest to growing between them, not proven; slower rates may be stable again.",
            rate_text(undelayed),
            rate_text(with),
            because(&with.motion),
            100.0 * (LIMIT_STEP - 1.0)
        ));
        if !margins.analogue_blocks.is_empty() {
            out.push(format!(
                "These rates sample the law alone: its blocks without a sample time ({}) stay in continuous time. A control unit that samples them \
                 too may need a higher rate; give the law and the blocks a `sample_time` to examine it.",
                quoted(&margins.analogue_blocks)
            ));
        }
    }
    let tolerated = |limit: &LoopLimit, [before, after]: [&str; 2], none: &str| match limit.value.is_finite() {
        true => format!("{before}{}{after}{}.", time(limit.value), because(&limit.motion)),
        false => none.to_string(),
    };
    if let Some(delay) = &margins.longest_delay {
        let words = ["At this sample time it tolerates a delay of ", ""];
        out.push(tolerated(delay, words, "No delay of up to ten samples makes it unstable."));
    }
    if let Some(lag) = &margins.longest_lag {
        let words = ["A lag of ", " of its motors is just tolerated"];
        out.push(tolerated(lag, words, "No lag of its motors of up to 1 s makes it unstable."));
    }
    if let Some([down, up]) = &margins.gain_margin {
        let up_to = if up.value.is_finite() { format!("{:.3}", up.value) } else { "100 and more".into() };
        let motion = if up.motion.is_empty() { &down.motion } else { &up.motion };
        out.push(format!(
            "It tolerates torque errors by factors from {:.3} to {up_to}{}.",
            down.value,
            because(motion)
        ));
    }
    if margins.longest_delay.is_some() || margins.longest_lag.is_some() || margins.gain_margin.is_some() {
        out.push(format!(
            "Delays, lags and factors are searched in steps (a twentieth of a sample, {:.0} %) and between steps \
             where the loop comes closest to growing: the values between are not proven.",
            100.0 * (LIMIT_STEP - 1.0)
        ));
    }
}

/// The margins of single motors, and of all at once.
fn channels(margins: &Margins, out: &mut Vec<String>) {
    let motors = margins.channels.iter().filter(|one| !one.is_sensor);
    if let Some(worst) = motors.min_by(|a, b| a.disk.total_cmp(&b.disk)) {
        out.push(format!(
            "The least disk margin of a motor is {:.3} (`{}`{}): factors from {:.3} to {:.3} with {:.1}° of phase.",
            worst.disk,
            worst.name,
            at(worst.disk_frequency),
            worst.disk_gain[0],
            worst.disk_gain[1],
            worst.disk_phase.to_degrees()
        ));
        if worst.multirate_search {
            out.push(
                "With several clocks these margins of its motors are searched on the exact map over the common period, each for an \
                 error that is the same at each sample: factor and delay in steps, phase every 5°, the disk in 25 directions. Those \
                 of readings, and of all motors at once, are not known."
                    .into(),
            );
        }
    } else if margins.stable == Some(true) {
        out.push(
            "Margins of single motors and readings are not known: of a loop with several clocks those of sampled controllers are, if \
             the clocks have a short common period."
                .into(),
        );
    }
    if let Some(all) = &margins.multiloop {
        let sentence = at_once(all);
        out.push(format!("W{}.", &sentence[1..]));
    }
}

/// `a, b and c`
fn list(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => format!("`{one}`"),
        [first @ .., last] => {
            let first: Vec<String> = first.iter().map(|name| format!("`{name}`")).collect();
            format!("{} and `{last}`", first.join(", "))
        }
    }
}

pub(super) fn because(motion: &str) -> String {
    if motion.is_empty() { String::new() } else { format!(", because of {motion}") }
}

pub(super) fn at(frequency: Option<f64>) -> String {
    match frequency {
        None => String::new(),
        Some(0.0) => ", at rest".into(),
        Some(frequency) if frequency.is_finite() => format!(", at {frequency:.4} rad/s"),
        Some(_) => ", at infinite frequency".into(),
    }
}

/// A time as text.
pub(super) fn time(seconds: f64) -> String {
    match seconds {
        s if s < 1e-3 => format!("{:.1} us", 1e6 * s),
        s if s < 1.0 => format!("{:.3} ms", 1e3 * s),
        s => format!("{s:.3} s"),
    }
}

/// The margin of all motors at once as text.
pub(super) fn at_once(found: &MultiloopMargin) -> String {
    let worst: Vec<String> = found
        .worst_perturbation
        .iter()
        .map(|one| format!("`{}` × {:.3} ∠ {:.1}°", one.motor, one.factor, one.phase.to_degrees()))
        .collect();
    format!(
        "with errors of all its motors at once the disk margin is between {:.4} and {:.4}: {} make the loop unstable{}",
        found.disk[0],
        found.disk[1],
        worst.join(", "),
        at(Some(found.frequency))
    )
}

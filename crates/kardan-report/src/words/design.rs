//! A design in sentences.

use super::{Figures, list, pairs, percent, polynomial};
use crate::text::number;
use kardan::results::{
    Alternative, Canonical, ChannelMargin, ControllerData, CrossCoupling, DataMatrix, DataNumber, Decouplability,
    Design, Exploration, Feedback, Flatness, HiddenMotion, Integrators, Interaction, Interval, Margins, MotorStrain,
    ObserverResult, Passage, Pole, Robustness, Spread, TorquePeak, TransferEntry, VariedParameter, ZeroDynamics,
};

/// More names in a sentence are counted.
const NAMES: usize = 12;

/// The loop with the parameters of the variant, one sentence each.
pub fn passage(found: &Passage) -> Vec<String> {
    let degrees = |angle: f64| format!("{} deg", number((1e6 * angle.to_degrees()).round() / 1e6));
    let at = |angle: f64| if found.turned.is_empty() { String::new() } else { format!(" at {}", degrees(angle)) };
    let mut out = vec![
        if found.turned.is_empty() {
            "The loop is looked at with the parameters of the variant, which are not those of the design, in linear approximation."
                .into()
        } else {
            format!(
                "The loop is looked at with the parameters of the variant, in linear approximation at {} positions: {} turned from \
                 {} to {}.",
                found.positions,
                found.turned,
                degrees(found.range.from),
                degrees(found.range.until)
            )
        },
        "Law, observer and plant are linearised there in floating point, without Coulomb friction and limits of the motors; all \
         controllers are in the loop."
            .into(),
    ];
    out.push(match (found.stable, found.growth < -1e30) {
        (true, true) => "Nothing grows.".into(),
        (true, false) => {
            format!(
                "Nothing grows; the slowest motion decays with {} 1/s{}.",
                number(-found.growth),
                at(found.growth_at)
            )
        }
        (false, _) => format!("UNSTABLE: a motion grows with {} 1/s{}.", number(found.growth), at(found.growth_at)),
    });
    out.extend(found.interactions.iter().filter(|_| found.stable).map(|one| {
        format!(
            "{} by {} {} moves {} by at most {} {}{}; {} {} are acceptable.",
            one.reference,
            number(one.step),
            one.step_unit,
            one.signal,
            number(one.largest),
            one.unit,
            at(one.at),
            number(one.acceptable),
            one.unit
        )
    }));
    out
}

/// Limits of the sampled loop as rows: what, limit, the motion that grows beyond it.
pub fn margins(margins: &Margins) -> Vec<[String; 3]> {
    let mut out = Vec::new();
    for rate in &margins.rates {
        let delay = match rate.delay {
            0.0 => "without delay".to_string(),
            1.0 => "with one sample of delay".into(),
            part => format!("with {} samples of delay", number(part)),
        };
        let limit = match rate.rate {
            Some(0.0) => "any".into(),
            Some(rate) => format!("{} Hz", number(rate)),
            None => "above 1 MHz".into(),
        };
        out.push([format!("slowest stable rate {delay}"), limit, rate.motion.clone()]);
    }
    let seconds = |value: f64| if value.is_finite() { format!("{} s", number(value)) } else { "not limited".into() };
    let times = [("longest delay", &margins.longest_delay), ("longest lag of its motors", &margins.longest_lag)];
    for (what, limit) in times {
        out.extend(limit.as_ref().map(|limit| [what.to_string(), seconds(limit.value), limit.motion.clone()]));
    }
    if let Some(both) = &margins.gain_margin {
        for (what, limit) in ["smallest factor of its torques", "largest factor of its torques"].iter().zip(both) {
            let value = if limit.value.is_finite() { number(limit.value) } else { "not limited".into() };
            out.push([(*what).to_string(), value, limit.motion.clone()]);
        }
    }
    out
}

/// How wrong each channel of the loop may be alone, as rows: of what, factor, phase, delay, disk margin, its factors and phase;
/// with the frequencies in rad/s.
pub fn channels(margins: &Margins) -> Vec<[String; 6]> {
    let at = |frequency: Option<f64>| match frequency {
        Some(frequency) if frequency.is_finite() => format!(" ({})", number(frequency)),
        _ => String::new(),
    };
    let row = |one: &ChannelMargin| {
        let [low, high] = one.gain;
        let high = if high.is_finite() { number(high) + &at(one.gain_frequency[1]) } else { "any".into() };
        let degrees = |turn: f64| format!("{}°", number(turn.to_degrees()));
        let phase = if one.phase.is_finite() { degrees(one.phase) + &at(one.phase_frequency) } else { "any".into() };
        let delay = match one.delay {
            Some(delay) if delay.is_finite() => format!("{} s{}", number(delay), at(one.delay_frequency)),
            Some(_) if one.sampled => "10 samples and more".into(),
            Some(_) => "any".into(),
            None => "–".into(),
        };
        let disk = number(one.disk) + &at(one.disk_frequency);
        let disk = if one.searched { format!("{disk}, searched") } else { disk };
        let [from, to] = one.disk_gain;
        let to = if to.is_finite() { number(to) } else { "any".into() };
        let held = format!("{} to {to}, {}", number(from), degrees(one.disk_phase));
        let what = if one.reading { format!("reading {}", one.name) } else { format!("torque of {}", one.name) };
        let low = number(low) + &at(one.gain_frequency[0]);
        [what, format!("{low} to {high}"), phase, delay, disk, held]
    };
    margins.channels.iter().map(row).collect()
}

/// Headers of [`channels`].
pub const CHANNELS: [&str; 6] =
    ["error of", "factor (rad/s)", "phase (rad/s)", "delay (rad/s)", "disk margin (rad/s)", "which holds"];

/// A design beside this one as a row: rate, bandwidth, effort, sensors, interaction, torque, noise, spectral radius.
pub fn alternative(found: &Exploration, one: &Alternative) -> [String; 8] {
    let torque = |x: f64| if found.limited { format!("{} %", number(100.0 * x)) } else { format!("{} N m", number(x)) };
    [
        format!("{} Hz", number(1.0 / one.sample_time)),
        format!("× {}", number(one.bandwidth)),
        format!("× {}", number(one.effort)),
        one.sensors.clone(),
        number(one.interaction),
        torque(one.torque),
        torque(one.noise),
        number(one.spectral_radius),
    ]
}

/// What is said of the designs beside this one.
pub fn exploration(found: &Exploration) -> Vec<String> {
    let mut out = vec![format!(
        "{} designs were found, {} combinations have no stable one{}. Interaction: {}, in {}. Torque and noise are {}.",
        found.designs.len(),
        found.failed,
        match found.not_judged {
            0 => String::new(),
            count => format!(", {count} are not judged, as their sample times have no short common period"),
        },
        found.interaction,
        found.unit,
        if found.limited { "parts of the motors' limits" } else { "in N m, as no motor has a limit" }
    )];
    out.extend(found.advice.iter().cloned());
    out
}

/// What is said of the loop over a box of plants.
pub fn robustness(found: &Robustness) -> Vec<String> {
    let varied = found
        .parameters
        .iter()
        .filter(|VariedParameter { name: _, factors: Interval { lower: low, upper: high } }| low != high)
        .count();
    let mut out = vec![
        format!("{} coefficients vary: {}.", varied, found.range),
        format!(
            "{} of {} plants, drawn with the seed {}, are stable; {}.",
            found.stable,
            found.samples,
            found.seed,
            if found.worst_stable {
                "so is the worst corner that a search found"
            } else {
                "a corner of the box is not"
            }
        ),
    ];
    let radius = &found.spectral_radius;
    out.push(format!(
        "Spectral radius {} with the nominal plant, at most {} in the samples, {} in the worst corner.",
        number(radius.nominal),
        number(radius.sampled),
        number(radius.worst)
    ));
    if let Some(worst) = found.interactions.iter().max_by(|a, b| a.size.worst.total_cmp(&b.size.worst)) {
        let end = |(one, factor): (&VariedParameter, &f64)| {
            (one.factors.lower != one.factors.upper).then(|| format!("{} {}", one.name, number(*factor)))
        };
        let at: Vec<String> = found.parameters.iter().zip(&worst.size.at).filter_map(end).collect();
        out.push(format!("Worst for {} after {}, as factors: {}.", worst.signal, worst.reference, at.join(", ")));
    }
    out
}

/// An interaction over a box as a row: step, signal, nominal, median, 90 %, 99 %, largest, worst corner, unit.
pub fn interaction(found: &Interaction) -> [String; 9] {
    let Spread { nominal, median, q90, q99, sampled, worst, .. } = &found.size;
    let step = format!("{} by {} {}", found.reference, number(found.step), found.step_unit);
    let size = |x: &f64| if x.is_finite() { number(*x) } else { "unstable".into() };
    [
        step,
        found.signal.clone(),
        size(nominal),
        size(median),
        size(q90),
        size(q99),
        size(sampled),
        size(worst),
        found.unit.clone(),
    ]
}

/// What a step asks of a motor: step, motor, torque and limit.
pub fn torque_peak(peak: &TorquePeak) -> [String; 4] {
    let limit = peak.limit.map_or_else(|| "unlimited".to_string(), |limit| format!("{} N m", number(limit)));
    let step = format!("{} by {} {}", peak.reference, number(peak.step), peak.step_unit);
    [step, peak.input.clone(), format!("{} N m", number(peak.peak)), limit]
}

/// What a run asked of a motor with limits: torque, limits, time at them.
pub fn strain(strain: &MotorStrain, length: f64) -> [String; 3] {
    let limits = [(strain.torque_limit, "N m"), (strain.rate_limit, "N m/s")];
    let limits = limits.into_iter().filter_map(|(limit, unit)| Some(format!("{} {unit}", number(limit?))));
    let times = [
        (strain.torque_limit, strain.seconds_at_limit(0.0, length), ""),
        (strain.rate_limit, strain.seconds_at_rate_limit(0.0, length), " (rate)"),
    ];
    let time = |(_, time, what): (_, f64, &str)| match time {
        0.0 => format!("never{what}"),
        time => format!("{} s of {} s{what}", number(time), number(length)),
    };
    let times: Vec<String> = times.into_iter().filter(|(limit, ..)| limit.is_some()).map(time).collect();
    [format!("{} N m", number(strain.asked)), limits.collect::<Vec<_>>().join(", "), times.join(", ")]
}

/// What was designed, on which model, and what else is in the loop: one sentence each.
pub fn head(design: &Design) -> Vec<String> {
    let mut out = vec![format!("Controller {}, law {}.", or_dash(&design.controller), or_dash(&design.law))];
    if !design.design_model.is_empty() {
        out.push(format!("Design model: {}.", design.design_model));
    }
    if !design.variant.is_empty() && design.variant != design.model {
        out.push(format!("Variant: {}.", design.variant));
    }
    if !design.others.is_empty() {
        out.push(format!(
            "In the loop too, for the closed-loop poles and the simulation: {}. Transfer functions are without.",
            list(&design.others, NAMES)
        ));
    }
    out
}

fn or_dash(text: &str) -> &str {
    if text.is_empty() { "–" } else { text }
}

/// What the outputs do not show of the model, taken away before the design; `None` if nothing was.
pub fn hidden(design: &Design) -> Option<String> {
    let values = list(&pairs(&design.hidden), NAMES);
    (!design.hidden.is_empty())
        .then(|| format!("The outputs do not show the motions at {values} 1/s; the law leaves them."))
}

/// Whether static, block or dynamic feedback decouples the outputs, and why: one sentence each. Empty if it was not
/// asked.
pub fn decouplability(design: &Design) -> Vec<String> {
    let found = &design.decouplability;
    let Decouplability { rank, normal_rank, possible, integrators, reasons, .. } = found;
    if *rank == 0 && *normal_rank == 0 && reasons.is_empty() {
        return Vec::new();
    }
    let blocks = blocks(design);
    let in_blocks = if blocks.is_empty() { String::new() } else { format!(": {}", list(&blocks, NAMES)) };
    let added: Vec<String> = integrators
        .iter()
        .map(|Integrators { input, count }| {
            format!("{count} integrator{} before {input}", if *count == 1 { "" } else { "s" })
        })
        .collect();
    let added = if added.is_empty() { String::new() } else { format!(" with {}", list(&added, NAMES)) };
    let mut out = vec![match possible {
        Feedback::Static => "Static state feedback decouples every output from the others.".into(),
        Feedback::Block => format!("Static state feedback decouples blocks of outputs only{in_blocks}."),
        Feedback::Dynamic => {
            format!("Static state feedback does not decouple the outputs, dynamic feedback does{added}.")
        }
        Feedback::Impossible => "No state feedback decouples the outputs.".into(),
    }];
    if *possible != Feedback::Block && !blocks.is_empty() && *possible != Feedback::Static {
        out.push(format!("Static feedback decouples these blocks{in_blocks}."));
    }
    out.extend(reasons.iter().map(|reason| sentence(reason)));
    out.push(format!(
        "G has rank {rank} ({} × {}), the transfer matrix has normal rank {normal_rank}; both exact.",
        design.outputs.len(),
        design.inputs.len()
    ));
    out
}

/// Blocks of outputs by name: `{rk.phi, fs.phi}`.
fn blocks(design: &Design) -> Vec<String> {
    design.decouplability.blocks.iter().map(|block| format!("{{{}}}", block.join(", "))).collect()
}

fn sentence(text: &str) -> String {
    let text = super::capital(text);
    if text.ends_with(['.', '!', '?']) { text } else { text + "." }
}

/// `2`, or `never` where no input reaches the output.
pub fn relative_degree(degree: Option<usize>) -> String {
    degree.map_or("never".into(), |degree| degree.to_string())
}

/// What goes on while the outputs are held still: one sentence each. Empty if it was not asked.
pub fn zero_dynamics(found: &ZeroDynamics) -> Vec<String> {
    match found.kind() {
        HiddenMotion::Unknown => vec![],
        HiddenMotion::None => vec!["There are none: while the outputs are held still, nothing moves.".into()],
        HiddenMotion::Some => {
            let of =
                if found.polynomial.is_empty() { String::new() } else { format!(": roots of {}", found.polynomial) };
            let verdict = if found.stable {
                "They are stable, decided exactly: what excites them dies out."
            } else {
                "They are NOT stable, decided exactly: what excites them does not die out."
            };
            vec![format!("Motions that go on while the outputs are held still{of}."), verdict.into()]
        }
    }
}

/// Says where the poles of the closed loop are those of floating point.
pub fn floating_poles(design: &Design) -> Option<&'static str> {
    (!design.exact_poles && !design.closed_loop_poles.is_empty()).then_some(
        "These poles are eigenvalues in floating point; whether a motion within a millionth of the fastest one around the axis \
         decays is not decided.",
    )
}

/// Poles with conjugate pairs joined (the upper one stands for both) and equal ones counted.
pub fn joined(values: &[Pole]) -> Vec<(Pole, usize)> {
    let near = |a: Pole, b: Pole| (a.re - b.re).hypot(a.im - b.im) <= 1e-9 * a.re.hypot(a.im);
    let mut out: Vec<(Pole, usize)> = Vec::new();
    for &value in values {
        let mirrored = Pole { im: -value.im, ..value };
        if value.im < 0.0 && values.iter().any(|&other| near(mirrored, other)) {
            continue;
        }
        // Equal ones are counted, not those that lie near each other.
        match out.iter_mut().find(|(known, _)| *known == value || *known == mirrored) {
            Some((_, times)) => *times += 1,
            None => out.push((value, 1)),
        }
    }
    out
}

/// Whose pole it is: channels by their output, `zero dynamics`; empty if it is neither.
pub fn owner(pole: Pole, design: &Design) -> String {
    let near = |other: &Pole| (other.re - pole.re).hypot(other.im.abs() - pole.im.abs()) <= 1e-6 * pole.abs().max(1e-9);
    let channels = design.channels.iter().filter(|channel| channel.poles.iter().any(near));
    let mut names: Vec<&str> = channels.map(|channel| channel.output.as_str()).collect();
    if design.zero_dynamics.modes.iter().any(|mode| near(&mode.pole)) {
        names.push("zero dynamics");
    }
    list(&names, NAMES)
}

/// What the observer measures and estimates, and what can be told apart: one sentence each.
pub fn observer(found: &ObserverResult) -> Vec<String> {
    let method = match found.method.as_str() {
        "poles" => "placed poles",
        "kalman" => "a Kalman filter",
        other => other,
    };
    let torques = match &found.disturbances[..] {
        [] => String::new(),
        [one] => format!(", among them the torque along {one}"),
        names => format!(", among them the torques along {}", list(names, NAMES)),
    };
    let mut out = vec![format!(
        "Estimates {} state{}{torques}, from {}; designed by {method}.",
        found.states.len(),
        if found.states.len() == 1 { "" } else { "s" },
        list(&found.sensors, NAMES)
    )];
    out.extend(found.distinguishable.iter().map(|text| sentence(text)));
    out
}

/// An entry of the transfer matrix: `400/(s^2 + 28 s + 400)`, or `0 (exact)`.
pub fn transfer(entry: &TransferEntry) -> String {
    if entry.numerator.is_empty() {
        return "0 (exact)".into();
    }
    let part = |coefficients: &[String]| {
        let text = polynomial(coefficients);
        if text.contains([' ', '/']) { format!("({text})") } else { text }
    };
    match &entry.denominator[..] {
        [] => part(&entry.numerator),
        [one] if one == "1" => polynomial(&entry.numerator),
        denominator => format!("{}/{}", part(&entry.numerator), part(denominator)),
    }
}

/// What the transfer matrix proves; `None` where nothing is claimed.
pub fn proof(design: &Design) -> Option<&'static str> {
    match design.decoupled {
        Some(true) => {
            Some("Every entry that belongs to another channel is exactly zero: the linear loop is decoupled.")
        }
        Some(false) => Some("Entries that belong to other channels do not vanish: the linear loop is NOT decoupled."),
        None => None,
    }
}

/// The entry of the transfer matrix from that reference to that output.
pub fn linear<'a>(design: &'a Design, reference: &str, output: &str) -> Option<&'a TransferEntry> {
    design.transfer.iter().find(|entry| entry.reference == reference && entry.output == output)
}

/// `ref_rk by 1 rad`.
pub fn step(coupling: &CrossCoupling) -> String {
    format!("{} by {} {}", coupling.reference, number(coupling.step), coupling.step_unit).trim_end().into()
}

/// How long it was watched: `over 2 s`; `None` if there are several windows or none.
pub fn window(couplings: &[CrossCoupling]) -> Option<String> {
    let first = couplings.first()?.window;
    (first.is_finite() && couplings.iter().all(|other| other.window == first))
        .then(|| format!("over {} s", number(first)))
}

/// Whether the outputs are flat and what they determine: one sentence each.
pub fn flatness(found: &Flatness) -> Vec<String> {
    let mut out = Vec::new();
    if !found.statement.is_empty() {
        out.push(sentence(&found.statement));
    } else if found.flat {
        out.push("The outputs are flat.".into());
    } else {
        out.push("The outputs are not flat.".into());
    }
    if !found.flat && !found.remainder.is_empty() {
        let values = list(&pairs(&found.poles), NAMES);
        let at = if values.is_empty() { String::new() } else { format!(", at {values} 1/s") };
        out.push(format!("The filter that remains has the poles of {}{at}.", found.remainder));
    }
    let degrees =
        found.outputs.iter().zip(&found.derivatives).map(|(output, degree)| format!("{output} up to {degree}"));
    let degrees: Vec<String> = degrees.collect();
    if !degrees.is_empty() {
        out.push(format!("Derivatives needed: {}.", list(&degrees, NAMES)));
    }
    out
}

/// The sizes of the parts of the canonically decoupled form: one sentence each.
pub fn canonical(found: &Canonical, design: &Design) -> Vec<String> {
    let channels = found.sizes.len().saturating_sub(2);
    let name = |k: usize| design.outputs.get(k).cloned().unwrap_or_else(|| format!("channel {}", k + 1));
    let own: Vec<String> = (0..channels).map(|k| format!("{} {}", name(k), found.sizes[k])).collect();
    let mut out = Vec::new();
    if let [.., shared, unreached] = found.sizes[..] {
        out.push(format!(
            "States by channel: {}; in no channel of their own: {shared}; not controllable: {unreached}.",
            list(&own, NAMES)
        ));
    }
    let ranks = found.ranks.iter().enumerate().map(|(k, rank)| format!("all but input {}: {rank}", k + 1));
    let ranks: Vec<String> = ranks.collect();
    if !ranks.is_empty() {
        out.push(format!("Ranks of the controllability matrices: {}.", list(&ranks, NAMES)));
    }
    out
}

/// What runs in firmware: one sentence each; empty if there is nothing.
pub fn controller(data: &ControllerData) -> Vec<String> {
    if data.block.is_empty() {
        return Vec::new();
    }
    let time = match data.sample_time {
        Some(time) => format!("every {} s", number(time)),
        None => "in continuous time".into(),
    };
    let reads: Vec<&str> = data.reads.iter().map(|one| one.signal.as_str()).collect();
    let matrices: Vec<String> = data
        .matrices
        .iter()
        .map(|DataMatrix { name, values: rows }| {
            format!("{name} ({} × {})", rows.len(), rows.first().map_or(0, Vec::len))
        })
        .collect();
    let mut out = vec![
        format!("Block {} of kardan-rt, {time}.", data.block),
        format!("Reads {}; writes {}.", list(&reads, NAMES), list(&data.writes, NAMES)),
    ];
    if !matrices.is_empty() {
        out.push(format!("Matrices: {}.", list(&matrices, NAMES)));
    }
    let numbers: Vec<String> =
        data.numbers.iter().map(|DataNumber { name, value }| format!("{name} {}", number(*value))).collect();
    if !numbers.is_empty() {
        out.push(format!("Numbers: {}.", list(&numbers, NAMES)));
    }
    out
}

/// The deviation of another channel as a share of what the output's own step does; empty without a measure.
pub fn relative(coupling: &CrossCoupling, all: &[CrossCoupling]) -> Option<f64> {
    let own = all.iter().find(|other| other.own && other.output == coupling.output && other.failure.is_none())?;
    // A step of another unit has no share.
    let own = Some(own).filter(|own| own.step_unit == coupling.step_unit)?.peak?;
    let share = coupling.peak? / own;
    (!coupling.own && coupling.failure.is_none() && own > 0.0 && share.is_finite()).then_some(share)
}

/// A share that may be tiny: `12 %`, `0.024 %`, `0 %`.
pub fn share(value: f64, figures: Figures) -> String {
    if value == 0.0 || value >= 0.1 { percent(value) } else { format!("{} %", figures(100.0 * value)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transfer_functions_read_as_written_by_hand() {
        let said = |numerator: &[&str], denominator: &[&str]| {
            let texts = |words: &[&str]| words.iter().map(|&word| word.into()).collect();
            let entry =
                TransferEntry { numerator: texts(numerator), denominator: texts(denominator), ..Default::default() };
            transfer(&entry)
        };
        assert_eq!(said(&[], &["1"]), "0 (exact)");
        assert_eq!(said(&["400"], &["400", "28", "1"]), "400/(s^2 + 28 s + 400)");
        assert_eq!(said(&["0", "-3/2"], &["0", "0", "1"]), "(-3/2 s)/s^2");
        assert_eq!(said(&["1", "1"], &["1"]), "s + 1");
    }

    #[test]
    fn shares_may_be_tiny() {
        assert_eq!([0.0, 0.0002304, 0.123].map(|value| share(value, number)), ["0 %", "0.02304 %", "12 %"]);
    }
}

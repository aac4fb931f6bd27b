//! Stability margins of a loop, and the torques that it requests.

use crate::model::{Body, Cell, row};
use crate::phrases;
use crate::text::number;
use kardan_results::{ChannelMargin, ContactMargins, Margins, MotorLoad, OppositeSide, TorquePeak};

/// Limits of a loop with sampling, delay, lag and saturation.
pub(super) fn margins(found: &Margins) -> Body {
    Body::default()
        .paragraph(&found.verdict)
        .part("Limits of the linear loop", limits(found))
        .part("Stability margins of one channel", channels(&found.channels))
        .part("Stability margins with backlash in contact", contacts(found))
        .part("Torques requested by steps", peaks(&found.peaks))
}

/// The same on the other side of the kink.
pub(super) fn opposite_side(found: &OppositeSide) -> Body {
    let OppositeSide { reference_side: own, side, margins: other_side } = found;
    let text = format!(
        "The loop has a kink at its operating point. All other results on this page are for the side where {own}. Where {side}: {}",
        other_side.verdict
    );
    Body::default()
        .paragraph(&text)
        .part("Limits of the linear loop there", limits(other_side))
        .part("Stability margins of one channel there", channels(&other_side.channels))
}

/// The limits of the loop, and the unstable motion beyond each.
fn limits(margins: &Margins) -> Body {
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
        out.push(row![format!("slowest stable rate {delay}"), limit, &rate.motion]);
    }
    // Larger values were not searched.
    let seconds = |value: f64, most: &str| if value.is_finite() { format!("{} s", number(value)) } else { most.into() };
    let times = [
        ("longest delay", &margins.longest_delay, "10 samples and more"),
        ("longest lag of its motors", &margins.longest_lag, "1 s and more"),
    ];
    for (what, limit, most) in times {
        out.extend(limit.as_ref().map(|limit| row![what, seconds(limit.value, most), &limit.motion]));
    }
    if let Some(both) = &margins.gain_margin {
        for (what, limit) in ["smallest factor of its torques", "largest factor of its torques"].into_iter().zip(both) {
            let value = if limit.value.is_finite() { number(limit.value) } else { "100 and more".into() };
            out.push(row![what, value, &limit.motion]);
        }
    }
    Body::default().table(&["the loop tolerates", "#limit", "unstable motion beyond it"], out)
}

/// The channel with the error.
fn with_error(one: &ChannelMargin) -> String {
    if one.is_sensor { format!("reading {}", one.name) } else { format!("torque of {}", one.name) }
}

/// The margins of each single channel of the loop; with the frequencies in rad/s.
fn channels(channels: &[ChannelMargin]) -> Body {
    let at = |frequency: Option<f64>| match frequency {
        Some(frequency) if frequency.is_finite() => format!(" ({})", number(frequency)),
        _ => String::new(),
    };
    let row = |one: &ChannelMargin| {
        let [low, high] = phrases::factors(one.gain, |side, factor| number(factor) + &at(one.gain_frequency[side]));
        let degrees = |turn: f64| format!("{}°", number(turn.to_degrees()));
        let phase = if one.phase.is_finite() { degrees(one.phase) + &at(one.phase_frequency) } else { "any".into() };
        let delay = match one.delay {
            Some(delay) if delay.is_finite() => format!("{} s{}", number(delay), at(one.delay_frequency)),
            Some(_) if one.sampled => "10 samples and more".into(),
            Some(_) => "any".into(),
            None => "–".into(),
        };
        let disk = number(one.disk) + &at(one.disk_frequency);
        let disk = if one.multirate_search { format!("{disk}, searched") } else { disk };
        let [from, to] = phrases::factors(one.disk_gain, |_, factor| number(factor));
        let disk_range = format!("{from} to {to}, {}", degrees(one.disk_phase));
        row![with_error(one), format!("{low} to {high}"), phase, delay, disk, disk_range]
    };
    let headers =
        ["error of", "factor (rad/s)", "phase (rad/s)", "delay (rad/s)", "disk margin (rad/s)", "guaranteed range"];
    Body::default().table(&headers, channels.iter().map(row))
}

/// The margins of the loop with backlash in contact, beside those with open backlash; the smallest of its channels first, then all of them.
fn contacts(margins: &Margins) -> Body {
    let least = |channels: &[ChannelMargin]| -> [String; 2] {
        let found = channels.iter().min_by(|a, b| a.disk.total_cmp(&b.disk));
        found.map_or(["–".into(), "–".into()], |one| [number(one.disk), with_error(one)])
    };
    let stable = |stable: Option<bool>| match stable {
        Some(stable) => Cell::judged(stable, ["stable", "unstable"]),
        None => Cell::Mark(false, "not known".into()),
    };
    let Some(first) = margins.contacts.first() else { return Body::default() };
    let names = |list: &[String]| if list.is_empty() { "–".to_string() } else { list.join(", ") };
    let here = ContactMargins {
        open: first.closed.iter().chain(&first.open).cloned().collect(),
        stable: margins.stable,
        channels: margins.channels.clone(),
        multiloop: margins.multiloop.clone(),
        ..ContactMargins::default()
    };
    let row = |one: &ContactMargins| {
        let [disk, channel] = least(&one.channels);
        let multiloop = one.multiloop.as_ref().map_or("–".to_string(), |all| number(all.disk[0]));
        row![names(&one.closed), &one.flank, names(&one.open), stable(one.stable), disk, channel, multiloop]
    };
    let headers = ["in contact", "flank", "open", "loop", "#least disk margin", "of", "#of all motors at once"];
    let mut out = Body::default().table(&headers, [&here].into_iter().chain(&margins.contacts).map(row));
    for one in margins.contacts.iter().filter(|one| !one.channels.is_empty()) {
        let detail = Body::default().paragraph(format!("In contact: {} ({} flank).", one.closed.join(", "), one.flank));
        out = out.detail(detail).detail(channels(&one.channels));
    }
    out
}

fn peaks(peaks: &[TorquePeak]) -> Body {
    let rows = peaks.iter().map(|peak| {
        let unit = &peak.unit;
        let limit = peak.limit.map_or("unlimited".into(), |limit| format!("{} {unit}", number(limit)));
        let step = format!("{} by {} {}", peak.reference, number(peak.step), peak.step_unit);
        let value = format!("{} {unit}", number(peak.peak));
        let too_much = peak.limit.is_some_and(|limit| peak.peak > limit * (1.0 + 1e-9));
        let value = if too_much { Cell::Mark(false, value) } else { Cell::Text(value) };
        row![step, &peak.input, value, limit]
    });
    Body::default().table(&["step of", "motor", "#requested", "#limit"], rows)
}

/// Torques that runs of variants requested from motors with limits: variant, motor, length of the run in s. Empty if there are none.
pub(super) fn motor_loads<'a>(all: impl Iterator<Item = (String, &'a MotorLoad, f64)>) -> Body {
    let rows = all.map(|(variant, motor_load, length)| {
        let limits = [(motor_load.torque_limit, ""), (motor_load.rate_limit, "/s")];
        let limits = limits.into_iter();
        let limits = limits.filter_map(|(limit, per)| Some(format!("{} {}{per}", number(limit?), motor_load.unit)));
        let times = [
            (motor_load.torque_limit, motor_load.seconds_at_limit(0.0, length), ""),
            (motor_load.rate_limit, motor_load.seconds_at_rate_limit(0.0, length), " (rate)"),
        ];
        let time = |(_, time, what): (_, f64, &str)| match time {
            0.0 => format!("never{what}"),
            time => format!("{} s of {} s{what}", number(time), number(length)),
        };
        let times: Vec<String> = times.into_iter().filter(|(limit, ..)| limit.is_some()).map(time).collect();
        let (limits, times) = (limits.collect::<Vec<_>>().join(", "), times.join(", "));
        let times = if motor_load.at_limit() { Cell::Mark(false, times) } else { Cell::Text(times) };
        row![&motor_load.motor, variant, format!("{} {}", number(motor_load.demand), motor_load.unit), limits, times]
    });
    Body::default().table(&["motor", "variant", "#largest requested", "#limit", "#time at the limit"], rows)
}

//! Frequency and step responses of a loop.

use crate::frequency_pictures as pictures;
use crate::model::{Body, row};
use crate::phrases::list;
use crate::text::{number, unit};
use kardan_results::{ChannelMargin, LoopFunction, LoopResponses, SingularValues, WrongTorque};
use kardan_rt::functions::log10;

/// More names in a sentence are counted.
const NAMES: usize = 12;

/// Frequency and step responses of a loop with these margins.
pub(super) fn responses(found: &LoopResponses, margins: &[ChannelMargin]) -> Body {
    let readings = Body::default().pictures(pictures::loops(found, margins, true));
    Body::default()
        .list(sentences(found))
        .part("Largest singular values", largest(found))
        .pictures(pictures::loops(found, margins, false))
        .pictures(pictures::singular_values(found))
        .pictures(pictures::references(found))
        .pictures(pictures::steps(found))
        .part("Margins over the joint angle", over_positions(found))
        .fold("Bode, Nyquist and Nichols plots of the loop at the readings", readings)
}

/// The shown loop, and what is not shown.
fn sentences(found: &LoopResponses) -> Vec<String> {
    let mut out = Vec::new();
    match (found.frequencies.first(), found.frequencies.last(), found.nyquist) {
        (Some(low), _, Some(nyquist)) => out.push(format!(
            "The sampled linear loop, exactly, at its sample instants, from {} rad/s to its Nyquist frequency of {} rad/s; it \
             includes hold, delay and lag.",
            number(*low),
            number(nyquist)
        )),
        (Some(low), Some(high), None) => out.push(format!(
            "The linear loop in continuous time from {} to {} rad/s, with the lags of its motors.",
            number(*low),
            number(*high)
        )),
        _ => {}
    }
    let open: Vec<String> = found.loops.iter().filter(|one| one.open).map(|one| one.name.clone()).collect();
    if !open.is_empty() {
        out.push(format!(
            "No loop passes through {}: no error there can make the loop unstable, so there is no curve.",
            list(&open, NAMES)
        ));
    }
    if let Some(all) = &found.sensors_multiloop {
        let wrong =
            |one: &WrongTorque| format!("{} × {} ∠ {}°", one.motor, number(one.factor), number(one.phase.to_degrees()));
        let worst: Vec<String> = all.worst_perturbation.iter().map(wrong).collect();
        out.push(format!(
            "With errors of all readings at once the disk margin is between {} and {} (computed, not proven): {} make the loop unstable, at {} rad/s.",
            number(all.disk[0]),
            number(all.disk[1]),
            worst.join(", "),
            number(all.frequency)
        ));
    }
    if found.sensitivities.is_empty() {
        out.push("The closed loop is not known to be stable, so S, T, KS and step responses are omitted.".into());
    }
    out
}

/// The largest singular values of S, T and KS.
fn largest(found: &LoopResponses) -> Body {
    let row = |one: &SingularValues| {
        let largest = one.largest?;
        let meaning = match (one.function, one.at_sensors) {
            (LoopFunction::S, false) => "disturbance torques at the motors to the remaining torques",
            (LoopFunction::T, false) => "disturbance torques at the motors to the motor torques against them",
            (LoopFunction::S, true) => "reading errors to the errors that the controller reads",
            (LoopFunction::T, true) => "reading errors to the motion that they cause",
            (LoopFunction::Ks, _) => "reading errors to the commanded torques",
        };
        let mut value = number(largest.value);
        if one.mixed {
            value += " (SI units)";
        } else if !one.unit.is_empty() {
            value += &format!(" {}", unit(&one.unit));
        }
        let decibels = format!("{} dB", number(20.0 * log10(largest.value)));
        let at = largest.frequency.map_or("–".into(), |at| format!("{} rad/s", number(at)));
        Some(row![pictures::name(one), value, decibels, at, meaning])
    };
    let hint = if found.sensitivities.is_empty() {
        ""
    } else {
        "All channels at once. Each value is the largest one found at frequencies beside every pole and in between. \
         Where readings have different units, the values are in SI units."
    };
    Body::default()
        .table(
            &["of", "#largest singular value", "#in dB", "#at", "transfer"],
            found.sensitivities.iter().filter_map(row),
        )
        .hint(hint)
}

/// The least margins of each motor over the motions of the joints.
fn over_positions(found: &LoopResponses) -> Body {
    let Some(over_positions) = &found.margins_over_position else { return Body::default() };
    let stable: Vec<_> = over_positions.positions.iter().filter(|one| !one.motors.is_empty()).collect();
    let (Some(first), Some((worst, at))) = (stable.first(), over_positions.worst()) else { return Body::default() };
    let degrees = |angle: f64| format!("{}°", number(angle.to_degrees()));
    let count = over_positions.positions.len();
    let mut sentences = vec![format!(
        "The linear loop with {} at {count} positions: the least disk margin of a motor is {} ({}, at {}).",
        over_positions.rotated_coordinates,
        number(worst.disk),
        worst.name,
        degrees(at)
    )];
    if stable.len() < count {
        let others = count - stable.len();
        sentences.push(format!("At {others} of them the loop is not stable, or has no frequency response."));
    }
    let rows = first.motors.iter().map(|motor| {
        let all = || {
            let own = |one: &&ChannelMargin| one.name == motor.name;
            over_positions.positions.iter().filter_map(move |one| Some((one.motors.iter().find(own)?, one.angle)))
        };
        // The margin that is the least by its `size`, as it is written.
        let margin_cell = |size: fn(&ChannelMargin) -> f64, value: fn(&ChannelMargin) -> f64, what: &str| {
            let least = all().min_by(|a, b| size(a.0).total_cmp(&size(b.0)));
            let finite = least.map(|(one, at)| (value(one), at)).filter(|(value, _)| value.is_finite());
            finite.map_or("any".into(), |(value, at)| format!("{}{what} (at {})", number(value), degrees(at)))
        };
        row![
            &motor.name,
            margin_cell(|one| -one.gain[0], |one| one.gain[0], ""),
            margin_cell(|one| one.gain[1], |one| one.gain[1], ""),
            margin_cell(|one| one.phase, |one| one.phase.to_degrees(), "°"),
            margin_cell(|one| one.disk, |one| one.disk, ""),
        ]
    });
    let headers =
        ["torque of", "largest factor below one", "least factor above one", "least phase", "least disk margin"];
    Body::default().list(sentences).table(&headers, rows).pictures(pictures::over_positions(over_positions))
}

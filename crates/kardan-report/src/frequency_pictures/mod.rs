//! Frequency and step responses of a loop as pictures: Bode, Nyquist, Nichols, singular values, steps.

mod loop_plots;
mod panel;

pub(super) use loop_plots::loops;

use kardan_results::{
    LoopFunction, LoopResponses, MarginsOverPositions, PositionMargins, ReferenceResponse, SingularValues, StepResponse,
};
use kardan_rt::functions::hypot;

use super::groups::grouped;
use super::model::Picture;
use super::text::{escape, figure, unit, with_unit};
use super::ticks::{Axis, axis, extent};

use loop_plots::{Drawn, PHASE_STEPS, bode, decibels, frequency_axis, gain_axis};
use panel::{BETWEEN, HEAVY, HEIGHT, Panel, TOP, legend, solid, thin};

/// Responses below this fraction of the largest one of their output count as zero.
const NONE: f64 = 1e-9;

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
    let panel = Panel::new(TOP, 1.5 * HEIGHT, across, up);
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
    body += &panel.across_at(0.0, HEAVY);
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
    Some(panel.picture(title, title, &body, &caption))
}

/// From the references to the outputs, over the frequency.
pub(super) fn references(found: &LoopResponses) -> Option<Picture> {
    let size = |one: &ReferenceResponse| {
        let sizes = one.real.iter().zip(&one.imaginary).map(|(re, im)| hypot(*re, *im));
        sizes.filter(|x| x.is_finite()).fold(0.0, f64::max)
    };
    let largest =
        |output: &str| found.references.iter().filter(|one| one.output == output).map(size).fold(0.0, f64::max);
    let (shown, none): (Vec<&ReferenceResponse>, Vec<&ReferenceResponse>) =
        found.references.iter().partition(|one| size(one) > NONE * largest(&one.output));
    if shown.is_empty() || found.frequencies.len() < 2 {
        return None;
    }
    let of = |one: &ReferenceResponse| with_unit(&format!("{} → {}", one.reference, one.output), &unit(&one.unit));
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
    let title = "Bode plot from the references to the outputs";
    Some(bode(found, &curves, ["gain [dB]", "phase [°]"], title, &caption))
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
    let (low, high) = extent(angles);
    if !(high > low) {
        return None;
    }
    let disks = found.positions.iter().flat_map(|one| one.motors.iter().map(|motor| motor.disk));
    let across = Axis::by(&PHASE_STEPS, low, high, 9.0);
    let panel = Panel::new(TOP, HEIGHT, across, axis(disks.chain([0.0]), 0.06, 5));
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
    Some(panel.picture("Disk margins over the joint angle", "disk margins over the joint angle", &body, &caption))
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
    let groups = grouped(found.signals.iter().enumerate().map(|(k, one)| ((one.unit.as_str(), one.motor), (k, one))));
    let across = axis([0.0, end * clock.per_second].into_iter(), 0.0, 8);
    let mut body = String::new();
    let mut entries = Vec::new();
    let mut lowest: Option<Panel> = None;
    for (k, ((shown, motor), own)) in groups.iter().enumerate() {
        let values =
            own.iter().flat_map(|(_, one)| one.values.iter().map(|value| without_rounding(*value))).chain([0.0]);
        let top = lowest.map_or(TOP, |above| above.area.bottom() + BETWEEN);
        let panel = Panel::new(top, 0.8 * HEIGHT, across, axis(values, 0.06, 5));
        let what = if *motor { "commanded torques" } else { "outputs" };
        let below = if k + 1 == groups.len() { format!("time [{}]", clock.unit) } else { String::new() };
        body += &panel.frame(&below, &format!("{what} [{}]", unit(shown)));
        for &(colour, one) in own {
            let points = found
                .time
                .iter()
                .map(|time| time * clock.per_second)
                .zip(one.values.iter().map(|value| without_rounding(*value)));
            body += &panel.curve(points, &solid(colour));
            entries.push((colour, one.name.clone()));
        }
        lowest = Some(panel);
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
    Some(lowest?.picture(&format!("Step of {}", found.reference), "step responses", &body, &caption))
}

#[cfg(test)]
#[path = "../../tests/unit/frequency_pictures.rs"]
mod tests;

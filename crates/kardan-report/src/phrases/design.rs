//! Poles, transfer functions and shares of a design as text.

use super::{list, percent, polynomial};
use crate::text::figure;
use kardan_results::{CrossCoupling, Design, Pole, TransferEntry};
use kardan_rt::functions::hypot;

/// More names are counted.
const NAMES: usize = 12;

/// The origin of a pole: channels by their output, `zero dynamics`; empty if neither.
pub fn owner(pole: Pole, design: &Design) -> String {
    let near = |candidate: &Pole| {
        hypot(candidate.re - pole.re, candidate.im.abs() - pole.im.abs()) <= 1e-6 * pole.abs().max(1e-9)
    };
    let channels = design.channels.iter().filter(|channel| channel.poles.iter().any(near));
    let mut names: Vec<&str> = channels.map(|channel| channel.output.as_str()).collect();
    if design.zero_dynamics.modes.iter().any(|mode| near(&mode.pole)) {
        names.push("zero dynamics");
    }
    list(&names, NAMES)
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

/// The entry of the transfer matrix from that reference to that output.
pub fn linear<'a>(design: &'a Design, reference: &str, output: &str) -> Option<&'a TransferEntry> {
    design.transfer.iter().find(|entry| entry.reference == reference && entry.output == output)
}

/// The deviation of another channel as a share of the response to the output's own step; empty without a measure.
pub fn relative(coupling: &CrossCoupling, all: &[CrossCoupling]) -> Option<f64> {
    let own = all.iter().find(|candidate| {
        candidate.same_channel && candidate.output == coupling.output && candidate.failure.is_none()
    })?;
    // A step of another unit has no share.
    let own = Some(own).filter(|own| own.step_unit == coupling.step_unit)?.peak?;
    let share = coupling.peak? / own;
    (!coupling.same_channel && coupling.failure.is_none() && own > 0.0 && share.is_finite()).then_some(share)
}

/// A share that may be tiny: `12 %`, `0.024 %`, `0 %`.
pub fn share(value: f64, digits: usize) -> String {
    if value == 0.0 || value >= 0.1 { percent(value) } else { format!("{} %", figure(100.0 * value, digits)) }
}

#[cfg(test)]
#[path = "../../tests/unit/phrases/design.rs"]
mod tests;

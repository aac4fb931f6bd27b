//! A study on one screen: what failed first, then each requirement and each controller in one line.

use std::f64::consts::TAU;

use kardan_results::{ChannelMargin, Design, Margins, RequirementResult, Run, SignalError, Stability, Study};

use super::study::{alerts, judged, key_figures, measured, verdict};
use crate::curves::variant_label;
use crate::model::{Alert, Body, Cell, Page, row};
use crate::phrases;
use crate::text::figure;

/// Rows of each table, warnings and alerts that are listed; more are counted.
const ROWS: usize = 10;
const WARNINGS: usize = 4;
/// Names of variants in a row.
const NAMED: usize = 3;

/// The page of a study on one screen of a terminal.
pub fn page(study: &Study) -> Page {
    let all = requirements(study);
    let failed: Vec<&Summed<'_>> = all.iter().filter(|one| one.failed.len() + one.unmeasured > 0).collect();
    let figures = if all.is_empty() { key_figures(study) } else { Body::default() };
    Page {
        name: if study.model.name.is_empty() { "Study".into() } else { study.model.name.clone() },
        description: study.model.description.lines().next().unwrap_or_default().into(),
        verdict: Some(verdict(study)),
        alerts: first_alerts(study),
        sections: Page::sections([
            ("failed", "Failed requirements", failures(study, &failed)),
            ("controllers", "Closed loops", closed_loops(study)),
            ("requirements", "Requirements", passed(&all)),
            ("figures", "Key figures", figures),
            ("accuracy", "Accuracy", accuracy(study)),
            ("warnings", "Warnings", warnings(study)),
        ]),
        ..Page::default()
    }
}

/// A requirement over all variants.
struct Summed<'a> {
    first: &'a RequirementResult,
    count: usize,
    failed: Vec<(&'a Run, &'a RequirementResult)>,
    /// Variants that ended before it could be measured.
    unmeasured: usize,
    /// Smallest and largest measured value, SI.
    range: Option<[f64; 2]>,
}

fn requirements(study: &Study) -> Vec<Summed<'_>> {
    let summed = judged(study).into_iter().map(|(_, all)| {
        let measured: Vec<f64> =
            all.iter().filter_map(|(_, one)| one.measured.filter(|value| value.is_finite())).collect();
        let range = measured.iter().map(|&value| [value; 2]);
        Summed {
            first: all[0].1,
            count: all.len(),
            unmeasured: all.len() - measured.len(),
            range: range.reduce(|[low, high], [value, _]| [low.min(value), high.max(value)]),
            failed: all.into_iter().filter(|(_, one)| !one.passed).collect(),
        }
    });
    summed.collect()
}

/// The failed requirements with the values that failed.
fn failures(study: &Study, failed: &[&Summed<'_>]) -> Body {
    let rows = failed.iter().map(|sum| {
        let names: Vec<String> = sum.failed.iter().map(|(run, _)| variant_label(study, run)).collect();
        let value = |one: &RequirementResult| measured(one.measured, one.display.as_ref(), &one.unit);
        let values: Vec<String> = sum.failed.iter().take(NAMED).map(|(_, one)| value(one)).collect();
        let more = if sum.failed.len() > NAMED { ", …" } else { "" };
        row![&sum.first.text, phrases::list(&names, NAMED), values.join(", ") + more]
    });
    Body::default().table_of(ROWS, &["requirement", "failed in", "#measured"], rows)
}

/// Each requirement in one row.
fn passed(all: &[Summed<'_>]) -> Body {
    let rows = all.iter().map(|sum| {
        let show = |value: f64| measured(Some(value), sum.first.display.as_ref(), &sum.first.unit);
        let range = match sum.range {
            Some([low, high]) if show(low) == show(high) => show(low),
            Some([low, high]) => format!("{} to {}", show(low), show(high)),
            None => "not measured".into(),
        };
        let good = sum.count - sum.failed.len();
        let verdict =
            if good == sum.count { format!("passed in {good}") } else { format!("FAILED in {}", sum.failed.len()) };
        row![&sum.first.text, range, verdict]
    });
    if all.is_empty() {
        return Body::default().paragraph("The model file states no requirements.");
    }
    Body::default().table_of(ROWS, &["requirement", "#measured over all variants", "verdict"], rows)
}

/// Stability and margins of each controller.
fn closed_loops(study: &Study) -> Body {
    let rows = study.designs.iter().filter_map(|design| Some(closed_loop(design, design.margins.as_ref()?)));
    let headers = ["controller", "closed loop", "#gain margin", "#phase margin", "#delay margin", "#disk margin"];
    Body::default().table_of(ROWS, &headers, rows)
}

fn closed_loop(design: &Design, margins: &Margins) -> Vec<Cell> {
    let least = |of: &dyn Fn(&ChannelMargin) -> f64| {
        let channels = margins.channels.iter().filter(|one| of(one).is_finite());
        channels.min_by(|a, b| of(a).total_cmp(&of(b)))
    };
    // How far from one, on either side.
    let room = |one: &ChannelMargin| one.gain[1].min(1.0 / one.gain[0]);
    let gain = least(&room).map_or("–".into(), |one| {
        let [low, high] = one.gain;
        match (low > 0.0, high.is_finite()) {
            (true, true) => format!("× {} to × {}", figure(low, 2), figure(high, 2)),
            (true, false) => format!("> × {}", figure(low, 2)),
            _ => format!("< × {}", figure(high, 2)),
        }
    });
    let phase = least(&|one| one.phase).map_or("–".into(), |one| {
        let at = |at| format!(" at {} Hz ({} rad/s)", figure(at / TAU, 3), figure(at, 3));
        let at = one.phase_frequency.map_or(String::new(), at);
        format!("{}°{at}", figure(one.phase.to_degrees(), 3))
    });
    let delay = least(&|one| one.delay.unwrap_or(f64::INFINITY)).and_then(|one| one.delay);
    let delay = delay.map_or("–".into(), |delay| format!("{} ms", figure(1e3 * delay, 3)));
    let disk = least(&|one| one.disk).map_or("–".into(), |one| format!("{} at {}", figure(one.disk, 2), one.name));
    let stable = margins.stable == Some(true);
    let state = match (margins.stable, margins.stability.word) {
        (Some(true), _) if margins.low_margins => "stable, low margins",
        (Some(true), _) => "stable",
        (_, Stability::Unstable) => "unstable",
        (_, Stability::Marginal) => "marginal",
        _ => "not decided",
    };
    row![&design.controller, Cell::Mark(stable, state.into()), gain, phase, delay, disk]
}

/// The largest estimated error and the largest residual of an energy balance.
fn accuracy(study: &Study) -> Body {
    let errors = study.runs.iter().filter_map(|run| run.accuracy.as_ref()).flat_map(|found| &found.errors);
    let mut worst: Vec<&SignalError> = Vec::new();
    for one in errors {
        match worst.iter_mut().find(|other| other.unit == one.unit) {
            Some(other) if one.error > other.error => *other = one,
            Some(_) => {}
            None => worst.push(one),
        }
    }
    let mut text = Vec::new();
    if !worst.is_empty() {
        let one = |one: &&SignalError| {
            format!("{} {} in {}", figure(one.error, 2), one.unit.unit(), one.signal).replace("  ", " ")
        };
        let all: Vec<String> = worst.iter().take(NAMED).map(one).collect();
        text.push(format!("Largest estimated integration error: {} (not proven).", all.join(", ")));
    }
    let share = study
        .runs
        .iter()
        .filter_map(|run| run.energy.residual_share())
        .fold(None, |most: Option<f64>, x| Some(most.map_or(x, |most| most.max(x))));
    if let Some(share) = share {
        text.push(format!("Largest residual of an energy balance: {} of the energy exchanged.", figure(share, 2)));
    }
    text.into_iter().fold(Body::default(), Body::paragraph)
}

fn warnings(study: &Study) -> Body {
    let listed = study.warnings.iter().take(WARNINGS).fold(Body::default(), |body, text| body.judge(false, text));
    let more = study.warnings.len().saturating_sub(WARNINGS);
    if more == 0 { listed } else { listed.paragraph(format!("… and {more} more; --verbose prints them.")) }
}

fn first_alerts(study: &Study) -> Vec<Alert> {
    let mut all = alerts(study);
    let more = all.len().saturating_sub(WARNINGS);
    all.truncate(WARNINGS);
    if more > 0 {
        all.push(Alert { kind: "Warning".into(), text: format!("{more} more; --verbose prints them.") });
    }
    all
}

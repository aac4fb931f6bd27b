//! `kardan design`: design, proof and simulation of one controller.

use std::path::Path;

use kardan::diagnostics::{Diagnostic, Severity};
use kardan::results::Design;
use kardan::study::{DesignSettings, Part, ToleranceBox};
use kardan::{export, study};
use kardan_report as report;

use crate::args::{DesignArgs, number, word};
use crate::exit::{ERROR, exit_code, verdict};
use crate::input;
use crate::output::{deliver, prepare_files, render_text};
use crate::progress::{Bars, because};
use crate::render::{self, Failure};
use crate::stop;

/// The law of a controller that is not in the file.
const LAW: &str = "decoupling";

pub fn design(args: &DesignArgs, quiet: bool) -> Result<u8, Failure> {
    let settings = settings(args)?;
    let (source, project) = input::prepared(&args.model, &args.changes, quiet)?;
    prepare_files(args.report.iter().chain(&args.controller), None)?;
    // Only the design knows which errors stop it; the command reports the warnings.
    let mut warnings = project.diagnostics().to_vec();
    if args.force {
        study::overrule(&mut warnings);
    }
    warnings.retain(|d| d.severity == Severity::Warning);
    render::show(Some(&source), &warnings);
    let origin = source.to_string();
    let bars = Bars::limited(quiet, args.limits).showing({
        let (args, origin) = (args.clone(), origin.clone());
        move |part| match part {
            Part::Design(found) => exit_code(report_result(&found, &args, &origin, quiet), args.json),
            _ => ERROR,
        }
    });
    let found = bars.during(|bars| project.design(&settings, bars));
    let mut design = found.map_err(|found| Failure::beside(source, found, &warnings))?;
    if let Some(reason) = stop::reason() {
        because(&mut design.incomplete_reason, &reason);
    }
    report_result(&design, args, &origin, quiet)
}

/// Writes and prints the design, complete or partial.
fn report_result(design: &Design, args: &DesignArgs, origin: &str, quiet: bool) -> Result<u8, Failure> {
    let page = report::design(design);
    let controller = |_: &Path| Ok(export::controller_json(design).into_bytes());
    let printed = || if args.json { export::design_json(design) + "\n" } else { render_text(&page, origin) };
    deliver([&args.report, &args.controller], || &page, controller, printed, quiet)?;
    Ok(verdict(design.incomplete_reason.is_none(), true))
}

fn settings(args: &DesignArgs) -> Result<DesignSettings, Diagnostic> {
    let has_task = !args.inputs.is_empty() || !args.outputs.is_empty() || !args.at.is_empty();
    Ok(DesignSettings {
        control: args.control.clone(),
        law: args.law.clone().or_else(|| has_task.then(|| LAW.into())),
        inputs: args.inputs.clone(),
        outputs: args.outputs.clone(),
        at: points(&args.at)?,
        feedback: args.feedback.and_then(word),
        variant: args.variant.clone(),
        simulate: !args.no_simulation,
        force: args.force,
        explore: args.explore,
        tolerance: args.tolerance.as_deref().map(tolerance).transpose()?,
    })
}

/// Signals with their values: `arm.phi=60 deg`.
pub fn points(all: &[String]) -> Result<Vec<(String, String)>, Diagnostic> {
    let point = |text: &String| -> Result<(String, String), Diagnostic> {
        let parts = text.split_once('=').map(|(signal, value)| (signal.trim(), value.trim()));
        let (signal, value) =
            parts.filter(|(signal, value)| !signal.is_empty() && !value.is_empty()).ok_or_else(|| {
                let message = format!("`--at {text}` is not a signal with a value");
                Diagnostic::error("arguments::at", message).help("write `--at arm.phi=\"60 deg\"`")
            })?;
        Ok((signal.into(), value.into()))
    };
    all.iter().map(point).collect()
}

/// `file`, or a percentage above 0 and below 100.
fn tolerance(text: &str) -> Result<ToleranceBox, Diagnostic> {
    if text == "file" {
        return Ok(ToleranceBox::File);
    }
    match number(text.trim().trim_end_matches('%')) {
        Some(percent) if percent > 0.0 && percent < 100.0 => Ok(ToleranceBox::Part(percent / 100.0)),
        _ => {
            let message = format!("`--tolerance {text}` is not a percentage above 0 and below 100");
            let help = "write `--tolerance 20%`; without a number kardan uses the tolerances of the file. The model \
                        comes before the option";
            Err(Diagnostic::error("arguments::tolerance", message).help(help))
        }
    }
}

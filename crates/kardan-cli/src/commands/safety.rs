//! `kardan safety`: the effects of every fault of a model file, and whether it is detected.

use std::path::Path;

use kardan::export;
use kardan::results::{Safety, SafetyVerdict};
use kardan::study::{Part, SafetySettings};
use kardan_report as report;

use crate::args::SafetyArgs;
use crate::exit::{ERROR, exit_code, verdict};
use crate::input;
use crate::output::{deliver, prepare_files, render_text};
use crate::progress::Bars;
use crate::render::Failure;

pub fn safety(args: &SafetyArgs, quiet: bool) -> Result<u8, Failure> {
    let (source, project, model_diagnostics) = input::checked(&args.model, &args.changes, false, quiet)?;
    prepare_files(args.report.iter().chain(&args.csv), None)?;
    let settings = SafetySettings { origin: args.model.display().to_string(), changes: args.changes.set.clone() };
    let origin = source.to_string();
    let bars = Bars::limited(quiet, args.limits).showing({
        let (args, origin) = (args.clone(), origin.clone());
        move |part| match part {
            Part::Safety(table) => exit_code(report_result(&table, &args, &origin, quiet), args.json),
            _ => ERROR,
        }
    });
    let found = bars.during(|bars| project.safety(&settings, bars));
    let table = found.map_err(|found| Failure::beside(source, found, &model_diagnostics))?;
    report_result(&table, args, &origin, quiet)
}

/// Writes and prints the results, complete or partial.
fn report_result(table: &Safety, args: &SafetyArgs, origin: &str, quiet: bool) -> Result<u8, Failure> {
    let page = report::safety(table);
    let csv = |_: &Path| Ok(export::safety_csv(table).into_bytes());
    let printed = || if args.json { export::safety_json(table) + "\n" } else { render_text(&page, origin) };
    deliver([&args.report, &args.csv], || &page, csv, printed, quiet)?;
    let failed = table.rows.iter().any(|row| row.verdict == SafetyVerdict::Failed);
    Ok(verdict(table.missing == 0 && !failed, table.passes()))
}

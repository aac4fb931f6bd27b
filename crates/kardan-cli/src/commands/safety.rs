//! `kardan safety`: the effects of every fault of a model file, and whether it is detected.

use kardan::export;
use kardan::results::{Safety, SafetyVerdict};
use kardan::study::{Part, SafetySettings};
use kardan_report as report;

use crate::args::SafetyArgs;
use crate::exit::{DONE, ERROR, REQUIREMENT_FAILED, exit_code};
use crate::input;
use crate::output::{note_saved_file, prepare_files, print, render_text, save, save_page};
use crate::progress::Bars;
use crate::render::Failure;

pub fn safety(args: &SafetyArgs, quiet: bool) -> Result<u8, Failure> {
    let (source, project, model_diagnostics) = input::checked(&args.model, &args.changes, false, quiet)?;
    let files: Vec<_> = args.report.iter().chain(&args.csv).map(std::path::PathBuf::as_path).collect();
    prepare_files(&files, None)?;
    let settings = SafetySettings { origin: args.model.display().to_string(), changes: args.changes.set.clone() };
    let origin = source.to_string();
    let bars = Bars::limited(quiet, args.limits).showing({
        let (args, origin) = (args.clone(), origin.clone());
        move |part| match part {
            Part::Safety(table) => exit_code(report_result(&table, &args, &origin, quiet), args.json),
            _ => ERROR,
        }
    });
    let found = project.safety(&settings, &bars);
    bars.finish();
    let table = found.map_err(|found| Failure::beside(source, found, &model_diagnostics))?;
    report_result(&table, args, &origin, quiet)
}

/// Writes and prints the results, complete or partial.
fn report_result(table: &Safety, args: &SafetyArgs, origin: &str, quiet: bool) -> Result<u8, Failure> {
    let page = report::safety(table);
    if let Some(path) = &args.report {
        save_page(path, &page)?;
    }
    if let Some(path) = &args.csv {
        save(path, export::safety_csv(table).as_bytes())?;
    }
    print(&if args.json { export::safety_json(table) + "\n" } else { render_text(&page, origin) })?;
    for path in args.report.iter().chain(&args.csv).filter(|_| !quiet) {
        note_saved_file(path);
    }
    let failed = table.rows.iter().any(|row| row.verdict == SafetyVerdict::Failed);
    Ok(match (table.missing > 0 || failed, table.passes()) {
        (true, _) => ERROR,
        (false, true) => DONE,
        (false, false) => REQUIREMENT_FAILED,
    })
}

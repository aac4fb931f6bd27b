//! What `kardan run` writes and prints: tables, plots, report, summary.

use std::sync::{Mutex, PoisonError};

use kardan::diagnostics::Diagnostic;
use kardan::export::{self, Files};
use kardan::results::{Outcome, Run, RunVerdict, Study};
use kardan_report as report;
use rayon::prelude::*;

use crate::args::{Format, RunArgs};
use crate::exit::verdict;
use crate::folder::{Folder, note_moved_files};
use crate::output::{likely_columns, print, render_summary, render_text, shown};
use crate::render::{self, Failure};
use crate::stop;

/// Lines of what is printed without `--verbose`, the files included.
const SUMMARY_LINES: usize = 60;
/// More files of one kind are counted.
const MOST_LISTED_FILES: usize = 4;

/// Writes and prints the results, complete or partial.
pub(super) fn report_result(
    study: &Study,
    folder: &Mutex<Folder>,
    args: &RunArgs,
    origin: &str,
    quiet: bool,
) -> Result<u8, Failure> {
    let mut folder = folder.lock().unwrap_or_else(PoisonError::into_inner);
    let page = match args.no_report {
        false => report::study(study),
        true => report::study_text(study),
    };
    let (files, mut problems) = write(study, &page, &mut folder, args);
    // If a file could not be written, files of an earlier run may be the only ones.
    let finished = if problems.is_empty() { folder.finish("run") } else { Ok(Vec::new()) };
    let gone = finished.map_err(|problem| problems.push(problem)).unwrap_or_default();
    render::show(None, &problems);
    if args.json {
        print(&(export::json(study, &files) + "\n"))?;
    } else {
        let mut paths = format_saved_files(&files, args.verbose);
        files.report.iter().for_each(|report| paths += &likely_columns(report));
        let text = match args.verbose {
            true => render_text(&page, origin),
            false => render_summary(&report::summary(study), origin, SUMMARY_LINES - 1 - paths.lines().count()),
        };
        print(&(text + "\n" + &render::visible(&paths)))?;
    }
    note_moved_files(&gone, quiet);
    // A signal after all files are written has no effect.
    let early = |warning: &&String| stop::reason().is_some_and(|why| warning.starts_with(&why));
    let missing: Vec<&String> = study.warnings.iter().filter(early).collect();
    missing.iter().for_each(|warning| render::note(warning));
    let completed = study.runs.iter().all(|run| run.outcome == Outcome::Completed);
    Ok(verdict(completed && problems.is_empty() && missing.is_empty(), passes(&study.runs, args.strict)))
}

/// The files that were written, one line each; of more tables or plots than a few their number.
fn format_saved_files(files: &Files, all: bool) -> String {
    let list = |paths: Vec<&String>, what: &str| match &paths[..] {
        [first, .., last] if paths.len() > MOST_LISTED_FILES && !all => {
            format!("wrote {} {what}: {first} … {last}\n", paths.len())
        }
        _ => paths.iter().map(|path| format!("wrote {path}\n")).collect(),
    };
    let tables = list(files.runs.iter().flatten().collect(), "tables");
    let other_files = list(files.figures.iter().chain(&files.report).collect(), "files");
    tables + &other_files + &list(files.plots.iter().collect(), "plots")
}

/// Writes all files that can be written, tables first; returns those that could not.
fn write(study: &Study, page: &report::Page, folder: &mut Folder, args: &RunArgs) -> (Files, Vec<Diagnostic>) {
    let mut files = Files::default();
    let mut problems = Vec::new();
    let tables: Vec<_> = study.runs.par_iter().map(|run| table(&study.model.name, run, args.format)).collect();
    let mut save = |stem: &str, table: Result<(&str, Vec<u8>), Diagnostic>| {
        let saved = table.and_then(|(extension, bytes)| folder.write(stem, extension, &bytes));
        saved.map_err(|problem| problems.push(problem)).ok()
    };
    for (run, table) in study.runs.iter().zip(tables) {
        files.runs.push(save(&run.name, table).into_iter().collect());
    }
    if let Some(figures) = export::figures_csv(study) {
        let mut name = String::from("figures");
        while study.runs.iter().any(|run| run.name.eq_ignore_ascii_case(&name)) {
            name.push('_');
        }
        files.figures = save(&name, Ok(("csv", figures.into_bytes())));
    }
    if !args.no_report {
        let drawing = report::mechanism(&study.model.mechanism);
        for (name, svg) in drawing.iter().map(|svg| ("mechanism", svg.as_str())).chain(page.plots()) {
            files.plots.extend(save(name, Ok(("svg", svg.into()))));
        }
        let (extension, text) = shown(page, args.markdown);
        files.report = save("report", Ok((extension, text.into_bytes())));
    }
    files.unwritten = problems.iter().map(|problem| problem.message.clone()).collect();
    (files, problems)
}

/// The signals of a run in a format: extension and bytes.
pub(super) fn table(model: &str, run: &Run, format: Format) -> Result<(&'static str, Vec<u8>), Diagnostic> {
    match format {
        Format::Csv => Ok(("csv", export::csv(run))),
        Format::Parquet => export::parquet(model, run).map(|bytes| ("parquet", bytes)).map_err(|error| {
            Diagnostic::error("export::parquet", format!("cannot make a Parquet file of `{}`: {error}", run.name))
        }),
        Format::Mat => export::mat(&run.series).map(|bytes| ("mat", bytes)).ok_or_else(|| {
            let message =
                format!("`{}` is too long for a MAT file of version 5, which allows 2 GiB per variable", run.name);
            Diagnostic::error("export::mat", message).help("use another format, such as parquet")
        }),
        Format::Mdf => Ok(("mf4", export::mdf(&[(&run.name, &run.series)]))),
    }
}

/// Whether the numbers of all runs may be used, and meet the requirements.
fn passes(runs: &[Run], strict: bool) -> bool {
    let doubted = strict && runs.iter().any(|run| run.verdict() == RunVerdict::Doubtful);
    !doubted && runs.iter().flat_map(|run| &run.requirements).all(|requirement| requirement.passed)
}

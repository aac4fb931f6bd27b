//! `kardan sweep`: a model over many values of its parameters.

use std::fs;
use std::path::{Path, PathBuf};

use kardan::diagnostics::{Diagnostic, Severity};
use kardan::export;
use kardan::results::{Sweep, SweepRow};
use kardan::study::{Settings, SweepPlan, SweepSettings};
use kardan_report as report;

use super::run::method;
use crate::args::SweepArgs;
use crate::exit::{DONE, ERROR, REQUIREMENT_FAILED};
use crate::input;
use crate::output::{in_words, prepare_folder, print, reason, save, save_page, say_written};
use crate::progress::Bars;
use crate::render::{self, Failure};

/// What files of rows are called.
const STEM: &str = "rows-";

pub fn sweep(args: &SweepArgs, quiet: bool) -> Result<u8, Failure> {
    let (source, project) = input::prepared(&args.model, &args.changes, quiet)?;
    let known = project.mistakes().to_vec();
    if known.iter().any(|d| d.severity == Severity::Error) {
        return Err(Failure { source: Some(source), diagnostics: known });
    }
    render::show(Some(&source), &known);
    let run = Settings { method: method(args.method), tolerance: args.tolerance, ..Settings::default() };
    let settings = SweepSettings { samples: args.samples, seed: args.seed, variants: args.variants.clone(), run };
    let refused = |diagnostics: Vec<Diagnostic>| {
        let diagnostics = diagnostics.into_iter().filter(|d| d.severity == Severity::Error || !known.contains(d));
        Failure { source: Some(source.clone()), diagnostics: diagnostics.collect() }
    };
    let plan = project.sweep_plan(&settings).map_err(refused)?;
    let before = match &args.out {
        Some(out) => rows_before(args, out, &plan)?,
        None => Vec::new(),
    };
    let bars = Bars::within(quiet, args.limits);
    let mut failed = None;
    let mut write = |block: u64, rows: &[SweepRow]| match &args.out {
        Some(out) => write_block(out, &plan, block, rows).map_err(|mistake| {
            let why = mistake.message.clone();
            failed = Some(mistake);
            why
        }),
        None => Ok(()),
    };
    let found = project.sweep(&plan, &settings.run, before, &bars, &mut write);
    bars.finish();
    if let Some(mistake) = failed {
        let help =
            "the rows that were written before are complete: once that is put right, `--resume` makes the others";
        return Err(mistake.help(help).into());
    }
    let mut found = found.map_err(refused)?;
    if let (Some(out), true) = (&args.out, found.missing > 0) {
        found.notes.push(format!(
            "The rows that are there stay: the same command with `--resume` makes the others in `{}`.",
            out.display()
        ));
    }
    if let (Some(out), 0) = (&args.out, found.missing) {
        put_away(out, plan.blocks())?;
    }
    tell(&found, args, &source.to_string(), quiet)
}

/// The name of a block's file.
fn path_of(out: &Path, block: u64) -> PathBuf {
    out.join(format!("{STEM}{block:06}.parquet"))
}

fn write_block(out: &Path, plan: &SweepPlan, block: u64, rows: &[SweepRow]) -> Result<(), Diagnostic> {
    let bytes = export::sweep_rows(&plan.head, rows)
        .map_err(|error| Diagnostic::error("output::folder", format!("rows cannot be written as Parquet: {error}")))?;
    save(&path_of(out, block), &bytes)
}

/// Files of rows in the folder, by their blocks.
fn files_of_rows(out: &Path) -> Vec<(u64, PathBuf)> {
    let entries = fs::read_dir(out).into_iter().flatten().filter_map(Result::ok);
    let block = |path: PathBuf| {
        let name = path.file_name()?.to_str()?.strip_prefix(STEM)?.strip_suffix(".parquet")?;
        Some((name.parse().ok()?, path))
    };
    let mut found: Vec<(u64, PathBuf)> = entries.filter_map(|entry| block(entry.path())).collect();
    found.sort();
    found
}

/// Removes files of rows behind those of a sweep that is complete: they are of another one, whose others were replaced.
fn put_away(out: &Path, blocks: u64) -> Result<(), Diagnostic> {
    for (_, path) in files_of_rows(out).into_iter().filter(|(block, _)| *block >= blocks) {
        fs::remove_file(&path).map_err(|error| {
            let message = format!("cannot remove `{}`: {}", path.display(), reason(&error));
            Diagnostic::error("output::folder", message).help("remove it: it holds rows of another sweep")
        })?;
    }
    Ok(())
}

/// The rows that are there already, of the same sweep; a folder with those of another one is refused.
fn rows_before(args: &SweepArgs, out: &Path, plan: &SweepPlan) -> Result<Vec<SweepRow>, Diagnostic> {
    prepare_folder(out)?;
    let files = files_of_rows(out);
    let shown = out.display();
    if !args.resume {
        if !files.is_empty() && !args.force {
            let message = format!("the folder `{shown}` holds rows of a sweep already");
            let help = "go on with `--resume`, replace them with `--force`, or name another folder with --out DIR";
            return Err(Diagnostic::error("output::folder", message).help(help));
        }
        return Ok(Vec::new());
    }
    let mut rows: Vec<SweepRow> = Vec::new();
    for (block, path) in files {
        let read = fs::read(&path).map_err(|error| reason(&error));
        let found = read.and_then(|bytes| export::read_sweep_rows(&plan.head, bytes));
        let found = found.map_err(|why| {
            let message = format!("`{}` cannot be gone on with: {why}", path.display());
            let help = "run with the model and the options that made it, or start anew with `--force`";
            Diagnostic::error("sweep::resume", message).help(help)
        })?;
        let size = plan.block();
        let samples = (block * size..plan.samples.min((block + 1) * size)).count();
        let own = found.iter().filter(|row| row.sample / size == block).count();
        if own == found.len() && own == samples * plan.head.variants.len() {
            rows.extend(found);
        } else {
            let message = format!("`{}` does not hold all rows of its block", path.display());
            let help = "remove it to run its samples again, or start anew with `--force`";
            return Err(Diagnostic::error("sweep::resume", message).help(help));
        }
    }
    Ok(rows)
}

/// Writes and prints what was found, all of it or not.
fn tell(found: &Sweep, args: &SweepArgs, origin: &str, quiet: bool) -> Result<u8, Failure> {
    let page = report::sweep(found);
    let mut written = Vec::new();
    if let Some(out) = &args.out {
        let (pages, numbers) = (out.join("sweep.html"), out.join("sweep.json"));
        save_page(&pages, &page)?;
        save(&numbers, (export::sweep_json(found) + "\n").as_bytes())?;
        written = vec![pages, numbers];
    }
    print(&if args.json { export::sweep_json(found) + "\n" } else { in_words(&page, origin) })?;
    written.iter().filter(|_| !quiet).for_each(|path| say_written(path));
    let fails = found.requirements.iter().any(|one| one.failed > 0) || !found.failures.is_empty();
    Ok(match (found.missing > 0, fails) {
        (true, _) => ERROR,
        (false, true) => REQUIREMENT_FAILED,
        (false, false) => DONE,
    })
}

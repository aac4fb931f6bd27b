//! `kardan sweep`: a model over many values of its parameters.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use kardan::diagnostics::{Diagnostic, Severity};
use kardan::export;
use kardan::project::Project;
use kardan::results::{RowAgain, Sweep, SweepRow, SweepRows, SweptRequirement};
use kardan::study::{Progress, Settings, Shard, SweepGoal, SweepPlan, SweepSettings};
use kardan_report as report;

use super::model_store::store_model;
use super::rows::{files_of_rows, put_away, removed, rows_before, rows_of, shard_counts, write_block, write_manifest};
use crate::args::{Limits, MOST_STEPS, MergeArgs, RunMethod, SweepArgs, SweepCommand, word};
use crate::exit::verdict;
use crate::files::{self, reason};
use crate::input;
use crate::lock::Lock;
use crate::output::{note_saved_file, prepare_folder, print, quoted_for_shell, render_text, save_in, shown, stays};
use crate::progress::Bars;
use crate::render::Failure;
use crate::stop;

/// The page and the results.
const PAGE: &str = "sweep.html";
const RESULTS: &str = "sweep.json";
/// The page with the full runs of the worst cases, and how many.
const FULL: &str = "worst.html";
const MOST_FULL: usize = 3;

pub fn sweep(args: &SweepArgs, quiet: bool) -> Result<u8, Failure> {
    if let Some(SweepCommand::Merge(args)) = &args.merge {
        return merge(args, quiet);
    }
    let begun = Instant::now();
    // The rows exist, as no other rows replace them.
    let model = args.model.clone().unwrap_or_default();
    let (source, project, model_diagnostics) = input::checked(&model, &args.changes, false, quiet)?;
    let settings = settings(args);
    let refused = |found| Failure::beside(source.clone(), found, &model_diagnostics);
    let mut plan = project.sweep_plan(&settings).map_err(refused)?;
    plan.shard = args.shard;
    let (_lock, mut rows) = match &args.out {
        Some(out) => (Some(prepared_folder(out, plan.shard)?), rows_before(args, out, (&project, &plan))?),
        None => (None, SweepRows::default()),
    };
    let bars = Bars::limited(quiet, args.limits);
    stop::finish_parts();
    let mut failed = None;
    // Rows of another sweep stay until the first ones of this sweep are written.
    let (mut first, mut is_stored) = (args.force, false);
    let mut write = |block: u64, rows: &[SweepRow]| {
        let Some(out) = &args.out else { return Ok(()) };
        // The model, once, before the first rows of it.
        let store = || store_model(out, &project, &plan.head.identity);
        let model_store = if std::mem::replace(&mut is_stored, true) { Ok(()) } else { store() };
        let saved = model_store.and_then(|()| write_block(out, &plan, block, rows, std::mem::take(&mut first)));
        saved.map_err(|diagnostic| {
            let why = diagnostic.message.clone();
            failed = Some(diagnostic);
            why
        })
    };
    let found = bars.during(|bars| project.sweep(&plan, &settings.run, &mut rows, bars, &mut write));
    if let Some(diagnostic) = failed {
        let help = "the rows written before are complete: after fixing the cause, `--resume` computes the others";
        return Err(diagnostic.help(help).into());
    }
    let mut found = found.map_err(refused)?;
    if let (Some(out), true) = (&args.out, found.missing > 0) {
        found.notes.push(how_to_go_on(args, out, found.rows));
    }
    if let (Some(out), 0) = (&args.out, found.missing) {
        // A sweep that ended by its goal may continue from rows after its end.
        put_away(out, if args.resume { plan.blocks() } else { plan.blocks_of(found.rows) })?;
        if let Some(shard) = plan.shard {
            write_manifest(out, (&plan, shard), found.rows, begun.elapsed().as_secs_f64())?;
        }
    }
    let files = args.out.iter().flat_map(|out| files_of_rows(out)).collect();
    let command = command_again((&model, &args.changes.set), (args.method, args.tolerance, args.limits.max_steps));
    let (project, plan, found, rows, limits) = (&project, &plan, &found, &rows, args.limits);
    let runs = Runs { project, plan, found, rows, settings: &settings.run, limits, quiet };
    runs.report((args.out.as_deref(), args.json), &files, command, &source.to_string())
}

/// Prepares the folder of a sweep: it is writable, no link leads out of it, and no other sweep writes to it.
pub fn prepared_folder(out: &Path, shard: Option<Shard>) -> Result<Lock, Diagnostic> {
    prepare_folder(out)?;
    [PAGE, RESULTS, FULL].iter().try_for_each(|name| stays(out, &out.join(name)))?;
    Lock::take(out, shard)
}

/// How to continue a sweep that ended early.
fn how_to_go_on(args: &SweepArgs, out: &Path, rows: u64) -> String {
    let out = out.display();
    if args.force && rows == 0 {
        return format!("No row was computed: `{out}` contains the earlier sweep.");
    }
    // Another `--force` would discard the new rows.
    let instead = if args.force { " in place of `--force`" } else { "" };
    format!("Existing rows stay: the same command with `--resume`{instead} computes the others in `{out}`.")
}

/// Files of rows, by blocks.
type Files = BTreeMap<u64, PathBuf>;

/// The command that reruns rows, up to their file.
fn command_again(
    (model, set): (&Path, &[String]),
    (method, tolerance, max_steps): (RunMethod, Option<f64>, u64),
) -> String {
    let mut command = format!("kardan run {}", quoted_for_shell(&model.display().to_string()));
    for change in set {
        command += &format!(" --set {}", quoted_for_shell(change));
    }
    if let Some(word) = word(method).filter(|_| method != RunMethod::Automatic) {
        command += &format!(" --method {word}");
    }
    if let Some(tolerance) = tolerance {
        command += &format!(" --tolerance {tolerance:e}");
    }
    if max_steps != MOST_STEPS {
        command += &format!(" --max-steps {max_steps}");
    }
    command + " --variants-from"
}

/// The runs of a sweep.
struct Runs<'a> {
    project: &'a Project,
    plan: &'a SweepPlan,
    found: &'a Sweep,
    rows: &'a SweepRows,
    settings: &'a Settings,
    limits: Limits,
    quiet: bool,
}

impl Runs<'_> {
    /// Writes and prints the results, complete or partial; the page shows how to run rows again, by their files and the command for them.
    fn report(
        &self,
        (out, json): (Option<&Path>, bool),
        files: &Files,
        command: String,
        origin: &str,
    ) -> Result<u8, Failure> {
        let found = self.found;
        let page = report::sweep(found);
        let numbers = || export::sweep_json(found) + "\n";
        let mut paths = Vec::new();
        if let Some(out) = out {
            let (samples, again) = self.inspect(out, files, command)?;
            let (_, whole) = shown(&report::sweep_with(found, &samples, &again), false);
            paths.push(save_in(out, PAGE, whole.as_bytes())?);
            paths.push(save_in(out, RESULTS, numbers().as_bytes())?);
        }
        print(&if json { numbers() } else { render_text(&page, origin) })?;
        paths.iter().filter(|_| !self.quiet).for_each(|path| note_saved_file(path));
        let fails = found.requirements.iter().any(|one| one.failed > 0) || !found.failures.is_empty();
        let fails = fails || found.worst.as_ref().is_some_and(|worst| worst.fails);
        let fails = fails || found.rare.as_ref().is_some_and(|rare| rare.probability.is_some());
        Ok(verdict(found.missing == 0, !fails))
    }

    /// The rows that the page draws, and how to rerun each; the worst ones have a page of their own.
    fn inspect(
        &self,
        out: &Path,
        files: &Files,
        command: String,
    ) -> Result<(report::Samples, report::Again), Diagnostic> {
        let plan = self.plan;
        let full = if plan.shard.is_some() { None } else { self.full_page(out)? };
        let mut paths = Vec::new();
        for (&block, path) in files.range(..plan.blocks()) {
            paths.resize(block as usize, String::new());
            paths.push(quoted_for_shell(&path.display().to_string()));
        }
        let names = plan.head.variants.iter().map(|name| quoted_for_shell(name));
        let variants = if plan.head.variants.len() > 1 { names.collect() } else { Vec::new() };
        let again = report::Again { command, block: plan.block(), files: paths, variants, full };
        Ok((report::Samples::new(&plan.head, self.found, self.rows), again))
    }

    /// Reruns the worst cases with all signals and writes their page, or removes that of an earlier sweep; returns its name, or why there is none.
    fn full_page(&self, out: &Path) -> Result<Option<Result<String, String>>, Diagnostic> {
        let has_requirements = !(self.found.requirements.is_empty() && self.found.worst.is_none());
        let bars = Bars::limited(self.quiet, self.limits);
        let made = bars.during(|bars| has_requirements.then(|| self.full_runs(bars)));
        match &made {
            Some(Ok(page)) => save_in(out, FULL, shown(page, false).1.as_bytes()).map(|_| ())?,
            _ => removed(&out.join(FULL), "it is of an earlier sweep")?,
        }
        Ok(made.map(|made| made.map(|_| FULL.into())))
    }

    /// The page of the worst cases, rerun with all signals.
    fn full_runs(&self, bars: &Bars) -> Result<report::Page, String> {
        if self.found.missing > 0 {
            return Err(format!("{} runs are missing", self.found.missing));
        }
        let head = &self.plan.head;
        let again = |(sample, variant): (u64, &str)| {
            let number = head.variants.iter().position(|name| name == variant)?;
            let own = self.rows.range(sample..sample + 1);
            let row = own.map(|row| self.rows.get(row)).find(|row| row.variant == number)?;
            let names = head.varied.iter().map(|one| one.name.clone());
            Some(RowAgain { sample, variant: variant.into(), values: names.zip(row.values.iter().copied()).collect() })
        };
        let rows: Vec<RowAgain> = worst_cases(self.found).into_iter().filter_map(again).collect();
        if rows.is_empty() {
            return Err("no run has a value that a requirement measures".into());
        }
        let settings = Settings { runs_only: true, ..self.settings.clone() };
        let first = |diagnostics: Vec<Diagnostic>| {
            let first = diagnostics.into_iter().find(|one| one.severity == Severity::Error);
            first.map_or_else(|| "they cannot be prepared".into(), |one| one.message)
        };
        let project = self.project.rows_again(&head.identity, &rows, &settings).map_err(first)?;
        let study = project.run(&settings, bars).map_err(first)?;
        bars.stop().map_or(Ok(report::study(&study)), Err)
    }
}

/// Samples of the worst cases of the first requirements, with their variants.
fn worst_cases(found: &Sweep) -> Vec<(u64, &str)> {
    let worst = |one: &SweptRequirement| {
        let ([least, largest], quantiles) = (one.measured.extreme_samples?, one.measured.quantiles?);
        let above = one.above.map_or(f64::INFINITY, |bound| quantiles[0] - bound);
        let below = one.below.map_or(f64::INFINITY, |bound| bound - quantiles[6]);
        Some(if above < below { least } else { largest })
    };
    let searched = found.worst.iter().map(|one| (one.sample, one.variant.as_str()));
    let own = found.requirements.iter().filter_map(|one| Some((worst(one)?, one.variant.as_str())));
    let mut all: Vec<(u64, &str)> = Vec::new();
    for one in searched.chain(own) {
        if !all.contains(&one) && all.len() < MOST_FULL {
            all.push(one);
        }
    }
    all
}

/// The sweep.
pub fn settings(args: &SweepArgs) -> SweepSettings {
    let run = Settings { method: args.method.into(), tolerance: args.tolerance, ..Settings::default() };
    let (variants, goal) = (args.variants.clone(), goal(args));
    let most_steps = usize::try_from(args.limits.max_steps).ok();
    SweepSettings { samples: args.samples, seed: args.seed, variants, run, most_steps, goal, lanes: None }
}

/// Its goal; mutually exclusive options are rejected earlier.
fn goal(args: &SweepArgs) -> SweepGoal {
    match (&args.worst, &args.rare, args.until) {
        (Some(name), ..) => SweepGoal::Worst(name.clone()),
        (_, Some(name), _) => SweepGoal::Rare(name.clone()),
        (_, _, Some(half)) => SweepGoal::Until(half),
        _ => SweepGoal::Samples,
    }
}

/// `kardan sweep merge`.
pub fn merge(args: &MergeArgs, quiet: bool) -> Result<u8, Failure> {
    let (source, project) = input::prepared(&args.model, &args.changes, quiet)?;
    let no_rows = |message: String| {
        let help = "name the folders that `kardan sweep --shard I/N --out DIR` wrote";
        Diagnostic::error("sweep::merge", message).help(help)
    };
    if let Some(part) = args.parts.iter().find(|part| !part.is_dir()) {
        return Err(no_rows(format!("there is no folder `{}`", part.display())).into());
    }
    let files: Vec<(u64, PathBuf)> = args.parts.iter().flat_map(|part| files_of_rows(part)).collect();
    let Some((_, first)) = files.first() else {
        let parts: Vec<String> = args.parts.iter().map(|part| format!("`{}`", part.display())).collect();
        return Err(no_rows(format!("there are no rows in {}", parts.join(", "))).into());
    };
    let bytes = files::read(first).map_err(|error| reason(&error));
    let (samples, seed) = bytes.and_then(export::samples_and_seed).map_err(|why| unmerged(first, &why, DAMAGED))?;
    let run = Settings { method: args.method.into(), tolerance: args.tolerance, ..Settings::default() };
    let options = SweepSettings {
        samples: Some(samples),
        seed: Some(seed),
        variants: args.variants.clone(),
        run: run.clone(),
        most_steps: usize::try_from(args.max_steps).ok(),
        ..SweepSettings::default()
    };
    let refused = |diagnostics| Failure { source: Some(source.clone()), diagnostics };
    let plan = project.sweep_plan(&options).map_err(refused)?;
    let (mut rows, blocks) = merged_rows((&project, &plan), files)?;
    let missing: Vec<u64> = (0..plan.blocks()).filter(|block| !blocks.contains_key(block)).collect();
    let mut found = project.sweep_summary(&plan, &mut rows);
    let empty = args.parts.iter().filter(|part| files_of_rows(part).is_empty());
    let empty: Vec<String> = empty.map(|part| format!("`{}`", part.display())).collect();
    if !(empty.is_empty() || missing.is_empty()) {
        found.notes.push(format!("There are no rows in {}.", empty.join(", ")));
    }
    if let (Some(first), Some(last)) = (missing.first(), missing.last()) {
        let samples = plan.samples_of(*first..last + 1);
        found.notes.push(format!(
            "{} of {} blocks of samples are missing, between samples {} and {}: run their shards again, with `--resume`{}.",
            missing.len(),
            plan.blocks(),
            samples.start,
            samples.end - 1,
            named_shards(&shards_of(&args.parts, &plan, &missing))
        ));
    }
    let _lock = args.out.as_deref().map(|out| prepared_folder(out, None)).transpose()?;
    let limits = Limits { max_steps: args.max_steps, time_limit: None };
    let command = command_again((&args.model, &args.changes.set), (args.method, args.tolerance, args.max_steps));
    let (project, plan, found, rows) = (&project, &plan, &found, &rows);
    let runs = Runs { project, plan, found, rows, settings: &run, limits, quiet };
    runs.report((args.out.as_deref(), args.json), &blocks, command, &source.to_string())
}

/// Help for a file of rows that cannot be merged: it is of another sweep, or damaged.
const OTHER: &str = "name the model, its `--set`, `--method`, `--tolerance`, `--max-steps` and `--variant` of all shards, and only their folders";
const DAMAGED: &str = "rerun its shard with `--resume`, which recomputes its rows, then merge";

fn unmerged(path: &Path, why: &str, help: &str) -> Diagnostic {
    Diagnostic::error("sweep::merge", format!("`{}` cannot be merged: {why}", path.display())).help(help)
}

/// The rows of files, each block once: if two files contain it, both have the same bits.
fn merged_rows(
    (project, plan): (&Project, &SweepPlan),
    files: Vec<(u64, PathBuf)>,
) -> Result<(SweepRows, Files), Diagnostic> {
    let (mut rows, mut blocks) = (SweepRows::default(), Files::new());
    for (block, path) in files {
        let read = |path: &Path| {
            rows_of(project, plan, block, path)
                .map_err(|found| unmerged(path, &found.why, if found.is_damaged { DAMAGED } else { OTHER }))
        };
        let found = read(&path)?;
        match blocks.get(&block) {
            Some(other) if !same(&read(other)?, &found) => {
                let why = format!("`{}` has different numbers in the same rows", other.display());
                return Err(unmerged(&path, &why, OTHER));
            }
            Some(_) => {}
            None => {
                rows.extend(found);
                blocks.insert(block, path);
            }
        }
    }
    Ok((rows, blocks))
}

/// Shards of blocks, by the number in the manifests in folders; none where these differ or are missing.
fn shards_of(parts: &[PathBuf], plan: &SweepPlan, missing: &[u64]) -> Vec<String> {
    let &[of @ 1..=MOST_COUNTED] = &shard_counts(parts)[..] else { return Vec::new() };
    let mut part = plan.clone();
    let mut lacks = |number: &u64| {
        part.shard = Some(Shard { number: *number, of });
        let own = part.own_blocks();
        let next = missing.partition_point(|block| *block < own.start);
        missing.get(next).is_some_and(|block| *block < own.end)
    };
    (1..=of).filter(|number| lacks(number)).map(|number| format!("{number}/{of}")).collect()
}

/// The first shards that lack rows, as text.
fn named_shards(shards: &[String]) -> String {
    match shards {
        [] => String::new(),
        all if all.len() <= MOST_SHARDS => format!(": {}", all.join(", ")),
        all => format!(": {} and {} more", all[..MOST_SHARDS].join(", "), all.len() - MOST_SHARDS),
    }
}

/// Most shards that kardan searches for: no manifest has a higher number.
const MOST_COUNTED: u64 = 1_000_000;
/// Shards that the message names.
const MOST_SHARDS: usize = 20;

/// Whether rows are the same to the last bit.
fn same(one: &[SweepRow], other: &[SweepRow]) -> bool {
    let bits = |row: &SweepRow| {
        let numbers = [&row.values, &row.measured, &row.passed, &row.figures];
        let bits: Vec<u64> = numbers.into_iter().flatten().map(|x| x.to_bits()).collect();
        (row.sample, row.variant, row.reason.clone(), bits)
    };
    one.len() == other.len() && one.iter().zip(other).all(|(one, other)| bits(one) == bits(other))
}

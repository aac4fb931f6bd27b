//! `kardan bench`: the virtual test bench, its logs, plan and true values, and the complete study.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use kardan::diagnostics::{Diagnostic, Severity};
use kardan::export::{self, LogFiles};
use kardan::project::Named;
use kardan::results::{BenchStudy, Experiment, Outcome, Run};
use kardan::study::{self, BenchRun, BenchSettings, IdentifySettings, PreparedBench, Project};
use kardan_report as report;

use super::identify::logs as opened;
use super::run_files::table;
use crate::args::{BenchArgs, Format};
use crate::exit::{DONE, ERROR};
use crate::folder::{Folder, note_moved_files};
use crate::input;
use crate::output::{likely_columns, print, render_text, shown};
use crate::progress::Bars;
use crate::render::{self, Failure};
use crate::source::{Origin, Source};
use crate::stop;

/// Logs that are made before they are written.
const AT_ONCE: u64 = 16;
/// Files that are named on the terminal.
const SHOWN: usize = 12;

pub fn bench(args: &BenchArgs, quiet: bool) -> Result<u8, Failure> {
    let mut formats: Vec<Format> = Vec::new();
    for format in &args.format {
        if !formats.contains(format) {
            formats.push(*format);
        }
    }
    let (source, project, _) = input::checked(&args.model, &args.changes, false, quiet)?;
    let truth = args.truth.as_deref().map(true_values).transpose()?;
    let control = args.control.clone().filter(|_| !args.study);
    let settings = BenchSettings {
        seed: args.seed,
        repetitions: args.repetitions as usize,
        plan: args.plan.clone(),
        truth,
        variant: args.variant.clone(),
        run: control.map_or(BenchRun::Excitation, BenchRun::Control),
    };
    let failed = |mut diagnostics: Vec<Diagnostic>| {
        diagnostics.retain(|d| d.severity == Severity::Error);
        Failure { source: Some(source.clone()), diagnostics }
    };
    // Errors that would stop the study midway are reported before it starts.
    let controller = || study::bench_controller(&project, args.control.as_deref(), args.variant.as_deref());
    let tried = args.study.then(controller).transpose().map_err(failed)?;
    let bench = study::prepare_bench(&project, &settings).map_err(failed)?;
    let folder = Folder::prepare(&args.out)?;
    let (bench, formats) = (&bench, &formats[..]);
    let mut output = Output { args, bench, formats, quiet, folder, files: Vec::new(), problems: Vec::new() };
    let logs = output.logs();
    // A study that lacks one of its logs would look like a study with fewer logs.
    let all_logged = logs.iter().all(|log| !log.files.is_empty());
    let found = match tried.filter(|_| all_logged) {
        Some(control) if stop::reason().is_none() => {
            let settings = BenchSettings {
                // Random true values lie around those of this file, not of the written one.
                truth: Some(study::truth_table(bench.truth())),
                run: BenchRun::Control(control),
                ..settings
            };
            output.study(&source, &project, &logs, &settings)?
        }
        _ => None,
    };
    if let (true, None, Some(reason)) = (args.study, &found, stop::reason()) {
        output.problems.push(missing(&reason));
    }
    print(&output.printed(&logs, found.as_ref()))?;
    let Output { folder, mut problems, .. } = output;
    // If a file could not be written, files of an earlier run may be the only ones.
    let finished = if problems.is_empty() { folder.finish("bench") } else { Ok(Vec::new()) };
    let gone = finished.map_err(|problem| problems.push(problem)).unwrap_or_default();
    note_moved_files(&gone, quiet);
    render::show(None, &problems);
    let runs = found.iter().flat_map(|found| &found.closed_loop.experiments);
    let outcomes = runs.flat_map(|one| [&one.simulated.outcome, &one.measured.outcome]);
    let whole = outcomes.chain(logs.iter().map(|log| &log.outcome)).all(|outcome| *outcome == Outcome::Completed);
    Ok(if problems.is_empty() && whole { DONE } else { ERROR })
}

/// The true values in a file.
fn true_values(path: &Path) -> Result<Named, Failure> {
    let text = input::read_text(path)?;
    let source = Source::new(path.display().to_string(), text, Origin::File);
    study::read_truth(&source.text).map_err(|diagnostics| Failure { source: Some(source), diagnostics })
}

/// A study that ended early.
fn missing(reason: &str) -> Diagnostic {
    Diagnostic::error("bench::study", format!("{reason}: the study is not complete, its report is not written"))
        .help("the files named are complete; continue with `kardan identify` and `kardan design`")
}

/// The files written, and those that could not be written.
struct Output<'a> {
    args: &'a BenchArgs,
    bench: &'a PreparedBench,
    formats: &'a [Format],
    quiet: bool,
    folder: Folder,
    files: Vec<String>,
    problems: Vec<Diagnostic>,
}

impl Output<'_> {
    fn save(&mut self, stem: &str, extension: &str, bytes: &[u8]) -> Option<String> {
        let path = self.folder.write(stem, extension, bytes).map_err(|problem| self.problems.push(problem)).ok()?;
        self.files.push(path.clone());
        Some(path)
    }

    fn table(&mut self, run: &Run, stem: &str, format: Format) -> Option<String> {
        let made = table(self.bench.name(), run, format).map_err(|problem| self.problems.push(problem)).ok();
        made.and_then(|(extension, bytes)| self.save(stem, extension, &bytes))
    }

    /// The results as a JSON object, or as text.
    fn printed(&self, logs: &[LogFiles], found: Option<&BenchStudy>) -> String {
        let (bench, files) = (self.bench, &self.files);
        if self.args.json {
            return match found {
                Some(found) => export::bench_study_json(found, logs, files),
                None => export::bench_json(bench.name(), bench.plan(), bench.truth(), logs, bench.notes()),
            } + "\n";
        }
        let page = match found {
            Some(found) => report::bench(found),
            None => report::plan(bench.name(), bench.plan(), bench.notes()),
        };
        let mut out = render_text(&page, "");
        let _ = writeln!(out, "\nThe plant differs from its model in {} values.\nWritten:", bench.truth().len());
        files.iter().take(SHOWN).for_each(|file| out += &format!("  {file}\n"));
        if files.len() > SHOWN {
            let _ = writeln!(out, "  and {} more", files.len() - SHOWN);
        }
        if found.is_some() {
            files.iter().filter(|file| file.ends_with(".html")).for_each(|report| out += &likely_columns(report));
        }
        out
    }

    /// Runs the bench and writes all files that can be written.
    fn logs(&mut self) -> Vec<LogFiles> {
        let (bench, formats, all) = (self.bench, self.formats, u64::from(self.args.repetitions));
        let mut logs = Vec::new();
        if let plan @ Some(_) = bench.plan() {
            self.save("plan", "txt", report::plan(bench.name(), plan, &[]).text("").as_bytes());
        }
        self.save("truth", "toml", export::truth_toml(bench.truth()).as_bytes());
        let bars = Bars::limited(self.quiet, self.args.limits);
        let mut next = 0;
        while next < all && stop::reason().is_none() {
            let until = (next + AT_ONCE).min(all);
            for log in bench.logs(next..until, &bars) {
                let paths = formats.iter().filter_map(|format| self.table(&log, &log.name, *format)).collect();
                if let Some(cause) = log.outcome.cause() {
                    let early = if matches!(log.outcome, Outcome::Failed { .. }) { " ends early," } else { ":" };
                    let message = format!("the log `{}`{early} {cause}", log.name);
                    self.problems.push(Diagnostic::error("bench::run", message));
                }
                logs.push(LogFiles { name: log.name, outcome: log.outcome, files: paths });
            }
            next = until;
        }
        if let (true, Some(reason)) = (next < all, stop::reason()) {
            let message = format!("{reason}: {next} of {all} logs are complete");
            self.problems.push(Diagnostic::error("bench::logs", message).help("they are usable"));
        }
        bars.finish();
        logs
    }

    /// If the current computation ends early, the command lists the files written so far.
    fn print_on_stop(&self, logs: &[LogFiles]) {
        let (text, mut problems) = (self.printed(logs, None), self.problems.clone());
        stop::store_partial(Some(Box::new(move |reason| {
            problems.push(missing(reason));
            problems.extend(print(&text).err());
            render::show(None, &problems);
            ERROR
        })));
    }

    /// Steps after the logs: identify, write the model, design on it, run in simulation and on the bench, report; `None` if it had to
    /// end before.
    fn study(
        &mut self,
        source: &Source,
        project: &Project,
        logs: &[LogFiles],
        settings: &BenchSettings,
    ) -> Result<Option<BenchStudy>, Failure> {
        let (bench, args) = (self.bench, self.args);
        let failed = |diagnostics| Failure { source: Some(source.clone()), diagnostics };
        // One file of each log: all formats contain the same data.
        let paths: Vec<PathBuf> = logs.iter().filter_map(|log| log.files.first()).map(PathBuf::from).collect();
        let options = IdentifySettings { variant: settings.variant.clone(), ..IdentifySettings::default() };
        let (bars, files) = (Bars::new(self.quiet), opened(&paths)?);
        self.print_on_stop(logs);
        let found = bars.during(|bars| project.identify(files, &options, bars));
        if stop::reason().is_some() {
            return Ok(None);
        }
        let found = found.map_err(failed)?;
        let (text, omissions) = study::write_values(source.model(), &found).map_err(failed)?;
        self.save("identified", "toml", text.as_bytes());
        let bars = Bars::limited(self.quiet, args.limits);
        self.print_on_stop(logs);
        let closed_loop = bars.during(|bars| study::closed_loop(&Project::open(text), settings, bars));
        let closed_loop = closed_loop.map_err(|diagnostics| Failure { source: None, diagnostics })?;
        for Experiment { name, simulated, measured, .. } in &closed_loop.experiments {
            for format in self.formats {
                self.table(simulated, &format!("{name}-simulation"), *format);
                self.table(measured, &format!("{name}-bench"), *format);
            }
        }
        let mut notes = bench.notes().to_vec();
        notes.extend(
            omissions.iter().map(|why| format!("Not in the model that the controller was designed on: {why}.")),
        );
        let Some(plan) = bench.plan().cloned() else { unreachable!("a study starts with an excitation") };
        let found = BenchStudy {
            model: bench.name().into(),
            description: found.description.clone(),
            truth: bench.truth().to_vec(),
            plan,
            identification: found,
            closed_loop,
            notes,
        };
        let page = report::bench(&found);
        let (extension, text) = shown(&page, args.markdown);
        for (name, picture) in page.plots().filter(|_| args.markdown) {
            self.save(name, "svg", picture.as_bytes());
        }
        self.save("report", extension, text.as_bytes());
        Ok(Some(found))
    }
}

//! `kardan bench`: the virtual test bench, its logs, plan and true values.

use kardan::diagnostics::{Diagnostic, Severity};
use kardan::export::{self, WrittenLog};
use kardan::results::Outcome;
use kardan::study::{self, BenchRun, BenchSettings, PreparedBench};

use super::run::table;
use super::{DONE, ERROR};
use crate::args::BenchArgs;
use crate::bench_text;
use crate::input;
use crate::output::{Folder, print};
use crate::progress::Bars;
use crate::render::{self, Failure};

/// Logs that are made before they are written.
const AT_ONCE: u64 = 16;
/// Files that are named on the terminal.
const SHOWN: usize = 12;

pub fn bench(args: &BenchArgs, quiet: bool) -> Result<u8, Failure> {
    let source = input::read(&args.model, quiet)?;
    let truth = args.truth.as_deref().map(input::read_text).transpose()?;
    let known = study::check(&source.text);
    if known.iter().any(|d| d.severity == Severity::Error) {
        return Err(Failure { source: Some(source), diagnostics: known });
    }
    render::show(Some(&source), &known);
    let settings = BenchSettings {
        seed: args.seed,
        repetitions: args.repetitions as usize,
        plan: args.plan.clone(),
        truth,
        variant: args.variant.clone(),
        run: args.control.clone().map_or(BenchRun::Excitation, BenchRun::Control),
    };
    let bench = study::prepare_bench(&source.text, &settings).map_err(|mut diagnostics| {
        diagnostics.retain(|d| d.severity == Severity::Error);
        Failure { source: Some(source.clone()), diagnostics }
    })?;
    let folder = Folder::prepare(&args.out)?;
    let (files, logs, problems) = write(&bench, folder, args, quiet);
    render::show(None, &problems);
    if args.json {
        print(&(export::bench_json(bench.name(), bench.plan(), bench.truth(), &logs, bench.notes()) + "\n"))?;
    } else {
        let plan = bench.plan().map(|plan| bench_text::plan(bench.name(), plan)).unwrap_or_default();
        print(&(plan + &bench_text::summary(bench.truth(), bench.notes(), &files, SHOWN)))?;
    }
    let failed = logs.iter().any(|log| log.outcome != Outcome::Completed);
    Ok(if problems.is_empty() && !failed { DONE } else { ERROR })
}

/// Runs and writes everything that can be written; gives the files, the logs, and what could not.
fn write(
    bench: &PreparedBench,
    mut folder: Folder,
    args: &BenchArgs,
    quiet: bool,
) -> (Vec<String>, Vec<WrittenLog>, Vec<Diagnostic>) {
    let (mut files, mut logs, mut problems) = (Vec::new(), Vec::new(), Vec::new());
    let mut keep = |stem: &str, extension: &str, bytes: &[u8], folder: &mut Folder, problems: &mut Vec<Diagnostic>| {
        let written = folder.write(stem, extension, bytes);
        let path = written.map_err(|problem| problems.push(problem)).ok()?;
        files.push(path.clone());
        Some(path)
    };
    if let Some(plan) = bench.plan() {
        keep("plan", "txt", bench_text::plan(bench.name(), plan).as_bytes(), &mut folder, &mut problems);
    }
    keep("truth", "toml", export::truth_toml(bench.truth()).as_bytes(), &mut folder, &mut problems);
    let bars = Bars::new(quiet);
    let all = u64::from(args.repetitions);
    let mut next = 0;
    while next < all {
        let until = (next + AT_ONCE).min(all);
        for log in bench.logs(next..until, &bars) {
            let mut paths = Vec::new();
            for format in &args.format {
                match table(bench.name(), &log, *format) {
                    Ok((extension, bytes)) => {
                        paths.extend(keep(&log.name, extension, &bytes, &mut folder, &mut problems));
                    }
                    Err(problem) => problems.push(problem),
                }
            }
            if let Outcome::Failed { cause, .. } = &log.outcome {
                problems.push(Diagnostic::error("bench::run", format!("the log `{}` ends early, {cause}", log.name)));
            }
            logs.push(WrittenLog { name: log.name, outcome: log.outcome, files: paths });
        }
        next = until;
    }
    bars.finish();
    (files, logs, problems)
}

//! `kardan analyze`: the structure of a model, or of plain matrices.

use std::path::Path;

use kardan::diagnostics::{Diagnostic, Severity};
use kardan::results::Analysis;
use kardan::study::{AnalyzeSettings, ParitySettings, Part};
use kardan::{export, study};
use kardan_report as report;

use super::design::points;
use crate::args::AnalyzeArgs;
use crate::exit::{DONE, ERROR, exit_code};
use crate::input;
use crate::output::{note_saved_file, prepare_file, print, render_text, save, save_page};
use crate::progress::Bars;
use crate::render::{self, Failure};
use crate::source::{Origin, Source};

pub fn analyze(args: &AnalyzeArgs, quiet: bool) -> Result<u8, Failure> {
    let settings = AnalyzeSettings {
        variant: args.variant.clone(),
        at: points(&args.at)?,
        inputs: args.inputs.clone(),
        outputs: args.outputs.clone(),
        certify: args.certify,
        parity: args.parity.then(|| {
            let defaults = ParitySettings::default();
            ParitySettings {
                false_alarms_per_hour: args.false_alarms.unwrap_or(defaults.false_alarms_per_hour),
                debounce: args.debounce.map_or(defaults.debounce, |samples| samples as usize),
                filter: args.filter,
            }
        }),
    };
    let (analysis, origin) = match &args.state_space {
        Some(path) => of_matrices(path, args, &settings, quiet)?,
        None => of_model(args, &settings, quiet)?,
    };
    report_result(&analysis, args, &origin, quiet)
}

/// Writes and prints the results, complete or partial.
fn report_result(analysis: &Analysis, args: &AnalyzeArgs, origin: &str, quiet: bool) -> Result<u8, Failure> {
    if let Some(path) = &args.report {
        save_page(path, &report::analysis(analysis))?;
    }
    if let Some(path) = &args.export {
        save_forms(path, analysis)?;
    }
    let render_text = || render_text(&report::analysis_text(analysis), origin);
    print(&if args.json { export::analysis_json(analysis) + "\n" } else { render_text() })?;
    for path in args.report.iter().chain(&args.export).filter(|_| !quiet) {
        note_saved_file(path);
    }
    Ok(if analysis.unfinished.is_none() { DONE } else { ERROR })
}

/// The matrices to export, as JSON or as a MAT file by the name of the file.
fn save_forms(path: &Path, analysis: &Analysis) -> Result<(), Failure> {
    let Some(forms) = &analysis.realisations else {
        let message = "there is no result to export: no exact forms were found";
        let help = "kardan computes them for few states: 64 with short numbers, 12 with floating-point numbers; the analysis itself has no such limit";
        return Err(Diagnostic::error("analysis::no-realisation", message).help(help).into());
    };
    let is_mat = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mat"));
    let bytes = match is_mat {
        false => (export::realisations_json(forms) + "\n").into_bytes(),
        true => export::realisations_mat(forms).ok_or_else(|| {
            Diagnostic::error("output::too-large", "the matrices are larger than a MAT file allows")
                .help("name a file that ends with .json")
        })?,
    };
    Ok(save(path, &bytes)?)
}

fn of_model(args: &AnalyzeArgs, settings: &AnalyzeSettings, quiet: bool) -> Result<(Analysis, String), Failure> {
    let (source, project) = input::prepared(&args.model, &args.changes, quiet)?;
    args.report.as_deref().map_or(Ok(()), prepare_file)?;
    args.export.as_deref().map_or(Ok(()), prepare_file)?;
    // Only the analysis knows which errors stop it; the command reports the warnings.
    let mut warnings = project.diagnostics().to_vec();
    warnings.retain(|d| d.severity == Severity::Warning);
    render::show(Some(&source), &warnings);
    let origin = source.to_string();
    let found = with_bars(args, &origin, quiet, |bars| project.analyze(settings, bars));
    let analysis = found.map_err(|found| Failure::beside(source, found, &warnings))?;
    Ok((analysis, origin))
}

fn of_matrices(
    path: &Path,
    args: &AnalyzeArgs,
    settings: &AnalyzeSettings,
    quiet: bool,
) -> Result<(Analysis, String), Failure> {
    let (name, bytes) = input::read_matrices(path)?;
    args.report.as_deref().map_or(Ok(()), prepare_file)?;
    args.export.as_deref().map_or(Ok(()), prepare_file)?;
    let found = with_bars(args, &name, quiet, |bars| study::analyze_state_space(&bytes, settings, bars));
    let analysis = found.map_err(|diagnostics| {
        // Spans in a file that is not text cannot be shown.
        let text = String::from_utf8(bytes).unwrap_or_default();
        Failure { source: Some(Source::new(name.clone(), text, Origin::File)), diagnostics }
    })?;
    Ok((analysis, name))
}

fn with_bars(
    args: &AnalyzeArgs,
    origin: &str,
    quiet: bool,
    work: impl FnOnce(&Bars) -> Result<Analysis, Vec<Diagnostic>>,
) -> Result<Analysis, Vec<Diagnostic>> {
    let (args, origin) = (args.clone(), origin.to_owned());
    let bars = Bars::new(quiet).showing(move |part| match part {
        Part::Analysis(found) => exit_code(report_result(&found, &args, &origin, quiet), args.json),
        _ => ERROR,
    });
    let found = work(&bars);
    bars.finish();
    found
}

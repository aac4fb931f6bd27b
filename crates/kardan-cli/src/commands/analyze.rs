//! `kardan analyze`: the structure of a model, or of plain matrices.

use std::path::Path;

use kardan::diagnostics::{Diagnostic, Severity};
use kardan::results::Analysis;
use kardan::study::{AnalyzeSettings, ParitySettings, Part};
use kardan::{export, study};
use kardan_report as report;

use super::design::points;
use crate::args::AnalyzeArgs;
use crate::exit::{ERROR, exit_code, verdict};
use crate::input;
use crate::output::{deliver, prepare_files, render_text};
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
    let forms = |path: &Path| realisations(path, analysis);
    let printed = || match args.json {
        true => export::analysis_json(analysis) + "\n",
        false => render_text(&report::analysis_text(analysis), origin),
    };
    deliver([&args.report, &args.export], || report::analysis(analysis), forms, printed, quiet)?;
    Ok(verdict(analysis.unfinished.is_none(), true))
}

/// The matrices to export, as JSON or as a MAT file by the name of the file.
fn realisations(path: &Path, analysis: &Analysis) -> Result<Vec<u8>, Diagnostic> {
    let Some(forms) = &analysis.realisations else {
        let message = "there is no result to export: no exact forms were found";
        let help = "kardan computes them for few states: 64 with short numbers, 12 with floating-point numbers; the analysis itself has no such limit";
        return Err(Diagnostic::error("analysis::no-realisation", message).help(help));
    };
    let is_mat = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mat"));
    match is_mat {
        false => Ok((export::realisations_json(forms) + "\n").into_bytes()),
        true => export::realisations_mat(forms).ok_or_else(|| {
            Diagnostic::error("output::too-large", "the matrices are larger than a MAT file allows")
                .help("name a file that ends with .json")
        }),
    }
}

fn of_model(args: &AnalyzeArgs, settings: &AnalyzeSettings, quiet: bool) -> Result<(Analysis, String), Failure> {
    let (source, project) = input::prepared(&args.model, &args.changes, quiet)?;
    prepare_files(&args.report, None)?;
    prepare_files(&args.export, None)?;
    // Only the analysis knows which errors stop it; the command reports the warnings.
    let mut warnings = project.diagnostics().to_vec();
    warnings.retain(|d| d.severity == Severity::Warning);
    render::show(Some(&source), &warnings);
    let origin = source.to_string();
    let found = bars(args, &origin, quiet).during(|bars| project.analyze(settings, bars));
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
    prepare_files(&args.report, None)?;
    prepare_files(&args.export, None)?;
    let found = bars(args, &name, quiet).during(|bars| study::analyze_state_space(&bytes, settings, bars));
    let analysis = found.map_err(|diagnostics| {
        // Spans in a file that is not text cannot be shown.
        let text = String::from_utf8(bytes).unwrap_or_default();
        Failure { source: Some(Source::new(name.clone(), text, Origin::File)), diagnostics }
    })?;
    Ok((analysis, name))
}

fn bars(args: &AnalyzeArgs, origin: &str, quiet: bool) -> Bars {
    let (args, origin) = (args.clone(), origin.to_owned());
    Bars::new(quiet).showing(move |part| match part {
        Part::Analysis(found) => exit_code(report_result(&found, &args, &origin, quiet), args.json),
        _ => ERROR,
    })
}

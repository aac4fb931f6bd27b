//! `kardan run`: the study of a model file, its tables, plots and report.

use std::sync::{Arc, Mutex};

use kardan::diagnostics::Severity;
use kardan::study::{self, Part};

use super::rerun::rows_again;
use super::run_files::report_result;
use crate::args::RunArgs;
use crate::exit::{ERROR, exit_code};
use crate::folder::Folder;
use crate::input;
use crate::progress::Bars;
use crate::render::{self, Failure};

pub fn run(args: &RunArgs, quiet: bool) -> Result<u8, Failure> {
    let (source, project) = input::prepared(&args.model, &args.changes, quiet)?;
    let mut model_diagnostics = project.diagnostics().to_vec();
    if args.force {
        study::overrule(&mut model_diagnostics);
    }
    if model_diagnostics.iter().any(|d| d.severity == Severity::Error) {
        return Err(Failure { source: Some(source), diagnostics: model_diagnostics });
    }
    render::show(Some(&source), &model_diagnostics);
    let settings = args.settings();
    let project = match &args.variants_from {
        None => project,
        Some(rows) => rows_again(&project, rows, args, &settings)
            .map_err(|diagnostics| Failure { source: Some(source.clone()), diagnostics })?,
    };
    let folder = Arc::new(Mutex::new(Folder::prepare(&args.out)?));
    let origin = source.to_string();
    let bars = Bars::limited(quiet, args.limits).showing({
        let (args, origin, folder) = (args.clone(), origin.clone(), Arc::clone(&folder));
        move |part| match part {
            Part::Study(study) => exit_code(report_result(&study, &folder, &args, &origin, quiet), args.json),
            _ => ERROR,
        }
    });
    let study = project.run(&settings, &bars);
    bars.finish();
    let study = study.map_err(|mut diagnostics| {
        diagnostics.retain(|d| d.severity == Severity::Error || !model_diagnostics.contains(d));
        Failure { source: Some(source.clone()), diagnostics }
    })?;
    report_result(&study, &folder, args, &origin, quiet)
}

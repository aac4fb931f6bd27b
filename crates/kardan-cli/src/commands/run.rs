//! `kardan run`: the study of a model file, its tables, plots and report.

use std::sync::{Arc, Mutex};

use kardan::study::Part;

use super::rerun::rows_again;
use super::run_files::report_result;
use crate::args::RunArgs;
use crate::exit::{ERROR, exit_code};
use crate::folder::Folder;
use crate::input;
use crate::progress::Bars;
use crate::render::Failure;

pub fn run(args: &RunArgs, quiet: bool) -> Result<u8, Failure> {
    let (source, project, model_diagnostics) = input::checked(&args.model, &args.changes, args.force, quiet)?;
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
    let study = bars.during(|bars| project.run(&settings, bars));
    let study = study.map_err(|found| Failure::beside(source, found, &model_diagnostics))?;
    report_result(&study, &folder, args, &origin, quiet)
}

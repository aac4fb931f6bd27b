//! `kardan linearise`: A, B, C, D of a model for other tools.

use kardan::diagnostics::Diagnostic;
use kardan::export;
use kardan::study::AnalyzeSettings;

use super::design::points;
use crate::args::{LinearFormat, LineariseArgs};
use crate::exit::DONE;
use crate::input;
use crate::output::{prepare_files, print, save};
use crate::render::{self, Failure, note};

pub fn linearise(args: &LineariseArgs, quiet: bool) -> Result<u8, Failure> {
    let (source, project) = input::prepared(&args.model, &args.changes, quiet)?;
    prepare_files(&args.out, None)?;
    let settings = AnalyzeSettings {
        variant: args.variant.clone(),
        at: points(&args.at)?,
        inputs: args.inputs.clone(),
        outputs: args.outputs.clone(),
        ..AnalyzeSettings::default()
    };
    let found = project.linearise(&settings, args.descriptor);
    let (model, warnings) = found.map_err(|diagnostics| Failure { source: Some(source.clone()), diagnostics })?;
    render::show(Some(&source), &warnings);
    let bytes = match args.format {
        LinearFormat::Json => (export::linear_json(&model) + "\n").into_bytes(),
        LinearFormat::Py => export::linear_python(&model).into_bytes(),
        LinearFormat::Mat => export::linear_mat(&model).ok_or_else(|| {
            Diagnostic::error("output::too-large", "the matrices are larger than a MAT file allows")
                .help("write JSON: --format json")
        })?,
    };
    match &args.out {
        None => print(&String::from_utf8_lossy(&bytes))?,
        Some(path) => {
            save(path, &bytes)?;
            if !quiet {
                note(&format!("wrote {}", path.display()));
            }
        }
    }
    Ok(DONE)
}

//! Rows of a sweep, run again with all signals.

use std::path::Path;

use kardan::diagnostics::Diagnostic;
use kardan::export;
use kardan::project::Project;
use kardan::study::Settings;

use super::model_store::stored_model;
use crate::args::RunArgs;
use crate::files::{self, reason};

/// The model with rows of a file in place of its variants.
pub(super) fn rows_again(
    project: &Project,
    path: &Path,
    args: &RunArgs,
    settings: &Settings,
) -> Result<Project, Vec<Diagnostic>> {
    let shown = path.display();
    let wrong = |message: String, help: &str| vec![Diagnostic::error("sweep::rerun", message).help(help)];
    let read = files::read(path).map_err(|error| reason(&error)).and_then(export::rows_of_any_sweep);
    let (identity, mut rows) = read.map_err(|why| {
        let help = "name one of the files `rows-….parquet` that `kardan sweep --out DIR` writes";
        wrong(format!("`{shown}`: {why}"), help)
    })?;
    let was = path.parent().and_then(|folder| stored_model(folder, &identity));
    if let Some(difference) = project.other_model(&identity, was.as_deref()) {
        let help = "run with their original model, `--set`, and version of kardan";
        let message = format!("the rows of `{shown}` are of another sweep: {difference}");
        return Err(wrong(message, help));
    }
    let (samples, variants) = (&args.samples, &args.variants);
    let has_row = |sample: &u64| rows.iter().any(|row| row.sample == *sample);
    if let Some(missing) = samples.iter().find(|sample| !has_row(sample)) {
        let ends = rows.iter().map(|row| row.sample);
        let (first, last) = (ends.clone().min().unwrap_or(0), ends.max().unwrap_or(0));
        let message = format!("`{shown}` has no sample {missing}: it has those from {first} to {last}");
        return Err(wrong(message, "name another sample, or another file of rows"));
    }
    rows.retain(|row| {
        (samples.is_empty() || samples.contains(&row.sample))
            && (variants.is_empty() || variants.contains(&row.variant))
    });
    project.rows_again(&identity, &rows, settings)
}

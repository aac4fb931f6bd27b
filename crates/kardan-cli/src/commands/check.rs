//! `kardan check`: only the diagnostics of a model file.

use kardan::diagnostics::Severity;
use kardan::export;
use kardan::study::{listed_blocks, signal_graph};

use crate::args::CheckArgs;
use crate::exit::DONE;
use crate::input;
use crate::output::print;
use crate::render::{self, Failure, visible};

pub fn check(args: &CheckArgs, quiet: bool) -> Result<u8, Failure> {
    let (source, project) = input::prepared(&args.model, &args.changes, quiet)?;
    let diagnostics = project.diagnostics().to_vec();
    if diagnostics.iter().any(|d| d.severity == Severity::Error) {
        return Err(Failure { source: Some(source), diagnostics });
    }
    render::show(Some(&source), &diagnostics);
    if args.json {
        let graph = project.prepared().variants.first().map(|variant| signal_graph(&variant.model)).unwrap_or_default();
        print(&(export::check_json(&source.to_string(), &source.text, &graph, &diagnostics) + "\n"))?;
        return Ok(DONE);
    }
    // The summary must not contradict the diagnostics above it.
    let warnings = match diagnostics.iter().filter(|d| d.severity == Severity::Warning).count() {
        0 => String::new(),
        1 => ", 1 warning".into(),
        many => format!(", {many} warnings"),
    };
    let rounded =
        project.prepared().variants.first().map(|variant| variant.model.rounding_messages()).unwrap_or_default();
    let notes: String = rounded.iter().map(|note| format!("note: {note}\n")).collect();
    let blocks = project.prepared().variants.first().map(|variant| listed_blocks(&variant.model)).unwrap_or_default();
    let blocks: String = blocks.iter().map(|line| format!("{line}\n")).collect();
    print(&visible(&format!("{source}: no errors{warnings}\n{blocks}{notes}")))?;
    Ok(DONE)
}

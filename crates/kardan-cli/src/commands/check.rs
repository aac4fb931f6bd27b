//! `kardan check`: only the diagnostics of a model file.

use kardan::diagnostics::Severity;
use kardan::export;
use kardan::study::{listed_blocks, signal_graph};

use crate::args::CheckArgs;
use crate::exit::done;
use crate::input;
use crate::render::{Failure, visible};

pub fn check(args: &CheckArgs, quiet: bool) -> Result<u8, Failure> {
    let (source, project, diagnostics) = input::checked(&args.model, &args.changes, false, quiet)?;
    let first = project.prepared().variants.first().map(|variant| &variant.model);
    if args.json {
        let graph = first.map(signal_graph).unwrap_or_default();
        return done(&(export::check_json(&source.to_string(), &source.text, &graph, &diagnostics) + "\n"));
    }
    // The summary must not contradict the diagnostics above it.
    let warnings = match diagnostics.iter().filter(|d| d.severity == Severity::Warning).count() {
        0 => String::new(),
        1 => ", 1 warning".into(),
        many => format!(", {many} warnings"),
    };
    let rounded = first.map(|model| model.rounding_messages()).unwrap_or_default();
    let notes: String = rounded.iter().map(|note| format!("note: {note}\n")).collect();
    let blocks = first.map(listed_blocks).unwrap_or_default();
    let blocks: String = blocks.iter().map(|line| format!("{line}\n")).collect();
    done(&visible(&format!("{source}: no errors{warnings}\n{blocks}{notes}")))
}

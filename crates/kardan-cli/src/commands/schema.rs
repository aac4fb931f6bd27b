//! `kardan schema`: the JSON schemas of what the commands print.

use kardan::diagnostics::Diagnostic;
use kardan::export::{SCHEMAS, schema as text_of};
use kardan::names::unknown_name;

use crate::args::SchemaArgs;
use crate::exit::DONE;
use crate::output::print;
use crate::render::Failure;

pub fn schema(args: &SchemaArgs) -> Result<u8, Failure> {
    let Some(name) = &args.name else {
        let width = SCHEMAS.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        let lines = SCHEMAS.iter().map(|(name, what)| format!("{name:width$}  {what}\n"));
        print(&lines.collect::<String>())?;
        return Ok(DONE);
    };
    let text = text_of(name).ok_or_else(|| {
        Diagnostic::error("schema::unknown", format!("there is no schema `{name}`"))
            .help(unknown_name(name, SCHEMAS.iter().map(|(known, _)| *known)))
    })?;
    print(&(text + "\n"))?;
    Ok(DONE)
}

//! `kardan schema`: the JSON schemas of the output of commands.

use kardan::diagnostics::Diagnostic;
use kardan::export::{schema as text_of, schemas, schemas_json};
use kardan::model;
use kardan::names::unknown_name;

use crate::args::SchemaArgs;
use crate::exit::done;
use crate::render::Failure;

/// The schema of model files, which is no schema of an output.
const MODEL: (&str, &str) = ("model", "a model file, for editors: see docs/editors.md");

pub fn schema(args: &SchemaArgs) -> Result<u8, Failure> {
    let Some(name) = &args.name else {
        if args.json {
            return done(&(schemas_json() + "\n"));
        }
        let all = [MODEL].into_iter().chain(schemas());
        let width = schemas().map(|(name, _)| name.len()).max().unwrap_or(0);
        let lines = all.map(|(name, what)| format!("{name:width$}  {what}\n"));
        return done(&lines.collect::<String>());
    };
    if name == MODEL.0 {
        return done(&(model::json_schema() + "\n"));
    }
    let text = text_of(name).ok_or_else(|| {
        Diagnostic::error("schema::unknown", format!("there is no schema `{name}`"))
            .help(unknown_name(name, schemas().map(|(schema_name, _)| schema_name).chain([MODEL.0])))
    })?;
    done(&(text + "\n"))
}

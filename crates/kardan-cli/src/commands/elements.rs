//! `kardan elements`: the manual of the tables in a model file.

use kardan::diagnostics::Diagnostic;

use super::DONE;
use crate::api::model;
use crate::args::ElementsArgs;
use crate::output::print;
use crate::render::Failure;

pub fn elements(args: &ElementsArgs) -> Result<u8, Failure> {
    let page = match &args.name {
        None => model::manual(),
        Some(name) => model::manual_of(name).ok_or_else(|| {
            Diagnostic::error("element::unknown", format!("a model file has no tables `{name}`"))
                .help("`kardan elements` lists all tables")
        })?,
    };
    print(&page)?;
    Ok(DONE)
}

//! `kardan elements`: the manual of the tables in a model file.

use kardan::diagnostics::Diagnostic;
use kardan::names::nearest_or_alike;
use kardan::{element, model, synthesis};

use crate::args::ElementsArgs;
use crate::exit::DONE;
use crate::output::print;
use crate::render::Failure;

pub fn elements(args: &ElementsArgs) -> Result<u8, Failure> {
    let page = match &args.name {
        None => model::manual(),
        Some(name) => model::manual_of(name).ok_or_else(|| {
            Diagnostic::error("element::unknown", format!("a model file has no tables `{name}`")).help(hint(name))
        })?,
    };
    print(&page)?;
    Ok(DONE)
}

fn hint(name: &str) -> String {
    let elements = element::REGISTRY.iter().map(|element| element.keyword);
    let laws = synthesis::REGISTRY.iter().map(|law| law.keyword);
    let list = "`kardan elements` lists all tables";
    let pages = model::STUDY_PAGES.iter().copied();
    nearest_or_alike(name, elements.chain(laws).chain(pages))
        .map_or(list.into(), |near| format!("did you mean `{near}`? ({list})"))
}

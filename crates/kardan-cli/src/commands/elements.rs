//! `kardan elements`: the manual of the tables in a model file.

use kardan::diagnostics::Diagnostic;
use kardan::names::nearest_or_similar;
use kardan::{element, export, model, synthesis};

use crate::args::ElementsArgs;
use crate::exit::done;
use crate::render::Failure;

pub fn elements(args: &ElementsArgs) -> Result<u8, Failure> {
    let page = match &args.name {
        None => model::manual(),
        Some(name) => model::manual_of(name).ok_or_else(|| {
            Diagnostic::error("element::unknown", format!("a model file has no table `{name}`")).help(hint(name))
        })?,
    };
    if args.json {
        let page = args.name.as_deref().map(|name| name.trim_start_matches("scenario."));
        let mut tables = model::manual_tables();
        tables.retain(|table| page.is_none_or(|page| table.name == page));
        return done(&(export::elements_json(&tables) + "\n"));
    }
    done(&page)
}

fn hint(name: &str) -> String {
    let elements = element::REGISTRY.iter().map(|element| element.keyword);
    let laws = synthesis::REGISTRY.iter().map(|law| law.keyword);
    let list = "`kardan elements` lists all tables";
    nearest_or_similar(name, elements.chain(laws).chain(model::study_pages()))
        .map_or(list.into(), |near| format!("did you mean `{near}`? ({list})"))
}

//! `kardan equations`: the equations of motion of a model.

use kardan::export;
use kardan::study::EquationsForm;

use crate::args::EquationsArgs;
use crate::exit::done;
use crate::input;
use crate::render::{self, Failure, visible};

pub fn equations(args: &EquationsArgs, quiet: bool) -> Result<u8, Failure> {
    let (source, project) = input::open(&args.model, &args.changes, quiet)?;
    let form = match (args.latex, args.plan) {
        (true, _) => EquationsForm::Latex,
        (_, true) => EquationsForm::Plan,
        _ => EquationsForm::Text,
    };
    let (text, warnings) = match (args.json, args.symbolic) {
        (true, symbolic) => project
            .motion_equations()
            .and_then(|(mut found, warnings)| {
                found.symbolic = if symbolic { Some(project.symbolic_equations()?.0) } else { None };
                Ok((found, warnings))
            })
            .map(|(found, warnings)| (export::equations_json(&found, &source.text, &warnings) + "\n", warnings)),
        (false, true) => project.symbolic_text(form).map(|(text, warnings)| (visible(&text), warnings)),
        (false, false) => project.equations(form).map(|(text, warnings)| (visible(&text), warnings)),
    }
    .map_err(|diagnostics| Failure { source: Some(source.clone()), diagnostics })?;
    render::show(Some(&source), &warnings);
    done(&text)
}

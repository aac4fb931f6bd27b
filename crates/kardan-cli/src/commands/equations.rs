//! `kardan equations`: the equations of motion of a model.

use kardan::study::{self, EquationsForm};

use crate::args::EquationsArgs;
use crate::exit::DONE;
use crate::input;
use crate::output::print;
use crate::render::{self, Failure, visible};

pub fn equations(args: &EquationsArgs, quiet: bool) -> Result<u8, Failure> {
    let source = input::read(&args.model, quiet)?;
    let form = if args.latex { EquationsForm::Latex } else { EquationsForm::Text };
    match study::equations(&source.text, form) {
        Ok((text, warnings)) => {
            render::show(Some(&source), &warnings);
            print(&visible(&text))?;
            Ok(DONE)
        }
        Err(diagnostics) => Err(Failure { source: Some(source), diagnostics }),
    }
}

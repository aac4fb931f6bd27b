//! `kardan models`: the built-in models, as a list or as TOML.

use kardan::diagnostics::Diagnostic;
use kardan::model::BUILTIN;

use crate::args::ModelsArgs;
use crate::exit::DONE;
use crate::input::builtin_hint;
use crate::output::{print, save, sweep_beside};
use crate::render::{Failure, note};

pub fn models(args: &ModelsArgs, quiet: bool) -> Result<u8, Failure> {
    let Some(name) = &args.name else {
        let width = BUILTIN.iter().map(|builtin| builtin.name.len()).max().unwrap_or(0);
        let lines = BUILTIN.iter().map(|builtin| format!("{:width$}  {}\n", builtin.name, builtin.summary));
        print(&lines.collect::<String>())?;
        return Ok(DONE);
    };
    let builtin = BUILTIN.iter().find(|builtin| builtin.name == name).ok_or_else(|| {
        Diagnostic::error("model::unknown", format!("there is no built-in model `{name}`")).help(builtin_hint(name))
    })?;
    match &args.write {
        None => print(builtin.source)?,
        Some(path) if path.symlink_metadata().is_ok() => {
            let message = format!("`{}` exists already and is not touched", path.display());
            return Err(Diagnostic::error("file::exists", message).help("choose another name or remove it").into());
        }
        Some(path) => {
            sweep_beside(path);
            save(path, builtin.source.as_bytes())?;
            if !quiet {
                note(&format!("wrote {}", path.display()));
            }
        }
    }
    Ok(DONE)
}

//! `kardan models`: the built-in models, as a list or as TOML.

use kardan::diagnostics::Diagnostic;
use kardan::export;
use kardan::model::{BUILTIN, Builtin, json_schema};
use kardan::results::BuiltinModel;

use crate::args::ModelsArgs;
use crate::exit::{DONE, done};
use crate::input::builtin_hint;
use crate::output::{print, save, sweep_beside};
use crate::render::{Failure, note};

/// The schema that the built-in models name in their first line.
const SCHEMA: &str = "kardan.schema.json";

/// A line with name and summary, and below it the sketch.
fn entry(builtin: &Builtin, width: usize) -> String {
    let sketch = builtin.sketch();
    let end = if sketch.is_empty() { "" } else { "\n" };
    let lines = sketch.lines().map(|line| format!("  {line}\n"));
    format!("{:width$}  {}\n{}{end}", builtin.name, builtin.summary, lines.collect::<String>())
}

pub fn models(args: &ModelsArgs, quiet: bool) -> Result<u8, Failure> {
    let listed = |builtin: &Builtin| BuiltinModel {
        name: builtin.name.into(),
        summary: builtin.summary.into(),
        sketch: Some(builtin.sketch()).filter(|sketch| !sketch.is_empty()),
        ..BuiltinModel::default()
    };
    let Some(name) = &args.name else {
        if args.json {
            let all: Vec<BuiltinModel> = BUILTIN.iter().map(listed).collect();
            return done(&(export::models_json(&all) + "\n"));
        }
        let width = BUILTIN.iter().map(|builtin| builtin.name.len()).max().unwrap_or(0);
        return done(&BUILTIN.iter().map(|builtin| entry(builtin, width)).collect::<String>());
    };
    let builtin = BUILTIN.iter().find(|builtin| builtin.name == name).ok_or_else(|| {
        Diagnostic::error("model::unknown", format!("there is no built-in model `{name}`")).help(builtin_hint(name))
    })?;
    let file = args.write.as_ref().map(|path| path.display().to_string());
    let whole = BuiltinModel { source: Some(builtin.source.into()), file, ..listed(builtin) };
    let json = || export::models_json(&[whole]) + "\n";
    let Some(path) = &args.write else {
        return if args.json { done(&json()) } else { done(builtin.source) };
    };
    if path.symlink_metadata().is_ok() {
        let message = format!("`{}` exists already and is not touched", path.display());
        return Err(Diagnostic::error("file::exists", message).help("choose another name or remove it").into());
    }
    sweep_beside(path);
    save(path, builtin.source.as_bytes())?;
    print(&if args.json { json() } else { String::new() })?;
    let schema = path.with_file_name(SCHEMA);
    let beside = schema.symlink_metadata().is_err();
    if beside {
        save(&schema, (json_schema() + "\n").as_bytes())?;
    }
    if !quiet {
        note(&format!("wrote {}", path.display()));
        if beside {
            note(&format!("wrote {}, with which editors complete its keys and mark errors", schema.display()));
        }
    }
    Ok(DONE)
}

//! `kardan identify`: parameters from measured logs.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use kardan::diagnostics::{Diagnostic, nearest};
use kardan::results::Identification;
use kardan::study::{IdentifySettings, LogFile, Part};
use kardan::tables::read::{Bytes, ReadSeek};
use kardan::units::{Dimension, parse_quantity};
use kardan::{export, study};
use kardan_report as report;

use crate::args::{IdentifyArgs, word};
use crate::exit::{ERROR, exit_code, verdict};
use crate::files::{self, expect_plain, protect, reason};
use crate::input;
use crate::output::{note_saved_file, prepare_files, print, render_text, save_over, save_page};
use crate::progress::{Bars, because};
use crate::render::{Failure, note};
use crate::source::Source;
use crate::stop;

/// A file that a format can open repeatedly.
struct OnDisk(PathBuf);

impl Bytes for OnDisk {
    fn open(&self) -> std::io::Result<Box<dyn ReadSeek>> {
        Ok(Box::new(files::open(&self.0)?))
    }
}

pub fn identify(args: &IdentifyArgs, quiet: bool) -> Result<u8, Failure> {
    let (source, project) = input::open(&args.model, &args.changes, quiet)?;
    let files = logs(&args.logs)?;
    // Only the option that writes a model may replace the model.
    prepare_files(args.report.iter().chain(&args.write), args.write.as_ref().map(|_| args.model.as_path()))?;
    let settings = IdentifySettings {
        variant: args.variant.clone(),
        parameters: args.parameters.clone(),
        method: args.method.and_then(word),
        window: args.window.as_deref().map(window).transpose()?,
        loss: args.loss.and_then(word),
        confidence: args.confidence.map(|percent| percent / 100.0),
        compare: args.compare,
        suggest: args.suggest,
    };
    let bars = Bars::new(quiet).showing({
        let (args, source) = (args.clone(), source.clone());
        move |part| match part {
            Part::Identification(found) => exit_code(report_result(&found, &args, &source, quiet), args.json),
            _ => ERROR,
        }
    });
    let found = bars.during(|bars| project.identify(files, &settings, bars));
    let mut found = found.map_err(|diagnostics| Failure { source: Some(source.clone()), diagnostics })?;
    if let Some(reason) = stop::reason() {
        because(&mut found.incomplete_reason, &reason);
    }
    report_result(&found, args, &source, quiet)
}

/// Writes and prints the results, complete or partial; only complete results are written into a model.
fn report_result(found: &Identification, args: &IdentifyArgs, source: &Source, quiet: bool) -> Result<u8, Failure> {
    let page = report::identification(found);
    if let Some(path) = &args.report {
        save_page(path, &page)?;
    }
    let whole = found.incomplete_reason.is_none();
    let write_to = args.write.as_deref().filter(|_| whole);
    let omissions = write_to.map(|path| write(path, &args.model, source, found)).transpose();
    // The results are printed even if they cannot be written; JSON output is one object, then that of the error.
    let omissions = if args.json { Ok(omissions?) } else { omissions };
    print(&if args.json {
        export::identification_json(found) + "\n"
    } else {
        render_text(&page, &source.to_string())
    })?;
    let omissions = omissions?.unwrap_or_default();
    for path in args.report.iter().map(PathBuf::as_path).chain(write_to).filter(|_| !quiet) {
        note_saved_file(path);
    }
    if let (Some(path), false) = (&args.write, whole) {
        note(&format!("`{}` is not written: the identification is not complete", path.display()));
    }
    for why in omissions.iter().filter(|_| !quiet) {
        note(&format!("not written: {why}"));
    }
    Ok(verdict(whole, !args.strict || found.verdict().sound))
}

/// The logs, each a file that can be opened and different from the others.
pub(super) fn logs(paths: &[PathBuf]) -> Result<Vec<LogFile>, Diagnostic> {
    let same = |a: &PathBuf, b: &PathBuf| match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    };
    if let Some(path) =
        paths.iter().enumerate().find_map(|(k, path)| paths[..k].iter().find(|candidate| same(candidate, path)))
    {
        let message = format!("the log `{}` is repeated", path.display());
        return Err(Diagnostic::error("log::duplicate", message)
            .help("name it once: repeated data would make the results look more certain than they are"));
    }
    paths.iter().map(|path| log(path)).collect()
}

fn log(path: &Path) -> Result<LogFile, Diagnostic> {
    let name = path.display().to_string();
    let wrong = |error: &std::io::Error| {
        let mut found =
            Diagnostic::error("file::unreadable", format!("cannot read the log `{name}`: {}", reason(error)));
        if error.kind() == std::io::ErrorKind::NotFound {
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let own = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
            let names: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
            if let Some(near) = nearest(&own, names.iter().map(String::as_str)) {
                found = found.help(format!("did you mean `{}`?", folder.join(near).display()));
            }
        }
        found
    };
    expect_plain(path, &name)?;
    files::open(path).map_err(|error| wrong(&error))?;
    protect(path);
    Ok(LogFile { name, bytes: Arc::new(OnDisk(path.to_owned())) })
}

/// `50 ms`, or a number of seconds.
fn window(text: &str) -> Result<f64, Diagnostic> {
    match parse_quantity(text) {
        Ok((value, Dimension::TIME | Dimension::NONE)) if value.signum() > 0 => Ok(value.to_f64()),
        _ => Err(Diagnostic::error("arguments::window", format!("`--window {text}` is not a time above zero"))
            .help("write it like `--window \"50 ms\"`")),
    }
}

/// Writes a copy of the model file with the identified values, and reports those that it cannot contain.
fn write(path: &Path, model: &Path, source: &Source, found: &Identification) -> Result<Vec<String>, Failure> {
    let (text, omissions) = study::write_values(source.model(), found).map_err(|mut diagnostics| {
        diagnostics.insert(
            0,
            Diagnostic::error("identify::write", "with the identified values the model file would not be valid")
                .help("no file was written; omit `--write`, or the parameters named"),
        );
        Failure { source: None, diagnostics }
    })?;
    save_over(path, text.as_bytes(), Some(model))?;
    Ok(omissions)
}

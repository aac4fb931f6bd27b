//! Parameters from measured logs: what the file asks for, the logs read, the samples fitted, and what was found said.

mod asked;
mod channels;
mod compare;
mod plant;
mod reading;
mod rows;
mod summary;

use std::io::{Seek, SeekFrom};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use asked::{Asked, asked};
use channels::{OpenLog, Quantity, log_error, open_log, recordings};
use compare::{Whole, compare};
use plant::{Columns, columns, plant, slots};
use reading::{Counted, Recording, read as read_logs, usual_window};
use rows::{Built, Material, rows, settled};

use super::prepare::is_error;
use super::{Part, Progress, Project};
use crate::assemble::CoefficientKind as Kind;
use crate::diagnostics::{Diagnostic, nearest, quoted};
use crate::identify::{Excitation, FitOptions, Samples, cross_validate, fit};
use crate::model::{self, Document, Model, NewValue, Setting};
use crate::results::{Identification, LogRead, WindowCount};
use kardan_tables::read::Bytes;

/// A log to be read.
pub struct LogFile {
    /// What to call it.
    pub name: String,
    /// What is in it.
    pub bytes: Arc<dyn Bytes>,
}

/// How parameters are identified; what is left out is as the model file says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct IdentifySettings {
    /// Variant of the model; the first if not given.
    pub variant: Option<String>,
    /// What is to be found.
    pub parameters: Vec<String>,
    /// `steady` or `dynamic`.
    pub method: Option<String>,
    /// Width of the windows, s.
    pub window: Option<f64>,
    /// `squares`, `huber` or `bisquare`.
    pub loss: Option<String>,
    /// Confidence of the intervals.
    pub confidence: Option<f64>,
    /// Whether candidates are compared.
    pub compare: bool,
}

/// What of a log counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Method {
    Steady,
    Dynamic,
}

impl Method {
    fn word(self) -> &'static str {
        match self {
            Self::Steady => "steady",
            Self::Dynamic => "dynamic",
        }
    }

    fn excitation(self) -> Excitation {
        match self {
            Self::Steady => Excitation::Steady,
            Self::Dynamic => Excitation::Free,
        }
    }
}

/// Steady segments are taken unasked where they have so many rows for each parameter, and at least this part of the windows.
const PLENTY: usize = 3;
const RARE: usize = 5;
/// Folds of the cross-validation.
const FOLDS: usize = 5;
/// Remarks of logs that a diagnostic repeats.
const REMARKS: usize = 4;
/// Blocks of windows that stay together in it, for each fold.
const BLOCKS: usize = 20;

/// Identifies parameters of a model from logs.
///
/// The rows are those of the torque balance at the middle of windows ([`crate::identify::Regressor`],
/// [`crate::identify::Windows`]), or their means over segments of constant speed \[diss. 6.1.4\]; see [`crate::identify::fit`].
///
/// ```
/// use kardan::{study, tables::read::in_memory};
/// let source = "[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"1 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n";
/// // Torques of 2 N m s/rad times the speed.
/// let mut log = String::from("time,a.w,m.tau\ns,rad/s,N m\n");
/// for k in 0..4000 {
///     let speed = f64::from(1 + k / 500);
///     log += &format!("{},{speed},{}\n", 0.001 * f64::from(k), 2.0 * speed + 1e-3 * f64::from(k % 7));
/// }
/// let files = vec![study::LogFile { name: "log.csv".into(), bytes: in_memory(log.into_bytes()) }];
/// let found = study::identify(source, files, &study::IdentifySettings::default(), &study::Silent).unwrap();
/// assert!((found.parameters[0].value.unwrap() - 2.0).abs() < 1e-3);
/// ```
///
/// # Errors
/// Mistakes of the file and of what is asked for; logs that cannot be read, or hold too little.
pub fn identify(
    source: &str,
    files: Vec<LogFile>,
    settings: &IdentifySettings,
    progress: &dyn Progress,
) -> Result<Identification, Vec<Diagnostic>> {
    Project::open(source).identify(files, settings, progress)
}

impl Project {
    /// Identifies parameters from logs; see [`identify`](super::identify()).
    ///
    /// # Errors
    /// Mistakes of the model and of what is asked for; logs that cannot be read, or hold too little.
    pub fn identify(
        &self,
        files: Vec<LogFile>,
        settings: &IdentifySettings,
        progress: &dyn Progress,
    ) -> Result<Identification, Vec<Diagnostic>> {
        of_project(self, files, settings, progress)
    }
}

/// The same of a model that is open.
fn of_project(
    project: &Project,
    files: Vec<LogFile>,
    settings: &IdentifySettings,
    progress: &dyn Progress,
) -> Result<Identification, Vec<Diagnostic>> {
    let (document, mistakes) = project.read();
    let mut out: Vec<Diagnostic> = mistakes.iter().filter(|one| is_error(one)).cloned().collect();
    if !out.is_empty() {
        return Err(out);
    }
    if files.is_empty() {
        return Err(vec![
            Diagnostic::error("log::none", "there is no log to read")
                .help("name one or more behind the model: `kardan identify my.toml bench.mf4`"),
        ]);
    }
    let set = variant(document, settings.variant.as_deref())?;
    let (model, mistakes) = document.model_with(&set, Some(&[]));
    out.extend(mistakes.into_iter().filter(is_error));
    let asked = asked(document, &model, &set, settings, &mut out);
    if !out.is_empty() {
        return Err(out);
    }
    let Opened { mut experiments, counters, bytes } = opened(document, &model, files)?;
    let slots = slots(&experiments)?;
    let notes: Vec<String> = experiments
        .iter()
        .flatten()
        .flat_map(|open| open.log.notes().into_iter().map(|note| format!("`{}`: {note}", open.name)))
        .collect();
    let plant = plant(document, &set, &asked, &slots, &model).map_err(|mistakes| with_remarks(mistakes, &notes))?;
    let failed = |(name, error): (String, _)| vec![log_error(&name, &error)];
    let window = match asked.window {
        Some(window) => window,
        None => {
            let mut widest = 0.0_f64;
            for logs in &mut experiments {
                widest = widest.max(usual_window(logs).map_err(failed)?);
            }
            widest
        }
    };
    let part = || {
        let read: u64 = counters.iter().map(|count| count.load(Ordering::Relaxed)).sum();
        if bytes > 0 { (read as f64 / bytes as f64).min(0.999) } else { 0.0 }
    };
    let mut recorded = Vec::new();
    let heard = |part: f64| {
        progress.advance(0, "logs", part);
        progress.stop().is_some()
    };
    // What was read of the logs by the time that all is to end is fitted all the same.
    let mut early = None;
    for logs in experiments {
        recorded.push(read_logs(logs, &slots, window, &part, &heard).map_err(failed)?);
        if progress.stop().is_some() {
            early = Some(format!("of the logs {:.1} % were read", 100.0 * part()));
            break;
        }
    }
    progress.advance(0, "logs", 1.0);

    let material = Material { recorded: &recorded, slots: &slots, window };
    // What was wrong with a log is likely to be why it does not suffice.
    let remarks: Vec<String> = recorded
        .iter()
        .flat_map(|one| &one.logs)
        .flat_map(|log| log.remarks.iter().map(|remark| format!("`{}`: {remark}", log.name)))
        .collect();
    let Taken { method, columns, built, samples, notes } =
        taken(&plant, &asked, &material).map_err(|mistakes| with_remarks(mistakes, &remarks))?;
    let count = WindowCount {
        moving: match method {
            Method::Steady => built.samples.len() - samples.windows.iter().sum::<usize>(),
            Method::Dynamic => 0,
        },
        used: samples.windows.iter().sum(),
        ..built.count
    };
    let options = fit_options(&asked, &columns, method);
    let chosen: Vec<usize> = (0..samples.len()).collect();
    let Some(best) = fit(&samples, &chosen, &options) else {
        return Err(vec![too_large()]);
    };
    let told = |k: usize| best.values[k].is_finite() && !(best.standard_errors[k].is_nan() && best.values[k] != 0.0);
    if !best.scale.is_finite() || !(0..best.values.len()).all(told) {
        return Err(vec![too_large()]);
    }
    let tell = |unseen: Option<&[f64]>, unfinished: Option<String>| {
        let fitted = summary::Fitted {
            plant: &plant,
            asked: &asked,
            columns: &columns,
            samples: &samples,
            fit: &best,
            unseen,
            method: method.word(),
            window,
            noise: &built.noise,
        };
        let mut out = summary::summary(&fitted);
        out.logs = recorded.iter().flat_map(|recording| logs_told(recording, &slots)).collect();
        out.windows = count;
        out.notes.splice(0..0, notes.iter().cloned());
        out.unfinished = unfinished;
        out
    };
    let missing =
        |what: &str| Some([early.as_deref(), Some(what)].into_iter().flatten().collect::<Vec<_>>().join("; "));
    let keep = |found: &dyn Fn() -> Identification| progress.keep(&|| Part::Identification(Box::new(found())));
    keep(&|| tell(None, missing("validation and comparison are missing")));
    let ends = || early.is_some() || progress.stop().is_some();
    let folds = folds(&samples, method);
    let unseen = (!ends()).then(|| cross_validate(&samples, &chosen, &folds, &options)).flatten();
    let mut out = tell(unseen.as_deref(), None);
    keep(&|| Identification { unfinished: missing("the comparison of models is missing"), ..out.clone() });
    if settings.compare && !ends() {
        let settings = &set[..];
        let whole = Whole { document, settings, asked: &asked, plant: &plant, built: &built, method };
        out.candidates = compare(&whole, &material, progress)?;
        if out.candidates.is_empty() {
            let note =
                "there is nothing to compare: the terms asked for are one model, and the file has no other candidate";
            out.notes.insert(0, note.into());
        }
    }
    if ends() {
        out.unfinished = missing("what was left to validate and to compare is missing");
    }
    progress.release();
    Ok(out)
}

/// Diagnostics that tell what was remarked about the logs.
fn with_remarks(mut mistakes: Vec<Diagnostic>, remarks: &[String]) -> Vec<Diagnostic> {
    if let (Some(first), false) = (mistakes.first_mut(), remarks.is_empty()) {
        let known = first.help.take().unwrap_or_default();
        let shown = remarks[..remarks.len().min(REMARKS)].join("; ");
        first.help = Some(format!("{known}; and see what the logs say: {shown}"));
    }
    mistakes
}

/// The text of the model file with what was found in place, and what it cannot hold, with the reason.
///
/// # Errors
/// Mistakes of the file, or those that the values found would make of it.
pub fn written(source: &str, found: &Identification) -> Result<(String, Vec<String>), Vec<Diagnostic>> {
    let values = found.for_file.iter().map(|one| NewValue {
        name: one.name.clone(),
        value: one.value,
        interval: one.interval.map(|it| (it.lower, it.upper)),
        confidence: found.confidence,
    });
    let (text, mut left) = model::written(source, &values.collect::<Vec<_>>())?;
    left.extend(found.not_for_file.iter().cloned());
    Ok((text, left))
}

fn too_large() -> Diagnostic {
    Diagnostic::error("identify::numbers", "the logs hold numbers too large to compute with").help(
        "check units and factors of the channels, and whether a large number stands for a reading that is missing (it may be left \
         empty)",
    )
}

/// Logs that are open: those recorded together in one list each; what counts the bytes read, and all bytes.
struct Opened {
    experiments: Vec<Vec<OpenLog>>,
    counters: Vec<Arc<AtomicU64>>,
    bytes: u64,
}

fn opened(document: &Document, model: &Model, files: Vec<LogFile>) -> Result<Opened, Vec<Diagnostic>> {
    let mut out = Opened { experiments: Vec::new(), counters: Vec::new(), bytes: 0 };
    let mut mistakes = Vec::new();
    for group in recordings(document, files)? {
        let mut logs = Vec::new();
        for file in group {
            let (counted, count) = Counted::new(Arc::clone(&file.bytes));
            if let Ok(mut bytes) = file.bytes.open() {
                out.bytes += bytes.seek(SeekFrom::End(0)).unwrap_or(0);
            }
            logs.extend(open_log(document, model, &LogFile { name: file.name, bytes: counted }, &mut mistakes));
            out.counters.push(count);
        }
        out.experiments.push(logs);
    }
    if mistakes.is_empty() { Ok(out) } else { Err(mistakes) }
}

/// What of the logs is fitted, and why.
struct Taken {
    method: Method,
    columns: Columns,
    built: Built,
    samples: Samples,
    notes: Vec<String>,
}

/// Chooses between segments of constant speed and everything, where nobody has, and makes the rows.
fn taken(plant: &plant::Plant, asked: &Asked, material: &Material<'_>) -> Result<Taken, Vec<Diagnostic>> {
    let with = |method: Method| {
        let columns = columns(plant, asked, method);
        let built = rows(plant, asked, &columns, material);
        let samples = match method {
            Method::Steady => settled(&built, asked, material.window),
            Method::Dynamic => built.samples.clone(),
        };
        Taken { method, columns, built, samples, notes: Vec::new() }
    };
    let needed = |taken: &Taken| taken.columns.kept.len() + 2 * asked.extras.len();
    let enough = |taken: &Taken, samples: &Samples| samples.len() * samples.rows > needed(taken);
    let inertial = asked.wanted.iter().any(|one| matches!(one.keys[0].1, Kind::Inertia | Kind::Stiffness));
    let mut taken = match (asked.method.as_deref(), inertial) {
        (Some("steady"), _) | (None, false) => with(Method::Steady),
        _ => with(Method::Dynamic),
    };
    let plenty = taken.samples.len() * taken.samples.rows >= PLENTY * needed(&taken)
        && taken.samples.windows.iter().sum::<usize>() >= taken.built.samples.len() / RARE;
    let free = asked.method.is_none() && taken.method == Method::Steady;
    if free && !plenty && enough(&taken, &taken.built.samples) {
        let note = format!(
            "the logs have {} segments of constant speed, few for {} parameters: everything is used, with filtered derivatives \
             (`--method steady` takes the segments alone)",
            taken.samples.len(),
            needed(&taken)
        );
        taken = with(Method::Dynamic);
        taken.notes.push(note);
    }
    if taken.columns.kept.is_empty() && asked.extras.is_empty() {
        let message = "none of the parameters asked for can be told by a log of this kind";
        let help = match taken.method {
            Method::Steady => "at constant speed nothing accelerates: use `--method dynamic`",
            Method::Dynamic => "they do not enter the torque balance of what moves",
        };
        return Err(vec![Diagnostic::error("identify::structure", message).help(help)]);
    }
    if !enough(&taken, &taken.samples) {
        return Err(vec![too_little(&taken, needed(&taken), material.window)]);
    }
    Ok(taken)
}

/// The settings of a variant.
fn variant(document: &Document, name: Option<&str>) -> Result<Vec<Setting>, Vec<Diagnostic>> {
    let all = document.variant_settings();
    let Some(name) = name else { return Ok(all.into_iter().next().map(|one| one.settings).unwrap_or_default()) };
    let names: Vec<String> = all.iter().map(|one| one.name.clone()).collect();
    match all.into_iter().find(|one| one.name == name) {
        Some(found) => Ok(found.settings),
        None => {
            let help = match nearest(name, names.iter().map(String::as_str)) {
                Some(near) => format!("did you mean `{near}`?"),
                None if names.iter().all(String::is_empty) => "the model has no variants".into(),
                None => format!("there are {}", quoted(names.iter().map(String::as_str))),
            };
            let message = format!("there is no variant `{name}`");
            Err(vec![Diagnostic::error("variant::unknown", message).help(help)])
        }
    }
}

fn fit_options(asked: &Asked, columns: &Columns, method: Method) -> FitOptions {
    let nonnegative = |name: &String| asked.nonnegative.contains(name);
    let kept = columns.kept.iter().map(|(k, _)| nonnegative(&columns.asked[*k].name));
    FitOptions {
        loss: asked.loss,
        nonnegative: kept.chain(asked.extras.iter().map(|extra| nonnegative(&extra.name))).collect(),
        shapes: asked.extras.iter().map(|extra| extra.shape).collect(),
        speeds: asked.extras.iter().map(|extra| extra.speed).collect(),
        serial: method == Method::Dynamic,
    }
}

/// The fold of each sample: segments in turn, or blocks of windows that follow each other.
fn folds(samples: &Samples, method: Method) -> Vec<usize> {
    let n = samples.len();
    let folds = FOLDS.min(n);
    (0..n).map(|k| if method == Method::Steady { k % folds } else { (k * folds * BLOCKS / n.max(1)) % folds }).collect()
}

fn too_little(taken: &Taken, needed: usize, window: f64) -> Diagnostic {
    let (count, steady) = (&taken.built.count, taken.method == Method::Steady);
    let message = format!(
        "{} {} tell too little for {needed} parameters: of {} windows of {} s, {} lack samples of a channel, in {} a \
         friction rests or its sign is not known",
        taken.samples.len(),
        if steady { "segments of constant speed" } else { "windows" },
        count.all,
        summary::short(window),
        count.incomplete,
        count.resting,
    );
    let help = if steady {
        "use `--method dynamic`, a wider `steady_tolerance`, or a shorter `--window`; or ask for fewer parameters"
    } else {
        "log longer, use a shorter `--window`, lower `rest_speed`, or ask for fewer parameters"
    };
    Diagnostic::error("identify::too-little", message).help(help)
}

/// The logs of a recording, with the noise of their channels.
fn logs_told(recording: &Recording, slots: &[Quantity]) -> Vec<LogRead> {
    let mut logs = recording.logs.clone();
    for channel in logs.iter_mut().flat_map(|log| &mut log.channels) {
        if let Some(slot) = slots.iter().position(|slot| slot.signal() == channel.signal) {
            (channel.noise, channel.stated) = recording.noise[slot];
        }
    }
    logs
}

//! Parameters from measured logs: what the file asks for, the logs read, the samples fitted, and what was found said.

mod asked;
mod channels;
mod clocks;
mod compare;
mod cutting;
mod extra;
mod fitted;
mod fitting;
mod group_reader;
mod laws;
mod open_log;
mod open_logs;
mod parameters;
mod pictures;
mod plant;
mod plays;
mod reading;
mod recordings;
mod redundant;
mod rows;
mod settings;
mod stream;
mod suggest;
mod summary;
mod taken_out;
mod wanted;
mod ways;
mod written;

use asked::asked;
use compare::{Whole, compare};
use cutting::teeth_to_try;
use extra::with_harmonics;
use fitted::Fitted;
use fitting::{choose, fit_options, unseen};
use laws::with_harmonics_of_laws;
use open_logs::OpenLogs;
use plant::plant;
use plays::Play;
use redundant::contradictions;
use rows::Material;
pub use settings::{IdentifySettings, LogFile};
use suggest::{suggest, with_all_harmonics};
use summary::summary;
use ways::tell_ways;
pub use written::written;

use super::prepare::is_error;
use super::{Part, Progress, Project};
use crate::diagnostics::Diagnostic;
use crate::identify::{Fit, FitOptions};
use crate::model::{Document, Setting};
use crate::names::unknown_name;
use crate::results::Identification;

/// Remarks of logs that a diagnostic repeats.
const REMARKS: usize = 4;

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
    let mistakes: Vec<Diagnostic> = mistakes.iter().filter(|one| is_error(one)).cloned().collect();
    if !mistakes.is_empty() {
        return Err(mistakes);
    }
    if files.is_empty() {
        return Err(vec![
            Diagnostic::error("log::none", "there is no log to read")
                .help("name one or more behind the model: `kardan identify my.toml bench.mf4`"),
        ]);
    }
    let set = variant(document, settings.variant.as_deref())?;
    let (model, mut mistakes) = document.model_with(&set, Some(&[]));
    mistakes.retain(is_error);
    let mut asked = asked(document, &model, &set, settings, &mut mistakes);
    if !mistakes.is_empty() {
        return Err(mistakes);
    }
    let mut logs = OpenLogs::open(document, &model, files)?;
    let mut slots = with_harmonics_of_laws(with_harmonics(logs.slots()?, &asked.declared)?, &model);
    if settings.suggest {
        slots = with_all_harmonics(slots);
    }
    let notes = logs.notes();
    let tried = if settings.suggest { teeth_to_try(document) } else { Vec::new() };
    let plant =
        plant(document, &set, &asked, &slots, &model, &tried).map_err(|mistakes| with_remarks(mistakes, &notes))?;
    let window = match asked.window {
        Some(window) => window,
        None => logs.usual_window()?,
    };
    // What was read of the logs by the time that all is to end is fitted all the same.
    let (recorded, early) = logs.read(&slots, window, progress)?;
    let material = Material { recorded: &recorded, slots: &slots, window };
    let mut left = asked.tell_recordings(&plant, &material);
    left.extend(tell_ways(&mut asked, &plant, &material));
    left.extend(plant.notes.iter().cloned());
    // What was wrong with a log is likely to be why it does not suffice.
    let mut chosen =
        choose(&plant, &asked, &material).map_err(|mistakes| with_remarks(mistakes, &material.remarks()))?;
    let contradictions = contradictions(&plant, &material);
    chosen.warnings = contradictions.warnings;
    chosen.notes.extend(left.into_iter().chain(contradictions.notes));
    let options = fit_options(&asked, &chosen.columns, chosen.method);
    let fit = chosen.fit(&options)?;
    let whole = Whole { document, settings: &set, asked: &asked, plant: &plant, chosen: &chosen };
    Fitting { whole, material, options, fit, early }.validated(settings, progress)
}

/// The parameters are found, and how good they are is not known yet.
struct Fitting<'a> {
    whole: Whole<'a>,
    material: Material<'a>,
    options: FitOptions,
    fit: Fit,
    /// How much of the logs was read, if not all.
    early: Option<String>,
}

impl Fitting<'_> {
    /// Validates the fit and compares other models, until all is to end.
    fn validated(&self, asked: &IdentifySettings, progress: &dyn Progress) -> Result<Identification, Vec<Diagnostic>> {
        let keep = |found: &dyn Fn() -> Identification| progress.keep(&|| Part::Identification(Box::new(found())));
        let missing =
            |what: &str| Some(self.early.iter().map(String::as_str).chain([what]).collect::<Vec<_>>().join("; "));
        let ends = || self.early.is_some() || progress.stop().is_some();
        keep(&|| Identification { unfinished: missing("validation and comparison are missing"), ..self.summary(None) });
        let chosen = self.whole.chosen;
        let unseen = (!ends()).then(|| unseen(&chosen.samples, chosen.method, &self.options).0).flatten();
        let mut out = self.summary(unseen.as_deref());
        keep(&|| Identification { unfinished: missing("the comparison of models is missing"), ..out.clone() });
        if asked.compare && !ends() {
            out.candidates = compare(&self.whole, &self.material, progress)?;
            if out.candidates.is_empty() {
                let note = "there is nothing to compare: the terms asked for are one model, and the file has no other candidate";
                out.notes.insert(0, note.into());
            }
        }
        if asked.suggest && !ends() {
            keep(&|| Identification { unfinished: missing("suggestions are missing"), ..out.clone() });
            out.suggestions = suggest(&self.whole, &self.material, &self.options, &self.plays(), progress);
        }
        if ends() {
            out.unfinished = missing("what was left to validate and to compare is missing");
        }
        progress.release();
        Ok(out)
    }

    /// What the teeth of plays did, by the values that were found.
    fn plays(&self) -> Vec<Play> {
        let Whole { asked, chosen, .. } = self.whole;
        let kept = chosen.columns.kept.iter().map(|(k, _)| chosen.columns.asked[*k].name.clone());
        let names: Vec<String> = kept.chain(asked.extras.iter().map(|extra| extra.name.clone())).collect();
        chosen.built.plays.iter().map(|play| play.fitted(&self.fit, &names)).collect()
    }

    /// What was found, with the predictions of fits that have not seen what they predict, if there are any.
    fn summary(&self, unseen: Option<&[f64]>) -> Identification {
        let Whole { asked, plant, chosen, .. } = self.whole;
        let plays = self.plays();
        let mut out = summary(&Fitted {
            plant,
            asked,
            columns: &chosen.columns,
            samples: &chosen.samples,
            fit: &self.fit,
            unseen,
            method: chosen.method.word(),
            window: self.material.window,
            noise: &chosen.built.noise,
            plays: &plays,
        });
        out.logs = self.material.logs();
        out.windows = chosen.windows();
        out.notes.splice(0..0, chosen.notes.iter().cloned());
        out.warnings.splice(0..0, chosen.warnings.iter().cloned());
        out
    }
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

/// The settings of a variant.
fn variant(document: &Document, name: Option<&str>) -> Result<Vec<Setting>, Vec<Diagnostic>> {
    let all = document.variant_settings();
    let Some(name) = name else { return Ok(all.into_iter().next().map(|one| one.settings).unwrap_or_default()) };
    let named = all.iter().find(|one| one.name == name).map(|one| one.settings.clone());
    named.ok_or_else(|| {
        let names = all.iter().map(|one| one.name.as_str());
        let help = match names.clone().all(str::is_empty) {
            true => "the model has no variants".into(),
            false => unknown_name(name, names),
        };
        vec![Diagnostic::error("variant::unknown", format!("there is no variant `{name}`")).help(help)]
    })
}

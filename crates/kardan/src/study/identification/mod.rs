//! Parameters from measured logs: reads the request of the file and the logs, fits the samples, and reports the result.

mod backlashes;
mod channels;
mod clocks;
mod compare;
mod cutting;
mod entry_removal;
mod extra;
mod fitted;
mod fitting;
mod group_reader;
mod laws;
mod numbers;
mod open_log;
mod open_logs;
mod parameters;
mod pictures;
mod plant;
mod reading;
mod recordings;
mod redundant;
mod request;
mod rows;
mod settings;
mod stream;
mod suggest;
mod summary;
mod unknowns;
mod ways;
mod write_values;

use backlashes::Backlash;
use compare::{Whole, compare};
use cutting::teeth_to_try;
use extra::with_harmonics;
use fitted::Fitted;
use fitting::{choose, cross_validated};
use laws::with_harmonics_of_laws;
use open_logs::OpenLogs;
use plant::plant;
use redundant::report_contradictions;
use request::request;
use rows::Material;
pub use settings::{IdentifySettings, LogFile};
use suggest::{suggest, with_all_harmonics};
use summary::summary;
use ways::drop_unused_directions;
pub use write_values::write_values;

use crate::study::{Part, Progress, Project};
use kardan_identify::{Fit, FitOptions};
use kardan_math::names::unknown_name;
use kardan_model::{Document, Setting};
use kardan_results::Identification;
use kardan_schema::diagnostics::Diagnostic;

/// Remarks of logs that a diagnostic repeats.
const REMARKS: usize = 4;

/// Identifies parameters of a model from logs.
///
/// The rows are those of the torque balance at the middle of windows ([`kardan_identify::Regressor`],
/// [`kardan_identify::Windows`]), or their means over segments of constant speed \[diss. 6.1.4\]; see [`kardan_identify::fit`].
///
/// ```
/// use kardan::study;
/// use kardan::tables::read::in_memory;
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
/// Errors of the file and of the request; logs that cannot be read, or contain too few data.
pub fn identify(
    source: &str,
    files: Vec<LogFile>,
    settings: &IdentifySettings,
    progress: &dyn Progress,
) -> Result<Identification, Vec<Diagnostic>> {
    Project::open(source).identify(files, settings, progress)
}

impl Project {
    /// Identifies parameters from logs; see [`identify`](crate::study::identify()).
    ///
    /// # Errors
    /// Errors of the model and of the request; logs that cannot be read, or contain too few data.
    pub fn identify(
        &self,
        files: Vec<LogFile>,
        settings: &IdentifySettings,
        progress: &dyn Progress,
    ) -> Result<Identification, Vec<Diagnostic>> {
        let (document, diagnostics) = self.read();
        let diagnostics: Vec<Diagnostic> = diagnostics.iter().filter(|one| one.is_error()).cloned().collect();
        if !diagnostics.is_empty() {
            return Err(diagnostics);
        }
        if files.is_empty() {
            return Err(vec![
                Diagnostic::error("log::none", "there is no log to read")
                    .help("name one or more after the model: `kardan identify my.toml bench.mf4`"),
            ]);
        }
        let set = variant(document, settings.variant.as_deref())?;
        let (model, mut diagnostics) = document.model_with(&set, Some(&[]));
        diagnostics.retain(Diagnostic::is_error);
        let mut request = request(document, &model, &set, settings, &mut diagnostics);
        if !diagnostics.is_empty() {
            return Err(diagnostics);
        }
        let logs = OpenLogs::open(document, &model, files)?;
        let mut slots = with_harmonics_of_laws(with_harmonics(logs.slots()?, &request.declared)?, &model);
        if settings.suggest {
            slots = with_all_harmonics(slots);
        }
        let notes = logs.notes();
        let tried = if settings.suggest { teeth_to_try(document) } else { Vec::new() };
        let plant =
            plant(document, &set, &request, &slots, &tried).map_err(|diagnostics| with_remarks(diagnostics, &notes))?;
        let window = match request.window {
            Some(window) => window,
            None => logs.usual_window()?,
        };
        // After an early stop the part of the logs read so far is fitted nevertheless.
        let (recorded, early) = logs.read(&slots, window, progress)?;
        let material = Material::new(&recorded, &slots, window, &model);
        let mut notes = request.split_by_recording(&plant, &material);
        notes.extend(drop_unused_directions(&mut request, &plant, &material));
        notes.extend(plant.notes.iter().cloned());
        // An error of a log is a likely reason for insufficient data.
        let mut chosen = choose(&plant, &request, &material)
            .map_err(|diagnostics| with_remarks(diagnostics, &material.remarks()))?;
        chosen.notes.extend(notes);
        report_contradictions(&plant, &material, &mut chosen);
        let options = chosen.fit_options(&request);
        let fit = chosen.fit(&options)?;
        let whole = Whole { document, settings: &set, material, request: &request, plant: &plant, chosen: &chosen };
        Fitting { whole, options, fit, early }.validated(settings, progress)
    }
}

/// The identified parameters, before validation.
struct Fitting<'a> {
    whole: Whole<'a>,
    options: FitOptions,
    fit: Fit,
    /// The fraction of the logs read, if not all.
    early: Option<String>,
}

impl Fitting<'_> {
    /// Validates the fit and compares other models, until a stop is requested.
    fn validated(
        &self,
        request: &IdentifySettings,
        progress: &dyn Progress,
    ) -> Result<Identification, Vec<Diagnostic>> {
        let store_partial =
            |found: &dyn Fn() -> Identification| progress.store_partial(&|| Part::Identification(Box::new(found())));
        let missing =
            |what: &str| Some(self.early.iter().map(String::as_str).chain([what]).collect::<Vec<_>>().join("; "));
        let ends = || self.early.is_some() || progress.stop().is_some();
        store_partial(&|| Identification {
            incomplete_reason: missing("validation and comparison are missing"),
            ..self.summary(None)
        });
        let chosen = self.whole.chosen;
        let cross_validated =
            (!ends()).then(|| cross_validated(chosen.samples(), chosen.method, &self.options).0).flatten();
        let mut out = self.summary(cross_validated.as_deref());
        store_partial(&|| Identification {
            incomplete_reason: missing("the comparison of models is missing"),
            ..out.clone()
        });
        if request.compare && !ends() {
            out.candidates = compare(&self.whole, progress)?;
            if out.candidates.is_empty() {
                let note = "kardan has no models to compare: the requested terms are one model, and the file has no other candidate";
                out.notes.insert(0, note.into());
            }
        }
        if request.suggest && !ends() {
            store_partial(&|| Identification { incomplete_reason: missing("suggestions are missing"), ..out.clone() });
            out.suggestions = suggest(&self.whole, &self.options, &self.backlashes(), progress);
        }
        if ends() {
            out.incomplete_reason = missing("the remaining validation and comparison are missing");
        }
        progress.release();
        Ok(out)
    }

    /// Contacts of the backlashes with the identified values.
    fn backlashes(&self) -> Vec<Backlash> {
        let Whole { request, chosen, .. } = self.whole;
        let names = chosen.columns.names(request);
        chosen.built.backlashes.iter().map(|backlash| backlash.fitted(&self.fit, &names)).collect()
    }

    /// The result, with cross-validated predictions, if any.
    fn summary(&self, cross_validated: Option<&[f64]>) -> Identification {
        let Whole { request, plant, chosen, .. } = self.whole;
        let backlashes = self.backlashes();
        let mut out = summary(&Fitted {
            whole: &self.whole,
            plant,
            request,
            columns: &chosen.columns,
            samples: chosen.samples(),
            fit: &self.fit,
            cross_validated,
            backlashes: &backlashes,
        });
        out.logs = self.whole.material.logs();
        out.windows = chosen.windows();
        out.notes.splice(0..0, chosen.notes.iter().cloned());
        out.warnings.splice(0..0, chosen.warnings.iter().cloned());
        out
    }
}

/// Diagnostics with the remarks about the logs.
fn with_remarks(mut diagnostics: Vec<Diagnostic>, remarks: &[String]) -> Vec<Diagnostic> {
    if let (Some(first), false) = (diagnostics.first_mut(), remarks.is_empty()) {
        let own_help = first.help.take().unwrap_or_default();
        let shown = remarks[..remarks.len().min(REMARKS)].join("; ");
        first.help = Some(format!("{own_help}; remarks about the logs: {shown}"));
    }
    diagnostics
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

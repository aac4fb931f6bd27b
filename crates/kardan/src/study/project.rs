//! One model, read once and prepared once: the entry point of every command.

use std::collections::BTreeSet;
use std::sync::OnceLock;

use crate::study::check::multiplier_constraints::for_analysis;
use crate::study::prepare::document::prepare_document;
use crate::study::prepare::variants::Purpose;
use crate::study::progress::{Progress, Silent};
use crate::study::read::variant_diagnostics::without_errors;
use crate::study::{Prepared, PreparedVariant};
use kardan_model::{Builder, Document, FileBytes, assign, open, read_entries};
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::entries::{Entries, RawValue};
use kardan_schema::file::to_toml;
use kardan_schema::schema::{ElementKeys, LawKeys};
use kardan_simulate::{Setup, Simulation};

/// A model, read once. Derived data (equations, designed laws, scenarios) is computed at the first request and cached: a
/// command that checks, runs and reports prepares once and designs each law once for each variant. The methods that run, analyse, design and
/// identify a project are in the modules of these studies.
///
/// ```
/// use kardan::model;
/// use kardan::study::{Project, Settings, Silent};
///
/// let project = Project::open(model::builtin("two-bodies").unwrap().source);
/// assert!(project.diagnostics().is_empty());
/// let study = project.run(&Settings::default(), &Silent).unwrap();
/// let design = project.design(&Default::default(), &Silent);
/// assert_eq!(study.runs.len(), project.prepared().variants.len());
/// # let _ = design;
/// ```
#[derive(Debug)]
pub struct Project {
    entries: Entries,
    /// The source text, if it comes from a file.
    source: String,
    document: Document,
    reading: Vec<Diagnostic>,
    ready: OnceLock<(Prepared, Vec<Diagnostic>)>,
    /// For an analysis, if a run is not possible.
    analysed: OnceLock<(Prepared, Vec<Diagnostic>)>,
    /// Without the designs of its controllers, if no request needed them.
    undesigned: OnceLock<(Prepared, Vec<Diagnostic>)>,
}

impl Project {
    /// Reads the text of a model file; [`diagnostics`](Self::diagnostics) reports errors.
    pub fn open(source: impl Into<String>) -> Self {
        let source = source.into();
        let (entries, diagnostics, broken) = open(&source);
        Self::of(entries, source, diagnostics, broken)
    }

    /// The model that a program has built.
    ///
    /// ```
    /// use kardan::project::{Builder, Project, Shaft};
    ///
    /// let shaft = Shaft::new().inertia("2 kg cm^2").friction("0.1 Nm");
    /// let project = Project::build(Builder::new("axle").element("axle", shaft));
    /// assert!(project.diagnostics().is_empty());
    /// assert_eq!(project.to_toml(), "[model]\nname = \"axle\"\n\n[shaft.axle]\ninertia = \"2 kg cm^2\"\nfriction = \"0.1 Nm\"\n");
    ///
    /// let wrong = Project::build(Builder::new("axle").element("axle", Shaft::new().inertia("2 kg")));
    /// assert_eq!(wrong.diagnostics()[0].labels[0].place.path(), Some("shaft.axle.inertia"));
    /// ```
    pub fn build(model: Builder) -> Self {
        Self::of(model.into_entries(), String::new(), Vec::new(), false)
    }

    /// Names of further files that the model needs, each once: tables of signals.
    ///
    /// ```
    /// use kardan::project::Project;
    ///
    /// let project = Project::open("[signal.road]\nkind = \"table\"\nfile = \"road.csv\"\n");
    /// assert_eq!(project.files(), ["road.csv"]);
    /// ```
    pub fn files(&self) -> Vec<String> {
        let names: BTreeSet<&str> = self.document.file_names().collect();
        names.into_iter().map(Into::into).collect()
    }

    /// The same model with the bytes of its further files, or why they cannot be read, which is reported at their names.
    #[must_use]
    pub fn with_files(mut self, files: impl IntoIterator<Item = (String, FileBytes)>) -> Self {
        self.document.files.extend(files);
        (self.ready, self.analysed, self.undesigned) = Default::default();
        self
    }

    /// The same with other runs, ready.
    pub(in crate::study) fn with_ready(&self, prepared: Prepared, diagnostics: Vec<Diagnostic>) -> Self {
        let (entries, source) = (self.entries.clone(), self.source.clone());
        let (document, reading) = (self.document.clone(), self.reading.clone());
        let (analysed, undesigned) = Default::default();
        Self { entries, source, document, reading, ready: (prepared, diagnostics).into(), analysed, undesigned }
    }

    /// Its typed tables.
    pub(in crate::study) fn document(&self) -> &Document {
        &self.document
    }

    fn of(entries: Entries, source: String, diagnostics: Vec<Diagnostic>, broken: bool) -> Self {
        let (document, reading) = read_entries(&entries, diagnostics, broken);
        let (ready, analysed, undesigned) = Default::default();
        Self { entries, source, document, reading, ready, analysed, undesigned }
    }

    /// The same model with changes: unchanged entries retain their spans, new ones have their path.
    ///
    /// ```
    /// use kardan::project::{Project, Quantity};
    ///
    /// let project = Project::open("[shaft.axle]\ninertia = \"2 kg cm^2\"\n");
    /// let heavier = project.changed(|model| model.set(&["shaft", "axle", "inertia"], Quantity::from("3 kg cm^2")));
    /// assert_eq!(heavier.to_toml(), "[shaft.axle]\ninertia = \"3 kg cm^2\"\n");
    /// ```
    #[must_use]
    pub fn changed(&self, change: impl FnOnce(Builder) -> Builder) -> Self {
        self.again(change(Builder::from_entries(self.entries.clone())).into_entries())
    }

    /// The same model with new values, as `kardan run --set` sets them, and remarks on them: `beta=10 deg` for a parameter,
    /// `wg.inertia=2 kg cm^2` for a key of an element of the model, or a path from the top of the file.
    ///
    /// ```
    /// use kardan::project::Project;
    ///
    /// let project = Project::open("[shaft.axle]\ninertia = \"2 kg cm^2\"\n");
    /// let (heavier, _) = project.with(&["axle.inertia=3 kg cm^2"]).unwrap();
    /// assert_eq!(heavier.to_toml(), "[shaft.axle]\ninertia = \"3 kg cm^2\"\n");
    /// let diagnostic = project.with(&["axel.inertia=3 kg cm^2"]).unwrap_err();
    /// assert_eq!(diagnostic.help.as_deref(), Some("did you mean `axle`?"));
    /// ```
    ///
    /// # Errors
    /// No `=`, no such table or parameter. [`diagnostics`](Self::diagnostics) reports errors in the value.
    pub fn with(&self, values: &[impl AsRef<str>]) -> Result<(Self, Vec<String>), Diagnostic> {
        let mut entries = self.entries.clone();
        let mut remarks = Vec::new();
        for value in values {
            remarks.extend(assign(&mut entries, value.as_ref())?);
        }
        entries.assign_places();
        Ok((self.again(entries), remarks))
    }

    /// Other entries from the same text; syntax errors of that text remain.
    fn again(&self, entries: Entries) -> Self {
        let broken = |d: &&Diagnostic| matches!(d.code, "toml::syntax" | "file::empty");
        let broken: Vec<_> = self.reading.iter().filter(broken).cloned().collect();
        let is_broken = !broken.is_empty();
        Self::of(entries, self.source.clone(), broken, is_broken).with_files(self.document.files.clone())
    }

    /// The same model with another operating point of its analysis: signals with their values.
    pub(in crate::study) fn looked_at(&self, at: &[(String, String)]) -> Self {
        let put =
            |model: Builder, (signal, value): &(String, String)| model.set(&["analysis", "at", signal], value.clone());
        self.changed(|model| at.iter().fold(model.removing(&["analysis", "at"]), put))
    }

    /// The model as a file: reading it again gives the same model.
    pub fn to_toml(&self) -> String {
        to_toml(&self.entries)
    }

    /// The source text of the model.
    pub fn entries(&self) -> &Entries {
        &self.entries
    }

    /// The element of that kind and name, as in the file; none if there is no readable one.
    ///
    /// ```
    /// use kardan::project::{Project, Shaft};
    ///
    /// let project = Project::open("[shaft.axle]\ninertia = \"2 kg cm^2\"\n");
    /// assert_eq!(project.element::<Shaft>("axle"), Some(Shaft::new().inertia("2 kg cm^2")));
    /// ```
    pub fn element<E: ElementKeys>(&self, name: &str) -> Option<E> {
        E::read_entries(self.entries.table(E::KEYWORD)?.table(name)?)
    }

    /// The controller of that law and name, as in the file.
    pub fn control<L: LawKeys>(&self, name: &str) -> Option<L> {
        let table = self.entries.table("control")?.table(name)?;
        let law = matches!(table.get("law"), Some(RawValue::Text(law)) if law == L::KEYWORD);
        if law { L::read_entries(table) } else { None }
    }

    /// The text that it was read from; empty for a model built by a program.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// All its errors and warnings, in the order of the file.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.ready().1
    }

    /// Prepares it now, with progress to `progress`; earlier preparations are reused.
    pub fn prepare_with_progress(&self, progress: &dyn Progress) {
        self.ready.get_or_init(|| self.prepare(Purpose::Run, progress));
    }

    /// The prepared study, as far as the file has no errors.
    pub fn prepared(&self) -> &Prepared {
        &self.ready().0
    }

    /// The closed loop of a variant (of the first, if none is named), to be stepped by a caller.
    ///
    /// # Errors
    /// All errors; no such variant.
    pub fn simulation(&self, variant: Option<&str>) -> Result<Simulation, Vec<Diagnostic>> {
        without_errors(self.diagnostics())?;
        let prepared = self.prepared();
        let variant = prepared.variant(variant)?;
        let setup = Setup { reduced: &variant.reduced, laws: &variant.implemented, scenario: &variant.scenario };
        Ok(Simulation::new(setup, prepared.tolerance))
    }

    /// The typed tables, and the errors of the tables alone.
    pub(in crate::study) fn read(&self) -> (&Document, &[Diagnostic]) {
        (&self.document, &self.reading)
    }

    /// The preparation for an analysis: the same, if a run is possible.
    ///
    /// # Errors
    /// All errors of the file.
    pub(in crate::study) fn for_analysis(&self) -> Result<(&Prepared, &[Diagnostic]), Vec<Diagnostic>> {
        let ready = self.ready();
        let (prepared, diagnostics) = ready;
        let has_error = diagnostics.iter().any(Diagnostic::is_error);
        // A run eliminates motions without inertia, an analysis lists them.
        let settled = prepared.variants.iter().any(|variant| variant.reduced.is_settled());
        let keeps =
            prepared.variants.iter().any(|variant| !variant.reduced.equations.multiplier_constraints.is_empty());
        let (prepared, diagnostics) = if has_error || settled && !keeps {
            self.analysed.get_or_init(|| self.prepare(Purpose::Analysis, &Silent))
        } else if keeps {
            self.analysed.get_or_init(|| match for_analysis(prepared) {
                Ok(frozen) => (frozen, diagnostics.clone()),
                Err(refused) => (Prepared::default(), diagnostics.iter().cloned().chain([refused]).collect()),
            })
        } else {
            ready
        };
        without_errors(diagnostics)?;
        Ok((prepared, diagnostics))
    }

    /// The first variant for writing its equations, and the warnings of the file: no controller is designed for it.
    ///
    /// # Errors
    /// All errors of the file.
    pub(in crate::study) fn for_equations(&self) -> Result<(&PreparedVariant, Vec<Diagnostic>), Vec<Diagnostic>> {
        let (prepared, diagnostics) = match self.ready.get() {
            None if !self.document.controls.is_empty() => {
                self.undesigned.get_or_init(|| self.prepare(Purpose::Equations, &Silent))
            }
            _ => self.ready(),
        };
        without_errors(diagnostics)?;
        prepared.all().next().map(|variant| (variant, diagnostics.clone())).ok_or_else(|| diagnostics.clone())
    }

    fn ready(&self) -> &(Prepared, Vec<Diagnostic>) {
        self.ready.get_or_init(|| self.prepare(Purpose::Run, &Silent))
    }

    fn prepare(&self, purpose: Purpose, progress: &dyn Progress) -> (Prepared, Vec<Diagnostic>) {
        let mut out = self.reading.clone();
        if out.iter().any(|d| d.code == "file::empty") {
            return (Prepared::default(), out);
        }
        let prepared = prepare_document(purpose, &self.document, progress, &mut out);
        (prepared, out)
    }
}

/// All errors and warnings of a model file, in the order of the file.
pub fn check(source: &str) -> Vec<Diagnostic> {
    prepare(source).1
}

/// Reads, checks and designs a study. The result can be run only if no diagnostic is an error.
///
/// Errors in one part do not hide those in others: the equations are reduced if everything they need could be
/// read, the study is checked against the available part of the model. Entries that depend on doubtful parts are skipped
/// silently.
pub fn prepare(source: &str) -> (Prepared, Vec<Diagnostic>) {
    Project::open(source).prepare(Purpose::Run, &Silent)
}

#[cfg(test)]
#[path = "../../tests/unit/study/project.rs"]
mod tests;

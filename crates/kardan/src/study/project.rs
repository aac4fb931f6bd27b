//! One model, read once and prepared once: the door that every command goes through.

use std::collections::BTreeSet;
use std::sync::OnceLock;

use super::Prepared;
use super::prepare::{Purpose, is_error, prepare_document};
use super::progress::{Progress, Silent};
use crate::diagnostics::Diagnostic;
use crate::entries::{Entries, RawValue};
use crate::file::to_toml;
use crate::model::{Builder, Document, FileBytes, assign, open, read_entries};
use crate::schema::{ElementKeys, LawKeys};
use crate::simulate::{Setup, Simulation};

/// A model, read once. What follows from it (equations, designed laws, scenarios) is made when it is asked for first, and kept: a
/// command that checks, runs and reports prepares once and designs each law once for each variant. What runs, analyses, designs and
/// identifies a project stands with these studies.
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
    /// The text, of a file.
    source: String,
    document: Document,
    reading: Vec<Diagnostic>,
    ready: OnceLock<(Prepared, Vec<Diagnostic>)>,
    /// Where a run is not possible, but an analysis may be.
    analysed: OnceLock<(Prepared, Vec<Diagnostic>)>,
    /// Without the designs of its controllers, where nothing else was asked for.
    undesigned: OnceLock<(Prepared, Vec<Diagnostic>)>,
}

impl Project {
    /// Reads the text of a model file; mistakes are told by [`diagnostics`](Self::mistakes).
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

    /// Names of the files that the model needs besides itself, each once: tables of signals.
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

    /// The same model with the bytes of files that it needs, or why they cannot be read, which is told where it names them.
    #[must_use]
    pub fn with_files(mut self, files: impl IntoIterator<Item = (String, FileBytes)>) -> Self {
        self.document.files.extend(files);
        (self.ready, self.analysed, self.undesigned) = Default::default();
        self
    }

    /// The same with other runs, ready.
    pub(super) fn with_ready(&self, prepared: Prepared, diagnostics: Vec<Diagnostic>) -> Self {
        let (entries, source) = (self.entries.clone(), self.source.clone());
        let (document, reading) = (self.document.clone(), self.reading.clone());
        let (analysed, undesigned) = Default::default();
        Self { entries, source, document, reading, ready: (prepared, diagnostics).into(), analysed, undesigned }
    }

    /// Its typed tables.
    pub(super) fn document(&self) -> &Document {
        &self.document
    }

    fn of(entries: Entries, source: String, diagnostics: Vec<Diagnostic>, broken: bool) -> Self {
        let (document, reading) = read_entries(&entries, diagnostics, broken);
        let (ready, analysed, undesigned) = Default::default();
        Self { entries, source, document, reading, ready, analysed, undesigned }
    }

    /// The same model with changes: what stays keeps its places, what is new is told by its path.
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

    /// The same model with values written anew, as `kardan run --set` does, and remarks on them: `beta=10 deg` for a parameter,
    /// `wg.inertia=2 kg cm^2` for a key of what the model names, or a path from the top of the file.
    ///
    /// ```
    /// use kardan::project::Project;
    ///
    /// let project = Project::open("[shaft.axle]\ninertia = \"2 kg cm^2\"\n");
    /// let (heavier, _) = project.with(&["axle.inertia=3 kg cm^2"]).unwrap();
    /// assert_eq!(heavier.to_toml(), "[shaft.axle]\ninertia = \"3 kg cm^2\"\n");
    /// let mistake = project.with(&["axel.inertia=3 kg cm^2"]).unwrap_err();
    /// assert_eq!(mistake.help.as_deref(), Some("did you mean `axle`?"));
    /// ```
    ///
    /// # Errors
    /// No `=`, no such table or parameter. What is wrong in the value is told by [`diagnostics`](Self::mistakes).
    pub fn with(&self, values: &[impl AsRef<str>]) -> Result<(Self, Vec<String>), Diagnostic> {
        let mut entries = self.entries.clone();
        let mut remarks = Vec::new();
        for value in values {
            remarks.extend(assign(&mut entries, value.as_ref())?);
        }
        entries.settle();
        Ok((self.again(entries), remarks))
    }

    /// Other entries from the same text; what is broken in that text still is.
    fn again(&self, entries: Entries) -> Self {
        let broken = |d: &&Diagnostic| matches!(d.code, "toml::syntax" | "file::empty");
        let broken: Vec<_> = self.reading.iter().filter(broken).cloned().collect();
        let is_broken = !broken.is_empty();
        Self::of(entries, self.source.clone(), broken, is_broken).with_files(self.document.files.clone())
    }

    /// The same model with another operating point of its analysis: signals with their values.
    pub(super) fn looked_at(&self, at: &[(String, String)]) -> Self {
        let put =
            |model: Builder, (signal, value): &(String, String)| model.set(&["analysis", "at", signal], value.clone());
        self.changed(|model| at.iter().fold(model.removing(&["analysis", "at"]), put))
    }

    /// The model as a file: opened again it says the same.
    pub fn to_toml(&self) -> String {
        to_toml(&self.entries)
    }

    /// What is written in the model.
    pub fn entries(&self) -> &Entries {
        &self.entries
    }

    /// The element of that kind and name, as it is written; nothing if there is none that could be read.
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

    /// The controller of that law and name, as it is written.
    pub fn control<L: LawKeys>(&self, name: &str) -> Option<L> {
        let table = self.entries.table("control")?.table(name)?;
        let law = matches!(table.get("law"), Some(RawValue::Text(law)) if law == L::KEYWORD);
        if law { L::read_entries(table) } else { None }
    }

    /// The text that it was read from; empty for a model that a program built.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// Everything that is wrong with it, and warnings, in the order of the file.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.ready().1
    }

    /// Prepares it now, heard by `progress`; what was prepared before is kept.
    pub fn prepare_with_progress(&self, progress: &dyn Progress) {
        self.ready.get_or_init(|| self.prepare(Purpose::Run, progress));
    }

    /// What is ready to run, as far as the file is right.
    pub fn prepared(&self) -> &Prepared {
        &self.ready().0
    }

    /// The closed loop of a variant (of the first, if none is named), to be stepped from outside.
    ///
    /// # Errors
    /// All mistakes; no such variant.
    pub fn simulation(&self, variant: Option<&str>) -> Result<Simulation, Vec<Diagnostic>> {
        if self.diagnostics().iter().any(is_error) {
            return Err(self.diagnostics().to_vec());
        }
        let prepared = self.prepared();
        let variant = prepared.variant(variant)?;
        let setup = Setup { reduced: &variant.reduced, laws: &variant.implemented, scenario: &variant.scenario };
        Ok(Simulation::new(setup, prepared.tolerance))
    }

    /// The typed tables, and what was wrong with them alone.
    pub(super) fn read(&self) -> (&Document, &[Diagnostic]) {
        (&self.document, &self.reading)
    }

    /// What an analysis may go on with: the same, where a run is possible.
    pub(super) fn for_analysis(&self) -> (&Prepared, &[Diagnostic]) {
        let (prepared, diagnostics) = self.ready();
        // A run settles motions without inertia, an analysis names them.
        let settled = prepared.variants.iter().any(|variant| variant.reduced.is_settled());
        let keeps =
            prepared.variants.iter().any(|variant| !variant.reduced.equations.multiplier_constraints.is_empty());
        if keeps && !diagnostics.iter().any(is_error) {
            let (prepared, diagnostics) =
                self.analysed.get_or_init(|| match super::multiplier_constraints::for_analysis(prepared) {
                    Ok(frozen) => (frozen, diagnostics.clone()),
                    Err(refused) => (Prepared::default(), diagnostics.iter().cloned().chain([refused]).collect()),
                });
            return (prepared, diagnostics);
        }
        if !settled && !diagnostics.iter().any(is_error) {
            return (prepared, diagnostics);
        }
        let (prepared, diagnostics) = self.analysed.get_or_init(|| self.prepare(Purpose::Analysis, &Silent));
        (prepared, diagnostics)
    }

    /// What equations are written from: no controller is designed for that.
    pub(super) fn for_equations(&self) -> (&Prepared, &[Diagnostic]) {
        let (prepared, diagnostics) = match self.ready.get() {
            None if !self.document.controls.is_empty() => {
                self.undesigned.get_or_init(|| self.prepare(Purpose::Equations, &Silent))
            }
            _ => self.ready(),
        };
        (prepared, diagnostics)
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

    /// What was prepared, and the mistakes.
    fn into_prepared(self) -> (Prepared, Vec<Diagnostic>) {
        self.ready();
        self.ready.into_inner().unwrap_or_default()
    }
}

/// All mistakes and warnings of a model file, in the order of the file.
pub fn check(source: &str) -> Vec<Diagnostic> {
    prepare(source).1
}

/// Reads, checks and designs a study. The result can be run only if no diagnostic is an error.
///
/// Mistakes in one part do not hide those in others: the equations are reduced if everything that makes them could be
/// read, the study is checked against as much of the model as there is. What depends on something in doubt is passed
/// over in silence.
pub fn prepare(source: &str) -> (Prepared, Vec<Diagnostic>) {
    Project::open(source).into_prepared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::{AnalyzeSettings, DesignSettings, EquationsForm, Settings};
    use crate::synthesis::designs_of;

    /// The parts done of the preparation.
    #[derive(Default)]
    struct Recorded(std::sync::Mutex<Vec<f64>>);

    impl Progress for Recorded {
        fn advance(&self, _: usize, _: &str, _: f64) {}

        fn preparing(&self, fraction: f64) {
            self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(fraction);
        }
    }

    /// However many commands look at a model, each law is designed once for each variant.
    #[test]
    fn each_law_is_designed_once_for_each_variant() {
        let text = "\
[parameters]
push = \"1 N m\"
[variants]
push = [\"1 N m\", \"2 N m\", \"3 N m\"]
[shaft.a]
inertia = \"1 kg m^2\"
[shaft.b]
inertia = \"2 kg m^2\"
[spring_damper.s]
shaft_1 = \"a\"
shaft_2 = \"b\"
stiffness = \"50 N m/rad\"
damping = \"1 N m s/rad\"
[motor.m]
shaft = \"a\"
[disturbance.load]
shaft = \"b\"
[control.counted_once]
law = \"decoupling\"
inputs = [\"m\"]
sample_time = \"1 ms\"
[[control.counted_once.channels]]
output = \"a.phi\"
reference = \"ref_a\"
[scenario]
duration = \"0.2 s\"
[[scenario.event]]
at = \"0.1 s\"
signal = \"load\"
to = \"push\"
";
        let project = Project::open(text);
        let fractions = Recorded::default();
        project.prepare_with_progress(&fractions);
        assert_eq!(project.diagnostics(), []);
        // The equations, the law, the sampled loop and its margins of three variants, begin and end.
        let mut fractions = fractions.0.into_inner().unwrap_or_default();
        assert_eq!((fractions.len(), fractions.first(), fractions.last()), (14, Some(&0.0), Some(&1.0)));
        fractions.sort_by(f64::total_cmp);
        fractions.dedup();
        assert_eq!(fractions.len(), 13, "{fractions:?}");
        let study = project.run(&Settings::default(), &Silent).expect("no mistakes");
        assert_eq!((study.runs.len(), study.designs.len()), (3, 1));
        project.analyze(&AnalyzeSettings::default(), &Silent).expect("no mistakes");
        let simulated = DesignSettings { simulate: true, ..DesignSettings::default() };
        project.design(&simulated, &Silent).expect("no mistakes");
        project.equations(EquationsForm::Text).expect("no mistakes");
        assert_eq!(designs_of("counted_once"), 3);
    }
}

//! Repeats rows of a sweep as full runs.

use super::batch::Batch;
use super::integrated;
use super::rows::{blank, sampled};
use crate::study::read::variant_diagnostics::without_errors;
use crate::study::requests::varied::Varied;
use crate::study::{Prepared, PreparedVariant, Project, Settings, Silent};
use kardan_model::Setting;
use kardan_results::{ParameterValue, RowAgain, SweepRow};
use kardan_schema::diagnostics::{Diagnostic, quoted};

/// Most rows of one repetition.
const MOST_ROWS: usize = 100;

impl Project {
    /// The model with rows of a sweep instead of its variants, named `<variant>_sample-<number>`: its runs equal those of the sweep, to the last bit,
    /// with all signals. Laws are those of the sweep. `identity` is the identity stored with the rows.
    ///
    /// ```
    /// use kardan::project::Project;
    /// use kardan::results::RowAgain;
    /// use kardan::study::{Settings, Silent};
    ///
    /// let project = Project::open("[shaft.a]\ninertia = \"2 kg m^2 ± 10 %\"\n[scenario]\ninitial = { \"a.w\" = \"3 rad/s\" }\n");
    /// let plan = project.sweep_plan(&Default::default()).unwrap();
    /// let row = RowAgain { sample: 7, variant: "model".into(), values: vec![("a.inertia".into(), plan.values(7)[0])] };
    /// let again = project.rows_again(&plan.head.identity, &[row], &Settings::default()).unwrap();
    /// let study = again.run(&Settings { runs_only: true, ..Settings::default() }, &Silent).unwrap();
    /// assert_eq!(study.runs[0].name, "model_sample-7");
    /// ```
    ///
    /// # Errors
    /// Errors of the file; rows of another model or program, or with other integration settings; a variant or a value that the model does not have; a sample
    /// that cannot be prepared.
    pub fn rows_again(&self, identity: &str, rows: &[RowAgain], settings: &Settings) -> Result<Self, Vec<Diagnostic>> {
        let (prepared, diagnostics) = (self.prepared(), self.diagnostics());
        without_errors(diagnostics)?;
        let refused = |message: String, help: &str| Err(vec![Diagnostic::error("sweep::rerun", message).help(help)]);
        let (origin, integrated) = (self.origin(), integrated(settings));
        if !identity.starts_with(&format!("{origin},")) {
            let message = format!("the rows are of another sweep: {identity}; this is {origin}");
            return refused(message, "run with the model, its `--set`, and the version of kardan that made them");
        }
        if !identity.ends_with(&format!(", {integrated}")) {
            let message = format!("the rows used other integration settings: {identity}; this is {integrated}");
            return refused(message, "give the `--method` and `--tolerance` of the sweep");
        }
        if rows.is_empty() || rows.len() > MOST_ROWS {
            let message = format!("{} rows selected to run again: the allowed number is 1 to {MOST_ROWS}", rows.len());
            return refused(message, "choose some with `--sample 17,203` and `--variant NAME`");
        }
        let varied = prepared.sweep.as_ref().map(|spec| self.with_laws(&spec.space.varied)).unwrap_or_default();
        let searched = [", --worst ", ", --rare "].iter().any(|search| identity.contains(search));
        let draws = prepared.sweep.as_ref().is_some_and(|spec| spec.space.sampling.draws()) && !searched;
        let mut variants = Vec::new();
        for row in rows {
            let matched = prepared.all().find(|variant| variant.name == row.variant);
            let value = |name: &str| {
                row.values
                    .iter()
                    .find(|(candidate, value)| candidate == name && value.is_finite())
                    .map(|(_, value)| *value)
            };
            let values: Option<Vec<f64>> = varied.iter().map(|one| value(&one.name)).collect();
            let (Some(variant), Some(values)) = (matched, values) else {
                let names = quoted(varied.iter().map(|one| one.name.as_str()));
                let message = format!("row {} of `{}` does not have {names}", row.sample, row.variant);
                return refused(message, "run with the model that made the rows");
            };
            let found = sampled(self.document(), variant, &varied, (&values, draws.then_some(row.sample)));
            let mut found = found.map_err(|diagnostics| refused_row(row, diagnostics))?;
            found.name = format!("{}_sample-{}", row.variant, row.sample);
            for one in &varied {
                let parameters = &mut found.model.parameters;
                let setting = found.own.settings.iter().find(|setting| setting.name == one.name);
                if let Some(Setting { name, text, value }) =
                    setting.filter(|_| parameters.iter().all(|two| two.name != one.name))
                {
                    let (name, text, unit) = (name.clone(), text.clone(), one.dimension.si());
                    parameters.push(ParameterValue { name, value: value.to_f64(), unit, text });
                }
            }
            found.swept = self.swept((variant, &values), (&varied, settings), (row.sample, draws)).map(Box::new);
            variants.push(found.into());
        }
        let prepared = Prepared { variants, safety: None, sweep: None, ..prepared.clone() };
        Ok(self.with_ready(renamed(prepared, rows), diagnostics.to_vec()))
    }

    /// The result of a row in lanes, if it ran in lanes.
    fn swept(
        &self,
        (variant, values): (&PreparedVariant, &[f64]),
        (spread, settings): (&[Varied], &Settings),
        (sample, draws): (u64, bool),
    ) -> Option<SweepRow> {
        let prepared = self.prepared();
        let number = prepared.all().position(|candidate| candidate.name == variant.name)?;
        let one_lane = (Some(1), draws);
        let lanes = Batch::new(self, variant, spread, (settings, &Silent), one_lane).ok()?;
        let mut row = blank(prepared, (sample, number), values);
        let filled = lanes.fill(prepared, &mut [&mut row], &|| ());
        filled.into_iter().all(|filled| filled).then_some(row)
    }
}

/// The runs of variants, instead of the variants.
fn renamed(mut prepared: Prepared, rows: &[RowAgain]) -> Prepared {
    let Prepared { requirements, figures, plots, .. } = &mut prepared;
    let lists = requirements.iter_mut().map(|one| &mut one.variants);
    let lists = lists.chain(figures.iter_mut().map(|one| &mut one.variants));
    for own in lists.chain(plots.iter_mut().map(|one| &mut one.variants)) {
        let found = rows.iter().filter(|row| own.contains(&row.variant));
        let found: Vec<String> = found.map(|row| format!("{}_sample-{}", row.variant, row.sample)).collect();
        // An empty list means all.
        if !found.is_empty() {
            *own = found;
        }
    }
    prepared
}

/// Why a row cannot be repeated, with the message of the sweep.
fn refused_row(row: &RowAgain, diagnostics: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let in_row = |one: Diagnostic| {
        let message = format!("sample {} of `{}` cannot be run: {}", row.sample, row.variant, one.message);
        Diagnostic { message, labels: Vec::new(), ..one }
            .help("its row contains a reason instead of numbers: omit it from `--sample`")
    };
    diagnostics.into_iter().filter(Diagnostic::is_error).map(in_row).collect()
}

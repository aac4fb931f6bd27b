//! Models compared by cross-validation.

use super::extra::{ExtraTerm, Law, law_parameters};
use super::fitting::{Chosen, cross_validated};
use super::laws::silence_law;
use super::numbers::mean_and_error;
use super::plant::{Plant, plant_excluding};
use super::request::{CandidateSpec, FitRequest, request};
use super::rows::Material;
use super::settings::IdentifySettings;
use super::unknowns::UnknownParameter;
use crate::study::Progress;
use kardan_identify::Samples;
use kardan_mechanics::assemble::CoefficientKind as Kind;
use kardan_model::{Document, Setting};
use kardan_results::{Candidate, PredictionError};
use kardan_schema::diagnostics::Diagnostic;

/// Basis of the comparison: the model with all requested terms, and its windows.
pub(super) struct Whole<'a> {
    pub document: &'a Document,
    pub settings: &'a [Setting],
    pub material: Material<'a>,
    pub request: &'a FitRequest,
    pub plant: &'a Plant,
    pub chosen: &'a Chosen,
}

impl Whole<'_> {
    /// Columns and samples of another model, at the places of the whole one and with the covariances there.
    pub fn aligned(&self, plant: &Plant, request: &FitRequest) -> Chosen {
        let reference = Some(&self.chosen.built.samples);
        Chosen::new(self.chosen.method, plant, request, &self.material, reference)
    }
}

/// Compares models by their predictions of segments that were not fitted.
pub(super) fn compare(whole: &Whole<'_>, progress: &dyn Progress) -> Result<Vec<Candidate>, Vec<Diagnostic>> {
    let specs = match whole.request.candidates.as_slice() {
        [] => usual_candidates(whole.request),
        list => list.to_vec(),
    };
    let mut out = Vec::new();
    let count = specs.len();
    for (k, spec) in specs.into_iter().enumerate() {
        progress.advance(1, "candidates", k as f64 / count as f64);
        if progress.stop().is_some() {
            // Without all candidates the best one is undefined.
            return Ok(out);
        }
        out.push(judged(spec, whole)?);
    }
    progress.advance(1, "candidates", 1.0);
    choose_simplest(&mut out);
    Ok(out)
}

/// Without friction, without damping, and with each of the extra terms: models that differ.
fn usual_candidates(request: &FitRequest) -> Vec<CandidateSpec> {
    let laws = law_parameters(&request.extras);
    let names = |kinds: &[Kind]| -> Vec<String> {
        let retained = request.unknowns.iter().filter(|one| kinds.contains(&one.keys[0].1)).map(|one| one.name.clone());
        retained.chain(laws.iter().cloned()).collect()
    };
    let all: Vec<String> = request.unknowns.iter().map(|one| one.name.clone()).chain(laws.iter().cloned()).collect();
    let mut extras: Vec<String> = request.declared.iter().map(|extra| extra.term.clone()).collect();
    extras.dedup();
    let spec = |name: String, parameters: Vec<String>, extras: Vec<String>| CandidateSpec { name, parameters, extras };
    let mut specs = vec![
        spec("without Coulomb friction".into(), names(&[Kind::Inertia, Kind::Damping, Kind::Stiffness]), Vec::new()),
        spec("without damping".into(), names(&[Kind::Inertia, Kind::Friction, Kind::Stiffness]), Vec::new()),
        spec("as requested, no extra terms".into(), all.clone(), Vec::new()),
    ];
    specs.extend(extras.iter().map(|extra| spec(format!("with {extra}"), all.clone(), vec![extra.clone()])));
    if extras.len() > 1 {
        specs.push(spec("with all extra terms".into(), all, extras));
    }
    let mut sets = Vec::new();
    specs.retain(|spec| {
        let own = (spec.parameters.clone(), spec.extras.clone());
        let new = !sets.contains(&own);
        sets.push(own);
        new && !spec.parameters.is_empty()
    });
    specs
}

/// The request of a candidate.
fn candidate_request(spec: &CandidateSpec, whole: &Whole<'_>) -> Result<FitRequest, Vec<Diagnostic>> {
    let mut diagnostics = Vec::new();
    let options = IdentifySettings { parameters: spec.parameters.clone(), ..IdentifySettings::default() };
    let mut own = request(whole.document, &whole.plant.model, whole.settings, &options, &mut diagnostics);
    for name in &spec.extras {
        if !own.declared.iter().any(|extra| extra.is(name)) {
            let message = format!("candidate `{}`: the file has no extra term `{name}`", spec.name);
            diagnostics
                .push(Diagnostic::error("name::unknown", message).help("declare it as `[[identification.extra]]`"));
        }
    }
    if !diagnostics.is_empty() {
        return Err(diagnostics);
    }
    let laws = own.extras.into_iter().filter(|extra| matches!(extra.law, Law::Parameter { .. }));
    let laws: Vec<ExtraTerm> = laws.collect();
    own.extras = own.declared.iter().filter(|extra| spec.extras.iter().any(|name| extra.is(name))).cloned().collect();
    own.extras.extend(laws);
    own.split_by_recording(whole.plant, &whole.material);
    own.loss = whole.request.loss;
    own.nonnegative.retain(|name| spec.parameters.contains(name) || spec.extras.contains(name));
    Ok(own)
}

/// A candidate with its error. The windows and their covariances are those of the whole model, so that all predict the same on one scale.
fn judged(spec: CandidateSpec, whole: &Whole<'_>) -> Result<Candidate, Vec<Diagnostic>> {
    let own = candidate_request(&spec, whole)?;
    // Terms that are not among its parameters are removed from the model, not taken from the file.
    let silent: Vec<&UnknownParameter> =
        whole.request.unknowns.iter().filter(|one| !spec.parameters.contains(&one.name)).collect();
    let mut trial = plant_excluding(whole.plant, &silent);
    for name in law_parameters(&whole.request.extras).iter().filter(|name| !spec.parameters.contains(name)) {
        silence_law(&mut trial.reduced.equations, name);
    }
    let chosen = whole.aligned(&trial, &own);
    let samples = chosen.samples();
    let (predicted, folds) = cross_validated(samples, chosen.method, &chosen.fit_options(&own));
    let mut candidate = Candidate {
        name: spec.name,
        parameters: spec.parameters.into_iter().chain(spec.extras).collect(),
        ..Candidate::default()
    };
    match predicted {
        Some(predicted) => candidate.error = Some(fold_errors(samples, &folds, &predicted)),
        None => candidate.failure = "too few samples".into(),
    }
    Ok(candidate)
}

/// Chooses among the candidates within one spread of the best the one with the fewest parameters.
fn choose_simplest(candidates: &mut [Candidate]) {
    let errors = candidates.iter().filter_map(|one| one.error).filter(|error| error.mean.is_finite());
    let Some(best) = errors.min_by(|a, b| a.mean.total_cmp(&b.mean)) else { return };
    let is_close = |one: &&mut Candidate| one.error.is_some_and(|error| error.mean <= best.mean + best.spread);
    if let Some(simplest) = candidates.iter_mut().filter(is_close).min_by_key(|one| one.parameters.len()) {
        simplest.chosen = true;
    }
}

/// Mean squares of predictions' errors in standard deviations of the sensors, fold by fold.
pub(super) fn fold_squares(samples: &Samples, folds: &[usize], predicted: &[f64]) -> Vec<f64> {
    let count = folds.iter().max().map_or(1, |most| most + 1);
    let mut sums = vec![(0.0, 0.0); count];
    for (sample, fold) in folds.iter().enumerate() {
        for row in 0..samples.rows {
            let error = samples.y(sample)[row] - predicted[sample * samples.rows + row];
            let variance = samples.covariance(sample)[row * (samples.rows + 1)];
            sums[*fold].0 += if variance > 0.0 { error * error / variance } else { error * error };
            sums[*fold].1 += 1.0;
        }
    }
    sums.iter().filter(|sum| sum.1 > 0.0).map(|sum| sum.0 / sum.1).collect()
}

/// Root mean square of predictions' errors in standard deviations of the sensors, and its standard error over the folds.
fn fold_errors(samples: &Samples, folds: &[usize], predicted: &[f64]) -> PredictionError {
    let (mean, spread) = mean_and_error(&fold_squares(samples, folds, predicted));
    PredictionError { mean: mean.sqrt(), spread: if mean > 0.0 { spread / (2.0 * mean.sqrt()) } else { 0.0 } }
}

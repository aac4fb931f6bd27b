//! Models compared by cross-validation.

use kardan_rt::functions::powi;

use super::asked::{Asked, CandidateSpec, Method, asked};
use super::extra::{ExtraTerm, Law, law_parameters};
use super::fitting::{Chosen, fit_options, unseen};
use super::laws::silence_law;
use super::plant::{Plant, columns, plant_without};
use super::rows::{Material, rows, settled};
use super::settings::IdentifySettings;
use super::wanted::Wanted;
use crate::assemble::CoefficientKind as Kind;
use crate::diagnostics::Diagnostic;
use crate::identify::{Samples, Where};
use crate::model::{Document, Setting};
use crate::results::{Candidate, PredictionError};
use crate::study::Progress;

/// What is compared: the model of all that is asked for, and the windows that it uses.
pub(super) struct Whole<'a> {
    pub document: &'a Document,
    pub settings: &'a [Setting],
    pub asked: &'a Asked,
    pub plant: &'a Plant,
    pub chosen: &'a Chosen,
}

/// Compares models by what they predict of segments that they have not seen.
pub(super) fn compare(
    whole: &Whole<'_>,
    material: &Material<'_>,
    progress: &dyn Progress,
) -> Result<Vec<Candidate>, Vec<Diagnostic>> {
    let specs = match whole.asked.candidates.as_slice() {
        [] => usual_candidates(whole.asked),
        given => given.to_vec(),
    };
    let mut out = Vec::new();
    let count = specs.len();
    for (k, spec) in specs.into_iter().enumerate() {
        progress.advance(1, "candidates", k as f64 / count as f64);
        if progress.stop().is_some() {
            // Of some of them none is the best.
            return Ok(out);
        }
        out.push(judged(spec, whole, material)?);
    }
    progress.advance(1, "candidates", 1.0);
    choose_simplest(&mut out);
    Ok(out)
}

/// Without friction, without damping, and with each of the extra terms: models that differ.
fn usual_candidates(asked: &Asked) -> Vec<CandidateSpec> {
    let laws = law_parameters(&asked.extras);
    let names = |kinds: &[Kind]| -> Vec<String> {
        let kept = asked.wanted.iter().filter(|one| kinds.contains(&one.keys[0].1)).map(|one| one.name.clone());
        kept.chain(laws.iter().cloned()).collect()
    };
    let all: Vec<String> = asked.wanted.iter().map(|one| one.name.clone()).chain(laws.iter().cloned()).collect();
    let mut extras: Vec<String> = asked.declared.iter().map(|extra| extra.term.clone()).collect();
    extras.dedup();
    let spec = |name: String, parameters: Vec<String>, extras: Vec<String>| CandidateSpec { name, parameters, extras };
    let mut specs = vec![
        spec("without Coulomb friction".into(), names(&[Kind::Inertia, Kind::Damping, Kind::Stiffness]), Vec::new()),
        spec("without damping".into(), names(&[Kind::Inertia, Kind::Friction, Kind::Stiffness]), Vec::new()),
        spec("as asked, no extra terms".into(), all.clone(), Vec::new()),
    ];
    specs.extend(extras.iter().map(|extra| spec(format!("with {extra}"), all.clone(), vec![extra.clone()])));
    if extras.len() > 1 {
        specs.push(spec("with all extra terms".into(), all, extras));
    }
    let mut seen = Vec::new();
    specs.retain(|spec| {
        let own = (spec.parameters.clone(), spec.extras.clone());
        let new = !seen.contains(&own);
        seen.push(own);
        new && !spec.parameters.is_empty()
    });
    specs
}

/// What is asked for by a candidate.
fn asked_by(spec: &CandidateSpec, whole: &Whole<'_>, material: &Material<'_>) -> Result<Asked, Vec<Diagnostic>> {
    let mut mistakes = Vec::new();
    let given = IdentifySettings { parameters: spec.parameters.clone(), ..IdentifySettings::default() };
    let mut own = asked(whole.document, &whole.plant.model, whole.settings, &given, &mut mistakes);
    for name in &spec.extras {
        if !own.declared.iter().any(|extra| extra.is(name)) {
            let message = format!("candidate `{}`: there is no extra term `{name}`", spec.name);
            mistakes.push(Diagnostic::error("name::unknown", message).help("declare it as `[[identification.extra]]`"));
        }
    }
    if !mistakes.is_empty() {
        return Err(mistakes);
    }
    let laws = own.extras.into_iter().filter(|extra| matches!(extra.law, Law::Parameter { .. }));
    let laws: Vec<ExtraTerm> = laws.collect();
    own.extras = own.declared.iter().filter(|extra| spec.extras.iter().any(|name| extra.is(name))).cloned().collect();
    own.extras.extend(laws);
    own.tell_recordings(whole.plant, material);
    own.loss = whole.asked.loss;
    own.nonnegative.retain(|name| spec.parameters.contains(name) || spec.extras.contains(name));
    Ok(own)
}

/// A candidate with its error. The windows and their covariances are those of the whole model, so that all predict the same on one scale.
fn judged(spec: CandidateSpec, whole: &Whole<'_>, material: &Material<'_>) -> Result<Candidate, Vec<Diagnostic>> {
    let (own, method) = (asked_by(&spec, whole, material)?, whole.chosen.method);
    // What is not among its parameters is left out of the model, not taken from the file.
    let silent: Vec<&Wanted> = whole.asked.wanted.iter().filter(|one| !spec.parameters.contains(&one.name)).collect();
    let mut trial = plant_without(whole.plant, &silent);
    for name in law_parameters(&whole.asked.extras).iter().filter(|name| !spec.parameters.contains(name)) {
        silence_law(&mut trial.reduced.equations, name);
    }
    let columns = columns(&trial, &own, method);
    let mut rows = rows(&trial, &own, &columns, material);
    keep_places(&mut rows.samples, &whole.chosen.built.samples);
    let samples = match method {
        Method::Steady => settled(&rows, &own, material.window),
        Method::Dynamic => rows.samples,
    };
    let (predicted, folds) = unseen(&samples, method, &fit_options(&own, &columns, method));
    let mut candidate = Candidate {
        name: spec.name,
        parameters: spec.parameters.into_iter().chain(spec.extras).collect(),
        ..Candidate::default()
    };
    match predicted {
        Some(predicted) => candidate.error = Some(fold_errors(&samples, &folds, &predicted)),
        None => candidate.failure = "too few samples".into(),
    }
    Ok(candidate)
}

/// Chooses of those that are as good as the best, by its spread, the one of the fewest parameters.
fn choose_simplest(candidates: &mut [Candidate]) {
    let errors = candidates.iter().filter_map(|one| one.error).filter(|error| error.mean.is_finite());
    let Some(best) = errors.min_by(|a, b| a.mean.total_cmp(&b.mean)) else { return };
    let within = |one: &&mut Candidate| one.error.is_some_and(|error| error.mean <= best.mean + best.spread);
    if let Some(simplest) = candidates.iter_mut().filter(within).min_by_key(|one| one.parameters.len()) {
        simplest.chosen = true;
    }
}

/// Keeps the samples at the places of others, which are in order, with the covariances of those.
pub(super) fn keep_places(samples: &mut Samples, others: &Samples) {
    let mut kept = Vec::new();
    let mut covariance = Vec::new();
    let mut from = 0;
    for (k, place) in samples.places.iter().enumerate() {
        let key = |one: &Where| (one.log, one.section, one.time);
        while others.places.get(from).is_some_and(|other| key(other) < key(place)) {
            from += 1;
        }
        if others.places.get(from) == Some(place) {
            kept.push(k..k + 1);
            covariance.extend_from_slice(others.covariance(from));
        }
    }
    *samples = samples.averaged(&kept);
    samples.covariance = covariance;
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
    let each = fold_squares(samples, folds, predicted);
    let n = each.len() as f64;
    let mean = each.iter().sum::<f64>() / n;
    let spread = (each.iter().map(|x| powi(x - mean, 2)).sum::<f64>() / (n - 1.0).max(1.0) / n).sqrt();
    PredictionError { mean: mean.sqrt(), spread: if mean > 0.0 { spread / (2.0 * mean.sqrt()) } else { 0.0 } }
}

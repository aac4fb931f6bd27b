//! Models compared by cross-validation.

use super::asked::{Asked, CandidateSpec, Wanted};
use super::plant::{Plant, columns, plant_without};
use super::rows::{Built, Material, rows, settled};
use super::{IdentifySettings, Method, fit_options, folds};
use crate::assemble::CoefficientKind as Kind;
use crate::diagnostics::Diagnostic;
use crate::identify::{Samples, Where, cross_validate};
use crate::model::{Document, Setting};
use crate::results::{Candidate, PredictionError};
use crate::study::Progress;

/// What is compared: the model of all that is asked for, and the windows that it uses.
pub(super) struct Whole<'a> {
    pub document: &'a Document,
    pub settings: &'a [Setting],
    pub asked: &'a Asked,
    pub plant: &'a Plant,
    pub built: &'a Built,
    pub method: Method,
}

/// Compares models by what they predict of segments that they have not seen.
pub(super) fn compare(
    whole: &Whole<'_>,
    material: &Material<'_>,
    progress: &dyn Progress,
) -> Result<Vec<Candidate>, Vec<Diagnostic>> {
    let Whole { document, settings: set, asked, plant, built, method } = *whole;
    let names = |kinds: &[Kind]| -> Vec<String> {
        asked.wanted.iter().filter(|one| kinds.contains(&one.keys[0].1)).map(|one| one.name.clone()).collect()
    };
    let all: Vec<String> = asked.wanted.iter().map(|one| one.name.clone()).collect();
    let mut specs = asked.candidates.clone();
    if specs.is_empty() {
        let spec = |name: &str, parameters: Vec<String>, extras: Vec<String>| CandidateSpec {
            name: name.into(),
            parameters,
            extras,
        };
        specs.push(spec(
            "without Coulomb friction",
            names(&[Kind::Inertia, Kind::Damping, Kind::Stiffness]),
            Vec::new(),
        ));
        specs.push(spec("without damping", names(&[Kind::Inertia, Kind::Friction, Kind::Stiffness]), Vec::new()));
        specs.push(spec("as asked, no extra terms", all.clone(), Vec::new()));
        for extra in &asked.declared {
            specs.push(spec(&format!("with {}", extra.name), all.clone(), vec![extra.name.clone()]));
        }
        if asked.declared.len() > 1 {
            let every = asked.declared.iter().map(|extra| extra.name.clone()).collect();
            specs.push(spec("with all extra terms", all.clone(), every));
        }
        specs.retain(|spec| !spec.parameters.is_empty());
        let mut seen: Vec<(Vec<String>, Vec<String>)> = Vec::new();
        specs.retain(|spec| {
            let own = (spec.parameters.clone(), spec.extras.clone());
            let new = !seen.contains(&own);
            seen.push(own);
            new
        });
    }
    // The windows and their covariances are those of the whole model, so that all predict the same on one scale.
    let mut out = Vec::new();
    let count = specs.len();
    for (k, spec) in specs.into_iter().enumerate() {
        progress.advance(1, "candidates", k as f64 / count as f64);
        if progress.stop().is_some() {
            // Of some of them none is the best.
            return Ok(out);
        }
        let mut mistakes = Vec::new();
        let given = IdentifySettings { parameters: spec.parameters.clone(), ..IdentifySettings::default() };
        let mut own = super::asked::asked(document, &plant.model, set, &given, &mut mistakes);
        for name in &spec.extras {
            if !own.declared.iter().any(|extra| extra.name == *name) {
                mistakes.push(
                    Diagnostic::error(
                        "name::unknown",
                        format!("candidate `{}`: there is no extra term `{name}`", spec.name),
                    )
                    .help("declare it as `[[identification.extra]]`"),
                );
            }
        }
        if !mistakes.is_empty() {
            return Err(mistakes);
        }
        own.extras = own.declared.iter().filter(|extra| spec.extras.contains(&extra.name)).cloned().collect();
        own.loss = asked.loss;
        own.nonnegative.retain(|name| spec.parameters.contains(name) || spec.extras.contains(name));
        // What is not among its parameters is left out of the model, not taken from the file.
        let silent: Vec<&Wanted> = asked.wanted.iter().filter(|one| !spec.parameters.contains(&one.name)).collect();
        let trial = plant_without(plant, &silent);
        let columns = columns(&trial, &own, method);
        let mut rows = rows(&trial, &own, &columns, material);
        keep_places(&mut rows.samples, &built.samples);
        let samples = match method {
            Method::Steady => settled(&rows, &own, material.window),
            Method::Dynamic => rows.samples,
        };
        let chosen: Vec<usize> = (0..samples.len()).collect();
        let folds = folds(&samples, method);
        let predicted = cross_validate(&samples, &chosen, &folds, &fit_options(&own, &columns, method));
        let found = predicted.map(|predicted| fold_errors(&samples, &folds, &predicted));
        let mut candidate = Candidate {
            name: spec.name,
            parameters: spec.parameters.into_iter().chain(spec.extras).collect(),
            ..Candidate::default()
        };
        match found {
            Some((mean, spread)) => candidate.error = Some(PredictionError { mean, spread }),
            None => candidate.failure = "too few samples".into(),
        }
        out.push(candidate);
    }
    progress.advance(1, "candidates", 1.0);
    let errors = out.iter().filter_map(|one| one.error).filter(|error| error.mean.is_finite());
    let best = errors.min_by(|a, b| a.mean.total_cmp(&b.mean));
    if let Some(limit) = best.map(|best| best.mean + best.spread) {
        let within = |one: &Candidate| one.error.is_some_and(|error| error.mean <= limit);
        let simplest = (0..out.len()).filter(|&k| within(&out[k])).min_by_key(|&k| out[k].parameters.len());
        if let Some(simplest) = simplest {
            out[simplest].chosen = true;
        }
    }
    Ok(out)
}

/// Keeps the samples at the places of others, which are in order, with the covariances of those.
fn keep_places(samples: &mut Samples, others: &Samples) {
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

/// Root mean square of predictions' errors in standard deviations of the sensors, and its standard error over the folds.
fn fold_errors(samples: &Samples, folds: &[usize], predicted: &[f64]) -> (f64, f64) {
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
    let each: Vec<f64> = sums.iter().filter(|sum| sum.1 > 0.0).map(|sum| sum.0 / sum.1).collect();
    let n = each.len() as f64;
    let mean = each.iter().sum::<f64>() / n;
    let spread = (each.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0) / n).sqrt();
    (mean.sqrt(), if mean > 0.0 { spread / (2.0 * mean.sqrt()) } else { 0.0 })
}

//! Terms suggested by the residuals: each is tried on segments that were not fitted.

use super::backlashes::Backlash;
use super::channels::{Harmonic, Quantity};
use super::compare::{Whole, fold_squares};
use super::cutting::identifiable_teeth;
use super::extra::{ExtraTerm, Law};
use super::fitted::{Fitted, stiffness};
use super::fitting::{Chosen, cross_validated};
use super::numbers::{mean_and_error, rms};
use super::parameters::is_in_file;
use super::plant::{columns, in_coordinates};
use super::request::FitRequest;
use super::summary::{UNLIKELY, summary, test_name};
use crate::study::Progress;
use kardan_identify::{
    Excitation, Fit, FitOptions, Samples, Shape, TestKind, cross_validate, fit, residual_statistics,
};
use kardan_mechanics::assemble::CoefficientKind as Kind;
use kardan_mechanics::equations::Domain;
use kardan_mechanics::reduce::Kinematics;
use kardan_results::{FileContent, Suggestion, Suggestions, ValidationLogs};

/// Significance level of a term against zero, for all terms of a round together.
const LEVEL: f64 = 0.01;
/// Least fraction of the cross-validated square error that a term must remove.
const WORTH: f64 = 0.01;
/// Standard errors by which the gain must exceed zero: 95 % one-sided by Student's distribution, five folds.
const SURE: f64 = 2.132;
/// Difference of gains below which two terms count as equal.
const SAME: f64 = 1e-9;
/// Initial `min_deflection` of a backlash as a fraction of the largest twist, and its limit.
const CLEAR: f64 = 0.3;
const CLEAREST: f64 = 0.8;
/// `min_deflection` as a multiple of half the identified width, and its least multiple.
const BEYOND: f64 = 1.3;
const JUST_BEYOND: f64 = 1.1;
/// Number of repetitions of this identification.
const CLEARINGS: usize = 8;
/// Fraction of the samples that must contain information about a term.
const MIN_INFORMATIVE: f64 = 0.25;
/// Most accepted terms.
const MOST: usize = 6;
/// Fewest logs for the prediction of each by the others.
const LOGS: usize = 3;
/// Tried periods per revolution.
const ORDERS: [f64; 15] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 18.0, 24.0, 36.0];
/// Numbers in memory up to which all of them are tried; above that only the first few.
const NUMBERS: usize = 40_000_000;
const QUICK_ORDERS: usize = 6;

/// The candidate harmonics of measured angles, besides the measured quantities.
pub(super) fn with_all_harmonics(slots: Vec<Quantity>) -> Vec<Quantity> {
    let mut out = slots;
    let angles: Vec<String> = out
        .iter()
        .filter_map(|slot| if let Quantity::Angle(shaft, Domain::Rotation) = slot { Some(shaft.clone()) } else { None })
        .collect();
    for shaft in angles {
        for (order, sine) in ORDERS.iter().flat_map(|&order| [(order, false), (order, true)]) {
            let slot = Quantity::Harmonic(Harmonic { shaft: shaft.clone(), order, sine });
            if !out.contains(&slot) {
                out.push(slot);
            }
        }
    }
    out
}

/// A candidate term.
struct Pooled {
    extras: Vec<ExtraTerm>,
    /// Its columns among those of all.
    columns: Vec<usize>,
    /// Samples with information about it; empty: all.
    informative: Vec<bool>,
}

impl Pooled {
    fn term(&self) -> &str {
        &self.extras[0].term
    }

    /// Whether a missing term of this kind may explain a failing test.
    fn is_raised_by(&self, test: TestKind) -> bool {
        match self.extras[0].law {
            Law::FrictionAsymmetry => matches!(test, TestKind::Mean(_) | TestKind::Speed(_)),
            Law::Offset => matches!(test, TestKind::Mean(_)),
            Law::DampingAsymmetry | Law::Quadratic | Law::Stribeck { .. } => matches!(test, TestKind::Speed(_)),
            Law::Cogging(_) | Law::Ripple(_) => matches!(test, TestKind::Serial | TestKind::Normal),
            // They depend on all motions and loads.
            Law::Teeth { .. } | Law::Load { .. } | Law::Backlash { .. } => true,
            _ => test == TestKind::Serial,
        }
    }
}

/// All candidate terms: of each friction, each measured torque, each angle, of gears and springs. A loss proportional to a torque is
/// among them only in rows of the balance without that torque: otherwise the torque would explain itself.
fn pool(whole: &Whole<'_>, orders: &[f64]) -> Vec<Vec<ExtraTerm>> {
    let (plant, request) = (whole.plant, whole.request);
    let equations = &plant.reduced.equations;
    let mut out: Vec<Vec<ExtraTerm>> = Vec::new();
    let mut elements: Vec<&str> = equations.frictions.iter().map(|term| term.element.as_str()).collect();
    elements.dedup();
    for &element in &elements {
        let stribeck = Law::Stribeck { shape: Shape::Gaussian, speed: None };
        let over_speed = [Law::FrictionAsymmetry, Law::DampingAsymmetry, Law::Quadratic, stribeck];
        let laws = over_speed.into_iter().chain([Law::Drift, Law::Recordings]);
        out.extend(laws.map(|law| vec![ExtraTerm::new(element, law)]));
        let measured = plant.harmonics.iter().any(|(harmonic, _)| harmonic.shaft == element);
        for (order, ripple) in orders.iter().flat_map(|&order| [(order, false), (order, true)]).filter(|_| measured) {
            out.push(ExtraTerm::harmonics(element, order, ripple).to_vec());
        }
    }
    let inputs = equations.inputs.iter().zip(&plant.torques).filter(|(_, slot)| slot.is_some());
    out.extend(inputs.map(|(input, _)| vec![ExtraTerm::new(&input.element, Law::Offset)]));
    for (friction, input, _) in loads(whole).into_iter().filter(|(.., apart)| *apart) {
        out.push(vec![ExtraTerm::new(friction, Law::Load { torque: input.into() })]);
    }
    out.extend(identifiable_teeth(&plant.balance(&plant.reduced, &whole.chosen.columns.coefficients, request)));
    out.extend(backlashes(whole));
    out.retain(|columns| !request.extras.iter().any(|own| own.term == columns[0].term));
    out
}

/// The elements with friction, each with each measured input, and whether no row of the balance contains both.
fn loads<'a>(whole: &Whole<'a>) -> Vec<(&'a str, &'a str, bool)> {
    let (plant, basis) = (whole.plant, whole.plant.basis());
    let mut out = Vec::new();
    for friction in &plant.reduced.equations.frictions {
        let own = in_coordinates(&friction.row, &basis);
        let inputs = plant.reduced.equations.inputs.iter().zip(&plant.torques).filter(|(_, slot)| slot.is_some());
        for (input, _) in inputs {
            let acts = in_coordinates(&input.row, &basis);
            let apart = acts.iter().zip(&own).all(|(a, b)| *a == 0.0 || *b == 0.0);
            out.push((friction.element.as_str(), input.element.as_str(), apart));
        }
    }
    out
}

/// Untried losses proportional to a torque: the row of their friction contains that torque, which would explain itself.
fn not_tried(whole: &Whole<'_>) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for (friction, input, _) in loads(whole).into_iter().filter(|(.., apart)| !apart) {
        let load = Law::Load { torque: input.into() };
        let is_declared = whole.request.extras.iter().any(|extra| extra.element == friction && extra.law == load);
        let note = format!(
            "a loss of {friction} proportional to the torque of {input} (`kind = \"load\"`), as that torque would explain itself; \
             declare it where the logs drive and brake"
        );
        if !is_declared && !out.contains(&note) {
            out.push(note);
        }
    }
    out
}

/// A number with few digits for the file.
fn round_to_two_digits(x: f64) -> f64 {
    format!("{x:.1e}").parse().unwrap_or(0.0)
}

/// A twist that certainly exceeds the backlash of a spring: more than half the width identified with it. None if that is nearly the
/// largest twist.
fn clear_of(whole: &Whole<'_>, spring: &str, largest: f64) -> Option<f64> {
    let mut clear = round_to_two_digits(CLEAR * largest);
    for _ in 0..CLEARINGS {
        let half = half_width(whole, spring, clear)?;
        if half * JUST_BEYOND < clear {
            return Some(clear);
        }
        clear = round_to_two_digits(BEYOND * half);
        if clear > CLEAREST * largest {
            return None;
        }
    }
    None
}

/// Half the width of the backlash of a spring, identified on windows above a twist.
fn half_width(whole: &Whole<'_>, spring: &str, clear: f64) -> Option<f64> {
    let mut own = whole.request.clone();
    own.extras.push(ExtraTerm::new(spring, Law::Backlash { clear }));
    let chosen = Chosen::new(whole.chosen.method, whole.plant, &own, &whole.material, None);
    let samples = chosen.samples();
    let all: Vec<usize> = (0..samples.len()).collect();
    let found = fit(samples, &all, &chosen.fit_options(&own))?;
    let (_, stiffness) = stiffness(whole.plant, &chosen.columns, &found, spring);
    Some(found.values[samples.columns - 1] / stiffness).filter(|half| half.is_finite())
}

/// A backlash of each spring, with `min_deflection` a fraction of its largest twist.
fn backlashes(whole: &Whole<'_>) -> Vec<Vec<ExtraTerm>> {
    let (reduced, samples) = (&whole.plant.reduced, &whole.chosen.built.samples);
    let mut kinematics = Kinematics::new(reduced);
    let damper = |element: &str| {
        let own = whole.document.elements.get(element);
        own.is_some_and(|one| one.kind.keyword == "spring_damper")
    };
    let mut out = Vec::new();
    for spring in reduced.equations.springs.iter().filter(|spring| damper(&spring.element)) {
        let (row, rest) = (spring.row_f64(), spring.value.rest.to_f64());
        let mut largest = 0.0_f64;
        for k in 0..samples.len() {
            kinematics.update(samples.motion(k, 0), samples.motion(k, 1));
            largest =
                largest.max((row.iter().map(|(shaft, a)| a * kinematics.angles[*shaft]).sum::<f64>() - rest).abs());
        }
        let own = |extra: &ExtraTerm| extra.element == spring.element && matches!(extra.law, Law::Backlash { .. });
        let is_sought = whole.request.extras.iter().any(own);
        if is_sought || !(largest > 0.0) {
            continue;
        }
        if let Some(clear) = clear_of(whole, &spring.element, largest) {
            out.push(vec![ExtraTerm::new(&spring.element, Law::Backlash { clear })]);
        }
    }
    out
}

/// The samples with the columns of all terms, and the owner of each column.
struct Search<'a> {
    whole: &'a Whole<'a>,
    /// The fit options of the current model.
    options: &'a FitOptions,
    samples: Samples,
    pool: Vec<Pooled>,
    /// Columns of the current model.
    base: usize,
    /// Of the harmonics in the pool.
    orders: Vec<f64>,
}

/// A model with some of the terms, fitted.
struct Tried {
    samples: Samples,
    options: FitOptions,
    fit: Fit,
}

impl Tried {
    /// Whether the whole interval of a value is negative.
    fn is_negative(&self, column: usize, confidence: f64) -> bool {
        let fit = &self.fit;
        fit.values[column] + fit.quantile(column, confidence) * fit.standard_errors[column] < 0.0
    }
}

/// Cross-validated predictions.
struct Validated {
    predicted: Vec<f64>,
    /// Mean square error of each fold.
    squares: Vec<f64>,
}

impl Validated {
    fn mean(&self) -> f64 {
        self.squares.iter().sum::<f64>() / self.squares.len().max(1) as f64
    }

    /// The fraction of the mean square error that another model removes, and its standard error over the folds.
    fn gain(&self, other: &Self) -> (f64, f64) {
        let differences: Vec<f64> = self.squares.iter().zip(&other.squares).map(|(a, b)| a - b).collect();
        let (mean, error) = mean_and_error(&differences);
        (mean / self.mean(), error / self.mean())
    }
}

impl<'a> Search<'a> {
    fn new(whole: &'a Whole<'a>, options: &'a FitOptions) -> Self {
        let chosen = whole.chosen;
        let (mut orders, mut terms) = (&ORDERS[..], pool(whole, &ORDERS));
        let columns_of_all: usize = terms.iter().map(Vec::len).sum();
        if columns_of_all * chosen.built.samples.len() * chosen.samples().rows > NUMBERS {
            orders = &ORDERS[..QUICK_ORDERS];
            let beyond = |extra: &ExtraTerm| extra.harmonic().is_some_and(|own| !orders.contains(&own.order));
            terms.retain(|columns| !beyond(&columns[0]));
        }
        let (mut own, base) = (FitRequest { lenient: true, ..whole.request.clone() }, chosen.samples().columns);
        let mut pooled = Vec::new();
        for extras in terms {
            let mut single = FitRequest { extras, ..whole.request.clone() };
            single.split_by_recording(whole.plant, &whole.material);
            if !single.extras.is_empty() {
                let first = base + own.extras.len() - whole.request.extras.len();
                let columns = (first..first + single.extras.len()).collect();
                own.extras.extend(single.extras.iter().cloned());
                pooled.push(Pooled { extras: single.extras, columns, informative: Vec::new() });
            }
        }
        let mut samples = whole.aligned(whole.plant, &own).into_samples();
        let (size, p) = (samples.rows * samples.columns, samples.columns);
        for one in &mut pooled {
            let is_informative =
                |x: &[f64]| x.chunks_exact(p).all(|row| one.columns.iter().all(|&k| row[k].is_finite()));
            let informative: Vec<bool> = samples.x.chunks_exact(size).map(is_informative).collect();
            if informative.contains(&false) {
                one.informative = informative;
            }
        }
        let enough = |one: &Pooled| {
            let count = one.informative.iter().filter(|informative| **informative).count();
            one.informative.is_empty() || count as f64 > MIN_INFORMATIVE * one.informative.len() as f64
        };
        pooled.retain(enough);
        samples.x.iter_mut().filter(|x| x.is_nan()).for_each(|x| *x = 0.0);
        let harmonic = |order: &f64| {
            pooled.iter().any(|one: &Pooled| one.extras[0].harmonic().is_some_and(|own| own.order == *order))
        };
        let orders = orders.iter().copied().filter(harmonic).collect();
        Self { whole, options, samples, pool: pooled, base, orders }
    }

    /// The model with some of the terms, on the samples with information about these or others.
    fn tried(&self, terms: &[usize], informative: &[usize]) -> Option<Tried> {
        let added: Vec<usize> = terms.iter().flat_map(|&k| self.pool[k].columns.iter().copied()).collect();
        let extras = self.whole.request.extras.len() + added.len();
        let columns: Vec<usize> = (0..self.base).chain(added).collect();
        let mut samples = self.samples.of_columns(&columns, extras);
        let masks: Vec<&[bool]> =
            informative.iter().map(|&k| self.pool[k].informative.as_slice()).filter(|mask| !mask.is_empty()).collect();
        if !masks.is_empty() {
            let retained = (0..samples.len()).filter(|&k| masks.iter().all(|mask| mask[k]));
            samples = samples.averaged(&retained.map(|k| k..k + 1).collect::<Vec<_>>());
        }
        let mut options = self.options.clone();
        options.shapes.extend(terms.iter().flat_map(|&k| &self.pool[k].extras).map(ExtraTerm::shape));
        let all: Vec<usize> = (0..samples.len()).collect();
        let fit = fit(&samples, &all, &options)?;
        Some(Tried { samples, options, fit })
    }

    fn validated(&self, tried: &Tried) -> Option<Validated> {
        let (predicted, folds) = cross_validated(&tried.samples, self.whole.chosen.method, &tried.options);
        let predicted = predicted?;
        let squares = fold_squares(&tried.samples, &folds, &predicted);
        Some(Validated { predicted, squares })
    }

    /// Why a term is impossible: with it a parameter becomes negative that is not negative without it; a loss or a width would be
    /// negative; or half the width of a backlash, identified with all terms, is not below the twist that should exceed it.
    fn refusal(&self, k: usize, now: &Tried, tried: &Tried) -> Option<String> {
        let (columns, confidence) = (&self.whole.chosen.columns, self.whole.request.confidence);
        let mut coefficients = columns.identifiable.iter().enumerate();
        let parameter = coefficients.find_map(|(column, (number, with))| {
            let one = &columns.coefficients[*number];
            let bounded = with.is_empty() && one.kind != Kind::Damping;
            (bounded && tried.is_negative(column, confidence) && !now.is_negative(column, confidence))
                .then_some(&one.name)
        });
        let (extras, end) = (&self.pool[k].extras, tried.samples.columns);
        let is_loss = matches!(extras[0].law, Law::Teeth { .. } | Law::Load { .. } | Law::Backlash { .. });
        let mut own = extras.iter().enumerate().filter(|_| is_loss);
        let loss = own.find(|(number, _)| tried.is_negative(end - extras.len() + number, confidence));
        if let Some(name) = parameter.or(loss.map(|(_, extra)| &extra.name)) {
            return Some(format!("with it {name} would be negative, which is impossible"));
        }
        let Law::Backlash { clear } = extras[0].law else { return None };
        let (_, stiffness) = stiffness(self.whole.plant, columns, &tried.fit, &extras[0].element);
        let is_clear = tried.fit.values[end - 1] / stiffness < clear;
        (!is_clear)
            .then(|| "half the identified width is not less than the twist that was assumed to mean contact".into())
    }

    /// Tests that reject a model.
    fn failing(tried: &Tried) -> Vec<TestKind> {
        let tests = residual_statistics(&tried.samples, &tried.fit).into_iter();
        tests.filter(|test| test.probability < UNLIKELY).map(|test| test.what).collect()
    }

    /// Tries one term beside the accepted ones: its suggestion, and its gain, if it helps.
    fn attempt(
        &self,
        k: usize,
        test: TestKind,
        level: f64,
        (now, before): (&Tried, &Validated),
        accepted: &[usize],
    ) -> (Suggestion, Option<f64>) {
        let with: Vec<usize> = accepted.iter().chain([&k]).copied().collect();
        let (tried, count) = (self.tried(&with, &with), self.pool[k].columns.len());
        let end = tried.as_ref().map_or(0, |tried| tried.samples.columns);
        let own: Vec<usize> = (end.saturating_sub(count)..end).collect();
        let probability = tried.as_ref().and_then(|tried| tried.fit.joint_tail(&own));
        let informative = tried.as_ref().filter(|_| probability.is_some_and(|p| p < level));
        let refusal = informative.and_then(|tried| self.refusal(k, now, tried));
        let gain = informative.and_then(|tried| {
            if self.pool[k].informative.is_empty() {
                return Some(before.gain(&self.validated(tried)?));
            }
            let same = self.validated(&self.tried(accepted, &with)?)?;
            Some(same.gain(&self.validated(tried)?))
        });
        let helps = refusal.is_none() && gain.is_some_and(|(gain, error)| gain > WORTH && gain > SURE * error);
        let verdict = match (probability, refusal, helps) {
            (None, ..) => "in these logs it always occurs together with terms of the model".into(),
            (Some(p), ..) if p >= level => "not distinguishable from zero".into(),
            (_, Some(why), _) => why,
            (.., false) => "does not predict unused data better".into(),
            _ => String::new(),
        };
        let suggestion = Suggestion {
            round: accepted.len() + 1,
            term: self.pool[k].term().into(),
            parameters: count,
            raised_by: test_name(test, &self.row_names(), &self.whole.plant.speed_names()),
            probability,
            gain: gain.map(|(gain, _)| gain),
            gain_spread: gain.map(|(_, error)| error),
            selected: false,
            verdict,
        };
        (suggestion, gain.map(|(gain, _)| gain).filter(|_| helps))
    }

    /// Tries all terms that failing tests suggest; returns the best improvement, if any.
    fn round(&self, now: &Tried, accepted: &[usize], out: &mut Suggestions, progress: &dyn Progress) -> Option<usize> {
        let failing = Self::failing(now);
        let before = self.validated(now)?;
        let trials: Vec<(usize, TestKind)> = (0..self.pool.len())
            .filter(|k| !accepted.contains(k))
            .filter_map(|k| Some((k, *failing.iter().find(|&&test| self.pool[k].is_raised_by(test))?)))
            .collect();
        let level = LEVEL / trials.len().max(1) as f64;
        // Position in the list, number of the term, gain.
        let mut better: Vec<(usize, usize, f64)> = Vec::new();
        out.insignificant_harmonics = 0;
        for (number, &(k, test)) in trials.iter().enumerate() {
            progress.advance(1, "suggestions", number as f64 / trials.len() as f64);
            let (suggestion, gain) = self.attempt(k, test, level, (now, &before), accepted);
            if self.pool[k].extras[0].harmonic().is_some() && suggestion.gain.is_none() {
                out.insignificant_harmonics += 1;
                continue;
            }
            better.extend(gain.map(|gain| (out.tested_terms.len(), k, gain)));
            out.tested_terms.push(suggestion);
        }
        let each = |one: &(usize, usize, f64)| one.2 / self.pool[one.1].columns.len() as f64;
        // The first of equal ones.
        let best = better.iter().copied().max_by(|a, b| each(a).total_cmp(&each(b)).then(b.0.cmp(&a.0)))?;
        let name = self.pool[best.1].term();
        for (place, _, gain) in better {
            let one = &mut out.tested_terms[place];
            one.selected = place == best.0;
            one.verdict = match () {
                () if one.selected => "take it".into(),
                () if (gain - best.2).abs() < SAME => {
                    format!("the same torques as {name} in these logs: the logs do not distinguish the two")
                }
                () => format!("helps, for each parameter less than {name}"),
            };
        }
        Some(best.1)
    }

    /// How a model file declares a term.
    fn file_entry(&self, extra: &ExtraTerm) -> String {
        extra.file_entry(self.whole.plant.reduced.equations.domain_of_element(&extra.element))
    }

    fn row_names(&self) -> Vec<String> {
        self.whole.plant.row_names(self.samples.rows)
    }

    /// Each log predicted by the others, with the current model and with terms; without terms of single logs, which are unknown in
    /// a log that was not fitted.
    fn validation_logs(&self, plain: &Tried, terms: &[usize]) -> Vec<ValidationLogs> {
        let logs = self.whole.material.recorded.len();
        if logs < LOGS || self.whole.chosen.method == Excitation::Steady {
            return Vec::new();
        }
        let of_logs = |extra: &ExtraTerm| matches!(extra.law, Law::Recording { .. });
        if self.whole.request.extras.iter().any(of_logs) {
            return Vec::new();
        }
        let lasting: Vec<usize> = terms.iter().copied().filter(|&k| !of_logs(&self.pool[k].extras[0])).collect();
        let folds: Vec<usize> = plain.samples.places.iter().map(|place| place.log).collect();
        let errors = |tried: &Tried| -> Option<Vec<f64>> {
            let (samples, r) = (&tried.samples, tried.samples.rows);
            let predicted = cross_validate(samples, &folds, &tried.options)?;
            let error = |k: usize, row: usize| samples.y(k)[row] - predicted[k * r + row];
            Some((0..r).map(|row| rms(folds.len(), |k| error(k, row))).collect())
        };
        let (Some(before), Some(after)) = (errors(plain), self.tried(&lasting, &lasting).as_ref().and_then(errors))
        else {
            return Vec::new();
        };
        let names = self.row_names();
        (0..names.len()).map(|k| ValidationLogs { row: names[k].clone(), before: before[k], after: after[k] }).collect()
    }

    /// The text for the model file.
    fn text(&self, terms: &[usize]) -> String {
        let request = self.whole.request;
        let added = terms.iter().map(|&k| &self.pool[k].extras[0]);
        let mut out = String::new();
        if self.whole.document.identification.values.contains_key("parameters") && !terms.is_empty() {
            let mut names: Vec<&str> = request.unknowns.iter().map(|one| one.name.as_str()).collect();
            names.extend(request.extras.iter().chain(added.clone()).map(|extra| extra.term.as_str()));
            names.dedup();
            let quoted: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
            out = format!("[identification]\nparameters = [{}]\n", quoted.join(", "));
        }
        added.fold(out, |text, extra| {
            let between = if text.is_empty() { "" } else { "\n" };
            text + between + &self.file_entry(extra)
        })
    }
}

/// Extends the model by the terms that the residuals suggest, one after the other, as long as they improve the prediction of data that were
/// not fitted.
pub(super) fn suggest(
    whole: &Whole<'_>,
    options: &FitOptions,
    backlashes: &[Backlash],
    progress: &dyn Progress,
) -> Option<Suggestions> {
    let search = Search::new(whole, options);
    let mut out = Suggestions {
        harmonic_orders: search.orders.clone(),
        untested_terms: not_tried(whole),
        ..Suggestions::default()
    };
    let mut terms: Vec<usize> = Vec::new();
    while terms.len() < MOST && progress.stop().is_none() {
        let now = search.tried(&terms, &terms)?;
        let Some(next) = search.round(&now, &terms, &mut out, progress) else { break };
        terms.push(next);
    }
    progress.advance(1, "suggestions", 1.0);
    let last = search.tried(&terms, &terms)?;
    let validated = search.validated(&last);
    let mut own = whole.request.clone();
    own.extras.extend(terms.iter().flat_map(|&k| search.pool[k].extras.iter().cloned()));
    let own_columns = columns(whole.plant, &own, whole.chosen.method);
    let found = summary(&Fitted {
        whole,
        plant: whole.plant,
        request: &own,
        columns: &own_columns,
        samples: &last.samples,
        fit: &last.fit,
        cross_validated: validated.as_ref().map(|one| one.predicted.as_slice()),
        backlashes,
    });
    out.selected_terms = terms.iter().map(|&k| search.pool[k].term().to_string()).collect();
    out.text = search.text(&terms);
    out.log_cross_validation = search.validation_logs(&search.tried(&[], &terms)?, &terms);
    let declared = terms.iter().map(|&k| &search.pool[k].extras[0]).filter(|extra| !is_in_file(extra));
    let entries = declared.map(|extra| (extra.term.clone(), search.file_entry(extra))).collect();
    out.for_file = FileContent { entries, ..found.for_file };
    (out.parameters, out.tests, out.validation, out.scale) =
        (found.parameters, found.tests, found.validation, found.scale);
    Some(out)
}

//! Runs of a sweep as a SIMD ensemble in lanes, if the varied parameters affect only coefficients of the equations.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;

use super::recorded_signals::recorded_signals;
use super::rows::{fill, sampled, seed_of};
use crate::study::requests::varied::Varied;
use crate::study::run::runs::{judged, tolerance};
use crate::study::{Prepared, PreparedVariant, Progress, Project, Settings};
use kardan_math::num::rational_from_f64;
use kardan_math::units::Exact;
use kardan_mechanics::assemble::CoefficientKind;
use kardan_mechanics::reduce::Reduced;
use kardan_model::tables::Measure;
use kardan_results::{Effort, IntegrationMethod, Run, Series, SweepRow};
use kardan_simulate::{Ensemble, LaneRun, Method, Scenario, Setup, Tolerance};

/// Quantiles of the varied parameters for the analysis of their effects: the base, and others to compare.
const BASE: f64 = 0.5;
const PROBE_QUANTILES: [f64; 3] = [0.371, 0.993, 0.007];
/// Fewest runs of a thread.
const LEAST: usize = 16;

type Slot = (CoefficientKind, usize);

/// A variant that runs in lanes.
pub(super) struct Batch<'p> {
    variant: &'p PreparedVariant,
    reduced: Reduced,
    scenario: Scenario,
    varying: Vec<Slot>,
    /// For each coefficient the value on which it depends, and its ratio to it.
    from: Vec<(usize, f64)>,
    tolerance: Tolerance,
    count: Option<usize>,
    /// Whether each sample draws its own sensor noise.
    draws: bool,
    /// Idle lanes.
    ready: Mutex<Vec<Ensemble>>,
}

/// All other dependencies of a run, as text.
fn rest(variant: &PreparedVariant) -> String {
    let mut reduced = variant.reduced.clone();
    for slot in reduced.equations.coefficient_slots() {
        *reduced.equations.coefficient_mut(slot) = Exact::one();
    }
    let PreparedVariant { scenario, computed, start_notes, .. } = variant;
    format!("{reduced:?} {scenario:?} {computed:?} {start_notes:?}")
}

/// Whether two variants have the same laws: each sample rewrites its program.
fn has_same_laws(one: &PreparedVariant, two: &PreparedVariant) -> bool {
    let mut pairs = one.implemented.iter().zip(&two.implemented);
    one.implemented.len() == two.implemented.len() && pairs.all(|(one, two)| Arc::ptr_eq(one, two))
}

/// For each coefficient the value on which it depends, and its ratio to it.
fn followed(
    all: &[Slot],
    spread: &[Varied],
    (base, first): (&[f64], &PreparedVariant),
    prepared_with: &dyn Fn(&[f64]) -> Option<PreparedVariant>,
) -> Result<Vec<Option<(usize, f64)>>, String> {
    let expected = rest(first);
    let mut from: Vec<Option<(usize, f64)>> = vec![None; all.len()];
    for (k, varied) in spread.iter().enumerate() {
        let name = &varied.name;
        let more = || {
            format!(
                "`{name}` affects more than inertias, dampings, stiffnesses and frictions, or these not proportionally"
            )
        };
        let mut values = base.to_vec();
        // A list of two values may contain equal ones.
        let probe_values = PROBE_QUANTILES.map(|part| varied.distribution.quantile(part));
        values[k] = probe_values
            .into_iter()
            .find(|value| *value != base[k])
            .ok_or_else(|| format!("`{name}` has only one value"))?;
        let changed = prepared_with(&values).ok_or_else(|| format!("laws or programs depend on `{name}`"))?;
        if changed.reduced.equations.coefficient_slots() != *all || rest(&changed) != expected {
            return Err(more());
        }
        for (slot, from) in all.iter().zip(&mut from) {
            let [before, now] = [first, &changed].map(|one| one.reduced.equations.coefficient(*slot));
            if before == now {
                continue;
            }
            let part = |coefficient: &Exact, value: f64| {
                coefficient.div(&Exact::new(rational_from_f64(value).unwrap_or_default(), 0))
            };
            let parts = [part(before, base[k]), part(now, values[k])];
            match parts {
                [Some(part), Some(same)] if from.is_none() && part == same => *from = Some((k, part.to_f64())),
                _ => return Err(more()),
            }
        }
    }
    Ok(from)
}

impl<'p> Batch<'p> {
    /// A variant whose runs differ only in coefficients, each of them a multiple of one of the values.
    ///
    /// # Errors
    /// The further difference that prevents lanes; empty if the user requested a method.
    pub fn new(
        project: &Project,
        variant: &'p PreparedVariant,
        spread: &[Varied],
        (settings, progress): (&Settings, &dyn Progress),
        (count, draws): (Option<usize>, bool),
    ) -> Result<Self, String> {
        if settings.method != Method::Automatic {
            return Err(String::new());
        }
        let prepared = project.prepared();
        // Lanes report no events.
        if prepared.measured().any(|one| matches!(one.measure, Measure::Events | Measure::TimeAtLimit)) {
            return Err("figures or requirements count events".into());
        }
        let base: Vec<f64> = spread.iter().map(|varied| varied.distribution.quantile(BASE)).collect();
        let prepared_with = |values: &[f64]| {
            let found = sampled(project.document(), variant, spread, (values, None)).ok();
            found.filter(|found| has_same_laws(found, variant))
        };
        let first = prepared_with(&base).ok_or("laws or programs depend on the varied parameters")?;
        let all = first.reduced.equations.coefficient_slots();
        let from = followed(&all, spread, (&base, &first), &prepared_with)?;
        let varying: Vec<(Slot, (usize, f64))> =
            all.into_iter().zip(from).filter_map(|(slot, from)| Some((slot, from?))).collect();
        let mut reduced = first.reduced.clone();
        for (k, (slot, from)) in varying.iter().enumerate() {
            let stribeck = |term: usize| reduced.equations.frictions[term].value.stribeck.is_some();
            let (kind, term) = *slot;
            let name = &spread[from.0].name;
            if base[from.0] * from.1 <= 0.0 {
                return Err(format!("a coefficient that depends on `{name}` is not positive"));
            }
            if kind == CoefficientKind::Friction && stribeck(term) {
                return Err(format!("`{name}` is a friction that depends on the speed"));
            }
            let name = format!("given.{k}");
            let coefficient = reduced.equations.coefficient_mut(*slot);
            *coefficient = coefficient.clone().named(name.clone());
            reduced.equations.run_parameters.push(name);
        }
        let scenario = Scenario { recorded: Some(recorded_signals(prepared)), ..first.scenario.clone() };
        let tolerance = tolerance(prepared, settings, progress);
        let (varying, from) = varying.into_iter().unzip();
        let out =
            Self { variant, reduced, scenario, varying, from, tolerance, count, draws, ready: Mutex::new(Vec::new()) };
        let first = out.ensemble()?;
        out.put_back(first);
        Ok(out)
    }

    fn ensemble(&self) -> Result<Ensemble, &'static str> {
        let waiting = self.ready.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let setup = Setup { reduced: &self.reduced, laws: &self.variant.implemented, scenario: &self.scenario };
        waiting.map_or_else(|| Ensemble::new(setup, &self.varying, self.tolerance, self.count), Ok)
    }

    fn put_back(&self, ensemble: Ensemble) {
        self.ready.lock().unwrap_or_else(PoisonError::into_inner).push(ensemble);
    }

    /// The inputs of a single run, if all coefficients have the required signs.
    fn run_of(&self, row: &SweepRow) -> Option<LaneRun> {
        let values: Vec<f64> = self.from.iter().map(|(from, part)| row.values[*from] * part).collect();
        let own = self.scenario.seed;
        let seed = if self.draws { seed_of(own, row.sample) } else { own };
        values.iter().all(|value| *value > 0.0).then_some(LaneRun { values, seed })
    }

    /// Fills rows of this variant; returns for each whether it succeeded.
    pub fn fill(&self, prepared: &Prepared, rows: &mut [&mut SweepRow], done: &(dyn Fn() + Sync)) -> Vec<bool> {
        let chunk = |rows: &mut [&mut SweepRow]| -> Vec<bool> {
            let lane_runs: Vec<(usize, LaneRun)> =
                rows.iter().enumerate().filter_map(|(k, row)| Some((k, self.run_of(row)?))).collect();
            let (places, runs): (Vec<usize>, Vec<LaneRun>) = lane_runs.into_iter().unzip();
            let mut filled = vec![false; rows.len()];
            let run = AssertUnwindSafe(|| {
                let Ok(mut ensemble) = self.ensemble() else { return };
                ensemble.run(&runs, &mut |number, series| {
                    let Some(series) = series else { return };
                    let row = &mut *rows[places[number]];
                    self.record(prepared, row, series);
                    filled[places[number]] = true;
                    done();
                });
                self.put_back(ensemble);
            });
            // After an internal error the reference integrator continues, and the lanes are dropped.
            let _ = catch_unwind(run);
            filled
        };
        let chunk_size = rows.len().div_ceil(rayon::current_num_threads()).max(LEAST);
        rows.par_chunks_mut(chunk_size).flat_map_iter(chunk).collect()
    }

    /// The result of a run.
    fn record(&self, prepared: &Prepared, row: &mut SweepRow, series: &mut Series) {
        let own = series.signals.len();
        let effort = Effort { method: IntegrationMethod::Taylor, ..Effort::default() };
        let run = Run { series: std::mem::take(series), effort, ..Run::default() };
        let run = judged(self.variant, prepared, run);
        fill(row, prepared, &run);
        *series = run.series;
        series.signals.truncate(own);
    }
}

//! `kardan sweep`: many runs with values drawn from distributions, each a function of the seed and its number alone.

mod again;
mod answers;
mod points;
mod region;
mod spec;
mod tree;
mod wanted;

use std::collections::BTreeSet;
use std::ops::Range;

use rayon::prelude::*;

use answers::{Answers, CONFIDENCE};
use points::{Axis, Filling, axes, combinations};
use region::failing_rules;
pub use spec::SweepSpec;
pub(in crate::study) use spec::sweep_spec;
use spec::{MOST_SAMPLES, Varied};

use super::prepare::{is_error, prepare_sample};
use super::progress::Counted;
use super::run::{check_variants, run_variant};
use super::{Prepared, PreparedVariant, Progress, Project, Settings};
use crate::diagnostics::{Diagnostic, quoted};
use crate::model::{Setting, VariantSettings};
use crate::num::{Random, rational_from_f64};
use crate::results::{
    Outcome, Run, Sweep, SweepHead, SweepRow, SweptFigure, SweptParameter, SweptRequirement, SweptValues,
};
use crate::units::{Exact, written_quantity};

/// Samples of a block, at least.
const LEAST_BLOCK: u64 = 64;
/// Blocks of a sweep, at most.
const MOST_BLOCKS: u64 = 1000;

/// Takes the rows of a block by its number, or says why it cannot.
pub type TakeRows<'t> = dyn FnMut(u64, &[SweepRow]) -> Result<(), String> + 't;

/// How a model is swept.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SweepSettings {
    /// How many samples, in place of those of the file.
    pub samples: Option<u64>,
    /// The seed, in place of that of the file.
    pub seed: Option<u64>,
    /// Names of the variants, in place of those of the file; empty: those.
    pub variants: Vec<String>,
    /// How runs are integrated; variants and faults of it are not read.
    pub run: Settings,
}

/// What a sweep consists of, before a run.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPlan {
    /// What its rows are of.
    pub head: SweepHead,
    /// The part of the blocks that is run; `None`: all of them.
    pub shard: Option<Shard>,
    axes: Vec<Axis>,
    spread: Vec<Varied>,
    points: &'static str,
}

/// One of as many parts of a sweep: a process of its own runs it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Its number, from 1.
    pub number: u64,
    /// How many there are.
    pub of: u64,
}

impl SweepPlan {
    /// The values of a sample, SI: they follow from the seed and its number alone.
    pub fn values(&self, sample: u64) -> Vec<f64> {
        let axes = self.axes.iter().zip(&self.spread);
        axes.map(|(axis, varied)| varied.distribution.quantile(axis.at(sample))).collect()
    }

    /// Samples of a block, which is written as a whole: at most a thousand blocks, but for small ones.
    pub fn block(&self) -> u64 {
        self.head.samples.div_ceil(MOST_BLOCKS).max(LEAST_BLOCK)
    }

    /// How many blocks there are.
    pub fn blocks(&self) -> u64 {
        self.head.samples.div_ceil(self.block())
    }

    /// The blocks that are run: all of them, or those of the shard.
    pub fn own_blocks(&self) -> Range<u64> {
        let end = |number: u64, of: u64| (u128::from(self.blocks()) * u128::from(number) / u128::from(of)) as u64;
        self.shard.map_or(0..self.blocks(), |Shard { number, of }| end(number - 1, of)..end(number, of))
    }

    /// The samples of blocks.
    pub fn samples_of(&self, blocks: Range<u64>) -> Range<u64> {
        let at = |block: u64| block.saturating_mul(self.block()).min(self.head.samples);
        at(blocks.start)..at(blocks.end)
    }
}

impl Project {
    /// What a sweep of this model consists of.
    ///
    /// # Errors
    /// All mistakes, if there are any; nothing that varies; too many samples.
    pub fn sweep_plan(&self, settings: &SweepSettings) -> Result<SweepPlan, Vec<Diagnostic>> {
        let (prepared, mut diagnostics) = (self.prepared(), self.mistakes().to_vec());
        check_variants(prepared, &settings.variants, &mut diagnostics);
        if diagnostics.iter().any(is_error) {
            return Err(diagnostics);
        }
        let refused = |code, message: &str, help: &str| Err(vec![Diagnostic::error(code, message).help(help)]);
        let Some(spec) = prepared.sweep.as_ref().filter(|spec| !spec.varied.is_empty()) else {
            let help = "write tolerances behind values, \"100 N m/rad ± 10 %\", or a table `[sweep]`; `kardan elements sweep` shows one";
            return refused("sweep::nothing", "nothing in the file varies", help);
        };
        let (mut samples, seed) = (settings.samples.unwrap_or(spec.samples), settings.seed.unwrap_or(spec.seed));
        if let Filling::Levels(levels) = spec.filling {
            let all = combinations(levels, spec.varied.iter().map(|varied| &varied.distribution));
            if settings.samples.is_some_and(|asked| asked != all) {
                let message = format!("{samples} samples: all combinations of the grid are {all}");
                return refused("sweep::samples", &message, "leave the number out, or take other `points`");
            }
            samples = all;
        }
        if samples == 0 || samples > MOST_SAMPLES {
            let message = format!("{samples} samples: there can be 1 to {MOST_SAMPLES}");
            return refused("sweep::samples", &message, "ask for another number of samples");
        }
        let asked = if settings.variants.is_empty() { &spec.variants } else { &settings.variants };
        let variants = prepared.all().map(|variant| variant.name.clone());
        let variants: Vec<String> = variants.filter(|name| asked.is_empty() || asked.contains(name)).collect();
        let spread = spec.varied.iter().map(|varied| (varied.name.as_str(), &varied.distribution));
        let told = |varied: &Varied| SweptParameter {
            name: varied.name.clone(),
            unit: varied.dimension.si(),
            distribution: varied.text.clone(),
        };
        Ok(SweepPlan {
            head: SweepHead {
                identity: self.identity((samples, seed), &variants, settings),
                samples,
                seed,
                variants,
                varied: spec.varied.iter().map(told).collect(),
                requirements: prepared.requirements.iter().map(|one| (one.in_words(), one.unit.clone())).collect(),
                figures: prepared.figures.iter().map(|figure| (figure.name.clone(), figure.unit.clone())).collect(),
            },
            shard: None,
            axes: axes(spec.filling, (seed, samples), spread),
            spread: spec.varied.clone(),
            points: spec.filling.word(),
        })
    }

    /// What the rows of a sweep follow from: this program, the model with its files, the samples, the variants, how runs are integrated.
    fn identity(&self, (samples, seed): (u64, u64), variants: &[String], settings: &SweepSettings) -> String {
        let runs = format!("{samples} samples of {}", quoted(variants.iter().map(String::as_str)));
        format!("{}, {runs}, seed {seed}, {}", self.origin(), integrated(&settings.run))
    }

    /// This program and the model with its files.
    fn origin(&self) -> String {
        let files = self.document().files.iter();
        let bytes = files.flat_map(|(name, bytes)| [name.as_bytes(), bytes.as_deref().unwrap_or_default()]);
        let sum = bytes.fold(Random::fnv(Random::FNV, self.to_toml().as_bytes()), Random::fnv);
        format!("kardan {}, model {sum:016x}", env!("CARGO_PKG_VERSION"))
    }

    /// Runs every sample of a plan in every variant of it, block by block; `write` takes the rows of each block as soon as they are there, and
    /// ends the sweep where it fails. Blocks of `known` rows are not run again.
    ///
    /// ```
    /// use kardan::project::Project;
    /// use kardan::study::{Silent, SweepSettings};
    ///
    /// let project = Project::open(
    ///     "[shaft.a]\ninertia = \"2 kg m^2 ± 10 %\"\n[motor.m]\nshaft = \"a\"\n[scenario]\n[[scenario.event]]\n\
    ///      signal = \"m.tau\"\nat = \"0 s\"\nto = \"4 N m\"\n[[requirement]]\nsignal = \"a.w\"\nmeasure = \"final\"\nabove = \"2 rad/s\"\n",
    /// );
    /// let plan = project.sweep_plan(&SweepSettings { samples: Some(100), ..SweepSettings::default() }).unwrap();
    /// let found = project.sweep(&plan, &Default::default(), Vec::new(), &Silent, &mut |_, _| Ok(())).unwrap();
    /// // The speed 4 N m · 1 s / J is above 2 rad/s where J is below 2 kg m²: in half of the samples, one in each of 100 strips.
    /// assert_eq!(found.requirements[0].passed, 50);
    /// ```
    ///
    /// # Errors
    /// All mistakes of the file, if there are any.
    pub fn sweep(
        &self,
        plan: &SweepPlan,
        settings: &Settings,
        known: Vec<SweepRow>,
        progress: &dyn Progress,
        write: &mut TakeRows<'_>,
    ) -> Result<Sweep, Vec<Diagnostic>> {
        let (prepared, diagnostics) = (self.prepared(), self.mistakes());
        if diagnostics.iter().any(is_error) {
            return Err(diagnostics.to_vec());
        }
        let all_settings = self.document().variant_settings();
        let chosen: Vec<(&PreparedVariant, &VariantSettings)> = plan
            .head
            .variants
            .iter()
            .filter_map(|name| prepared.all().zip(&all_settings).find(|(variant, _)| variant.name == *name))
            .collect();
        let asked = plan.samples_of(plan.own_blocks()).count();
        let all = asked.saturating_mul(chosen.len());
        let heard = Counted::new(progress, known.len(), all);
        let size = plan.block();
        let there: BTreeSet<u64> = known.iter().map(|row| row.sample / size).collect();
        let missing: Vec<u64> = plan.own_blocks().filter(|block| !there.contains(block)).collect();
        let mut rows = known;
        let mut ended = None;
        for block in missing {
            let samples = plan.samples_of(block..block + 1);
            let cases: Vec<(u64, usize)> = samples.flat_map(|k| (0..chosen.len()).map(move |v| (k, v))).collect();
            let case = |(sample, variant): &(u64, usize)| {
                // Runs that were ended are none, nor are those behind them in the block.
                if progress.stop().is_some() {
                    return None;
                }
                let row = self.sample((prepared, settings), plan, (*sample, *variant), chosen[*variant], &heard);
                heard.count(1);
                Some(row)
            };
            let found: Option<Vec<SweepRow>> = cases.par_iter().map(case).collect();
            ended = progress.stop();
            let Some(found) = found.filter(|_| ended.is_none()) else { break };
            if let Err(why) = write(block, &found) {
                ended = Some(why);
                break;
            }
            rows.extend(found);
        }
        let mut out = self.sweep_answers(plan, rows);
        out.warnings.extend(ended.map(|why| format!("{why}: what was not computed by then is missing")));
        Ok(out)
    }

    /// What rows of a plan say together, as many as there are; nothing is run.
    pub fn sweep_answers(&self, plan: &SweepPlan, mut rows: Vec<SweepRow>) -> Sweep {
        rows.sort_by_key(|row| (row.sample, row.variant));
        let mut out = answered(self.prepared(), plan, &rows);
        out.warnings = self.mistakes().iter().map(ToString::to_string).collect();
        out
    }

    /// A run.
    fn sample(
        &self,
        (prepared, settings): (&Prepared, &Settings),
        plan: &SweepPlan,
        (sample, number): (u64, usize),
        (variant, own): (&PreparedVariant, &VariantSettings),
        progress: &dyn Progress,
    ) -> SweepRow {
        let values = plan.values(sample);
        let all = settings_with(own, plan.spread.iter().zip(values.iter().copied()));
        let found = prepare_sample(self.document(), variant, (&all, own.controls.as_deref(), &own.faults));
        let mut row = SweepRow {
            sample,
            variant: number,
            reason: String::new(),
            values,
            measured: vec![f64::NAN; prepared.requirements.len()],
            passed: vec![f64::NAN; prepared.requirements.len()],
            figures: vec![f64::NAN; prepared.figures.len()],
        };
        match found {
            Ok(mut ready) => {
                ready.scenario.recorded = Some(wanted::wanted(prepared));
                fill(&mut row, prepared, &run_variant(number, &ready, (prepared, settings), progress));
            }
            Err(mistakes) => {
                let first = mistakes.iter().find(|mistake| is_error(mistake));
                row.reason = first
                    .map_or_else(|| "it cannot be prepared".into(), |one| format!("{}: {}", one.code, one.message));
                for (k, requirement) in prepared.requirements.iter().enumerate() {
                    if requirement.variants.is_empty() || requirement.variants.contains(&variant.name) {
                        row.passed[k] = 0.0;
                    }
                }
            }
        }
        row
    }
}

/// How runs are integrated, in words.
fn integrated(Settings { method, tolerance, .. }: &Settings) -> String {
    let tolerance = tolerance.map_or(String::new(), |tolerance| format!(", tolerance {tolerance:e}"));
    format!("method {method:?}{tolerance}")
}

/// The settings of a variant with values of what varies in place of its own.
fn settings_with<'v>(own: &VariantSettings, values: impl Iterator<Item = (&'v Varied, f64)>) -> Vec<Setting> {
    let mut all: Vec<Setting> = own.settings.clone();
    for (varied, value) in values {
        // Every value is finite, as its distribution is.
        let value = Exact::new(rational_from_f64(value).unwrap_or_default(), 0);
        all.retain(|setting| setting.name != varied.name);
        all.push(Setting { name: varied.name.clone(), text: written_quantity(&value, varied.dimension), value });
    }
    all
}

/// What a run tells.
fn fill(row: &mut SweepRow, prepared: &Prepared, run: &Run) {
    if let Outcome::Failed { cause, .. } = &run.outcome {
        row.reason.clone_from(cause);
    }
    let own = |names: &[String]| names.is_empty() || names.contains(&run.name);
    let requirements = prepared.requirements.iter().enumerate().filter(|(_, one)| own(&one.variants));
    for ((k, _), found) in requirements.zip(&run.requirements) {
        row.measured[k] = found.measured.unwrap_or(f64::NAN);
        row.passed[k] = if found.passed { 1.0 } else { 0.0 };
    }
    let figures = prepared.figures.iter().enumerate().filter(|(_, one)| own(&one.variants));
    for ((k, _), found) in figures.zip(&run.figures) {
        row.figures[k] = found.value.unwrap_or(f64::NAN);
    }
}

/// What the rows say together.
fn answered(prepared: &Prepared, plan: &SweepPlan, rows: &[SweepRow]) -> Sweep {
    let parameters = plan.head.varied.iter().map(|varied| varied.name.clone()).collect();
    let answers = Answers { rows, parameters, variants: &plan.head.variants };
    let asked = plan.samples_of(plan.own_blocks());
    let mut out = Sweep {
        model: prepared.name.clone(),
        description: prepared.description.clone(),
        samples: plan.head.samples,
        seed: plan.head.seed,
        points: plan.points.into(),
        variants: plan.head.variants.clone(),
        varied: plan.head.varied.clone(),
        rows: rows.len() as u64,
        missing: (asked.end - asked.start) * plan.head.variants.len() as u64 - rows.len() as u64,
        failures: answers.failures(),
        confidence: CONFIDENCE,
        ..Sweep::default()
    };
    let own = |names: &[String]| {
        let own = |name: &&String| names.is_empty() || names.contains(name);
        plan.head.variants.iter().filter(own).cloned().collect::<Vec<_>>()
    };
    for (k, requirement) in prepared.requirements.iter().enumerate() {
        for variant in own(&requirement.variants) {
            let mut one = SweptRequirement {
                text: plan.head.requirements[k].0.clone(),
                unit: requirement.unit.clone(),
                display: requirement.display.clone(),
                passed: 0,
                failed: 0,
                probability: None,
                interval: None,
                measured: SweptValues::default(),
                rules: failing_rules(&answers, (k, &variant), &plan.head.varied),
                variant,
            };
            answers.fill_requirement(k, &mut one);
            if is_grid(plan) {
                (one.probability, one.interval, one.rules) = (None, None, Vec::new());
            }
            out.requirements.push(one);
        }
    }
    for (k, figure) in prepared.figures.iter().enumerate() {
        for variant in own(&figure.variants) {
            let mut one = SweptFigure {
                name: figure.name.clone(),
                text: figure.in_words(),
                variant,
                unit: figure.unit.clone(),
                display: figure.display.clone(),
                values: SweptValues::default(),
            };
            answers.fill_figure(k, &mut one);
            out.figures.push(one);
        }
    }
    out.notes = notes(prepared, plan, &out);
    out
}

/// What is to be known of the answers.
fn notes(prepared: &Prepared, plan: &SweepPlan, found: &Sweep) -> Vec<String> {
    let mut notes: Vec<String> = Vec::new();
    if is_grid(plan) {
        notes.push(
            "The samples are no draw: in how many of them a requirement holds is a count, and no probability.".into(),
        );
    }
    if let Some(Shard { number, of }) = plan.shard {
        let asked = plan.samples_of(plan.own_blocks());
        notes.push(match asked.is_empty() {
            true => format!("Shard {number} of {of}: there are fewer blocks of samples than shards, and it has none."),
            false => format!(
                "Shard {number} of {of}, samples {} to {} of {}: the whole is told by `kardan sweep merge` of all shards.",
                asked.start,
                asked.end - 1,
                plan.head.samples
            ),
        });
    }
    if found.requirements.iter().any(|one| !one.rules.is_empty()) {
        notes.push(region::NOTE.into());
    }
    if prepared.all().any(|variant| !variant.running.is_empty()) {
        notes.push(
            "Laws are those of the values in the file, whatever the sample is; programs and blocks follow its values."
                .into(),
        );
    }
    notes
}

/// Whether the samples are all combinations of some values.
fn is_grid(plan: &SweepPlan) -> bool {
    ["corners", "grid"].contains(&plan.points)
}

//! `kardan sweep`: many runs with values drawn from distributions, each a function of only the seed and its number.

mod again;
mod batch;
mod goal;
mod indices;
mod intervals;
mod laws;
mod plan;
mod points;
mod rare;
mod reasons;
mod recorded_signals;
mod region;
mod row_identity;
mod rows;
mod statistics;
mod stopping_rule;
mod summary;
mod tree;
mod worst;

use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};

use rayon::prelude::*;

use batch::Batch;
pub use goal::SweepGoal;
use goal::target;
pub use plan::{Shard, SweepPlan, SweepSettings};
use points::axes;
use rare::{CHAIN, MOST_LEVELS};
use recorded_signals::recorded_signals;
pub use row_identity::swept_model;
use rows::{blank, difference, fill, refusal, sampled};
use stopping_rule::StoppingRule;
use summary::summarise;

use crate::study::measure::requirement_verdict::Requirement;
use crate::study::measure::selected_variants::selects;
use crate::study::progress::Counted;
use crate::study::read::variant_diagnostics::without_errors;
use crate::study::requests::sample_space::SampleSpace;
use crate::study::requests::sampling_method::SamplingMethod;
use crate::study::requests::sweep_spec::MOST_SAMPLES;
use crate::study::requests::varied::{SWEEP, Varied};
use crate::study::run::runs::{check_variants, run_variant};
use crate::study::{Prepared, PreparedVariant, Progress, Project, Settings, Silent, SweepSpec};
use kardan_math::num::Random;
use kardan_results::{Sweep, SweepHead, SweepRequirement, SweepRow, SweepRows, SweptParameter};
use kardan_schema::diagnostics::{Diagnostic, quoted};
use kardan_simulate::{Recorded, Tolerance};

/// Fewest samples of a block.
const LEAST_BLOCK: u64 = 64;
/// Most blocks of a sweep.
const MOST_BLOCKS: u64 = 1000;
/// Blocks of a search: at least this many, with at least this many samples each.
const BLOCKS_OF_SEARCH: u64 = 16;
const LEAST_OF_SEARCH: u64 = 8;
/// Fewest samples of a level of a subset simulation.
const LEAST_LEVEL: u64 = 200;

/// Samples that the reference integrator repeats for runs in lanes: most, fewest, and one of this many.
const COMPARED: u64 = 64;
const LEAST_COMPARED: u64 = 4;
const SELDOM: u64 = 250;
/// Receives the rows of a block by its number, or returns the reason why it cannot.
pub type TakeRows<'t> = dyn FnMut(u64, &[SweepRow]) -> Result<(), String> + 't;

impl Project {
    /// The plan of a sweep of this model.
    ///
    /// # Errors
    /// All errors; no varied parameter; too many samples.
    pub fn sweep_plan(&self, settings: &SweepSettings) -> Result<SweepPlan, Vec<Diagnostic>> {
        let (prepared, mut diagnostics) = (self.prepared(), self.diagnostics().to_vec());
        check_variants(prepared, &settings.variants, &mut diagnostics);
        without_errors(&diagnostics)?;
        let nothing = || {
            let help = "write tolerances after values, \"100 N m/rad ± 10 %\", or a table `[sweep]`; `kardan elements sweep` shows one";
            vec![Diagnostic::error("sweep::no-variation", "no value of the file varies").help(help)]
        };
        let spec = prepared.sweep.as_ref().filter(|spec| !spec.space.varied.is_empty()).ok_or_else(nothing)?;
        let space = SampleSpace { varied: self.with_laws(&spec.space.varied), ..spec.space.clone() };
        let seed = settings.seed.unwrap_or(spec.seed);
        let (samples, block) = sizes(spec, settings).map_err(|diagnostic| vec![diagnostic])?;
        let chosen = if settings.variants.is_empty() { &spec.variants } else { &settings.variants };
        let variants = prepared.all().map(|variant| variant.name.clone());
        let mut variants: Vec<String> = variants.filter(|name| selects(chosen, name)).collect();
        let sought = settings.goal.sought();
        let target = sought.map(|sought| target(prepared, sought, &mut variants)).transpose();
        let target = target.map_err(|diagnostic| vec![diagnostic])?;
        let swept_parameter = |varied: &Varied| SweptParameter {
            name: varied.name.clone(),
            unit: varied.dimension.si(),
            distribution: varied.text.clone(),
        };
        let search = sought.zip(target.as_ref()).map(|((option, _), target)| (option, target.requirement));
        Ok(SweepPlan {
            head: SweepHead {
                identity: self.identity((samples, seed), &variants, search, settings),
                samples,
                seed,
                variants,
                varied: space.varied.iter().map(swept_parameter).collect(),
                requirements: prepared.requirements.iter().map(required).collect(),
                figures: prepared.figures.iter().map(|figure| (figure.name.clone(), figure.unit.clone())).collect(),
            },
            shard: None,
            // A search generates its own ones.
            axes: if search.is_some() { Vec::new() } else { axes(space.sampling, (seed, samples), &space) },
            space,
            goal: settings.goal.clone(),
            target,
            block,
            lanes: settings.lanes,
        })
    }

    /// The identity of the rows of a sweep: this program, the model with its files, the samples, the variants, the integration settings.
    fn identity(
        &self,
        (samples, seed): (u64, u64),
        variants: &[String],
        search: Option<(&str, usize)>,
        settings: &SweepSettings,
    ) -> String {
        let runs = format!("{samples} samples of {}", quoted(variants.iter().map(String::as_str)));
        let search = search.map_or(String::new(), |(option, number)| format!(", {option} {}", number + 1));
        let own = settings.most_steps.filter(|most| *most != Tolerance::default().most_steps);
        let steps = own.map_or(String::new(), |most| format!(", limit of steps {most}"));
        format!("{}, {runs}, seed {seed}{search}{steps}, {}", self.origin(), integrated(&settings.run))
    }

    /// This program and the model with its files.
    fn origin(&self) -> String {
        let files = self.document().files.iter();
        let bytes = files.flat_map(|(name, bytes)| [name.as_bytes(), bytes.as_deref().unwrap_or_default()]);
        let sum = bytes.fold(Random::fnv(Random::FNV, self.to_toml().as_bytes()), Random::fnv);
        format!("kardan {}, model {sum:016x}", env!("CARGO_PKG_VERSION"))
    }

    /// Runs every sample of a plan in every variant of it, block by block; `write` receives the rows of each completed block, and
    /// ends the sweep if it fails. Blocks with existing `rows` are not run again; afterwards `rows` contains all evaluated rows, by samples. If
    /// `progress` requests a stop, the current block is finished.
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
    /// let found = project.sweep(&plan, &Default::default(), &mut Default::default(), &Silent, &mut |_, _| Ok(())).unwrap();
    /// // The speed 4 N m · 1 s / J is above 2 rad/s where J is below 2 kg m²: in half of the samples, one in each of 100 strips.
    /// assert_eq!(found.requirements[0].passed, 50);
    /// ```
    ///
    /// # Errors
    /// All errors of the file.
    pub fn sweep(
        &self,
        plan: &SweepPlan,
        settings: &Settings,
        rows: &mut SweepRows,
        progress: &dyn Progress,
        write: &mut TakeRows<'_>,
    ) -> Result<Sweep, Vec<Diagnostic>> {
        let prepared = self.prepared();
        without_errors(self.diagnostics())?;
        if let (Some(_), false) = (plan.shard, plan.goal == SweepGoal::Samples) {
            let message = "a shard is a part of samples known in advance: a search has no shards, nor has a sweep with a stopping rule";
            return Err(vec![Diagnostic::error("sweep::shard", message).help("run it on one machine")]);
        }
        let named = |name: &String| prepared.all().find(|variant| variant.name == *name);
        let chosen: Vec<&PreparedVariant> = plan.head.variants.iter().filter_map(named).collect();
        let requested = plan.samples_of(plan.own_blocks()).count();
        let counted = Counted::new(progress, rows.len(), requested.saturating_mul(chosen.len())).of_whole_runs();
        let previous = std::mem::take(rows).in_order();
        let recorded = recorded_signals(prepared);
        let lanes = (plan.lanes, plan.draws());
        let batch = |variant| Batch::new(self, variant, &plan.space.varied, (settings, progress), lanes);
        let found: Vec<Result<Batch<'_>, String>> = chosen.iter().copied().map(batch).collect();
        if plan.own_blocks().any(|block| previous.range(plan.samples_of(block..block + 1)).is_empty()) {
            note_scalar_runs(&chosen, &found, progress);
        }
        let batch: Vec<Option<Batch<'_>>> = found.into_iter().map(Result::ok).collect();
        let mut ended = None;
        let mut run = |block: u64, values: &[Vec<f64>]| {
            // The current block is finished, and written.
            ended = progress.stop();
            if ended.is_some() {
                return None;
            }
            let cases = plan.samples_of(block..block + 1).zip(values);
            let found = self.rows((prepared, settings, &recorded), plan, cases, (&chosen, &batch), &counted);
            ended = write(block, &found).err();
            ended.is_none().then_some(found)
        };
        let mut stopping_rule = StoppingRule::of(plan);
        if let Err(samples) = replay(plan, &mut stopping_rule, previous, rows, &mut run) {
            let Range { start, end } = samples;
            let message = format!("the rows of samples {start} to {} do not follow from those before them", end - 1);
            let help = "some before them are missing or were changed: restart with `--force`";
            return Err(vec![Diagnostic::error("sweep::resume", message).help(help)]);
        }
        let mut out = self.summary(plan, rows, &stopping_rule);
        out.warnings.extend(ended.map(|why| format!("{why}: results not computed by then are missing")));
        Ok(out)
    }

    /// The summary of the existing rows of a plan, without runs. Rows after the end of a sweep that has reached its goal, and those of no block
    /// of it, are removed; the others are sorted by samples afterwards.
    pub fn sweep_summary(&self, plan: &SweepPlan, rows: &mut SweepRows) -> Sweep {
        *rows = std::mem::take(rows).in_order();
        let mut stopping_rule = StoppingRule::of(plan);
        match stopping_rule.is_plain() {
            true => rows.restrict(rows.range(plan.samples_of(plan.own_blocks()))),
            false => {
                // Rows that depend on missing or on other ones have no meaning.
                let previous = std::mem::take(rows);
                let _ = replay(plan, &mut stopping_rule, previous, rows, &mut |_, _| None);
            }
        }
        self.summary(plan, rows, &stopping_rule)
    }

    fn summary(&self, plan: &SweepPlan, rows: &SweepRows, stopping_rule: &StoppingRule) -> Sweep {
        let mut out = summarise(self.prepared(), plan, rows, stopping_rule);
        out.notes.extend(laws::designed_anew(&plan.space.varied));
        out.warnings.splice(0..0, self.diagnostics().iter().map(ToString::to_string));
        out
    }

    /// Rows of samples with their values: in lanes where possible, the others one by one.
    fn rows<'v>(
        &self,
        (prepared, settings, recorded): (&Prepared, &Settings, &Recorded),
        plan: &SweepPlan,
        cases: impl Iterator<Item = (u64, &'v Vec<f64>)>,
        (chosen, batch): (&[&PreparedVariant], &[Option<Batch<'_>>]),
        counted: &Counted<'_>,
    ) -> Vec<SweepRow> {
        let of_sample = |(sample, values): (u64, &'v Vec<f64>)| {
            (0..chosen.len()).map(move |variant| blank(prepared, (sample, variant), values))
        };
        let mut found: Vec<SweepRow> = cases.flat_map(of_sample).collect();
        let apart = (plan.head.samples / (plan.head.samples / SELDOM).clamp(LEAST_COMPARED, COMPARED)).max(1);
        let (mut remaining, mut all_compared): (Vec<&mut SweepRow>, Vec<&mut SweepRow>) =
            (found.iter_mut().collect(), Vec::new());
        for (number, lanes) in batch.iter().enumerate() {
            let Some(lanes) = lanes else { continue };
            let (mut own, other_rows): (Vec<_>, Vec<_>) = remaining.into_iter().partition(|row| row.variant == number);
            let filled = lanes.fill(prepared, &mut own, &|| counted.count(1));
            let (done, open): (Vec<_>, Vec<_>) = own.into_iter().zip(filled).partition(|(_, filled)| *filled);
            all_compared.extend(done.into_iter().map(|(row, _)| row).filter(|row| row.sample % apart == 0));
            remaining = open.into_iter().map(|(row, _)| row).chain(other_rows).collect();
        }
        let compare = |row: &mut SweepRow| {
            let mut rerun = SweepRow { reason: String::new(), ..row.clone() };
            self.sample((prepared, settings, recorded), plan, &mut rerun, chosen[row.variant], &Silent);
            row.difference = Some(difference(prepared, row, &rerun));
        };
        all_compared.into_par_iter().for_each(compare);
        remaining.into_par_iter().for_each(|row| {
            self.sample((prepared, settings, recorded), plan, row, chosen[row.variant], counted);
            counted.count(1);
        });
        found
    }

    /// The varied parameters, with the laws for those that occur in laws only.
    fn with_laws(&self, varied: &[Varied]) -> Vec<Varied> {
        let laws = |one: &Varied| laws::laws_of(self.entries(), &one.name).unwrap_or_default();
        varied.iter().map(|one| Varied { laws: laws(one), ..one.clone() }).collect()
    }

    /// A run.
    fn sample(
        &self,
        (prepared, settings, recorded): (&Prepared, &Settings, &Recorded),
        plan: &SweepPlan,
        row: &mut SweepRow,
        variant: &PreparedVariant,
        progress: &dyn Progress,
    ) {
        let number = row.variant;
        let run = || {
            let drawn = plan.draws().then_some(row.sample);
            let found = sampled(self.document(), variant, &plan.space.varied, (&row.values, drawn));
            let mut ready = found.map_err(|diagnostics| refusal(&diagnostics))?;
            ready.scenario.recorded = Some(recorded.clone());
            Ok(run_variant(number, &ready, (prepared, settings), progress, false).0)
        };
        match answering(run) {
            Ok(run) => fill(row, prepared, &run),
            Err(reason) => {
                row.reason = reason;
                for (k, requirement) in prepared.requirements.iter().enumerate() {
                    if selects(&requirement.variants, &variant.name) {
                        row.passed[k] = 0.0;
                    }
                }
            }
        }
    }
}

/// Reports the variants that run one by one, with the reason.
fn note_scalar_runs(chosen: &[&PreparedVariant], found: &[Result<Batch<'_>, String>], progress: &dyn Progress) {
    let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
    for (variant, why) in chosen.iter().zip(found).filter_map(|(one, found)| Some((one, found.as_ref().err()?))) {
        let name = format!("`{}`", variant.name);
        match reasons.iter_mut().find(|(reason, _)| reason == why) {
            _ if why.is_empty() => {}
            Some((_, names)) => names.push(name),
            None => reasons.push((why, vec![name])),
        }
    }
    for (why, names) in reasons {
        let of = if names.len() == chosen.len() { String::new() } else { format!(" of {}", names.join(", ")) };
        progress.message(&format!("kardan runs samples{of} one by one, not as a SIMD ensemble in lanes: {why}"));
    }
}

/// The result of a sample; an internal error loses only this sample.
fn answering<T>(run: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    // Its partial changes are dropped with it.
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
        Err(format!("an internal error of kardan, please report it: {}", text.unwrap_or("no message")))
    })
}

/// A requirement, before any run.
fn required(one: &Requirement) -> SweepRequirement {
    SweepRequirement {
        text: one.describe(),
        measured: one.describe_measure(),
        unit: one.unit.clone(),
        display: one.display.clone(),
        below: one.below,
        above: one.above,
    }
}

/// The largest number of samples, and the samples of a block.
fn sizes(spec: &SweepSpec, settings: &SweepSettings) -> Result<(u64, u64), Diagnostic> {
    let refused = |code, message: String, help: &str| Err(Diagnostic::error(code, message).help(help));
    let requested = settings.samples.unwrap_or(spec.samples);
    let too_many = |samples: u64| {
        let message = format!("{samples} samples: the allowed number is 1 to {MOST_SAMPLES}");
        refused("sweep::samples", message, "request another number of samples")
    };
    if requested == 0 || requested > MOST_SAMPLES {
        return too_many(requested);
    }
    let (space, sampling) = (&spec.space, spec.space.sampling);
    match &settings.goal {
        SweepGoal::Until(width) if !(1e-5..0.5).contains(width) => {
            let message = format!("`--until`: the half-width of intervals must be between 1e-5 and 0.5, not {width}");
            return refused("sweep::stopping-rule", message, "0.01 requests probabilities to 1 %");
        }
        SweepGoal::Until(_) if !sampling.draws() => {
            let word = sampling.word();
            let message =
                format!("`--until`: the samples of `points = \"{word}\"` are a fixed set, and not drawn one by one");
            return refused("sweep::stopping-rule", message, "choose other points, or omit it");
        }
        SweepGoal::Worst(_) => {
            let least = requested.div_ceil(BLOCKS_OF_SEARCH).clamp(LEAST_OF_SEARCH, LEAST_BLOCK);
            return Ok((requested, requested.div_ceil(MOST_BLOCKS).max(least)));
        }
        SweepGoal::Rare(_) if requested < LEAST_LEVEL => {
            let message = format!("`--rare`: {requested} samples per level are fewer than {LEAST_LEVEL}");
            return refused(
                "sweep::samples",
                message,
                "request more: 1000 give a probability of 1e-5 to about a third of it",
            );
        }
        SweepGoal::Rare(_) => {
            let chains = requested.div_ceil(CHAIN);
            return Ok((chains * (CHAIN + (MOST_LEVELS - 1) * (CHAIN - 1)), chains));
        }
        SweepGoal::Samples | SweepGoal::Until(_) => {}
    }
    let samples = match sampling {
        SamplingMethod::Levels(levels) => {
            let all = space.combinations(levels);
            if settings.samples.is_some_and(|requested| requested != all) {
                let message = format!("{requested} samples: the grid has {all} combinations");
                return refused("sweep::samples", message, "omit the number, or choose other `points`");
            }
            if all > MOST_SAMPLES {
                return Err(too_large(levels, space));
            }
            all
        }
        _ => requested.next_multiple_of(space.group()),
    };
    if samples == 0 || samples > MOST_SAMPLES {
        return too_many(samples);
    }
    Ok((samples, samples.div_ceil(MOST_BLOCKS).max(LEAST_BLOCK)))
}

/// The error of a grid with more combinations than the sample limit.
fn too_large(levels: u64, space: &SampleSpace) -> Diagnostic {
    let (word, count, all) = (space.sampling.word(), space.varied.len(), space.combinations(levels));
    let more = if all == u64::MAX { "more than " } else { "" };
    let message = format!(
        "{SWEEP}: `points = \"{word}\"` with {levels} levels of {count} parameters has {more}{all} samples: the limit is {MOST_SAMPLES}"
    );
    // The largest permitted number of levels.
    let (mut fit, mut over) = (1, levels);
    while over - fit > 1 {
        let middle = fit + (over - fit) / 2;
        if space.combinations(middle) <= MOST_SAMPLES { fit = middle } else { over = middle }
    }
    let fewer = if fit < 2 {
        String::new()
    } else {
        format!("write `points = \"grid\"` with `levels = {fit}`, which has {}, ", space.combinations(fit))
    };
    let row_note =
        "vary fewer parameters, or choose `points = \"latin_hypercube\"`, which has as many samples as requested";
    Diagnostic::error("sweep::samples", message).help(format!("{fewer}{row_note}"))
}

/// The rows of a block from the values of its samples; none where the sweep ends before it.
type RunBlock<'r> = dyn FnMut(u64, &[Vec<f64>]) -> Option<Vec<SweepRow>> + 'r;

/// Adds the rows of a plan block by block: previous ones, in order, and otherwise those that `run` makes. It ends at the goal, and where `run` makes
/// none; samples that depend only on their numbers keep their previous rows after that end.
///
/// # Errors
/// The samples of previous rows of a search that do not follow from those before them.
fn replay(
    plan: &SweepPlan,
    stopping_rule: &mut StoppingRule,
    previous: SweepRows,
    rows: &mut SweepRows,
    run: &mut RunBlock<'_>,
) -> Result<(), Range<u64>> {
    let own = plan.own_blocks();
    for block in own.clone() {
        let samples = plan.samples_of(block..block + 1);
        let range = previous.range(samples.clone());
        let found = if range.is_empty() {
            let values = stopping_rule.values(plan, samples.clone());
            match values.and_then(|values| run(block, &values)) {
                Some(found) => found,
                None if stopping_rule.is_plain() => {
                    let rest = previous.range(samples.start..plan.samples_of(own).end);
                    rows.extend(rest.map(|number| previous.get(number).to_row()));
                    return Ok(());
                }
                None => return Ok(()),
            }
        } else {
            let found: Vec<SweepRow> = range.map(|number| previous.get(number).to_row()).collect();
            if stopping_rule.is_led() && !follows(stopping_rule.values(plan, samples.clone()), plan, &found) {
                return Err(samples);
            }
            found
        };
        stopping_rule.take(plan, block, &found);
        rows.extend(found);
        if stopping_rule.is_done() {
            return Ok(());
        }
    }
    Ok(())
}

/// Whether rows are those of samples with these values.
fn follows(values: Option<Vec<Vec<f64>>>, plan: &SweepPlan, rows: &[SweepRow]) -> bool {
    let variants = plan.head.variants.len();
    let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    values.is_some_and(|values| {
        let own = values.iter().flat_map(|own| std::iter::repeat_n(own, variants));
        values.len() * variants == rows.len() && own.zip(rows).all(|(own, row)| bits(own) == bits(&row.values))
    })
}

/// The integration settings, as text.
fn integrated(Settings { method, tolerance, .. }: &Settings) -> String {
    let tolerance = tolerance.map_or(String::new(), |tolerance| format!(", tolerance {tolerance:e}"));
    format!("method {method:?}{tolerance}")
}

#[cfg(test)]
#[path = "../../../tests/unit/study/sweep.rs"]
mod tests;

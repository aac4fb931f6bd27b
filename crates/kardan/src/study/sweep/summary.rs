//! The summary of the rows of a sweep, with notes.

use super::goal::{InterimAnalyses, SweepGoal};
use super::intervals::CONFIDENCE;
use super::plan::{Shard, SweepPlan};
use super::reasons::reasons;
use super::region::{self, failing_rules};
use super::statistics::SweepStatistics;
use super::stopping_rule::StoppingRule;
use crate::study::measure::selected_variants::selects;
use crate::study::requests::sampling_method::SamplingMethod;
use crate::study::{Prepared, PreparedVariant};
use kardan_mechanics::equations::Sensor;
use kardan_results::{
    Sweep, SweepRequirement, SweepRows, SweptAt, SweptCompared, SweptFigure, SweptRare, SweptRequirement, SweptWorst,
};

/// Axes that Halton's sequence fills evenly with few samples.
const MOST_OF_HALTON: usize = 8;

/// The summary of the rows.
pub(super) fn summarise(prepared: &Prepared, plan: &SweepPlan, rows: &SweepRows, rule: &StoppingRule) -> Sweep {
    let (until, confidence) = match rule {
        StoppingRule::Until(InterimAnalyses { status, .. }) => (Some(status.clone()), status.confidence),
        _ => (None, CONFIDENCE),
    };
    let statistics = SweepStatistics { plan, rows, confidence };
    let own_samples = plan.samples_of(plan.own_blocks());
    let mut out = Sweep {
        model: prepared.name.clone(),
        description: prepared.description.clone(),
        samples: plan.head.samples,
        seed: plan.head.seed,
        points: plan.points().into(),
        variants: plan.head.variants.clone(),
        varied: plan.head.varied.clone(),
        rows: rows.len() as u64,
        missing: match rule.is_done() {
            true => 0,
            false => (own_samples.end - own_samples.start) * plan.head.variants.len() as u64 - rows.len() as u64,
        },
        failures: reasons(rows.iter(), &plan.head.variants),
        compared: compared(plan, rows),
        confidence: CONFIDENCE,
        stopping_rule: until,
        worst: worst(plan, rows, rule, prepared),
        rare: rare(plan, rule, prepared),
        ..Sweep::default()
    };
    if out.worst.is_some() || out.rare.is_some() {
        out.notes = notes(prepared, plan, &out);
        return out;
    }
    let own = |names: &[String]| {
        let own = plan.head.variants.iter().filter(|name| selects(names, name));
        own.cloned().collect::<Vec<_>>()
    };
    for (k, requirement) in prepared.requirements.iter().enumerate() {
        for variant in own(&requirement.variants) {
            let SweepRequirement { text, unit, display, below, above, .. } = plan.head.requirements[k].clone();
            let none = SweptRequirement::default();
            let mut one = SweptRequirement { text, unit, display, below, above, variant, ..none };
            statistics.fill_requirement(k, &mut one);
            if statistics.is_drawn() {
                one.rules = failing_rules(&statistics, k, &one.variant);
            }
            out.requirements.push(one);
        }
    }
    for (k, figure) in prepared.figures.iter().enumerate() {
        for variant in own(&figure.variants) {
            out.figures.push(SweptFigure {
                name: figure.name.clone(),
                text: figure.describe(),
                unit: figure.unit.clone(),
                display: figure.display.clone(),
                values: statistics.spread(&variant, |row| row.figures[k]),
                variant,
            });
        }
    }
    out.notes = notes(prepared, plan, &out);
    out.warnings.extend(uneven(plan, &out));
    out
}

/// Intervals of a sequence that fills many axes unevenly: bases of Halton's grow with their number, and long parts of their digits run in parallel.
fn uneven(plan: &SweepPlan, found: &Sweep) -> Option<String> {
    let (axes, has_intervals) = (plan.space.varied.len(), found.requirements.iter().any(|one| one.interval.is_some()));
    (has_intervals && axes > MOST_OF_HALTON && plan.points() == SamplingMethod::Halton.word()).then(|| {
        format!(
            "intervals of probabilities are those of random draws and may be too narrow: Halton's sequence fills {axes} axes unevenly; for more than about {MOST_OF_HALTON} \
             axes its error may exceed that of random draws; write `points = \"sobol\"` or `points = \"random\"` under `[sweep]`"
        )
    })
}

/// The notes on the results.
fn notes(prepared: &Prepared, plan: &SweepPlan, found: &Sweep) -> Vec<String> {
    let mut notes: Vec<String> = Vec::new();
    match (&plan.goal, plan.space.sampling) {
        (SweepGoal::Worst(_), _) => notes.push(
            "The search found the worst case without proof: worse cases may exist. The search stays between the ends of the distributions, and within three \
             deviations where they have none."
                .into(),
        ),
        (SweepGoal::Rare(_), _) => notes.push(
            "The probability is an estimate by chains of samples. Its deviation follows from the observed correlations of the chains. The interval, of \
             about 95 %, is an approximation, and does not include a failure that no chain comes near: repeat with other seeds."
                .into(),
        ),
        (_, SamplingMethod::Levels(_) | SamplingMethod::Morris) => notes.push(
            "The samples are not drawn at random: the number that satisfies a requirement is a count, and no probability.".into(),
        ),
        (_, SamplingMethod::Saltelli) => notes.push(
            "Probabilities, means and regressions use the two samples A and B only. Intervals of indices come from a bootstrap over base samples, as if \
             these were drawn independently; indices of a sequence usually scatter less. An estimated index may be slightly below 0 or above 1."
                .into(),
        ),
        _ => {}
    }
    // Runs without a measured value have no comparison.
    let measured = !prepared.requirements.is_empty() || !prepared.figures.is_empty();
    notes.extend(found.compared.as_ref().filter(|_| measured).map(side_by_side));
    if let Some(until) = &found.stopping_rule {
        notes.push(format!(
            "Repeated interim analyses find a narrow interval by chance more easily. So kardan plans at most {} analyses in advance, and the intervals of each have a confidence of \
             {:.3} %: all intervals together are correct with {} %, whichever analysis is the last. They are wider than that of one analysis of as many samples, planned in advance.",
            until.interim_analyses,
            100.0 * until.confidence,
            100.0 * CONFIDENCE
        ));
        if !until.converged && found.missing == 0 {
            notes.push(format!(
                "After all {} samples an interval is still wider than ± {}: request more samples.",
                plan.head.samples, until.half_width
            ));
        }
    }
    if !plan.space.correlated.is_empty() {
        notes.push(
            "Correlations are those of the normal numbers that kardan maps to the distributions by quantiles; for normal distributions they are those of the values."
                .into(),
        );
    }
    if let Some(Shard { number, of }) = plan.shard {
        let own_samples = plan.samples_of(plan.own_blocks());
        notes.push(match own_samples.is_empty() {
            true => format!("Shard {number} of {of}: it has no samples, as the sweep has fewer blocks of samples than shards."),
            false => format!(
                "Shard {number} of {of}, samples {} to {} of {}: `kardan sweep merge` of all shards gives the whole result.",
                own_samples.start,
                own_samples.end - 1,
                plan.head.samples
            ),
        });
    }
    if found.requirements.iter().any(|one| !one.rules.is_empty()) {
        notes.push(region::NOTE.into());
    }
    notes.extend(noise(prepared, plan));
    if prepared.all().any(|variant| !variant.implemented.is_empty()) {
        notes.push(
            "Laws use the values in the file, for every sample of the plant; programs and blocks use the sampled values."
                .into(),
        );
    }
    notes
}

/// Note on the sensor noise of the samples, if there is some.
fn noise(prepared: &Prepared, plan: &SweepPlan) -> Option<String> {
    let is_noisy = |(_, sensor): &(String, Sensor)| sensor.noise.is_some();
    let noisy = |variant: &PreparedVariant| {
        variant.reduced.equations.sensors.iter().any(is_noisy) || !variant.scenario.faults.is_empty()
    };
    let note = match plan.draws() {
        true => {
            "kardan draws sensor noise and random faults anew for each sample; signals of the kind `noise` are equal in all samples."
        }
        false => "Sensor noise is the same in all samples, so that they can be compared.",
    };
    prepared.all().any(noisy).then(|| note.into())
}

/// The difference between runs in lanes and the reference, as text.
fn side_by_side(SweptCompared { rows, difference, sample, .. }: &SweptCompared) -> String {
    let differ = match *difference {
        0.0 => "do not differ".to_string(),
        _ => format!(
            "differ by at most {difference:.1e} of their value, or of a bound where that is larger (sample {sample})"
        ),
    };
    format!(
        "kardan computes runs as a SIMD ensemble in lanes. It computed {rows} of them with the reference integrator too, one by one: figures and measured requirements {differ}. \
         With `--method taylor` all runs use the reference integrator."
    )
}

/// The largest difference of compared rows to the reference.
fn compared(plan: &SweepPlan, rows: &SweepRows) -> Option<SweptCompared> {
    let all = || rows.iter().filter_map(|row| Some((row.difference?, row.sample, row.variant)));
    let (difference, sample, variant) = all().max_by(|one, other| one.0.total_cmp(&other.0))?;
    Some(SweptCompared { rows: all().count() as u64, difference, sample, variant: plan.head.variants[variant].clone() })
}

/// The worst case, of a search.
fn worst(plan: &SweepPlan, rows: &SweepRows, stopping_rule: &StoppingRule, prepared: &Prepared) -> Option<SweptWorst> {
    let StoppingRule::Worst(target, search) = stopping_rule else { return None };
    let (margin, sample) = search.least?;
    let of_sample = rows.range(sample..sample + 1).map(|number| rows.get(number).to_row());
    let row = of_sample.min_by(|one, other| target.margin_of_case(one).total_cmp(&target.margin_of_case(other)))?;
    let number = |x: f64| x.is_finite().then_some(x);
    let values = plan.head.varied.iter().zip(&row.values);
    Some(SweptWorst {
        text: plan.head.requirements[target.requirement].text.clone(),
        variant: plan.head.variants[row.variant].clone(),
        unit: prepared.requirements[target.requirement].unit.clone(),
        margin: number(margin),
        measured: number(row.measured[target.requirement]),
        fails: margin <= 0.0,
        sample,
        values: values
            .map(|(one, value)| SweptAt { parameter: one.name.clone(), unit: one.unit.clone(), value: *value })
            .collect(),
        margin_before_search: search.before.and_then(number),
        exploration_samples: search.explore.min(rows.len() as u64 / plan.head.variants.len().max(1) as u64),
        restarts: search.rests.len() as u64,
    })
}

/// The probability of a rare failure.
fn rare(plan: &SweepPlan, stopping_rule: &StoppingRule, prepared: &Prepared) -> Option<SweptRare> {
    let StoppingRule::Rare(target, found) = stopping_rule else { return None };
    let probability = found.probability();
    Some(SweptRare {
        text: plan.head.requirements[target.requirement].text.clone(),
        variant: plan.head.variants.join(", "),
        unit: prepared.requirements[target.requirement].unit.clone(),
        probability: probability.map(|(probability, _)| probability),
        deviation: probability.map(|(_, deviations)| deviations[0]),
        deviation_upper_bound: probability.map(|(_, deviations)| deviations[1]),
        interval: found.interval(),
        levels: found.levels.clone(),
        stop_reason: found.ended.as_deref().unwrap_or("it ended before its last level").into(),
    })
}

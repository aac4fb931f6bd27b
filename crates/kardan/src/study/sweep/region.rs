//! Where a requirement fails, as readable rules: leaves of a small tree (CART: Breiman, Friedman, Olshen, Stone, Classification and
//! Regression Trees, Wadsworth 1984).
//!
//! The tree is grown on a random half of the samples; its rules are counted on the other half, which it does not use. A leaf is a rule only if
//! it fails more often there than chance explains for the best of this many leaves.

use super::intervals::{CONFIDENCE, clopper_pearson};
use super::statistics::SweepStatistics;
use super::tree::{Case, Count, SplitRange, leaves};
use kardan_math::num::Random;
use kardan_results::{SweptBound, SweptParameter, SweptRule};

/// Fewest samples, and fewest of each verdict among them.
const LEAST_SAMPLES: (usize, usize) = (20, 5);
/// Most rules of a requirement.
const MOST_RULES: usize = 3;
/// The note on rules.
pub(super) const NOTE: &str = "A tree of thresholds (CART), grown on a random half of the samples, gives the regions where requirements fail; \
    kardan counts the samples inside, their failures and their share of all failures on the other half, which the tree does not use.";

/// Where a requirement fails in a variant, sorted by covered failures; empty for few samples, and if no rule is better than chance.
pub(super) fn failing_rules(statistics: &SweepStatistics<'_>, requirement: usize, variant: &str) -> Vec<SweptRule> {
    let judged = statistics.of(variant).filter(|row| !row.passed[requirement].is_nan());
    let cases =
        judged.map(|row| Case { sample: row.sample, values: row.values, failed: row.passed[requirement] <= 0.5 });
    rules(&cases.collect::<Vec<_>>(), &statistics.plan.head.varied)
}

/// The rules of samples with their verdicts.
fn rules(cases: &[Case<'_>], varied: &[SweptParameter]) -> Vec<SweptRule> {
    let all = Count::of(cases.iter());
    if all.all < LEAST_SAMPLES.0 || all.failed.min(all.all - all.failed) < LEAST_SAMPLES.1 {
        return Vec::new();
    }
    // At random, as numbers may correlate with the location of a sample (every second one of Halton's is in the same half of an axis).
    let (first, second): (Vec<&Case<'_>>, Vec<&Case<'_>>) =
        cases.iter().partition(|case| Random::named(case.sample, "grown").next_u64() & 1 == 0);
    let (grown, counted) = (Count::of(first.iter().copied()), Count::of(second.iter().copied()));
    let mut leaves = leaves(first, varied.len());
    leaves.retain(|(bounds, count)| !bounds.is_empty() && count.share() > grown.share());
    // One of several leaves exceeds the level by chance more easily than a single one: each gets its share of the level (Bonferroni).
    let confidence = 1.0 - (1.0 - CONFIDENCE) / leaves.len().max(1) as f64;
    let found = leaves.into_iter().filter_map(|(bounds, _)| {
        let inside = Count::of(second.iter().copied().filter(|case| bounds.iter().all(|bound| bound.contains(case))));
        let (fails, total) = (inside.failed as u64, inside.all as u64);
        if fails == 0 || clopper_pearson(fails, total, confidence)[0] <= counted.share() {
            return None;
        }
        Some(SweptRule {
            bounds: bounds.iter().map(|bound| swept_bound(*bound, varied)).collect(),
            inside: total,
            failed: fails,
            interval: clopper_pearson(fails, total, CONFIDENCE),
            coverage: fails as f64 / counted.failed as f64,
        })
    });
    let mut found: Vec<SweptRule> = found.collect();
    found.sort_by_key(|rule| (std::cmp::Reverse(rule.failed), rule.inside));
    found.truncate(MOST_RULES);
    found
}

/// A bound with its parameter.
fn swept_bound(bound: SplitRange, varied: &[SweptParameter]) -> SweptBound {
    let SweptParameter { name, unit, .. } = &varied[bound.parameter];
    let [below, above] = [bound.below, bound.above].map(|bound| bound.is_finite().then_some(bound));
    SweptBound { parameter: name.clone(), unit: unit.clone(), below, above }
}

#[cfg(test)]
#[path = "../../../tests/unit/study/sweep/region.rs"]
mod tests;

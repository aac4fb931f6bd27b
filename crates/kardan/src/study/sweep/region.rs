//! Where a requirement fails, as readable rules: leaves of a small tree (CART: Breiman, Friedman, Olshen, Stone, Classification and
//! Regression Trees, Wadsworth 1984).
//!
//! The tree is grown on a random half of the samples; its rules are counted on the other half, which it does not use. A leaf is a rule only if
//! it fails more often there than chance explains for the best of this many leaves.

use super::statistics::{CONFIDENCE, SweepStatistics, clopper_pearson};
use super::tree::{Case, Count, SplitRange, leaves};
use crate::num::Random;
use crate::results::{SweptBound, SweptParameter, SweptRule};

/// Fewest samples, and fewest of each verdict among them.
const LEAST_SAMPLES: (usize, usize) = (20, 5);
/// Most rules of a requirement.
const MOST_RULES: usize = 3;
/// The note on rules.
pub(super) const NOTE: &str = "A tree of thresholds (CART), grown on a random half of the samples, gives the regions where requirements fail; \
    kardan counts the samples inside, their failures and their share of all failures on the other half, which the tree does not use.";

/// Where a requirement fails in a variant, sorted by covered failures; empty for few samples, and if no rule is better than chance.
pub(super) fn failing_rules(
    statistics: &SweepStatistics<'_>,
    (requirement, variant): (usize, &str),
    varied: &[SweptParameter],
) -> Vec<SweptRule> {
    let judged = statistics.of(variant).filter(|row| !row.passed[requirement].is_nan());
    let cases =
        judged.map(|row| Case { sample: row.sample, values: row.values, failed: row.passed[requirement] <= 0.5 });
    rules(&cases.collect::<Vec<_>>(), varied)
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
mod tests {
    use super::*;

    /// Rules of samples whose two parameters lie anywhere between 0 and 1.
    fn of(samples: u64, seed: u64, fails: impl Fn(&[f64], &mut Random) -> bool) -> Vec<SweptRule> {
        let mut random = Random::new(seed);
        let values: Vec<[f64; 2]> = (0..samples).map(|_| [random.unit(), random.unit()]).collect();
        let case = |(k, values)| Case { sample: k as u64, values, failed: fails(values, &mut random) };
        let cases: Vec<Case<'_>> = values.iter().map(|values| &values[..]).enumerate().map(case).collect();
        let parameter =
            |name: &str| SweptParameter { name: name.into(), unit: "m".into(), distribution: String::new() };
        rules(&cases, &["a", "b"].map(parameter))
    }

    /// A box is found to a few distances of neighbours, and all that fails lies in it.
    #[test]
    fn boxes_are_found() {
        let found = of(4000, 1, |x, _| x[0] < 0.3 && x[1] > 0.6);
        let [rule] = &found[..] else { panic!("{found:?}") };
        let bound = |name: &str| rule.bounds.iter().find(|bound| bound.parameter == name).unwrap();
        let (a, b) = (bound("a"), bound("b"));
        // The tree grows on 2000 samples: along the sides of the box they are 1/800 and 1/600 apart.
        assert!((a.below.unwrap() - 0.3).abs() < 0.005 && a.above.is_none(), "{a:?}");
        assert!((b.above.unwrap() - 0.6).abs() < 0.005 && b.below.is_none(), "{b:?}");
        assert!(rule.failed as f64 > 0.98 * rule.inside as f64 && rule.coverage > 0.98, "{rule:?}");
        assert!(rule.interval[0] < 1.0 && rule.interval[1] <= 1.0 && rule.bounds.iter().all(|one| one.unit == "m"));
    }

    /// Both ends of one parameter are two rules, the larger one first, and noise hides neither.
    #[test]
    fn two_ends_are_two_rules() {
        let found = of(4000, 2, |x, random| (x[0] < 0.2 || x[0] > 0.9) != (random.unit() < 0.05));
        let ends: Vec<_> = found.iter().map(|rule| (rule.bounds[0].above, rule.bounds[0].below)).collect();
        let [(None, Some(low)), (Some(high), None)] = ends[..] else { panic!("{found:?}") };
        assert!((low - 0.2).abs() < 0.01 && (high - 0.9).abs() < 0.01 && found[0].failed > found[1].failed);
    }

    /// Coins give no rule, but for the chance that is left: below one in 40 for a requirement.
    #[test]
    fn chance_gives_no_rule() {
        let has_rule = |seed: u64| !of(400, seed, |_, random| random.unit() < 0.3).is_empty();
        let wrong = (0..200).filter(|seed| has_rule(*seed)).count();
        assert!(wrong <= 5, "{wrong} of 200");
    }

    /// Nor do samples that all fail, all pass, or are few.
    #[test]
    fn nothing_is_reported_of_few() {
        assert!(of(1000, 3, |_, _| true).is_empty() && of(1000, 3, |_, _| false).is_empty());
        assert!(of(19, 3, |x, _| x[0] < 0.5).is_empty());
        assert!(of(1000, 3, |x, _| x[0] < 0.002).is_empty());
    }
}

//! Tests of `src/study/sweep/region.rs`.

use super::*;

/// Rules of samples whose two parameters lie anywhere between 0 and 1.
fn of(samples: u64, seed: u64, fails: impl Fn(&[f64], &mut Random) -> bool) -> Vec<SweptRule> {
    let mut random = Random::new(seed);
    let values: Vec<[f64; 2]> = (0..samples).map(|_| [random.unit(), random.unit()]).collect();
    let case = |(k, values)| Case { sample: k as u64, values, failed: fails(values, &mut random) };
    let cases: Vec<Case<'_>> = values.iter().map(|values| &values[..]).enumerate().map(case).collect();
    let parameter = |name: &str| SweptParameter { name: name.into(), unit: "m".into(), distribution: String::new() };
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
fn no_region_is_reported_of_small_or_uniform_samples() {
    assert!(of(1000, 3, |_, _| true).is_empty() && of(1000, 3, |_, _| false).is_empty());
    assert!(of(19, 3, |x, _| x[0] < 0.5).is_empty());
    assert!(of(1000, 3, |x, _| x[0] < 0.002).is_empty());
}

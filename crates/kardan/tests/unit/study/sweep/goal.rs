//! Tests of `src/study/sweep/goal.rs`.

use super::*;
use kardan_math::num::Random;
use kardan_results::SweepRequirement;

/// The interval at the end of 400 sweeps that end by its width holds the probability in 95 % of them at least, within three standard deviations of that count,
/// and is as narrow as was asked for; with every sample a look it would not be: that is why there are few, and each has more confidence.
#[test]
fn intervals_are_valid_whenever_it_ends() {
    let head = SweepHead {
        requirements: vec![SweepRequirement::default()],
        variants: vec!["v".into()],
        ..SweepHead::default()
    };
    let ended = |probability: f64, seed: u64| {
        let (mut random, mut interim_analyses, mut block) =
            (Random::new(seed * 7919 + 1), InterimAnalyses::new(0.05, 64, &head), 0);
        while !interim_analyses.status.converged && block < 64 {
            let mut row = |k: u64| SweepRow {
                sample: 64 * block + k,
                variant: 0,
                reason: String::new(),
                values: Vec::new(),
                measured: vec![f64::NAN],
                passed: vec![f64::from(u8::from(random.unit() < probability))],
                figures: Vec::new(),
                difference: None,
            };
            let rows: Vec<SweepRow> = (0..64).map(&mut row).collect();
            interim_analyses.take(block, &rows, 1);
            block += 1;
        }
        let [passed, all] = interim_analyses.counts[0];
        assert_eq!((interim_analyses.status.samples, interim_analyses.status.converged), (64 * block, true));
        let [low, high] = clopper_pearson(passed, all, interim_analyses.status.confidence);
        assert!(0.5 * (high - low) <= 0.05);
        (low <= probability && probability <= high, all)
    };
    for probability in [0.02, 0.1, 0.5] {
        let covered = (0..400).filter(|seed| ended(probability, *seed).0).count();
        assert!(covered as f64 >= 380.0 - 3.0 * (400.0f64 * 0.95 * 0.05).sqrt(), "{probability}: {covered}");
    }
    // Fewer samples where the probability is far from a half.
    assert!(ended(0.02, 1).1 < ended(0.5, 1).1);
    let interim_analyses = InterimAnalyses::new(0.05, 64, &head);
    assert_eq!(interim_analyses.at, [64, 42, 28, 18, 12, 8, 5, 3, 2, 1]);
}

//! Tests of `src/study/sweep/statistics.rs`.

use kardan_rt::functions::powi;

use super::*;
use crate::study::requests::sample_space::SampleSpace;
use crate::study::sweep::SweepGoal;
use crate::study::sweep::intervals::CONFIDENCE;
use kardan_results::{SweepHead, SweepRow, SweptParameter};

/// The plan of random samples of these parameters in one variant.
fn drawn(parameters: &[&str]) -> SweepPlan {
    let varied =
        |name: &&str| SweptParameter { name: (*name).into(), unit: String::new(), distribution: String::new() };
    let varied = parameters.iter().map(varied).collect();
    SweepPlan {
        head: SweepHead { varied, variants: vec!["only".into()], ..SweepHead::default() },
        shard: None,
        axes: Vec::new(),
        space: SampleSpace { varied: Vec::new(), correlated: Vec::new(), sampling: SamplingMethod::Random },
        goal: SweepGoal::Samples,
        target: None,
        block: 1,
        lanes: None,
    }
}

/// The defining equation: at each end the tail of the binomial distribution is half of what the confidence leaves.
#[test]
fn intervals_of_probabilities_have_their_tails() {
    let choose = |n: u64, k: u64| (0..k).fold(1.0, |c, i| c * (n - i) as f64 / (i + 1) as f64);
    let mass = |n: u64, k: u64, p: f64| choose(n, k) * powi(p, k as i32) * powi(1.0 - p, (n - k) as i32);
    for (hits, all) in [(0, 10), (1, 10), (5, 10), (9, 10), (10, 10), (37, 60)] {
        let [low, high] = clopper_pearson(hits, all, 0.95);
        let above: f64 = (hits..=all).map(|k| mass(all, k, low)).sum();
        let below: f64 = (0..=hits).map(|k| mass(all, k, high)).sum();
        assert!(hits == 0 && low == 0.0 || (above - 0.025).abs() < 1e-9, "{hits} of {all}: {above}");
        assert!(hits == all && high == 1.0 || (below - 0.025).abs() < 1e-9, "{hits} of {all}: {below}");
    }
}

fn figure_of(sample: u64, reason: &str, values: Vec<f64>, figure: f64) -> SweepRow {
    SweepRow { sample, reason: reason.into(), values, figures: vec![figure], ..SweepRow::default() }
}

/// What a run has measured up to an early end is no number of it; runs without one are counted.
#[test]
fn runs_that_ended_early_have_no_numbers() {
    let rows = [("", 1.0), ("it ended", 1e9), ("", 3.0), ("", f64::NAN), ("it was refused", f64::NAN)];
    let rows = rows.into_iter().zip(0..).map(|((reason, x), k)| figure_of(k, reason, vec![k as f64], x)).collect();
    let statistics = SweepStatistics { plan: &drawn(&["a"]), rows: &rows, confidence: CONFIDENCE };
    let found = statistics.spread("only", |row| row.figures[0]);
    assert_eq!(
        (found.runs, found.invalid_runs, found.count, found.mean, found.extreme_samples),
        (5, 2, 2, Some(2.0), Some([0, 2]))
    );
}

/// A number that is a straight line of what varies is explained whole, by slopes in standard deviations.
#[test]
fn straight_lines_are_explained() {
    let row = |k: u64| {
        let (a, b) = ((k * 7 % 20) as f64, (k * 3 % 20) as f64 * (k % 2) as f64);
        figure_of(k, "", vec![a, b, 4.0], 5.0 + 3.0 * a - 2.0 * b)
    };
    let rows: SweepRows = (0..40).map(row).collect();
    let statistics = SweepStatistics { plan: &drawn(&["a", "b", "same"]), rows: &rows, confidence: CONFIDENCE };
    let found = statistics.spread("only", |row| row.figures[0]);
    let deviation = |of: &dyn Fn(SweepRowOf<'_>) -> f64| {
        let mean = rows.iter().map(of).sum::<f64>() / 40.0;
        (rows.iter().map(|row| (of(row) - mean) * (of(row) - mean)).sum::<f64>() / 39.0).sqrt()
    };
    let (a, b, y) =
        (deviation(&|row| row.values[0]), deviation(&|row| row.values[1]), deviation(&|row| row.figures[0]));
    assert!((found.r_squared.unwrap() - 1.0).abs() < 1e-12 && (found.deviation.unwrap() - y).abs() < 1e-12);
    let slope = |name: &str| found.shares.iter().find(|share| share.parameter == name).unwrap().slope;
    assert!((slope("a") - 3.0 * a / y).abs() < 1e-12 && (slope("b") + 2.0 * b / y).abs() < 1e-12);
    assert_eq!(found.shares.len(), 2);
    let quantiles = found.quantiles.unwrap();
    assert!(quantiles[0] <= quantiles[1] && quantiles[6] == rows.iter().map(|r| r.figures[0]).fold(f64::MIN, f64::max));
}

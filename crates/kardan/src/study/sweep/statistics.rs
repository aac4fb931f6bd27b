//! Statistics of many rows.

use super::indices::{effects, sobol_indices};
use super::intervals::clopper_pearson;
use super::plan::SweepPlan;
use crate::study::requests::sampling_method::SamplingMethod;
use kardan_math::num::Matrix;
use kardan_results::{SweepRowOf, SweepRows, SweptEffect, SweptIndex, SweptRequirement, SweptShare, SweptValues};

/// Probabilities of the reported quantiles.
const PARTS: [f64; 7] = [0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0];

/// Rows, by sample and variant, with their plan: input of the statistics.
pub(super) struct SweepStatistics<'a> {
    pub plan: &'a SweepPlan,
    pub rows: &'a SweepRows,
    /// Confidence of intervals of probabilities.
    pub confidence: f64,
}

impl SweepStatistics<'_> {
    /// Whether fractions of the samples are probabilities.
    pub fn is_drawn(&self) -> bool {
        let is_drawn = |method| !matches!(method, SamplingMethod::Levels(_) | SamplingMethod::Morris);
        self.plan.method().is_some_and(is_drawn)
    }

    /// Rows of a variant, only the independent draws if there are others.
    pub fn of(&self, variant: &str) -> impl Iterator<Item = SweepRowOf<'_>> {
        let has_others = self.plan.method() == Some(SamplingMethod::Saltelli);
        let group = has_others.then(|| self.plan.space.group());
        self.all_of(variant).filter(move |row| group.is_none_or(|group| row.sample % group <= 1))
    }

    fn all_of(&self, variant: &str) -> impl Iterator<Item = SweepRowOf<'_>> {
        let number = self.plan.head.variants.iter().position(|name| name == variant);
        self.rows.iter().filter(move |row| Some(row.variant) == number)
    }

    pub fn fill_requirement(&self, number: usize, out: &mut SweptRequirement) {
        let verdicts = self.of(&out.variant).map(|row| row.passed[number]).filter(|verdict| !verdict.is_nan());
        let (passed, failed) =
            verdicts.fold((0, 0), |(yes, no), one| if one > 0.5 { (yes + 1, no) } else { (yes, no + 1) });
        (out.passed, out.failed) = (passed, failed);
        let all = passed + failed;
        if all > 0 && self.is_drawn() {
            out.probability = Some(passed as f64 / all as f64);
            out.interval = Some(clopper_pearson(passed, all, self.confidence));
        }
        out.measured = self.spread(&out.variant, |row| row.measured[number]);
    }

    /// The numbers of a variant; a value measured up to an early end does not count.
    pub fn spread(&self, variant: &str, number: impl Fn(SweepRowOf<'_>) -> f64) -> SweptValues {
        let number = |row: SweepRowOf<'_>| if row.reason.is_empty() { number(row) } else { f64::NAN };
        let with: Vec<(SweepRowOf<'_>, f64)> =
            self.of(variant).map(|row| (row, number(row))).filter(|(_, x)| x.is_finite()).collect();
        let runs = self.of(variant).count() as u64;
        let ended = self.of(variant).filter(|row| !row.reason.is_empty()).count() as u64;
        let Some(first) = with.first() else {
            return SweptValues { runs, invalid_runs: ended, ..SweptValues::default() };
        };
        let count = with.len() as f64;
        // Sums about the first number lose nothing to a large mean.
        let mean = first.1 + with.iter().map(|(_, x)| x - first.1).sum::<f64>() / count;
        let squares = with.iter().map(|(_, x)| (x - mean) * (x - mean)).sum::<f64>();
        let mut sorted: Vec<f64> = with.iter().map(|(_, x)| *x).collect();
        sorted.sort_by(f64::total_cmp);
        let end = |is: fn(f64, f64) -> bool| {
            with.iter().fold(first, |best, one| if is(one.1, best.1) { one } else { best }).0.sample
        };
        let (shares, explained) = self.shares(&with, mean, squares);
        let (indices, effects) = self.followed(variant, &number);
        SweptValues {
            runs,
            invalid_runs: ended,
            count: with.len() as u64,
            mean: Some(mean),
            deviation: (with.len() > 1).then(|| (squares / (count - 1.0)).sqrt()),
            quantiles: Some(PARTS.map(|part| quantile(&sorted, part))),
            extreme_samples: Some([end(|a, b| a < b), end(|a, b| a > b)]),
            shares,
            r_squared: explained,
            indices,
            effects,
        }
    }

    /// Sensitivity of a number from dedicated samples: from complete groups only.
    fn followed(&self, variant: &str, number: &impl Fn(SweepRowOf<'_>) -> f64) -> (Vec<SweptIndex>, Vec<SweptEffect>) {
        let method = self.plan.method();
        if !matches!(method, Some(SamplingMethod::Saltelli | SamplingMethod::Morris)) {
            return (Vec::new(), Vec::new());
        }
        let group = self.plan.space.group();
        let mut groups: Vec<(u64, Vec<f64>)> = Vec::new();
        for row in self.all_of(variant) {
            let first = row.sample / group * group;
            match groups.last_mut().filter(|(own, _)| *own == first) {
                Some((_, numbers)) => numbers.push(number(row)),
                None => groups.push((first, vec![number(row)])),
            }
        }
        groups.retain(|(_, numbers)| numbers.len() as u64 == group);
        if method == Some(SamplingMethod::Morris) {
            let place = |sample: u64, axis: usize| self.plan.axes[axis].at(sample);
            let names: Vec<String> = self.plan.head.varied.iter().map(|one| one.name.clone()).collect();
            return (Vec::new(), effects(&groups, place, &names));
        }
        groups.retain(|(_, numbers)| numbers.iter().all(|x| x.is_finite()));
        let groups: Vec<Vec<f64>> = groups.into_iter().map(|(_, numbers)| numbers).collect();
        (sobol_indices(&groups, &self.moving(), self.plan.head.seed), Vec::new())
    }

    /// Names of the independent factors; parameters that vary together are one.
    fn moving(&self) -> Vec<String> {
        let mut out: Vec<String> = Vec::new();
        for (varied, factor) in self.plan.head.varied.iter().zip(self.plan.space.factors()) {
            match out.get_mut(factor) {
                Some(together) => *together += &format!(" with {}", varied.name),
                None => out.push(varied.name.clone()),
            }
        }
        out
    }

    /// The standardised regression of numbers over all varied parameters; `None` for fewer samples than unknowns, for a constant
    /// number, and if parameters do not vary independently.
    fn shares(&self, with: &[(SweepRowOf<'_>, f64)], mean: f64, squares: f64) -> (Vec<SweptShare>, Option<f64>) {
        let varied = &self.plan.head.varied;
        let (n, k) = (with.len(), varied.len());
        if n < 2 * k + 2 || squares <= 0.0 {
            return (Vec::new(), None);
        }
        let column = |j: usize| with.iter().map(move |(row, _)| row.values[j]);
        let means: Vec<f64> = (0..k).map(|j| column(j).sum::<f64>() / n as f64).collect();
        let sizes: Vec<f64> =
            (0..k).map(|j| column(j).map(|x| (x - means[j]) * (x - means[j])).sum::<f64>().sqrt()).collect();
        let moving: Vec<usize> = (0..k).filter(|&j| sizes[j] > 1e-12 * means[j].abs() * (n as f64).sqrt()).collect();
        let scaled = |row: SweepRowOf<'_>, j: usize| (row.values[j] - means[j]) / sizes[j];
        let product = |i: usize, j: usize| with.iter().map(|(row, _)| scaled(*row, i) * scaled(*row, j)).sum::<f64>();
        let correlations = Matrix::from_fn(moving.len(), moving.len(), |i, j| product(moving[i], moving[j]));
        let size = squares.sqrt();
        let own = |j: usize| with.iter().map(|(row, x)| scaled(*row, j) * (x - mean) / size).sum::<f64>();
        let right = Matrix::from_fn(moving.len(), 1, |i, _| own(moving[i]));
        let Some(slopes) = correlations.solve(&right) else { return (Vec::new(), None) };
        let explained = (0..moving.len()).map(|i| slopes[(i, 0)] * right[(i, 0)]).sum::<f64>();
        let share = |(i, &j): (usize, &usize)| SweptShare { parameter: varied[j].name.clone(), slope: slopes[(i, 0)] };
        let mut shares: Vec<SweptShare> = moving.iter().enumerate().map(share).collect();
        shares.sort_by(|a, b| b.slope.abs().total_cmp(&a.slope.abs()));
        (shares, Some(explained.clamp(0.0, 1.0)))
    }
}

/// The quantile of sorted numbers, with linear interpolation.
fn quantile(sorted: &[f64], part: f64) -> f64 {
    let place = part * (sorted.len() - 1) as f64;
    let (below, rest) = (place.floor() as usize, place.fract());
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + rest * (sorted[above] - sorted[below])
}

#[cfg(test)]
#[path = "../../../tests/unit/study/sweep/statistics.rs"]
mod tests;

//! Statistics of many rows.

use statrs::distribution::{Beta, ContinuousCDF};

use super::indices::{effects, sobol_indices};
use super::points::Axis;
use kardan_math::num::Matrix;
use kardan_results::{SweepRowOf, SweepRows, SweptEffect, SweptIndex, SweptRequirement, SweptShare, SweptValues};

/// Confidence of intervals of probabilities.
pub(super) const CONFIDENCE: f64 = 0.95;
/// Probabilities of the reported quantiles.
const PARTS: [f64; 7] = [0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0];

/// The origin of samples.
#[derive(Debug, Clone, Copy)]
pub(super) enum Sampled<'a> {
    /// From the distributions.
    Drawn,
    /// All combinations of some values, or each depends on earlier ones.
    NotDrawn,
    /// Groups of A, B, and A with one axis after another of B.
    Saltelli { group: u64 },
    /// Paths.
    Morris { group: u64, axes: &'a [Axis] },
}

impl Sampled<'_> {
    /// Whether their fractions are probabilities.
    pub fn is_drawn(self) -> bool {
        matches!(self, Self::Drawn | Self::Saltelli { .. })
    }

    /// Whether a sample is an independent draw.
    fn counts(self, sample: u64) -> bool {
        !matches!(self, Self::Saltelli { group } if sample % group > 1)
    }
}

/// Rows, by sample and variant, with their context: input of the statistics.
pub(super) struct SweepStatistics<'a> {
    pub rows: &'a SweepRows,
    /// Names of the varied parameters.
    pub parameters: Vec<String>,
    /// The same, with parameters that vary together merged.
    pub moving: Vec<String>,
    /// Names of the variants.
    pub variants: &'a [String],
    /// Their origin.
    pub sampled: Sampled<'a>,
    /// Their seed.
    pub seed: u64,
    /// Confidence of intervals of probabilities.
    pub confidence: f64,
}

impl SweepStatistics<'_> {
    /// Rows of a variant, only the independent draws if there are others.
    pub fn of(&self, variant: &str) -> impl Iterator<Item = SweepRowOf<'_>> {
        self.all_of(variant).filter(|row| self.sampled.counts(row.sample))
    }

    fn all_of(&self, variant: &str) -> impl Iterator<Item = SweepRowOf<'_>> {
        let number = self.variants.iter().position(|name| name == variant);
        self.rows.iter().filter(move |row| Some(row.variant) == number)
    }

    pub fn fill_requirement(&self, number: usize, out: &mut SweptRequirement) {
        let verdicts = self.of(&out.variant).map(|row| row.passed[number]).filter(|verdict| !verdict.is_nan());
        let (passed, failed) =
            verdicts.fold((0, 0), |(yes, no), one| if one > 0.5 { (yes + 1, no) } else { (yes, no + 1) });
        (out.passed, out.failed) = (passed, failed);
        let all = passed + failed;
        if all > 0 && self.sampled.is_drawn() {
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
        let (Sampled::Saltelli { group } | Sampled::Morris { group, .. }) = self.sampled else {
            return (Vec::new(), Vec::new());
        };
        let mut groups: Vec<(u64, Vec<f64>)> = Vec::new();
        for row in self.all_of(variant) {
            let first = row.sample / group * group;
            match groups.last_mut().filter(|(own, _)| *own == first) {
                Some((_, numbers)) => numbers.push(number(row)),
                None => groups.push((first, vec![number(row)])),
            }
        }
        groups.retain(|(_, numbers)| numbers.len() as u64 == group);
        match self.sampled {
            Sampled::Morris { axes, .. } => {
                let place = |sample: u64, axis: usize| axes[axis].at(sample);
                (Vec::new(), effects(&groups, place, &self.parameters))
            }
            _ => {
                groups.retain(|(_, numbers)| numbers.iter().all(|x| x.is_finite()));
                let groups: Vec<Vec<f64>> = groups.into_iter().map(|(_, numbers)| numbers).collect();
                (sobol_indices(&groups, &self.moving, self.seed), Vec::new())
            }
        }
    }

    /// The standardised regression of numbers over all varied parameters; `None` for fewer samples than unknowns, for a constant
    /// number, and if parameters do not vary independently.
    fn shares(&self, with: &[(SweepRowOf<'_>, f64)], mean: f64, squares: f64) -> (Vec<SweptShare>, Option<f64>) {
        let (n, k) = (with.len(), self.parameters.len());
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
        let share =
            |(i, &j): (usize, &usize)| SweptShare { parameter: self.parameters[j].clone(), slope: slopes[(i, 0)] };
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

/// The interval of a probability with `hits` of `all` observed.
pub(super) fn clopper_pearson(hits: u64, all: u64, confidence: f64) -> [f64; 2] {
    let (k, n, tail) = (hits as f64, all as f64, 0.5 * (1.0 - confidence));
    let point = |a: f64, b: f64, part: f64| Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(part));
    // At the ends there is a closed form.
    let low = match hits {
        0 => 0.0,
        _ if hits == all => kardan_rt::functions::exp(kardan_rt::functions::ln(tail) / n),
        _ => point(k, n - k + 1.0, tail),
    };
    let high = match hits {
        _ if hits == all => 1.0,
        0 => 1.0 - kardan_rt::functions::exp(kardan_rt::functions::ln(tail) / n),
        _ => point(k + 1.0, n - k, 1.0 - tail),
    };
    [low, high]
}

#[cfg(test)]
#[path = "../../../tests/unit/study/sweep/statistics.rs"]
mod tests;

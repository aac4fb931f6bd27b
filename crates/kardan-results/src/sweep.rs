//! Results of a model over many values of its parameters.

use schemars::JsonSchema;
use serde::Serialize;

use super::DisplayUnit;

/// Many runs of a model with values drawn from distributions, and their statistics.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Sweep {
    /// Name of the model.
    pub model: String,
    /// From the file.
    pub description: String,
    /// Number of requested samples.
    pub samples: u64,
    /// Seed of the samples, together with their numbers.
    pub seed: u64,
    /// How samples fill the space: `latin_hypercube`, `sobol`, `halton`, `random`, `corners`, `grid`, `saltelli`, `morris`; `worst` of a search
    /// and `rare` of one for rare events, whose samples follow from those before them.
    pub points: String,
    /// The variants that ran with each sample.
    pub variants: Vec<String>,
    /// The varied parameters.
    pub varied: Vec<SweptParameter>,
    /// Runs that were made, including failed and rejected ones.
    pub rows: u64,
    /// Runs that were not made.
    pub missing: u64,
    /// Each requirement in each variant that it applies to.
    pub requirements: Vec<SweptRequirement>,
    /// Each figure in each variant that it applies to.
    pub figures: Vec<SweptFigure>,
    /// Why runs ended early, were rejected or failed.
    pub failures: Vec<SweptFailure>,
    /// The confidence of the intervals of probabilities: 0.95.
    pub confidence: f64,
    /// The stop of sampling by the width of intervals, if requested.
    pub stopping_rule: Option<SweptUntil>,
    /// The worst case that a search found, if requested.
    pub worst: Option<SweptWorst>,
    /// The probability of a rare failure, if requested.
    pub rare: Option<SweptRare>,
    /// Deviation of SIMD ensemble runs from the reference, if there were any.
    pub compared: Option<SweptCompared>,
    /// Notes to the reader.
    pub notes: Vec<String>,
    /// Reasons to doubt the sweep.
    pub warnings: Vec<String>,
}

/// SIMD ensemble runs that the reference has also run.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptCompared {
    /// How many.
    pub rows: u64,
    /// Largest difference of figures and measures of requirements, relative to the number, or to a bound on it if that is larger.
    pub difference: f64,
    /// The sample with that difference.
    pub sample: u64,
    /// Its variant.
    pub variant: String,
}

/// A parameter that varied.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptParameter {
    /// Its name.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Its distribution as text.
    pub distribution: String,
}

/// A requirement over all samples.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SweptRequirement {
    /// As text: `max |driver.tau| < 3 N m`.
    pub text: String,
    /// The variant.
    pub variant: String,
    /// SI unit of the measure.
    pub unit: String,
    /// The unit of its bounds in the file, if that differs.
    pub display: Option<DisplayUnit>,
    /// Upper bound of the measure, SI.
    pub below: Option<f64>,
    /// Lower bound of the measure, SI.
    pub above: Option<f64>,
    /// Samples that satisfy it.
    pub passed: u64,
    /// Samples that violate it, including those whose run ended early.
    pub failed: u64,
    /// The fraction that satisfies it; `null` on a grid, whose samples are not random.
    pub probability: Option<f64>,
    /// An interval for its probability at the confidence of the sweep (Clopper and Pearson, Biometrika 26, 1934, 404), for samples that are drawn each by itself;
    /// those of a Latin hypercube spread no more, but for a part of one in n (Owen, SIAM J. Numer. Anal. 34, 1997, 1884).
    pub interval: Option<[f64; 2]>,
    /// Its measure over all samples.
    pub measured: SweptValues,
    /// Regions where it fails, by decreasing number of failures; empty if no region is better than chance.
    pub rules: Vec<SweptRule>,
}

/// Where a requirement fails: a leaf of a tree of thresholds (CART: Breiman, Friedman, Olshen, Stone, Classification and Regression Trees, 1984)
/// that is fitted to a random half of the samples; its numbers are those of the other half.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptRule {
    /// All of them are true there.
    pub bounds: Vec<SweptBound>,
    /// Number of samples there.
    pub inside: u64,
    /// Number of those that fail.
    pub failed: u64,
    /// An interval for the probability of failing there, at the confidence of the sweep (Clopper and Pearson).
    pub interval: [f64; 2],
    /// The fraction of all failures there.
    pub coverage: f64,
}

/// The range of a parameter.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptBound {
    /// The parameter.
    pub parameter: String,
    /// Its SI unit.
    pub unit: String,
    /// It is below this one.
    pub below: Option<f64>,
    /// It is at least this one.
    pub above: Option<f64>,
}

/// A figure over all samples.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptFigure {
    /// Its name.
    pub name: String,
    /// Its description.
    pub text: String,
    /// The variant.
    pub variant: String,
    /// SI unit.
    pub unit: String,
    /// The display unit of the file, if that differs.
    pub display: Option<DisplayUnit>,
    /// Its values, over all samples.
    pub values: SweptValues,
}

/// Numbers of many samples, SI.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SweptValues {
    /// Runs of these samples.
    pub runs: u64,
    /// Number of those that did not reach their end: their measures up to there are left out.
    pub invalid_runs: u64,
    /// How many samples have a number.
    pub count: u64,
    /// Their mean.
    pub mean: Option<f64>,
    /// Their standard deviation.
    pub deviation: Option<f64>,
    /// The numbers below which 0, 5, 25, 50, 75, 95 and 100 % of them lie.
    pub quantiles: Option<[f64; 7]>,
    /// The samples of the least and of the largest one.
    pub extreme_samples: Option<[u64; 2]>,
    /// The part that each parameter explains, the largest first.
    pub shares: Vec<SweptShare>,
    /// The part of the variance that a linear regression on all parameters explains; the rest is nonlinear or from interactions.
    pub r_squared: Option<f64>,
    /// Indices of Sobol of each parameter, the largest total one first; of `points = "saltelli"` alone.
    pub indices: Vec<SweptIndex>,
    /// Elementary effects of each parameter, the largest first; of `points = "morris"` alone.
    pub effects: Vec<SweptEffect>,
}

/// Fractions of the variance of a number (Sobol, Math. Comput. Simul. 55, 2001, 271), with intervals of a bootstrap over the base samples.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptIndex {
    /// The parameter; of those that vary together all, with ` with ` between them: they have one index.
    pub parameter: String,
    /// The first-order index (Saltelli and others, Comput. Phys. Commun. 181, 2010, 259, table 2 (b)).
    pub first: f64,
    /// An interval for it, 95 %.
    pub first_interval: [f64; 2],
    /// The total index, with all interactions (Jansen, ibid. (f)).
    pub total: f64,
    /// An interval for it, 95 %.
    pub total_interval: [f64; 2],
    /// Base samples with all their numbers.
    pub count: u64,
}

/// Change of a number when one parameter alone changes by 0.6 of its probability (Morris, Technometrics 33, 1991, 161), divided by that part.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptEffect {
    /// The parameter.
    pub parameter: String,
    /// Mean of the magnitudes of its effects, μ*.
    pub size: f64,
    /// Standard error of that mean.
    pub size_error: Option<f64>,
    /// Mean of its effects, μ.
    pub mean: f64,
    /// Their standard deviation, σ: large if the effect is nonlinear or interacts with others.
    pub deviation: Option<f64>,
    /// How many effects there are.
    pub count: u64,
}

/// Sampling until intervals are narrow.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptUntil {
    /// Half of the requested width.
    pub half_width: f64,
    /// Samples at the last check.
    pub samples: u64,
    /// Largest number of checks of the intervals.
    pub interim_analyses: u64,
    /// The confidence of the intervals at each check, so that all checks together have the confidence of the sweep (Bonferroni).
    pub confidence: f64,
    /// Whether all intervals reach that width.
    pub converged: bool,
}

/// The worst case that a search found; there may be a worse one.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptWorst {
    /// The requirement as text.
    pub text: String,
    /// The variant; of several, the one with the least margin.
    pub variant: String,
    /// SI unit of the margin.
    pub unit: String,
    /// Distance of the measure from its bound, SI; below zero it fails. `null` of a run that failed without a number.
    pub margin: Option<f64>,
    /// The measure there.
    pub measured: Option<f64>,
    /// Whether the requirement fails there.
    pub fails: bool,
    /// The sample.
    pub sample: u64,
    /// Its values.
    pub values: Vec<SweptAt>,
    /// The least margin of the samples before the search.
    pub margin_before_search: Option<f64>,
    /// Samples before the search.
    pub exploration_samples: u64,
    /// Number of restarts of the search from another point.
    pub restarts: u64,
}

/// A value of a varied parameter.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptAt {
    /// The parameter.
    pub parameter: String,
    /// SI unit.
    pub unit: String,
    /// SI value.
    pub value: f64,
}

/// The probability that a requirement fails, where that is rare, by subset simulation (Au, Beck, Probab. Eng. Mech. 16, 2001, 263).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptRare {
    /// The requirement as text.
    pub text: String,
    /// The variant, or all those in which it may fail.
    pub variant: String,
    /// SI unit of the margins.
    pub unit: String,
    /// The probability of failing; `null` if no level reached failures.
    pub probability: Option<f64>,
    /// Its relative standard deviation by the correlation within the chains of each level, with independent levels.
    pub deviation: Option<f64>,
    /// The same with fully dependent levels: an upper bound if the correlations within the chains are correct.
    pub deviation_upper_bound: Option<f64>,
    /// About 95 %: that of a lognormal number with the mean of both deviations.
    pub interval: Option<[f64; 2]>,
    /// The levels, in order.
    pub levels: Vec<SweptLevel>,
    /// Why it ended.
    pub stop_reason: String,
}

/// A level of subset simulation.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptLevel {
    /// The margin below which the next level is, SI; zero at the last one.
    pub margin: f64,
    /// The fraction of its samples below that margin.
    pub fraction: f64,
    /// Its samples, including those of the previous level.
    pub samples: u64,
    /// Increase of the variance of that fraction by the correlation in its chains: 0 for independent samples.
    pub correlation: f64,
    /// The acceptance rate of its chains.
    pub acceptance_rate: Option<f64>,
}

/// Sensitivity of a number to a parameter.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptShare {
    /// The parameter.
    pub parameter: String,
    /// Standardised regression coefficient: change of the number in its standard deviations for one standard deviation of the parameter.
    pub slope: f64,
}

/// Runs without valid results: they stopped early, were rejected, or their energy balance does not close.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptFailure {
    /// Why, with `…` in place of numbers that differ among these runs.
    pub reason: String,
    /// The reason of the first of them in full.
    pub example: String,
    /// How many.
    pub count: u64,
    /// The first sample.
    pub first: u64,
    /// Its variant.
    pub variant: String,
}

/// A run of a sweep, by itself or as part of [`SweepRows`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SweepRow<Text = String, Numbers = Vec<f64>> {
    /// Number of its sample, from 0.
    pub sample: u64,
    /// Number of its variant.
    pub variant: usize,
    /// Why it has no valid results: it did not reach its end, or its energy balance does not close; empty otherwise.
    pub reason: Text,
    /// Values of the varied parameters, SI.
    pub values: Numbers,
    /// Measures of its requirements, SI; NaN for those of other variants, and without a number.
    pub measured: Numbers,
    /// Whether they are satisfied: 1, 0, NaN for those of other variants.
    pub passed: Numbers,
    /// Its figures, SI, likewise.
    pub figures: Numbers,
    /// For a SIMD ensemble run that the reference has also run: the largest difference of its numbers, relative to the number, or to a bound on it
    /// if that is larger.
    pub difference: Option<f64>,
}

/// A run as part of [`SweepRows`].
pub type SweepRowOf<'r> = SweepRow<&'r str, &'r [f64]>;

/// Rows of a sweep, many of them: eight bytes a number and thirty-two a row.
///
/// ```
/// use kardan_results::{SweepRow, SweepRows};
/// let row: SweepRow = SweepRow { values: vec![1.0, 2.0], passed: vec![1.0], measured: vec![0.5], ..SweepRow::default() };
/// let rows: SweepRows = [SweepRow { sample: 7, ..row.clone() }, row.clone()].into_iter().collect();
/// assert_eq!((rows.len(), rows.get(0).sample, rows.get(1).values), (2, 7, &[1.0, 2.0][..]));
/// assert_eq!(rows.in_order().get(0).to_row(), row);
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SweepRows {
    /// Numbers of values, measures, verdicts and figures of each row.
    counts: [usize; 4],
    /// Of each row its sample, its variant, and the number of the reason why it did not reach its end.
    heads: Vec<(u64, u32, u32)>,
    numbers: Vec<f64>,
    /// Reasons; the first one is empty.
    reasons: Vec<String>,
}

impl SweepRows {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.heads.len()
    }

    /// Numbers of a row.
    fn width(&self) -> usize {
        self.counts.iter().sum::<usize>() + 1
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.heads.is_empty()
    }

    /// Adds one; all have as many numbers as the first.
    ///
    /// # Panics
    /// If the numbers of values differ.
    pub fn push(&mut self, row: &SweepRow) {
        let lists = [&row.values, &row.measured, &row.passed, &row.figures];
        let counts = lists.map(Vec::len);
        if self.heads.is_empty() {
            (self.counts, self.reasons) = (counts, vec![String::new()]);
        }
        assert_eq!(counts, self.counts, "rows of one sweep have as many numbers");
        let none = row.reason.is_empty();
        if !none && self.reasons.last() != Some(&row.reason) {
            self.reasons.push(row.reason.clone());
        }
        let reason = if none { 0 } else { self.reasons.len() - 1 };
        self.heads.push((row.sample, row.variant as u32, reason as u32));
        lists.into_iter().for_each(|list| self.numbers.extend_from_slice(list));
        // None is a number below zero, so that equal rows are equal.
        self.numbers.push(row.difference.unwrap_or(-1.0));
    }

    /// One of them.
    ///
    /// # Panics
    /// If there are fewer.
    pub fn get(&self, number: usize) -> SweepRowOf<'_> {
        let (sample, variant, reason) = self.heads[number];
        let width = self.width();
        let (values, rest) = self.numbers[number * width..][..width].split_at(self.counts[0]);
        let (measured, rest) = rest.split_at(self.counts[1]);
        let (passed, rest) = rest.split_at(self.counts[2]);
        let (figures, difference) = rest.split_at(self.counts[3]);
        let difference = Some(difference[0]).filter(|difference| *difference >= 0.0);
        let reason = &self.reasons[reason as usize];
        SweepRowOf { sample, variant: variant as usize, reason, values, measured, passed, figures, difference }
    }

    /// All of them.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = SweepRowOf<'_>> + ExactSizeIterator {
        (0..self.len()).map(|number| self.get(number))
    }

    /// By sample, then by variant.
    #[must_use]
    pub fn in_order(self) -> Self {
        let place = |number: &usize| (self.heads[*number].0, self.heads[*number].1);
        if (1..self.len()).all(|number| place(&(number - 1)) <= place(&number)) {
            return self;
        }
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.sort_by_key(place);
        order.into_iter().map(|number| self.get(number).to_row()).collect()
    }

    /// Those of some samples, of rows in order.
    pub fn range(&self, samples: std::ops::Range<u64>) -> std::ops::Range<usize> {
        let place = |sample: u64| self.heads.partition_point(|head| head.0 < sample);
        place(samples.start)..place(samples.end)
    }

    /// Keeps only those of that range.
    pub fn restrict(&mut self, range: std::ops::Range<usize>) {
        let width = self.width();
        self.heads.truncate(range.end);
        self.heads.drain(..range.start);
        self.numbers.truncate(range.end * width);
        self.numbers.drain(..range.start * width);
    }
}

impl FromIterator<SweepRow> for SweepRows {
    fn from_iter<I: IntoIterator<Item = SweepRow>>(rows: I) -> Self {
        let mut out = Self::default();
        out.extend(rows);
        out
    }
}

impl Extend<SweepRow> for SweepRows {
    fn extend<I: IntoIterator<Item = SweepRow>>(&mut self, rows: I) {
        rows.into_iter().for_each(|row| self.push(&row));
    }
}

impl SweepRowOf<'_> {
    /// By itself.
    pub fn to_row(self) -> SweepRow {
        let Self { sample, variant, reason, values, measured, passed, figures, difference } = self;
        let [values, measured, passed, figures] = [values, measured, passed, figures].map(<[f64]>::to_vec);
        SweepRow { sample, variant, reason: reason.into(), values, measured, passed, figures, difference }
    }
}

/// The head of the rows of a sweep.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SweepHead {
    /// The identity of the samples and their runs, as text: rows with another identity belong to another sweep.
    pub identity: String,
    /// How many samples there are.
    pub samples: u64,
    /// Their seed.
    pub seed: u64,
    /// The varied parameters.
    pub varied: Vec<SweptParameter>,
    /// Names of the variants.
    pub variants: Vec<String>,
    /// Its requirements.
    pub requirements: Vec<SweepRequirement>,
    /// Figures: their names, with their SI units.
    pub figures: Vec<(String, String)>,
}

/// A requirement on the runs of a sweep.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SweepRequirement {
    /// As text: `max |driver.tau| < 3 N m`.
    pub text: String,
    /// Its measure as text: `max |driver.tau|`.
    pub measured: String,
    /// SI unit of the measure.
    pub unit: String,
    /// The unit of its bounds in the file, if that differs.
    pub display: Option<DisplayUnit>,
    /// Upper bound of the measure, SI.
    pub below: Option<f64>,
    /// Lower bound of the measure, SI.
    pub above: Option<f64>,
}

/// A row of a sweep to run again.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RowAgain {
    /// The number of the sample.
    pub sample: u64,
    /// The name of the variant.
    pub variant: String,
    /// Names and values, SI.
    pub values: Vec<(String, f64)>,
}

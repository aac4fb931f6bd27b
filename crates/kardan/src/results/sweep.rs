//! What a model does over many values of its parameters.

use schemars::JsonSchema;
use serde::Serialize;

use super::DisplayUnit;

/// Many runs of a model with values drawn from distributions, and what they say together.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Sweep {
    /// Name of the model.
    pub model: String,
    /// From the file.
    pub description: String,
    /// How many samples were asked for.
    pub samples: u64,
    /// What the samples follow from, with their numbers.
    pub seed: u64,
    /// How samples fill the space: `latin_hypercube`, `sobol`, `halton`, `random`, `corners`, `grid`, `saltelli`, `morris`; `worst` of a search
    /// and `rare` of one for rare events, whose samples follow from those before them.
    pub points: String,
    /// The variants that ran with each sample.
    pub variants: Vec<String>,
    /// What varied.
    pub varied: Vec<SweptParameter>,
    /// Runs that were made, those that failed or were refused among them.
    pub rows: u64,
    /// Runs that were not made.
    pub missing: u64,
    /// Each requirement in each variant that it applies to.
    pub requirements: Vec<SweptRequirement>,
    /// Each figure in each variant that it applies to.
    pub figures: Vec<SweptFigure>,
    /// Why runs ended early, were refused or failed.
    pub failures: Vec<SweptFailure>,
    /// The confidence of the intervals of probabilities: 0.95.
    pub confidence: f64,
    /// How samples were ended by the width of intervals, if that was asked for.
    pub stopping_rule: Option<SweptUntil>,
    /// The worst case that a search found, if one was asked for.
    pub worst: Option<SweptWorst>,
    /// The probability of a rare failure, if it was asked for.
    pub rare: Option<SweptRare>,
    /// How far runs side by side are from the reference, where there were such.
    pub compared: Option<SweptCompared>,
    /// What the reader must know.
    pub notes: Vec<String>,
    /// What speaks against the sweep.
    pub warnings: Vec<String>,
}

/// Runs side by side in lanes that were run by the reference too.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptCompared {
    /// How many.
    pub rows: u64,
    /// By how much figures and what requirements measure differ at most: as a part of the number, or of a bound on it where that is larger.
    pub difference: f64,
    /// The sample where they do.
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
    /// How it was distributed, in words.
    pub distribution: String,
}

/// A requirement over all samples.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptRequirement {
    /// In words: `max |driver.tau| < 3 N m`.
    pub text: String,
    /// The variant.
    pub variant: String,
    /// SI unit of what is measured.
    pub unit: String,
    /// The unit of its bounds in the file, where that is another one.
    pub display: Option<DisplayUnit>,
    /// What is measured must be below this, SI.
    pub below: Option<f64>,
    /// What is measured must be above this, SI.
    pub above: Option<f64>,
    /// Samples in which it holds.
    pub passed: u64,
    /// Samples in which it does not, those whose run ended early among them.
    pub failed: u64,
    /// The part in which it holds; nothing on a grid, whose samples are no draw.
    pub probability: Option<f64>,
    /// An interval for its probability at the confidence of the sweep (Clopper and Pearson, Biometrika 26, 1934, 404), for samples that are drawn each by itself;
    /// those of a Latin hypercube spread no more, but for a part of one in n (Owen, SIAM J. Numer. Anal. 34, 1997, 1884).
    pub interval: Option<[f64; 2]>,
    /// What is measured, over all samples.
    pub measured: SweptValues,
    /// Where it fails, what covers the most failures first; empty where nothing better than chance is known.
    pub rules: Vec<SweptRule>,
}

/// Where a requirement fails: a leaf of a tree of thresholds (CART: Breiman, Friedman, Olshen, Stone, Classification and Regression Trees, 1984)
/// that is grown on one half of the samples, by lot; its numbers are those of the other half.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptRule {
    /// All of them hold there.
    pub bounds: Vec<SweptBound>,
    /// How many samples are there.
    pub inside: u64,
    /// How many of those fail.
    pub failed: u64,
    /// An interval for the probability of failing there, at the confidence of the sweep (Clopper and Pearson).
    pub interval: [f64; 2],
    /// The part of all failures that lies there.
    pub coverage: f64,
}

/// Between which values a parameter is.
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
    /// What it is, in words.
    pub text: String,
    /// The variant.
    pub variant: String,
    /// SI unit.
    pub unit: String,
    /// The unit in which the file wants it told, where that is another one.
    pub display: Option<DisplayUnit>,
    /// Its values, over all samples.
    pub values: SweptValues,
}

/// Numbers of many samples, SI.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SweptValues {
    /// Runs of these samples.
    pub runs: u64,
    /// How many of them did not come to their end: what they measured up to there is left out.
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
    /// How much of it each parameter explains, the largest first.
    pub shares: Vec<SweptShare>,
    /// The part of the variance that a straight line through all parameters explains; what is missing bends or comes from products.
    pub r_squared: Option<f64>,
    /// Indices of Sobol of each parameter, the largest total one first; of `points = "saltelli"` alone.
    pub indices: Vec<SweptIndex>,
    /// Elementary effects of each parameter, the largest first; of `points = "morris"` alone.
    pub effects: Vec<SweptEffect>,
}

/// Parts of the variance of a number (Sobol, Math. Comput. Simul. 55, 2001, 271), with intervals of a bootstrap over the base samples.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptIndex {
    /// The parameter; of those that vary together all, with ` with ` between them: they have one index.
    pub parameter: String,
    /// The part that it explains alone (Saltelli and others, Comput. Phys. Commun. 181, 2010, 259, table 2 (b)).
    pub first: f64,
    /// An interval for it, 95 %.
    pub first_interval: [f64; 2],
    /// The part that would be left if all others were known: alone and with others (Jansen, ibid. (f)).
    pub total: f64,
    /// An interval for it, 95 %.
    pub total_interval: [f64; 2],
    /// Base samples with all their numbers.
    pub count: u64,
}

/// How a number moves where one parameter alone moves by 0.6 of its probability (Morris, Technometrics 33, 1991, 161), divided by that part.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptEffect {
    /// The parameter.
    pub parameter: String,
    /// Mean of the sizes of its effects, μ*.
    pub size: f64,
    /// Standard error of that mean.
    pub size_error: Option<f64>,
    /// Mean of its effects, μ.
    pub mean: f64,
    /// Their standard deviation, σ: large where it bends, or acts together with others.
    pub deviation: Option<f64>,
    /// How many effects there are.
    pub count: u64,
}

/// Samples until intervals are narrow.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptUntil {
    /// Half of the width that was asked for.
    pub half_width: f64,
    /// Samples of the last look.
    pub samples: u64,
    /// How often the intervals are looked at, at most.
    pub interim_analyses: u64,
    /// The confidence of the intervals of each look, so that those of all looks hold together at the confidence of the sweep (Bonferroni).
    pub confidence: f64,
    /// Whether all are as narrow.
    pub converged: bool,
}

/// The worst case that a search found; there may be a worse one.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptWorst {
    /// The requirement in words.
    pub text: String,
    /// The variant, of several that with the least margin.
    pub variant: String,
    /// SI unit of the margin.
    pub unit: String,
    /// How far what is measured is from its bound, SI; below zero it fails. Nothing of a run that failed without a number.
    pub margin: Option<f64>,
    /// What is measured there.
    pub measured: Option<f64>,
    /// Whether the requirement fails there.
    pub fails: bool,
    /// The sample.
    pub sample: u64,
    /// Its values.
    pub values: Vec<SweptAt>,
    /// The least margin of the samples before the search, of as many.
    pub margin_before_search: Option<f64>,
    /// Samples before the search.
    pub exploration_samples: u64,
    /// How often the search came to rest and began from another place.
    pub restarts: u64,
}

/// A value of what varies.
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
    /// The requirement in words.
    pub text: String,
    /// The variant, or all those in any of which it fails.
    pub variant: String,
    /// SI unit of the margins.
    pub unit: String,
    /// The probability of failing; nothing where the levels did not come to failures.
    pub probability: Option<f64>,
    /// Its standard deviation by the correlation within the chains of each level, the levels taken as independent, as a part of it.
    pub deviation: Option<f64>,
    /// The same, the levels taken as wholly dependent: an upper bound as far as the correlations within the chains are known.
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
    /// The margin below which the next level lies, SI; zero at the last one.
    pub margin: f64,
    /// The part of its samples that lies below.
    pub fraction: f64,
    /// Its samples, those that the level before gave among them.
    pub samples: u64,
    /// By how much the correlation in its chains raises the variance of that part: 0 of independent samples.
    pub correlation: f64,
    /// The part of its candidates that its chains took.
    pub acceptance_rate: Option<f64>,
}

/// How a number follows a parameter.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptShare {
    /// The parameter.
    pub parameter: String,
    /// Standard deviations by which the number moves for one of the parameter: the coefficient of the regression, standardised.
    pub slope: f64,
}

/// Runs without valid results: that stopped early, were refused, or whose energy balance does not close.
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

/// A run of a sweep.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SweepRow {
    /// Number of its sample, from 0.
    pub sample: u64,
    /// Number of its variant.
    pub variant: usize,
    /// Why it has no valid results: it did not come to its end, or its energy balance does not close; empty if it has.
    pub reason: String,
    /// Values of what varies, SI.
    pub values: Vec<f64>,
    /// What its requirements measure, SI; NaN for those of other variants, and without a number.
    pub measured: Vec<f64>,
    /// Whether they hold: 1, 0, NaN for those of other variants.
    pub passed: Vec<f64>,
    /// Its figures, SI, likewise.
    pub figures: Vec<f64>,
    /// Of a run in lanes that was also run by the reference, by how much a number of it differs at most: as a part of that number, or of a bound on it
    /// where that is larger.
    pub difference: Option<f64>,
}

/// Rows of a sweep, many of them: eight bytes a number and thirty-two a row.
///
/// ```
/// use kardan::results::{SweepRow, SweepRows};
/// let row = SweepRow { values: vec![1.0, 2.0], passed: vec![1.0], measured: vec![0.5], ..SweepRow::default() };
/// let rows: SweepRows = [SweepRow { sample: 7, ..row.clone() }, row.clone()].into_iter().collect();
/// assert_eq!((rows.len(), rows.get(0).sample, rows.get(1).values), (2, 7, &[1.0, 2.0][..]));
/// assert_eq!(rows.in_order().get(0).to_row(), row);
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SweepRows {
    /// How many values, measured numbers, verdicts and figures each has.
    counts: [usize; 4],
    /// Of each its sample, its variant, and the number of why it did not come to its end.
    heads: Vec<(u64, u32, u32)>,
    numbers: Vec<f64>,
    /// Reasons in turn; the first one is none.
    reasons: Vec<String>,
}

/// One of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepRowOf<'r> {
    /// See [`SweepRow`], as for all of it.
    pub sample: u64,
    /// Number of its variant.
    pub variant: usize,
    /// Why it did not come to its end.
    pub reason: &'r str,
    /// Values of what varies.
    pub values: &'r [f64],
    /// What its requirements measure.
    pub measured: &'r [f64],
    /// Whether they hold.
    pub passed: &'r [f64],
    /// Its figures.
    pub figures: &'r [f64],
    /// By how much it differs from the reference.
    pub difference: Option<f64>,
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
    /// Where it has not.
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
    /// Where there are not as many.
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

    /// Leaves those of that range alone.
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

/// What the rows of a sweep are of.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SweepHead {
    /// What the samples and their runs follow from, as a text: rows of another one are those of another sweep.
    pub identity: String,
    /// How many samples there are.
    pub samples: u64,
    /// What they follow from.
    pub seed: u64,
    /// What varies.
    pub varied: Vec<SweptParameter>,
    /// Names of the variants.
    pub variants: Vec<String>,
    /// Its requirements.
    pub requirements: Vec<SweepRequirement>,
    /// Figures: their names, with their SI units.
    pub figures: Vec<(String, String)>,
}

/// What a requirement asks of the runs of a sweep.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SweepRequirement {
    /// In words: `max |driver.tau| < 3 N m`.
    pub text: String,
    /// What is measured, in words: `max |driver.tau|`.
    pub measured: String,
    /// SI unit of what is measured.
    pub unit: String,
    /// The unit of its bounds in the file, where that is another one.
    pub display: Option<DisplayUnit>,
    /// What is measured must be below this, SI.
    pub below: Option<f64>,
    /// What is measured must be above this, SI.
    pub above: Option<f64>,
}

/// A row of a sweep that is to be run again.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RowAgain {
    /// The number of the sample.
    pub sample: u64,
    /// The name of the variant.
    pub variant: String,
    /// Names and values, SI.
    pub values: Vec<(String, f64)>,
}

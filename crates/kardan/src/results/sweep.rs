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
    /// How samples fill the space: `latin_hypercube`, `sobol`, `halton`, `random`, `corners`, `grid`.
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
    /// What the reader must know.
    pub notes: Vec<String>,
    /// What speaks against the sweep.
    pub warnings: Vec<String>,
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
    pub covers: f64,
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
    /// How many samples have a number.
    pub count: u64,
    /// Their mean.
    pub mean: Option<f64>,
    /// Their standard deviation.
    pub deviation: Option<f64>,
    /// The numbers below which 0, 5, 25, 50, 75, 95 and 100 % of them lie.
    pub quantiles: Option<[f64; 7]>,
    /// The samples of the least and of the largest one.
    pub ends: Option<[u64; 2]>,
    /// How much of it each parameter explains, the largest first.
    pub shares: Vec<SweptShare>,
    /// The part of the variance that a straight line through all parameters explains; what is missing bends or comes from products.
    pub explained: Option<f64>,
}

/// How a number follows a parameter.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptShare {
    /// The parameter.
    pub parameter: String,
    /// Standard deviations by which the number moves for one of the parameter: the coefficient of the regression, standardised.
    pub slope: f64,
}

/// Runs that did not come to their end.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SweptFailure {
    /// Why.
    pub reason: String,
    /// How many.
    pub count: u64,
    /// The first sample.
    pub first: u64,
    /// Its variant.
    pub variant: String,
}

/// A run of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepRow {
    /// Number of its sample, from 0.
    pub sample: u64,
    /// Number of its variant.
    pub variant: usize,
    /// Why it did not come to its end; empty if it did.
    pub reason: String,
    /// Values of what varies, SI.
    pub values: Vec<f64>,
    /// What its requirements measure, SI; NaN for those of other variants, and without a number.
    pub measured: Vec<f64>,
    /// Whether they hold: 1, 0, NaN for those of other variants.
    pub passed: Vec<f64>,
    /// Its figures, SI, likewise.
    pub figures: Vec<f64>,
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
    /// Requirements: in words, with the SI unit of what they measure.
    pub requirements: Vec<(String, String)>,
    /// Figures: their names, with their SI units.
    pub figures: Vec<(String, String)>,
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

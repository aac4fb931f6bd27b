//! A small tree of thresholds that separates failing from passing samples: each one reduces Gini's impurity most (CART: Breiman, Friedman,
//! Olshen, Stone, Classification and Regression Trees, Wadsworth 1984). It is deterministic: ties go to the first parameter and its least threshold.

use rayon::prelude::*;

/// Most thresholds between root and leaf.
const MOST_DEPTH: usize = 3;
/// Fewest samples of a leaf: absolute, and as a fraction of all.
const LEAST_LEAF: (usize, f64) = (5, 0.01);
/// A threshold reduces the impurity by at least this fraction of that of all samples.
const LEAST_GAIN: f64 = 0.01;

/// A sample with its verdict.
pub(super) struct Case<'a> {
    /// Its number.
    pub sample: u64,
    /// The values of the varied parameters.
    pub values: &'a [f64],
    /// Whether it fails.
    pub failed: bool,
}

/// Values of a parameter: from one bound on and below another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SplitRange {
    /// Its number.
    pub parameter: usize,
    /// Lower bound, inclusive.
    pub above: f64,
    /// Upper bound, exclusive.
    pub below: f64,
}

/// Samples, and those of them that fail.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Count {
    /// All.
    pub all: usize,
    /// Those that fail.
    pub failed: usize,
}

impl Count {
    /// The counts of these samples.
    pub fn of<'c>(cases: impl Iterator<Item = &'c Case<'c>>) -> Self {
        cases.fold(Self::default(), |sum, case| sum.and(case.failed))
    }

    /// Sum with another count.
    fn and(self, failed: bool) -> Self {
        Self { all: self.all + 1, failed: self.failed + usize::from(failed) }
    }

    /// The fraction that fails.
    pub fn share(self) -> f64 {
        self.failed as f64 / self.all as f64
    }

    /// Gini's impurity of a node times its samples.
    fn impurity(self) -> f64 {
        2.0 * self.share() * (self.all - self.failed) as f64
    }
}

/// A node: a subset of the samples of the tree.
struct Node<'c> {
    cases: Vec<&'c Case<'c>>,
    bounds: Vec<SplitRange>,
    depth: usize,
}

impl SplitRange {
    /// Whether a sample is inside.
    pub fn contains(&self, case: &Case<'_>) -> bool {
        (self.above..self.below).contains(&case.values[self.parameter])
    }
}

/// The leaves of the tree that is grown on these samples.
pub(super) fn leaves<'c>(cases: Vec<&'c Case<'c>>, parameters: usize) -> Vec<(Vec<SplitRange>, Count)> {
    let all = Count::of(cases.iter().copied());
    let least = LEAST_LEAF.0.max((LEAST_LEAF.1 * all.all as f64).ceil() as usize);
    let mut open = vec![Node { cases, bounds: Vec::new(), depth: 0 }];
    let mut out = Vec::new();
    while let Some(Node { cases, bounds, depth }) = open.pop() {
        let count = Count::of(cases.iter().copied());
        let found = if depth < MOST_DEPTH && count.impurity() > 0.0 {
            let each: Vec<_> = (0..parameters).into_par_iter().map(|one| best_threshold(&cases, one, least)).collect();
            let each = each.into_iter().enumerate().filter_map(|(one, found)| found.map(|(gain, at)| (gain, one, at)));
            let enough = each.filter(|(gain, _, _)| *gain > 0.0 && *gain >= LEAST_GAIN * all.impurity());
            enough.reduce(|best, one| if one.0 > best.0 { one } else { best })
        } else {
            None
        };
        let Some((_, parameter, at)) = found else {
            out.push((bounds, count));
            continue;
        };
        let (below, above): (Vec<_>, Vec<_>) = cases.into_iter().partition(|case| case.values[parameter] < at);
        let sides = [(above, at, f64::INFINITY), (below, f64::NEG_INFINITY, at)];
        open.extend(sides.map(|(cases, from, to)| {
            let bounds = tightened(&bounds, SplitRange { parameter, above: from, below: to });
            Node { cases, bounds, depth: depth + 1 }
        }));
    }
    out
}

/// Bounds with another one, one for each parameter.
fn tightened(bounds: &[SplitRange], new: SplitRange) -> Vec<SplitRange> {
    let mut out = bounds.to_vec();
    match out.iter_mut().find(|bound| bound.parameter == new.parameter) {
        Some(bound) => (bound.above, bound.below) = (bound.above.max(new.above), bound.below.min(new.below)),
        None => out.push(new),
    }
    out
}

/// By how much the best threshold of a parameter lowers the impurity, and the threshold; each side has at least the fewest samples of a leaf.
fn best_threshold(cases: &[&Case<'_>], parameter: usize, least: usize) -> Option<(f64, f64)> {
    let mut sorted: Vec<(f64, bool)> = cases.iter().map(|case| (case.values[parameter], case.failed)).collect();
    sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let all = Count::of(cases.iter().copied());
    let mut below = Count::default();
    let mut best: Option<(f64, f64, f64)> = None;
    for pair in sorted.windows(2) {
        below = below.and(pair[0].1);
        let above = Count { all: all.all - below.all, failed: all.failed - below.failed };
        if pair[0].0 < pair[1].0 && below.all.min(above.all) >= least {
            let gain = all.impurity() - below.impurity() - above.impurity();
            if best.is_none_or(|(most, _, _)| gain > most) {
                best = Some((gain, pair[0].0, pair[1].0));
            }
        }
    }
    best.map(|(gain, low, high)| (gain, halfway(low, high)))
}

/// Halfway between two numbers, with the fewest digits that lie between them.
fn halfway(low: f64, high: f64) -> f64 {
    let middle = low + 0.5 * (high - low);
    let rounded = |digits: usize| format!("{middle:.digits$e}").parse().unwrap_or(middle);
    (0..17).map(rounded).find(|at| low < *at && *at < high).unwrap_or(high)
}

#[cfg(test)]
#[path = "../../../tests/unit/study/sweep/tree.rs"]
mod tests;

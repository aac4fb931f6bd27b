//! Linear equations over letters, solved with the pivots of the numerical values of the letters.

use std::collections::BTreeMap;

use super::{Laurent, Letters};
use kardan_math::num::{Rational, Scalar};

/// A coefficient, and its number at the values of the model.
#[derive(Debug, Clone, Default)]
pub(super) struct Entry {
    pub(super) symbol: Laurent,
    pub(super) number: Rational,
}

/// An equation: the sum of its entries times their unknowns is its right side.
#[derive(Debug, Clone)]
pub(super) struct Line {
    pub(super) entries: BTreeMap<usize, Entry>,
    pub(super) right: Laurent,
}

/// The divisors: the solution is valid where none of them is zero. And expressions that are zero only for the values of the model.
#[derive(Debug, Clone, Default)]
pub(super) struct Assumed {
    pub(super) divisors: Vec<Laurent>,
    pub(super) zeros: Vec<Laurent>,
    /// A product had too many terms, and is missing.
    pub(super) too_large: bool,
}

/// The most products of terms that are formed for one product of sums.
const MOST_PRODUCTS: usize = 5000;

impl Assumed {
    /// A product, unless it has too many terms.
    pub(super) fn product(&mut self, a: &Laurent, b: &Laurent) -> Laurent {
        if a.count().saturating_mul(b.count()) > MOST_PRODUCTS {
            self.too_large = true;
            return Laurent::default();
        }
        a.times(b)
    }

    fn divisor(&mut self, pivot: &Laurent) {
        if pivot.as_number().is_none() && !self.divisors.contains(pivot) {
            self.divisors.push(pivot.clone());
        }
    }
}

/// Eliminates unknowns that may be pivots from lines; returns the lines used, each with its unknown, and keeps the others.
pub(super) fn eliminate(
    lines: &mut Vec<Line>,
    may: &dyn Fn(usize) -> bool,
    letters: &mut Letters,
    assumed: &mut Assumed,
) -> Vec<(usize, Line)> {
    let mut used = Vec::new();
    while let Some((row, column)) = pivot(lines, may).filter(|_| !assumed.too_large) {
        let own = lines.remove(row);
        let pivot = own.entries[&column].clone();
        assumed.divisor(&pivot.symbol);
        for line in lines.iter_mut() {
            let Some(entry) = line.entries.remove(&column) else { continue };
            let factor = Entry {
                symbol: letters.divide(&entry.symbol, &pivot.symbol),
                number: entry.number.over(&pivot.number),
            };
            for (k, x) in own.entries.iter().filter(|(k, _)| **k != column) {
                let before = line.entries.remove(k).unwrap_or_default();
                let after = Entry {
                    symbol: letters.cancelled(&before.symbol.minus(&assumed.product(&factor.symbol, &x.symbol))),
                    number: before.number.minus(&factor.number.times(&x.number)),
                };
                if !after.symbol.is_zero() {
                    line.entries.insert(*k, after);
                }
            }
            line.right = letters.cancelled(&line.right.minus(&assumed.product(&factor.symbol, &own.right)));
        }
        used.push((column, own));
    }
    used
}

/// The unknown of a line in terms of its other ones: `constant + Σ share·other`. Missing unknowns have a share that is zero for the values
/// of the model.
pub(super) fn solved(
    line: &Line,
    unknown: usize,
    is_resolved: &dyn Fn(usize) -> bool,
    letters: &mut Letters,
    assumed: &mut Assumed,
) -> (Laurent, BTreeMap<usize, Laurent>) {
    let pivot = line.entries[&unknown].symbol.clone();
    assumed.divisor(&pivot);
    let mut shares = BTreeMap::new();
    for (k, entry) in line.entries.iter().filter(|(k, _)| **k != unknown) {
        if !is_resolved(*k) && Scalar::is_zero(&entry.number) {
            if !assumed.zeros.contains(&entry.symbol) {
                assumed.zeros.push(entry.symbol.clone());
            }
            continue;
        }
        shares.insert(*k, letters.divide(&entry.symbol, &pivot).scaled(&Rational::from(-1)));
    }
    (letters.divide(&line.right, &pivot), shares)
}

/// A number that is not zero: one without letters before others, one term before sums, then what has the fewest neighbours.
fn pivot(lines: &[Line], may: &dyn Fn(usize) -> bool) -> Option<(usize, usize)> {
    let mut uses: BTreeMap<usize, usize> = BTreeMap::new();
    lines.iter().flat_map(|line| line.entries.keys()).for_each(|k| *uses.entry(*k).or_default() += 1);
    let all = lines.iter().enumerate().flat_map(|(row, line)| line.entries.iter().map(move |entry| (row, line, entry)));
    let fitting = all.filter(|(_, _, (k, entry))| may(**k) && !Scalar::is_zero(&entry.number));
    let cost = |(_, line, (k, entry)): &(usize, &Line, (&usize, &Entry))| {
        let kind = match (entry.symbol.as_number(), entry.symbol.single()) {
            (Some(_), _) => 0,
            (None, Some(_)) => 1,
            _ => 2,
        };
        (kind, (line.entries.len() - 1) * (uses[*k] - 1))
    };
    fitting.min_by_key(cost).map(|(row, _, (k, _))| (row, *k))
}

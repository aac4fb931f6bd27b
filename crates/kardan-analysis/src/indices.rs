//! Controllability and observability indices over the rationals.

use super::LinearSystem;
use super::images::Images;
use kardan_math::num::{Rational, Scalar, reachable};

/// More states are computed modulo primes, ...
const MOST_EXACT: usize = 32;
/// ... or with a full proof: more than these are not.
const MOST_PROVEN: usize = 64;

/// Whether ranks of powers are taken over the rationals (`true`) or modulo primes; `None`: not at all, as a proof is requested and takes too long.
pub(super) fn is_exact(states: usize, certified: bool) -> Option<bool> {
    match (states <= MOST_EXACT, certified) {
        (true, _) => Some(true),
        (false, true) => (states <= MOST_PROVEN).then_some(true),
        (false, false) => Some(false),
    }
}

/// Primes that are drawn for more states.
const PRIMES: usize = 3;

/// How many columns `Gᵏ b` of each input, `G = E⁻¹A`, `b = E⁻¹B`, are independent of those before, power by power; of outputs those of the transposed
/// system.
///
/// If [`is_exact`] over the rationals: each column is reduced by those before and G times the remainder is its next one, which
/// changes no dependence. Else modulo primes that are drawn, of which the one with the earliest independent columns is taken: modulo a prime no
/// column is independent earlier than over the rationals.
pub(super) fn indices(system: &LinearSystem, certified: bool) -> Option<Vec<usize>> {
    if is_exact(system.states.len(), certified)? { exact(system) } else { modular(system) }
}

fn exact(system: &LinearSystem) -> Option<Vec<usize>> {
    let explicit = system.explicit()?;
    let (n, inputs) = (explicit.states.len(), explicit.inputs.len());
    let mut basis: Vec<(usize, Vec<Rational>)> = Vec::new();
    let mut open: Vec<(usize, Vec<Rational>)> =
        (0..inputs).map(|input| (input, (0..n).map(|i| explicit.b[(i, input)].clone()).collect())).collect();
    let mut out = vec![0; inputs];
    while !open.is_empty() && basis.len() < n {
        let mut next = Vec::new();
        for (input, mut column) in open {
            for (pivot, row) in &basis {
                let factor = column[*pivot].clone();
                if !Scalar::is_zero(&factor) {
                    column.iter_mut().zip(row).for_each(|(x, y)| *x = x.minus(&factor.times(y)));
                }
            }
            let Some(pivot) = column.iter().position(|x| !Scalar::is_zero(x)) else { continue };
            let size = column[pivot].clone();
            column.iter_mut().for_each(|x| *x = x.over(&size));
            let moved = (0..n).map(|i| {
                let entries = explicit.a.row(i).iter().zip(&column).filter(|(a, _)| !Scalar::is_zero(*a));
                entries.fold(Rational::ZERO, |sum, (a, x)| sum.plus(&a.times(x)))
            });
            next.push((input, moved.collect()));
            basis.push((pivot, column));
            out[input] += 1;
        }
        open = next;
    }
    Some(out)
}

fn modular(system: &LinearSystem) -> Option<Vec<usize>> {
    let mut images = Images::unforeseen(system);
    let columns = |number| {
        let image = images.get(number)?;
        Some(reachable(&image.field, &image.g, &image.b).columns)
    };
    let found: Vec<Vec<(usize, usize)>> = (0..PRIMES).filter_map(columns).collect();
    // Most columns, and of as many the earliest ones.
    let best = found.into_iter().max_by_key(|columns| {
        let order = |(input, power): &(usize, usize)| std::cmp::Reverse((*power, *input));
        (columns.len(), columns.iter().map(order).collect::<Vec<_>>())
    })?;
    let count = |input: usize| best.iter().filter(|(own, _)| *own == input).count();
    Some((0..system.inputs.len()).map(count).collect())
}

#[cfg(test)]
#[path = "../tests/unit/indices.rs"]
mod tests;

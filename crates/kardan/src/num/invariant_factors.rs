//! Invariant factors over a prime field.

use super::{ModularMatrix, Operator, PrimeField, Random, Residue, Span, recurrence};

/// The non-trivial invariant factors of `sI − G`, each dividing the next, monic, coefficients of 1, s, s², …
///
/// The random vectors affect the time only, never the result:
///
/// - If a sequence `uᵀGᵏv` obeys no recurrence shorter than n, the recurrence of degree n is that of the characteristic
///   polynomial and there is one factor (the minimal polynomial has degree n).
/// - Otherwise chains `v, Gv, G²v, …` fill the space one after the other. Chain k ends with
///   `f_k(G) v_k = Σ_{j<k} h_kj(G) v_j`. It is checked that f_k divides f_{k−1} and all h_kj: then the vectors
///   `v_k − Σ (h_kj/f_k)(G) v_j`, corrected in turn, generate the space as a direct sum of cyclic parts with annihilators
///   `f_1, f_2, …`, so these are the invariant factors. Chains that fail (probability below n²/p) are drawn again.
///
/// O(n³); O(n²) for a sparse matrix with one factor.
pub fn invariant_factors(field: &PrimeField, g: &ModularMatrix, random: &mut Random) -> Vec<Vec<Residue>> {
    let n = g.rows;
    if n == 0 {
        return Vec::new();
    }
    let operator = Operator::new(g);
    let mut draw = || (0..n).map(|_| random.below(field.prime())).collect::<Vec<Residue>>();
    let (left, mut v) = (draw(), draw());
    let mut sequence = Vec::with_capacity(2 * n);
    for _ in 0..2 * n {
        sequence.push(field.dot(&left, &v));
        v = operator.apply(field, &v);
    }
    let whole = recurrence(field, &sequence);
    if whole.len() == n + 1 {
        return vec![whole];
    }
    loop {
        if let Some(factors) = chain_factors(field, &operator, n, &mut draw) {
            return factors;
        }
    }
}

/// One attempt with chains; `None` if the vectors were special.
fn chain_factors(
    field: &PrimeField,
    operator: &Operator,
    n: usize,
    mut draw: impl FnMut() -> Vec<Residue>,
) -> Option<Vec<Vec<Residue>>> {
    use super::modular_polynomial::remainder;
    let mut span = Span::default();
    let mut begins = Vec::new();
    let mut factors: Vec<Vec<Residue>> = Vec::new();
    while span.dimension() < n {
        let begin = span.dimension();
        let mut v = draw();
        let relation = loop {
            match span.insert(field, &v) {
                None => v = operator.apply(field, &v),
                Some(relation) => break relation,
            }
        };
        let mut factor: Vec<Residue> = relation[begin..].iter().map(|&c| field.negate(c)).collect();
        factor.push(field.one());
        let earlier = begins.iter().enumerate().map(|(k, &from)| &relation[from..*begins.get(k + 1).unwrap_or(&begin)]);
        let splits = earlier.chain(factors.last().map(Vec::as_slice)).all(|h| remainder(field, h, &factor).is_empty());
        if factor.len() == 1 || !splits {
            return None;
        }
        begins.push(begin);
        factors.push(factor);
    }
    factors.reverse();
    Some(factors)
}

#[cfg(test)]
mod tests {
    use super::super::modular_polynomial::product;
    use super::*;
    use crate::num::random_prime;

    fn field() -> PrimeField {
        PrimeField::new(random_prime(&mut Random::new(1)))
    }

    fn companion(f: &PrimeField, polynomial: &[Residue]) -> ModularMatrix {
        let d = polynomial.len() - 1;
        ModularMatrix::from_fn(d, d, |i, j| match (i + 1 == j, i + 1 == d) {
            (_, true) => f.negate(polynomial[j]),
            (true, _) => f.one(),
            _ => 0,
        })
    }

    /// Companion blocks of known invariant factors, hidden by a random similarity, are found again.
    #[test]
    fn hidden_invariant_factors_are_found() {
        let f = field();
        let mut random = Random::new(7);
        for _ in 0..20 {
            let linear = |x: i64| vec![f.integer(-x), f.one()];
            let (a, b, c) = (random.small(5), random.small(5), random.small(5));
            let first = linear(a);
            let second = product(&f, &first, &linear(b));
            let third = product(&f, &product(&f, &second, &linear(c)), &linear(a));
            let blocks = [companion(&f, &first), companion(&f, &second), companion(&f, &third)];
            let n = 7;
            let mut g = ModularMatrix::zeros(n, n);
            let mut at = 0;
            for block in &blocks {
                for i in 0..block.rows {
                    g.row_mut(at + i)[at..at + block.columns].copy_from_slice(block.row(i));
                }
                at += block.rows;
            }
            let t = ModularMatrix::random(&f, n, n, &mut random);
            let hidden = t.multiply(&f, &g);
            let (hidden, _) = t.transpose().solve(&f, &hidden.transpose()).unwrap();
            let hidden = hidden.transpose();
            let found = invariant_factors(&f, &hidden, &mut random);
            assert_eq!(found, [first, second, third.clone()]);
            let all = found.iter().fold(vec![f.one()], |all, next| product(&f, &all, next));
            assert_eq!(hidden.characteristic_polynomial(&f), all);
        }
    }

    /// The minor that a span stores is the determinant; special chains are not mistaken for the result.
    #[test]
    fn minors_and_defective_matrices() {
        let f = field();
        let mut random = Random::new(11);
        let m = ModularMatrix::random(&f, 5, 5, &mut random);
        let mut span = Span::default();
        (0..5).for_each(|j| assert!(span.insert(&f, &m.column(j)).is_none()));
        assert_eq!(span.minor(&f), m.determinant(&f));
        // Two Jordan blocks: the first chain starts in a proper part of the space.
        let g = ModularMatrix::from_fn(4, 4, |i, j| if j == i + 1 && i != 2 { f.one() } else { 0 });
        let factors = invariant_factors(&f, &g, &mut random);
        assert_eq!(factors, [vec![0, f.one()], vec![0, 0, 0, f.one()]]);
        let start: Vec<Vec<Residue>> = vec![vec![0, 0, 0, f.one()], vec![0, 0, f.one(), 0]];
        let mut vectors = start.into_iter();
        let special = chain_factors(&f, &Operator::new(&g), 4, || vectors.next().unwrap());
        assert_eq!(special, None);
    }
}

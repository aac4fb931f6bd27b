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
#[path = "../../tests/unit/num/invariant_factors.rs"]
mod tests;

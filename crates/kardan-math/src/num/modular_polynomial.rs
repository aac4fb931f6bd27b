//! Polynomials over a prime field: coefficients of 1, s, s², …, no leading zeros; the zero polynomial is empty.

use super::{PrimeField, Residue};

fn trim(mut p: Vec<Residue>) -> Vec<Residue> {
    while p.last() == Some(&0) {
        p.pop();
    }
    p
}

/// a · b.
pub fn product(field: &PrimeField, a: &[Residue], b: &[Residue]) -> Vec<Residue> {
    if a.is_empty() || b.is_empty() {
        return Vec::new();
    }
    let mut out = vec![0; a.len() + b.len() - 1];
    for (i, &x) in a.iter().enumerate() {
        field.subtract(&mut out[i..], field.negate(x), b);
    }
    out
}

/// Quotient and remainder.
///
/// # Panics
/// If the divisor is zero.
pub fn divide(field: &PrimeField, a: &[Residue], b: &[Residue]) -> (Vec<Residue>, Vec<Residue>) {
    let leading = field.inverse(*b.last().expect("division by the zero polynomial"));
    let mut rest = a.to_vec();
    let mut quotient = vec![0; (a.len() + 1).saturating_sub(b.len())];
    for k in (0..quotient.len()).rev() {
        let factor = field.times(rest[k + b.len() - 1], leading);
        quotient[k] = factor;
        field.subtract(&mut rest[k..k + b.len()], factor, b);
    }
    rest.truncate(b.len() - 1);
    (quotient, trim(rest))
}

/// The remainder of a by b.
pub fn remainder(field: &PrimeField, a: &[Residue], b: &[Residue]) -> Vec<Residue> {
    divide(field, a, b).1
}

/// Leading coefficient one.
pub fn monic(field: &PrimeField, p: &[Residue]) -> Vec<Residue> {
    let p = trim(p.to_vec());
    let Some(&leading) = p.last() else { return p };
    let inverse = field.inverse(leading);
    p.into_iter().map(|x| field.times(x, inverse)).collect()
}

/// The greatest common divisor, monic.
pub fn gcd(field: &PrimeField, a: &[Residue], b: &[Residue]) -> Vec<Residue> {
    let (mut a, mut b) = (trim(a.to_vec()), trim(b.to_vec()));
    while !b.is_empty() {
        let rest = remainder(field, &a, &b);
        a = std::mem::replace(&mut b, rest);
    }
    monic(field, &a)
}

/// The derivative.
pub fn derivative(field: &PrimeField, p: &[Residue]) -> Vec<Residue> {
    trim(p.iter().enumerate().skip(1).map(|(k, &x)| field.times(field.element(k as u64), x)).collect())
}

/// `(g_e, e)` with `p = Π g_e^e`, the g_e monic, square-free and coprime (Yun); the degree must be below the prime.
pub fn square_free(field: &PrimeField, p: &[Residue]) -> Vec<(Vec<Residue>, usize)> {
    let mut out = Vec::new();
    if p.len() <= 1 {
        return out;
    }
    let slope = derivative(field, p);
    let common = gcd(field, p, &slope);
    let mut b = divide(field, p, &common).0;
    let mut c = divide(field, &slope, &common).0;
    let mut exponent = 1;
    loop {
        let change = derivative(field, &b);
        let length = c.len().max(change.len());
        let at = |p: &[Residue], k: usize| p.get(k).copied().unwrap_or(0);
        let d = trim((0..length).map(|k| field.minus(at(&c, k), at(&change, k))).collect());
        let g = gcd(field, &b, &d);
        if g.len() > 1 {
            out.push((g.clone(), exponent));
        }
        b = divide(field, &b, &g).0;
        if b.len() <= 1 {
            return out;
        }
        c = divide(field, &d, &g).0;
        exponent += 1;
    }
}

/// p(s + shift).
pub fn shifted(field: &PrimeField, p: &[Residue], shift: Residue) -> Vec<Residue> {
    let mut out = p.to_vec();
    for k in 0..p.len() {
        for j in (k..p.len().saturating_sub(1)).rev() {
            out[j] = field.plus(out[j], field.times(shift, out[j + 1]));
        }
    }
    out
}

#[cfg(test)]
#[path = "../../tests/unit/num/modular_polynomial.rs"]
mod tests;

//! Reconstructs fractions from their residues modulo several primes.

use dashu_int::{IBig, UBig};

use super::{Rational, Scalar};

/// Fractions from their images modulo several primes (Chinese remainders, then continued fractions).
#[derive(Debug, Clone, Default)]
pub struct Reconstruction {
    modulus: UBig,
    residues: Vec<UBig>,
}

impl Reconstruction {
    /// No image is known yet.
    pub fn new() -> Self {
        Self { modulus: UBig::ONE, residues: Vec::new() }
    }

    /// Adds the images modulo another prime (numbers from 0 to p − 1).
    ///
    /// # Panics
    /// If their number changes.
    pub fn add(&mut self, prime: u64, images: &[u64]) {
        if self.residues.is_empty() {
            self.residues = vec![UBig::ZERO; images.len()];
        }
        assert_eq!(self.residues.len(), images.len(), "a different number of images than before");
        let field = super::PrimeField::new(prime);
        let p = UBig::from(prime);
        let low = |x: &UBig| field.element(u64::try_from(x % &p).unwrap_or_default());
        let inverse = field.inverse(low(&self.modulus));
        for (residue, &image) in self.residues.iter_mut().zip(images) {
            let step = field.times(field.minus(field.element(image), low(residue)), inverse);
            *residue += &self.modulus * UBig::from(field.value(step));
        }
        self.modulus *= p;
    }

    /// The whole numbers of least size that have these images, between −M/2 and M/2: the true ones, if those are smaller
    /// than M/2.
    pub fn integers(&self) -> Vec<IBig> {
        let half = &self.modulus / UBig::from(2u8);
        let signed = |x: &UBig| {
            if *x > half { IBig::from(x.clone()) - IBig::from(self.modulus.clone()) } else { x.clone().into() }
        };
        self.residues.iter().map(signed).collect()
    }

    /// Whether numbers have these images modulo one of the primes.
    pub fn agrees(&self, prime: u64, numbers: &[Rational]) -> bool {
        let field = super::PrimeField::new(prime);
        let same = |(x, residue): (&Rational, &UBig)| {
            field.rational(x).map(|x| UBig::from(field.value(x))) == Some(residue % UBig::from(prime))
        };
        numbers.len() == self.residues.len() && numbers.iter().zip(&self.residues).all(same)
    }

    /// The fractions with numerator and denominator below √(M/2) that have these images; `None` if one has none.
    ///
    /// They are in lowest terms: a prime that numerator and denominator had in common is one whose image does not
    /// [agree](Self::agrees).
    pub fn fractions(&self) -> Option<Vec<Rational>> {
        self.residues.iter().map(|residue| fraction(residue, &self.modulus)).collect()
    }
}

/// The fraction n/d with `n ≡ d · residue` modulo M and |n|, d ≤ √(M/2).
fn fraction(residue: &UBig, modulus: &UBig) -> Option<Rational> {
    let bound = |x: &UBig| x * x * UBig::from(2u8) <= *modulus;
    let (mut r0, mut r1) = (modulus.clone(), residue.clone());
    let (mut t0, mut t1) = (IBig::ZERO, IBig::ONE);
    while !bound(&r1) {
        let quotient = &r0 / &r1;
        let r2 = &r0 - &quotient * &r1;
        let t2 = &t0 - IBig::from(quotient) * &t1;
        (r0, r1) = (r1, r2);
        (t0, t1) = (t1, t2);
    }
    let (sign, size) = t1.into_parts();
    if size.is_zero() || !bound(&size) {
        return None;
    }
    let numerator = IBig::from(r1) * IBig::from_parts(sign, UBig::ONE);
    let out = Rational::from_parts(numerator, size);
    Some(if Scalar::is_zero(&out) { Rational::ZERO } else { out })
}

/// The fraction with the least denominator within `tolerance` (relative) of a number, by continued fractions; a guess
/// that the caller checks.
pub fn nearby_fraction(value: f64, tolerance: f64) -> Option<Rational> {
    if !value.is_finite() || value.abs() > 1e15 {
        return None;
    }
    let (mut h0, mut h1, mut k0, mut k1) = (0i128, 1i128, 1i128, 0i128);
    let mut rest = value;
    for _ in 0..40 {
        let whole = rest.floor();
        if whole.abs() > 1e16 {
            return None;
        }
        (h0, h1) = (h1, (whole as i128).checked_mul(h1)?.checked_add(h0)?);
        (k0, k1) = (k1, (whole as i128).checked_mul(k1)?.checked_add(k0)?);
        if (h1 as f64 / k1 as f64 - value).abs() <= tolerance * value.abs() {
            return Some(Rational::from_parts(IBig::from(h1), UBig::try_from(k1).ok()?));
        }
        rest = (rest - whole).recip();
    }
    None
}

#[cfg(test)]
#[path = "../../tests/unit/num/reconstruct.rs"]
mod tests;

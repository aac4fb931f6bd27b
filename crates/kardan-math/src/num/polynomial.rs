//! Polynomials with exact coefficients.

use std::collections::BTreeMap;
use std::fmt;

use dashu_int::ops::BitTest;
use dashu_int::{IBig, UBig};

use crate::names::signed_sum;

use super::modular_polynomial::{self, remainder, square_free};
use super::{PrimeField, Rational, Reconstruction, Residue, Scalar, common_denominator, prime_below, whole_multiple};

/// A polynomial in s with exact coefficients, of 1, s, s², …; no leading zeros, the zero polynomial is empty.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Polynomial {
    coefficients: Vec<Rational>,
}

impl Polynomial {
    /// From coefficients of 1, s, s², …
    pub fn new(mut coefficients: Vec<Rational>) -> Self {
        while coefficients.last().is_some_and(Scalar::is_zero) {
            coefficients.pop();
        }
        Self { coefficients }
    }

    /// The coefficients.
    pub fn coefficients(&self) -> &[Rational] {
        &self.coefficients
    }

    /// The degree; 0 for constants and the zero polynomial.
    pub fn degree(&self) -> usize {
        self.coefficients.len().saturating_sub(1)
    }

    /// A constant.
    pub fn constant(value: Rational) -> Self {
        Self::new(vec![value])
    }

    /// The monic polynomial with these roots.
    ///
    /// ```
    /// use kardan_math::num::{Polynomial, Rational};
    /// assert_eq!(Polynomial::from_roots(&[Rational::from(-1), Rational::from(3)]).to_string(), "s^2 - 2 s - 3");
    /// ```
    pub fn from_roots(roots: &[Rational]) -> Self {
        let factor = |root: &Rational| Self::new(vec![Rational::ZERO.minus(root), Rational::ONE]);
        roots.iter().fold(Self::constant(Rational::ONE), |all, root| all.times(&factor(root)))
    }

    /// Whether it is the zero polynomial.
    pub fn is_zero(&self) -> bool {
        self.coefficients.is_empty()
    }

    /// The coefficient of `s^power`, zero above the degree.
    pub fn coefficient(&self, power: usize) -> Rational {
        self.coefficients.get(power).cloned().unwrap_or(Rational::ZERO)
    }

    /// The value at a number (Horner).
    pub fn evaluate(&self, s: &Rational) -> Rational {
        let (whole, scale) = self.in_whole_numbers();
        let Some((last, rest)) = whole.split_last() else { return Rational::ZERO };
        // Σ cₖ pᵏ qⁿ⁻ᵏ over qⁿ, reduced once in the end.
        let (p, q) = (s.numerator(), IBig::from(s.denominator().clone()));
        let mut power = IBig::ONE;
        let sum = rest.iter().rev().fold(last.clone(), |sum, c| {
            power *= &q;
            sum * p + c * &power
        });
        Rational::from(sum).over(&Rational::from(power * IBig::from(scale)))
    }

    /// `factor · self`.
    pub fn scale(&self, factor: &Rational) -> Self {
        Self::new(self.coefficients.iter().map(|c| c.times(factor)).collect())
    }

    /// `self + other`.
    pub fn plus(&self, other: &Self) -> Self {
        let length = self.coefficients.len().max(other.coefficients.len());
        Self::new((0..length).map(|k| self.coefficient(k).plus(&other.coefficient(k))).collect())
    }

    /// `self · other`.
    pub fn times(&self, other: &Self) -> Self {
        if self.is_zero() || other.is_zero() {
            return Self::default();
        }
        let ((one, first), (another, second)) = (self.in_whole_numbers(), other.in_whole_numbers());
        let (out, scale) = (multiply_whole(&one, &another), first * second);
        // Reduced once in the end.
        let scale = Rational::from(scale);
        let reduced = |c: IBig| if scale.is_one() { Rational::from(c) } else { Rational::from(c).over(&scale) };
        Self::new(out.into_iter().map(reduced).collect())
    }

    /// The same up to a factor, with whole coefficients that have no common divisor, the leading one positive.
    pub fn primitive(&self) -> Self {
        let whole = self.monic().whole_coefficients();
        Self { coefficients: whole.into_iter().map(Rational::from).collect() }
    }

    /// The greatest common divisor, monic; zero only if both polynomials are zero.
    ///
    /// Method: modulo primes below 2⁶¹, brought back with the common divisor of the leading coefficients. A divisor modulo a
    /// prime has at least the degree of the true one, so a candidate that divides both exactly is the greatest one.
    ///
    /// ```
    /// use kardan_math::num::{Polynomial, Rational};
    /// let roots = |list: &[i64]| Polynomial::from_roots(&list.iter().map(|&x| Rational::from(x)).collect::<Vec<_>>());
    /// assert_eq!(roots(&[1, 2, 2, 5]).gcd(&roots(&[2, 5, 7])), roots(&[2, 5]));
    /// ```
    pub fn gcd(&self, other: &Self) -> Self {
        if self.is_zero() || other.is_zero() {
            return if self.is_zero() { other.monic() } else { self.monic() };
        }
        let (a, b) = (self.whole_coefficients(), other.whole_coefficients());
        let leading = dashu_int::ops::Gcd::gcd(&a[a.len() - 1], &b[b.len() - 1]);
        let leading = IBig::from(leading);
        let (mut degree, mut reconstruction, mut primes) = (usize::MAX, Reconstruction::new(), 0usize);
        let mut prime = 1 << 61;
        loop {
            prime = prime_below(prime);
            let field = PrimeField::new(prime);
            let image = |p: &[IBig]| p.iter().map(|c| field.whole(c)).collect::<Vec<Residue>>();
            let (a, b) = (image(&a), image(&b));
            if a.last() == Some(&0) || b.last() == Some(&0) {
                continue;
            }
            let divisor = modular_polynomial::gcd(&field, &a, &b);
            if divisor.len() == 1 {
                return Self::constant(Rational::ONE);
            }
            if divisor.len() > degree {
                continue;
            }
            if divisor.len() < degree {
                (degree, reconstruction, primes) = (divisor.len(), Reconstruction::new(), 0);
            }
            let scale = field.whole(&leading);
            reconstruction.add(prime, &divisor.iter().map(|&x| field.value(field.times(x, scale))).collect::<Vec<_>>());
            primes += 1;
            if primes.is_power_of_two() {
                let candidate = Self::new(reconstruction.integers().into_iter().map(Rational::from).collect()).monic();
                if [self, other].iter().all(|p| p.may_divide(&candidate) && p.divide(&candidate).1.is_zero()) {
                    return candidate;
                }
            }
        }
    }

    /// Quotient and remainder.
    ///
    /// # Panics
    /// If the divisor is zero.
    pub fn divide(&self, divisor: &Self) -> (Self, Self) {
        let leading = divisor.coefficients.last().expect("division by the zero polynomial");
        let mut rest = self.coefficients.clone();
        let length = (rest.len() + 1).saturating_sub(divisor.coefficients.len());
        let mut quotient = vec![Rational::ZERO; length];
        for k in (0..length).rev() {
            let factor = rest[k + divisor.degree()].over(leading);
            for (x, y) in rest[k..].iter_mut().zip(&divisor.coefficients) {
                *x = x.minus(&factor.times(y));
            }
            quotient[k] = factor;
        }
        (Self::new(quotient), Self::new(rest))
    }

    /// `(g_e, e)` with this polynomial `Π g_e^e` up to a constant, the g_e monic, square-free and coprime.
    ///
    /// Method: modulo primes below 2⁶¹ (Yun), brought back with the bound of Mignotte and multiplied out in whole numbers;
    /// as what is square-free modulo a prime is so over the rationals, the result is exact.
    ///
    /// # Panics
    /// If the polynomial is zero.
    pub fn square_free(&self) -> Vec<(Self, usize)> {
        let whole = self.whole_coefficients();
        let leading = whole.last().expect("the zero polynomial has no square-free parts");
        let size = whole.iter().map(|c| c.clone().into_parts().1.bit_len()).max().unwrap_or(0);
        let needed = (size + whole.len() + whole.len().ilog2() as usize + 3) as u64;
        let own = self.monic().whole_coefficients();
        // Of each list of degrees with exponents: what is known, and the bits of its primes.
        let mut groups: BTreeMap<Vec<(usize, usize)>, (Reconstruction, u64)> = BTreeMap::new();
        let mut prime = 1 << 61;
        loop {
            prime = prime_below(prime);
            let field = PrimeField::new(prime);
            let image: Vec<Residue> = whole.iter().map(|c| field.whole(c)).collect();
            let Some(&scale) = image.last().filter(|x| **x != 0) else { continue };
            let parts = square_free(&field, &image);
            let layout: Vec<(usize, usize)> = parts.iter().map(|(g, e)| (g.len() - 1, *e)).collect();
            let low = |(g, _): &(Vec<Residue>, usize)| {
                g[..g.len() - 1].iter().map(|&x| field.value(field.times(x, scale))).collect::<Vec<_>>()
            };
            let values: Vec<u64> = parts.iter().flat_map(low).collect();
            let (all, bits) = groups.entry(layout.clone()).or_insert_with(|| (Reconstruction::new(), 0));
            if layout.iter().all(|(_, e)| *e == 1) {
                return if self.degree() == 0 { Vec::new() } else { vec![(self.monic(), 1)] };
            }
            all.add(prime, &values);
            *bits += 60;
            if *bits < needed {
                continue;
            }
            let mut lower = all.integers().into_iter().map(|x| Rational::from(x) / Rational::from(leading.clone()));
            let parts: Vec<(Self, usize)> = layout
                .iter()
                .map(|&(degree, e)| (Self::new(lower.by_ref().take(degree).chain([Rational::ONE]).collect()), e))
                .collect();
            let product = parts.iter().fold(vec![IBig::ONE], |all, (g, e)| {
                let g = g.whole_coefficients();
                (0..*e).fold(all, |all, _| multiply_whole(&all, &g))
            });
            if product == own {
                return parts;
            }
        }
    }

    /// Divided by the leading coefficient; the zero polynomial stays.
    pub fn monic(&self) -> Self {
        let Some(leading) = self.coefficients.last() else { return self.clone() };
        Self { coefficients: self.coefficients.iter().map(|c| c.over(leading)).collect() }
    }

    /// Whether a divisor divides modulo a prime; if not, it does not divide.
    pub(super) fn may_divide(&self, divisor: &Self) -> bool {
        let field = PrimeField::new((1 << 61) - 1);
        let image = |p: &Self| p.whole_coefficients().iter().map(|c| field.whole(c)).collect::<Vec<_>>();
        let (whole, divisor) = (image(self), image(divisor));
        divisor.last() == Some(&0) || remainder(&field, &whole, &divisor).is_empty()
    }

    /// As text, highest power first; `number` writes a coefficient.
    pub fn text(&self, number: impl Fn(&Rational) -> String) -> String {
        let terms = self.coefficients.iter().enumerate().rev().filter(|(_, c)| !Scalar::is_zero(*c));
        signed_sum(terms.map(|(k, c)| {
            let text = number(c);
            let (negative, size) = text.strip_prefix('-').map_or((false, text.as_str()), |size| (true, size));
            let power = match k {
                0 => return (negative, size.to_string()),
                1 => "s".to_string(),
                _ => format!("s^{k}"),
            };
            (negative, if size == "1" { power } else { format!("{size} {power}") })
        }))
    }

    /// The coefficients times their common denominator.
    pub fn whole_coefficients(&self) -> Vec<IBig> {
        self.in_whole_numbers().0
    }

    /// The same, and that denominator.
    fn in_whole_numbers(&self) -> (Vec<IBig>, UBig) {
        let scale = common_denominator(&self.coefficients);
        (self.coefficients.iter().map(|c| whole_multiple(c, &scale)).collect(), scale)
    }
}

/// The product of two polynomials with whole coefficients, of 1, s, s², …; neither is empty.
pub fn multiply_whole(a: &[IBig], b: &[IBig]) -> Vec<IBig> {
    let mut out = vec![IBig::ZERO; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            out[i + j] += x * y;
        }
    }
    out
}

impl fmt::Display for Polynomial {
    /// `s^2 + 2060/11 s + 4`, highest power first.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text(ToString::to_string))
    }
}

#[cfg(test)]
#[path = "../../tests/unit/num/polynomial.rs"]
mod tests;

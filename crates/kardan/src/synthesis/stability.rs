use std::cmp::Ordering;

use super::inversion::is_hurwitz;
use crate::num::{Polynomial, Rational, Scalar};

/// Where the roots of a polynomial lie, decided exactly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stability {
    /// All in the open left half plane.
    Stable,
    /// None in the open right half plane, some on the imaginary axis.
    Marginal,
    /// Some in the open right half plane.
    Unstable,
}

/// Decides where the roots of a polynomial lie.
///
/// Method: what `p(s)` and `p(−s)` have in common holds all roots that lie symmetrically to the origin, those on the
/// imaginary axis among them; Routh's table decides about the rest. The common part is `s^k q(s²)`, on the axis as a whole
/// iff all roots of q are real and negative, which Sturm's chain counts.
///
/// ```
/// use kardan::num::{Polynomial, Rational};
/// use kardan::synthesis::{Stability, stability};
/// let p = |coefficients: &[i64]| Polynomial::new(coefficients.iter().map(|&c| Rational::from(c)).collect());
/// assert_eq!(stability(&p(&[10_000_000, 2060, 11])), Stability::Stable);
/// assert_eq!(stability(&p(&[0, 10_000, 1])), Stability::Marginal);
/// assert_eq!(stability(&p(&[-1, 0, 1])), Stability::Unstable);
/// ```
///
/// # Panics
/// If the polynomial is zero.
pub fn stability(polynomial: &Polynomial) -> Stability {
    assert!(!polynomial.is_zero(), "the zero polynomial has no roots to speak of");
    if is_hurwitz(polynomial) {
        return Stability::Stable;
    }
    let mirrored = Polynomial::new(
        polynomial
            .coefficients()
            .iter()
            .enumerate()
            .map(|(k, c)| if k % 2 == 0 { c.clone() } else { Rational::ZERO.minus(c) })
            .collect(),
    );
    let common = polynomial.gcd(&mirrored);
    if !is_hurwitz(&polynomial.divide(&common).0) {
        return Stability::Unstable;
    }
    let zeros = common.coefficients().iter().take_while(|c| Scalar::is_zero(*c)).count();
    let even = Polynomial::new(common.coefficients()[zeros..].iter().step_by(2).cloned().collect());
    if negative_roots(&even) == distinct_roots(&even) { Stability::Marginal } else { Stability::Unstable }
}

/// Number of different complex roots.
fn distinct_roots(polynomial: &Polynomial) -> usize {
    if polynomial.degree() == 0 {
        return 0;
    }
    polynomial.square_free().iter().map(|(part, _)| part.degree()).sum()
}

/// Number of different real roots below zero, for a polynomial that does not vanish at zero (Sturm).
fn negative_roots(polynomial: &Polynomial) -> usize {
    let mut chain = vec![polynomial.clone(), derivative(polynomial)];
    while let [.., before, last] = &chain[..]
        && !last.is_zero()
    {
        let rest = before.divide(last).1;
        chain.push(rest.scale(&Rational::NEG_ONE));
    }
    chain.retain(|p| !p.is_zero());
    let at_minus_infinity = chain.iter().map(|p| {
        let leading = sign(&p.coefficient(p.degree()));
        if p.degree() % 2 == 0 { leading } else { -leading }
    });
    changes(at_minus_infinity) - changes(chain.iter().map(|p| sign(&p.coefficient(0))))
}

fn sign(x: &Rational) -> i32 {
    match x.cmp(&Rational::ZERO) {
        Ordering::Less => -1,
        Ordering::Equal => 0,
        Ordering::Greater => 1,
    }
}

/// Changes of sign, zeros left out.
fn changes(signs: impl Iterator<Item = i32>) -> usize {
    let signs: Vec<i32> = signs.filter(|sign| *sign != 0).collect();
    signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
}

fn derivative(polynomial: &Polynomial) -> Polynomial {
    let terms = polynomial.coefficients().iter().enumerate().skip(1);
    Polynomial::new(terms.map(|(k, c)| Rational::from(k).times(c)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn quadratic(re: i64, im: i64) -> Polynomial {
        Polynomial::new([re * re + im * im, -2 * re, 1].map(Rational::from).to_vec())
    }

    proptest! {
        /// Products of known factors: (s − a) and (s − re)² + im², each as often as it comes.
        #[test]
        fn roots_that_are_known(
            real in proptest::collection::vec(-3i64..=1, 0..4),
            pairs in proptest::collection::vec((-2i64..=1, 1i64..=3), 0..4),
            sign in prop_oneof![Just(-2i64), Just(3)],
        ) {
            let mut p = Polynomial::constant(Rational::from(sign));
            for &a in &real {
                p = p.times(&Polynomial::from_roots(&[Rational::from(a)]));
            }
            for &(re, im) in &pairs {
                p = p.times(&quadratic(re, im));
            }
            let largest = real.iter().copied().chain(pairs.iter().map(|(re, _)| *re)).max().unwrap_or(-1);
            let expected = match largest {
                1.. => Stability::Unstable,
                0 => Stability::Marginal,
                _ => Stability::Stable,
            };
            prop_assert_eq!(stability(&p), expected);
        }
    }

    /// Four roots in a square around the origin have no common factor with a real quadratic on the axis.
    #[test]
    fn symmetric_roots() {
        let p = |c: &[i64]| Polynomial::new(c.iter().map(|&c| Rational::from(c)).collect());
        assert_eq!(stability(&p(&[4, 0, 0, 0, 1])), Stability::Unstable);
        assert_eq!(stability(&p(&[4, 0, 5, 0, 1])), Stability::Marginal);
        assert_eq!(stability(&p(&[1, 0, 2, 0, 1])), Stability::Marginal);
        assert_eq!(stability(&p(&[0, 0, 0, 1])), Stability::Marginal);
        assert_eq!(stability(&p(&[-4, 0, 3, 0, 1])), Stability::Unstable);
    }
}

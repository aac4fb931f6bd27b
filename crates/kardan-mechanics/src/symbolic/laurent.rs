//! Sums of products of letters with whole powers, exact.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use kardan_math::num::{Rational, Scalar};

/// A letter, by its number.
pub type Letter = u32;

/// Letters with their powers: sorted, none of them zero.
pub type Monomial = Vec<(Letter, i32)>;

/// `Σ number · Π letter^power`, equal if and only if all numbers are; powers may be negative.
///
/// ```
/// use kardan_mechanics::symbolic::Laurent;
/// let [i, one] = [Laurent::letter(0), Laurent::number(1.into())];
/// let next = i.plus(&one);
/// let square = next.times(&next);
/// assert_eq!(square.minus(&one).divided_by(&i), Some(i.plus(&Laurent::number(2.into()))));
/// assert_eq!(square.divided_by(&i.plus(&Laurent::number(3.into()))), None);
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct Laurent {
    terms: BTreeMap<Monomial, Rational>,
}

impl Laurent {
    /// A number.
    pub fn number(value: Rational) -> Self {
        Self::of([(Monomial::new(), value)])
    }

    /// One letter.
    pub fn letter(letter: Letter) -> Self {
        Self::of([(vec![(letter, 1)], Rational::ONE)])
    }

    /// A sum of terms; equal products are added up.
    pub fn of(terms: impl IntoIterator<Item = (Monomial, Rational)>) -> Self {
        let mut out = Self::default();
        terms.into_iter().for_each(|(monomial, number)| *out.terms.entry(monomial).or_default() += number);
        out.terms.retain(|_, number| !Scalar::is_zero(number));
        out
    }

    /// The terms, in one order.
    pub fn terms(&self) -> impl DoubleEndedIterator<Item = (&Monomial, &Rational)> {
        self.terms.iter()
    }

    /// How many terms there are.
    pub fn count(&self) -> usize {
        self.terms.len()
    }

    /// Whether it is zero for all values of its letters.
    pub fn is_zero(&self) -> bool {
        self.terms.is_empty()
    }

    /// The number that it is.
    pub fn as_number(&self) -> Option<Rational> {
        match self.terms.iter().next() {
            None => Some(Rational::ZERO),
            Some((monomial, number)) if monomial.is_empty() && self.count() == 1 => Some(number.clone()),
            _ => None,
        }
    }

    /// Its only term.
    pub fn single(&self) -> Option<(&Monomial, &Rational)> {
        self.terms.iter().next().filter(|_| self.count() == 1)
    }

    /// a + b
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        let mut out = self.clone();
        for (monomial, number) in &other.terms {
            let sum = out.terms.entry(monomial.clone()).or_default();
            *sum += number;
            if Scalar::is_zero(sum) {
                out.terms.remove(monomial);
            }
        }
        out
    }

    /// a − b
    #[must_use]
    pub fn minus(&self, other: &Self) -> Self {
        self.plus(&other.scaled(&Rational::from(-1)))
    }

    /// A multiple.
    #[must_use]
    pub fn scaled(&self, factor: &Rational) -> Self {
        self.times_term(&Monomial::new(), factor)
    }

    /// A product with one term.
    #[must_use]
    pub fn times_term(&self, monomial: &Monomial, number: &Rational) -> Self {
        if Scalar::is_zero(number) {
            return Self::default();
        }
        let term = |(own, factor): (&Monomial, &Rational)| (product(own, monomial), factor * number);
        Self { terms: self.terms.iter().map(term).collect() }
    }

    /// a·b
    #[must_use]
    pub fn times(&self, other: &Self) -> Self {
        let products = self.terms.iter().flat_map(|(own, factor)| {
            other.terms.iter().map(move |(monomial, number)| (product(own, monomial), factor * number))
        });
        Self::of(products)
    }

    /// aⁿ for n ≥ 0, of a single term also below.
    pub fn power(&self, n: i32) -> Option<Self> {
        if let (Some((monomial, number)), true) = (self.single(), n < 0) {
            return Some(Self::of([(raised(monomial, n), number.pow(n as isize))]));
        }
        (n >= 0).then(|| (0..n).fold(Self::number(Rational::ONE), |all, _| all.times(self)))
    }

    /// The lowest power of each letter that is in all terms: their common factor.
    pub fn common(&self) -> Monomial {
        let least = |letter: Letter| self.terms.keys().map(|monomial| power_of(monomial, letter)).min().unwrap_or(0);
        self.letters().into_iter().map(|letter| (letter, least(letter))).filter(|(_, power)| *power != 0).collect()
    }

    /// The quotient if it is such a sum: the remainder must be zero.
    pub fn divided_by(&self, divisor: &Self) -> Option<Self> {
        let (own, other) = (self.common(), divisor.common());
        let mut rest = self.times_term(&raised(&own, -1), &Rational::ONE);
        let divisor = divisor.times_term(&raised(&other, -1), &Rational::ONE);
        let (leading, factor) = divisor.leading()?;
        let mut quotient = Self::default();
        while let Some((monomial, number)) = rest.leading() {
            let step = product(monomial, &raised(leading, -1));
            if step.iter().any(|(_, power)| *power < 0) || quotient.count() > MOST_TERMS {
                return None;
            }
            let number = number / factor;
            rest = rest.minus(&divisor.times_term(&step, &number));
            quotient = quotient.plus(&Self::of([(step, number)]));
        }
        Some(quotient.times_term(&product(&own, &raised(&other, -1)), &Rational::ONE))
    }

    /// The term that comes first where letters rank by their numbers and higher powers before lower ones.
    fn leading(&self) -> Option<(&Monomial, &Rational)> {
        self.terms.iter().max_by(|(a, _), (b, _)| rank(a, b))
    }

    /// The letters in it, each once.
    pub fn letters(&self) -> Vec<Letter> {
        let mut all: Vec<Letter> = self.terms.keys().flatten().map(|(letter, _)| *letter).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Its derivative by one of its letters, where no other one depends on that.
    #[must_use]
    pub fn slope(&self, letter: Letter) -> Self {
        let of = |(monomial, number): (&Monomial, &Rational)| {
            (product(monomial, &vec![(letter, -1)]), number * Rational::from(power_of(monomial, letter)))
        };
        Self::of(self.terms.iter().map(of))
    }

    /// Its value for those of its letters.
    pub fn value<N: Scalar>(&self, of: &dyn Fn(Letter) -> N) -> N {
        self.terms.iter().fold(N::zero(), |sum, (monomial, number)| {
            let product = monomial.iter().fold(N::from_rational(number), |product, (letter, power)| {
                let value = of(*letter);
                (0..power.unsigned_abs()).fold(product, |product, _| match *power > 0 {
                    true => product.times(&value),
                    false => product.over(&value),
                })
            });
            sum.plus(&product)
        })
    }
}

/// A quotient with more terms is not computed.
const MOST_TERMS: usize = 1000;

/// The product of two.
pub fn product(a: &Monomial, b: &Monomial) -> Monomial {
    let mut out: BTreeMap<Letter, i32> = a.iter().copied().collect();
    b.iter().for_each(|(letter, power)| *out.entry(*letter).or_default() += power);
    out.into_iter().filter(|(_, power)| *power != 0).collect()
}

/// The power of a letter in a product; zero where it is not in it.
pub(super) fn power_of(monomial: &Monomial, letter: Letter) -> i32 {
    monomial.iter().find(|(own, _)| *own == letter).map_or(0, |(_, power)| *power)
}

/// A power of one.
pub fn raised(monomial: &Monomial, power: i32) -> Monomial {
    monomial.iter().map(|(letter, own)| (*letter, own * power)).filter(|(_, power)| *power != 0).collect()
}

fn rank(a: &Monomial, b: &Monomial) -> Ordering {
    let quotient = product(a, &raised(b, -1));
    quotient.first().map_or(Ordering::Equal, |(_, power)| power.cmp(&0))
}

#[cfg(test)]
#[path = "../../tests/unit/symbolic/laurent.rs"]
mod tests;

//! Arithmetic modulo a prime.

use super::StateArchive;
use std::collections::{HashSet, VecDeque};
use std::hash::{BuildHasher, RandomState};

use dashu_int::{IBig, UBig, ops::RemEuclid};
use kardan_rt::functions::{cos, ln};

use super::Rational;

/// The whole numbers modulo a prime below 2⁶¹, for structure that is the same modulo almost every prime.
///
/// A minor that does not vanish modulo one prime does not vanish: full rank here is a proof. The opposite needs more
/// (see `analysis`). Elements are stored as `x · 2⁶⁴ mod p` (Montgomery), so that a product costs no division.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PrimeField {
    prime: u64,
    /// −p⁻¹ mod 2⁶⁴.
    negative_inverse: u64,
    /// 2¹²⁸ mod p.
    square: u64,
}

/// An element of a [`PrimeField`], in Montgomery form; 0 is zero.
pub type Residue = u64;

/// How many products of two residues can be added in a `u128` before the high half must be reduced.
const PRODUCTS: usize = 48;
/// How many products of two residues are below p · 2⁶⁴ together.
const UNREDUCED_PRODUCTS: usize = 8;

impl PrimeField {
    /// No prime is chosen by [`random_prime`] with a probability above one over this: it is chosen from the numbers of the
    /// gap before it, and no gap between primes below 2⁶⁴ is longer than 1550 (2⁶⁰ / 1550, rounded down).
    pub const CHOICES: f64 = 7.4e14;

    /// The field of a prime.
    ///
    /// # Panics
    /// If `prime` is even or 2⁶¹ and more. Whether it is prime is the caller's promise ([`is_prime`]).
    pub fn new(prime: u64) -> Self {
        assert!(prime % 2 == 1 && prime > 2 && prime < 1 << 61, "{prime} is not an odd prime below 2^61");
        let mut inverse = 1u64;
        for _ in 0..6 {
            inverse = inverse.wrapping_mul(2u64.wrapping_sub(prime.wrapping_mul(inverse)));
        }
        let r = (u128::from(u64::MAX) + 1) % u128::from(prime);
        let square = (r * r % u128::from(prime)) as u64;
        Self { prime, negative_inverse: inverse.wrapping_neg(), square }
    }

    /// p.
    pub fn prime(&self) -> u64 {
        self.prime
    }

    /// `t / 2⁶⁴ mod p` for `t < p · 2⁶⁴`.
    #[inline(always)]
    fn reduce(&self, t: u128) -> Residue {
        let m = (t as u64).wrapping_mul(self.negative_inverse);
        let sum = (t + u128::from(m) * u128::from(self.prime)) >> 64;
        let sum = sum as u64;
        if sum >= self.prime { sum - self.prime } else { sum }
    }

    /// 1.
    pub fn one(&self) -> Residue {
        self.reduce(u128::from(self.square))
    }

    /// A whole number below p.
    pub fn element(&self, value: u64) -> Residue {
        self.reduce(u128::from(value % self.prime) * u128::from(self.square))
    }

    /// A whole number of either sign.
    pub fn integer(&self, value: i64) -> Residue {
        let size = self.element(value.unsigned_abs());
        if value < 0 { self.negate(size) } else { size }
    }

    /// The number from 0 to p − 1.
    pub fn value(&self, x: Residue) -> u64 {
        self.reduce(u128::from(x))
    }

    /// A whole number of any size.
    pub fn whole(&self, value: &IBig) -> Residue {
        let rest = IBig::rem_euclid(value.clone(), &IBig::from(self.prime));
        self.element(u64::try_from(rest).unwrap_or_default())
    }

    /// A fraction; `None` if p divides its denominator.
    pub fn rational(&self, value: &Rational) -> Option<Residue> {
        let numerator = self.whole(value.numerator());
        if *value.denominator() == UBig::ONE {
            return Some(numerator);
        }
        let denominator = u64::try_from(value.denominator() % &UBig::from(self.prime)).ok()?;
        (denominator != 0).then(|| self.times(numerator, self.inverse(self.element(denominator))))
    }

    /// a + b.
    #[inline(always)]
    pub fn plus(&self, a: Residue, b: Residue) -> Residue {
        let sum = a + b;
        if sum >= self.prime { sum - self.prime } else { sum }
    }

    /// a − b.
    #[inline(always)]
    pub fn minus(&self, a: Residue, b: Residue) -> Residue {
        if a >= b { a - b } else { a + self.prime - b }
    }

    /// −a.
    #[inline(always)]
    pub fn negate(&self, a: Residue) -> Residue {
        if a == 0 { 0 } else { self.prime - a }
    }

    /// a · b.
    #[inline(always)]
    pub fn times(&self, a: Residue, b: Residue) -> Residue {
        self.reduce(u128::from(a) * u128::from(b))
    }

    /// 1 / a, by Fermat.
    ///
    /// # Panics
    /// If a is zero.
    pub fn inverse(&self, a: Residue) -> Residue {
        assert!(a != 0, "division by zero in a prime field");
        power(a, self.prime - 2, self.one(), |x, y| self.times(x, y))
    }

    /// Σ aᵢ bᵢ.
    pub fn dot(&self, a: &[Residue], b: &[Residue]) -> Residue {
        let mut sum = 0u128;
        if a.len() <= UNREDUCED_PRODUCTS {
            a.iter().zip(b).for_each(|(x, y)| sum += u128::from(*x) * u128::from(*y));
            return self.reduce(sum);
        }
        for (a, b) in a.chunks(PRODUCTS).zip(b.chunks(PRODUCTS)) {
            // Two sums do not wait for each other.
            let mut other = 0u128;
            let (a, b) = (a.chunks_exact(2), b.chunks_exact(2));
            for (x, y) in a.remainder().iter().zip(b.remainder()) {
                sum += u128::from(*x) * u128::from(*y);
            }
            for (x, y) in a.zip(b) {
                sum += u128::from(x[0]) * u128::from(y[0]);
                other += u128::from(x[1]) * u128::from(y[1]);
            }
            sum += other;
            let high = (sum >> 64) as u64 % self.prime;
            sum = u128::from(high) << 64 | u128::from(sum as u64);
        }
        self.reduce(sum)
    }

    /// `target −= factor · row`, where the row is not zero.
    pub fn subtract(&self, target: &mut [Residue], factor: Residue, row: &[Residue]) {
        let factor = self.negate(factor);
        for (x, y) in target.iter_mut().zip(row) {
            *x = self.plus(*x, self.times(factor, *y));
        }
    }
}

/// A power by squaring.
fn power(mut base: u64, mut exponent: u64, one: u64, times: impl Fn(u64, u64) -> u64) -> u64 {
    let mut out = one;
    while exponent > 0 {
        if exponent & 1 == 1 {
            out = times(out, base);
        }
        base = times(base, base);
        exponent >>= 1;
    }
    out
}

/// A generator of pseudo-random numbers (SplitMix64), the same for the same seed.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// With a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Others each time: the seed together with keys that the system draws (those of the hash tables of `std`).
    pub fn unforeseen(seed: u64) -> Self {
        Self(RandomState::new().hash_one(seed))
    }

    /// With a seed and a name: other draws for each name.
    pub fn named(seed: u64, name: &str) -> Self {
        Self(Self::fnv(Self(seed).next_u64(), name.as_bytes()))
    }

    /// Where sums of bytes begin.
    pub const FNV: u64 = 0xcbf2_9ce4_8422_2325;

    /// A hash of bytes that continues another one (Fowler, Noll, Vo: FNV-1a).
    pub fn fnv(start: u64, bytes: &[u8]) -> u64 {
        bytes.iter().fold(start, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3))
    }

    /// Its position in its sequence.
    pub fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.word(&mut self.0);
    }

    /// The next 64 bits.
    pub fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in `0..bound` (bias below `bound / 2⁶⁴`).
    pub fn below(&mut self, bound: u64) -> u64 {
        ((u128::from(self.next_u64()) * u128::from(bound)) >> 64) as u64
    }

    /// Uniform in `[0, 1)`.
    pub fn unit(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Normally distributed with mean 0 and variance 1 (Box, Muller, Ann. Math. Stat. 29, 1958); takes two draws.
    ///
    /// ```
    /// use kardan_math::num::Random;
    /// let mut random = Random::new(1);
    /// let mean = (0..10_000).map(|_| random.normal()).sum::<f64>() / 1e4;
    /// assert!(mean.abs() < 0.03); // three standard errors
    /// ```
    pub fn normal(&mut self) -> f64 {
        // 1 − u lies in (0, 1].
        let (radius, angle) = ((-2.0 * ln(1.0 - self.unit())).sqrt(), self.unit());
        radius * cos(std::f64::consts::TAU * angle)
    }

    /// A whole number from −size to size, not zero.
    pub fn small(&mut self, size: u64) -> i64 {
        let value = self.below(2 * size) as i64 - size as i64;
        if value >= 0 { value + 1 } else { value }
    }
}

/// Primes between 2⁶⁰ and 2⁶¹, each uniform up to the lengths of prime gaps, without repetition.
///
/// The result of a computation modulo a prime is wrong for a few primes at most. Who knows the primes in advance can write a
/// system for which they are among those: where chance matters, take [`unforeseen`](Self::unforeseen) ones.
///
/// ```
/// use kardan_math::num::{Primes, is_prime};
/// let first: Vec<u64> = Primes::new(7).take(3).collect();
/// assert!(first.iter().all(|&p| is_prime(p) && p >> 60 == 1));
/// assert_eq!(first, Primes::new(7).take(3).collect::<Vec<_>>());
/// assert_ne!(first, Primes::unforeseen(7).take(3).collect::<Vec<_>>());
/// ```
#[derive(Debug, Clone)]
pub struct Primes {
    random: Random,
    used: HashSet<u64>,
    /// Primes that come first.
    queued: VecDeque<u64>,
}

impl Primes {
    /// The same for the same seed: for results that are proven afterwards for any primes.
    pub fn new(seed: u64) -> Self {
        Self { random: Random::new(seed), used: HashSet::new(), queued: VecDeque::new() }
    }

    /// Others each time ([`Random::unforeseen`]).
    pub fn unforeseen(seed: u64) -> Self {
        Self { random: Random::unforeseen(seed), ..Self::new(0) }
    }

    /// The same, after the primes given.
    pub fn after(self, queued: &[u64]) -> Self {
        Self { queued: queued.iter().copied().collect(), ..self }
    }
}

impl Iterator for Primes {
    type Item = u64;

    fn next(&mut self) -> Option<u64> {
        loop {
            let prime = self.queued.pop_front().unwrap_or_else(|| random_prime(&mut self.random));
            if self.used.insert(prime) {
                return Some(prime);
            }
        }
    }
}

/// A prime between 2⁶⁰ and 2⁶¹, uniform up to the lengths of prime gaps.
pub fn random_prime(random: &mut Random) -> u64 {
    let mut candidate = (1 << 60) | random.below(1 << 60) | 1;
    while !is_prime(candidate) {
        candidate = if candidate >= (1 << 61) - 2 { (1 << 60) | 1 } else { candidate + 2 };
    }
    candidate
}

/// The largest odd prime below a number.
///
/// # Panics
/// If the number is below 4.
pub fn prime_below(number: u64) -> u64 {
    assert!(number > 3, "no odd prime is below {number}");
    let first = if number.is_multiple_of(2) { number - 1 } else { number - 2 };
    (3..=first).rev().step_by(2).find(|&candidate| is_prime(candidate)).expect("3 is prime")
}

/// Fields of large primes, one after the other.
pub fn prime_fields() -> impl Iterator<Item = PrimeField> {
    std::iter::successors(Some(prime_below(1 << 61)), |&prime| Some(prime_below(prime))).map(PrimeField::new)
}

/// Whether a number is prime: Miller and Rabin with the first twelve primes as bases, which decides all below 2⁶⁴.
///
/// ```
/// use kardan_math::num::is_prime;
/// assert!(is_prime((1 << 61) - 1) && !is_prime((1 << 59) - 1) && !is_prime(3_215_031_751));
/// ```
pub fn is_prime(n: u64) -> bool {
    const BASES: [u64; 12] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37];
    if n < 2 {
        return false;
    }
    for p in BASES {
        if n.is_multiple_of(p) {
            return n == p;
        }
    }
    let times = |a: u64, b: u64| (u128::from(a) * u128::from(b) % u128::from(n)) as u64;
    let twos = (n - 1).trailing_zeros();
    let odd = (n - 1) >> twos;
    BASES.iter().all(|&base| {
        let mut power = power(base % n, odd, 1, times);
        if power == 1 || power == n - 1 {
            return true;
        }
        (1..twos).any(|_| {
            power = times(power, power);
            power == n - 1
        })
    })
}

#[cfg(test)]
#[path = "../../tests/unit/num/prime_field.rs"]
mod tests;

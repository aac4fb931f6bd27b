//! What is computed modulo primes, and the primes that agree on it.

use std::sync::Arc;

use rayon::prelude::*;

use super::bounds::{norm_bits, without_ports};
use crate::LinearSystem;
use crate::images::Image;
use crate::spectrum::{Layout, Spectrum, factors};
use crate::structure::relative_degrees;
use crate::zeros::ZeroStructure;
use kardan_math::num::modular_polynomial::product;
use kardan_math::num::{Matrix, ModularMatrix, PrimeField, Rational, Reconstruction, Residue};

/// All that is computed modulo one prime; certain.
pub(super) struct Evidence {
    pub(super) field: PrimeField,
    /// det E.
    pub(super) determinant: Residue,
    pub(super) spectrum: Spectrum,
    pub(super) relative_degrees: Vec<Vec<Option<usize>>>,
    pub(super) zeros: ZeroStructure,
    /// det S, coefficients of 1, s, …, sⁿ, if S is square.
    pub(super) system_determinant: Vec<Residue>,
}

impl Evidence {
    /// `None` if the prime divides det E or a denominator.
    pub(super) fn of(system: &LinearSystem, actions: [Option<&Matrix<Rational>>; 2], prime: u64) -> Option<Self> {
        let image = Image::new(system, prime)?;
        let field = image.field;
        let of_action = |action: Option<&Matrix<Rational>>| match action {
            Some(action) => Some(factors(&field, &ModularMatrix::from_rational(&field, action)?)),
            None => Some(Vec::new()),
        };
        let lists = [factors(&field, &image.g), of_action(actions[0])?, of_action(actions[1])?];
        let zeros = ZeroStructure::of(&image);
        Some(Self {
            field,
            determinant: image.determinant,
            spectrum: Spectrum::new(&field, lists),
            relative_degrees: relative_degrees(&image),
            system_determinant: system_determinant(&image, &zeros),
            zeros,
        })
    }

    /// Coefficients of det E times the characteristic polynomials, all of them, the leading ones too.
    fn characteristic(&self) -> Vec<u64> {
        let whole =
            |list: &Vec<Vec<Residue>>| list.iter().fold(vec![self.determinant], |all, f| product(&self.field, &all, f));
        self.spectrum.lists.iter().flat_map(whole).map(|x| self.field.value(x)).collect()
    }

    /// Coefficients of det E times the polynomials of the spectrum, without the leading ones.
    fn divisors(&self) -> Vec<u64> {
        let scaled = |x: &Residue| self.field.value(self.field.times(*x, self.determinant));
        self.spectrum.polynomials().flat_map(|p| p[..p.len() - 1].iter().map(scaled)).collect()
    }

    /// Coefficients of the invariant polynomials of S, without the leading ones.
    fn zero_factors(&self) -> Vec<u64> {
        self.zeros.factors.iter().flat_map(|p| &p[..p.len() - 1]).map(|&x| self.field.value(x)).collect()
    }
}

/// det S; its zeros are known, so one value of it is enough.
fn system_determinant(image: &Image, zeros: &ZeroStructure) -> Vec<Residue> {
    let field = &image.field;
    let (n, m) = (image.g.rows, image.b.columns);
    if image.c.rows != m {
        return Vec::new();
    }
    let mut out = vec![0; n + 1];
    if zeros.rank < n + m {
        return out;
    }
    let monic = zeros.factors.iter().fold(vec![field.one()], |all, f| product(field, &all, f));
    let value = |s: Residue| monic.iter().rev().fold(0, |sum, &c| field.plus(field.times(sum, s), c));
    let at = (1..).map(|k| field.element(k)).find(|&s| value(s) != 0).expect("a polynomial has finitely many roots");
    let matrix = ModularMatrix::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
        (true, true) if i == j => field.minus(at, image.g.row(i)[j]),
        (true, true) => field.negate(image.g.row(i)[j]),
        (true, false) => field.negate(image.b.row(i)[j - n]),
        (false, true) => image.c.row(i - n)[j],
        (false, false) => image.d.row(i - n)[j - n],
    });
    let det = field.times(image.determinant, matrix.determinant(field));
    let factor = field.times(det, field.inverse(value(at)));
    for (x, &c) in out.iter_mut().zip(&monic) {
        *x = field.times(factor, c);
    }
    out
}

/// Images modulo primes that agree on a shape.
pub(super) struct Group<K> {
    pub(super) key: K,
    /// The product of the primes is at least `2^bits`.
    pub(super) bits: u64,
    pub(super) primes: Vec<u64>,
    pub(super) values: Reconstruction,
    pub(super) sample: Arc<Evidence>,
}

fn add<K: PartialEq>(groups: &mut Vec<Group<K>>, key: K, values: &[u64], evidence: &Arc<Evidence>) {
    let prime = evidence.field.prime();
    let index = groups.iter().position(|group| group.key == key);
    let index = index.unwrap_or_else(|| {
        groups.push(Group {
            key,
            bits: 0,
            primes: Vec::new(),
            values: Reconstruction::new(),
            sample: evidence.clone(),
        });
        groups.len() - 1
    });
    groups[index].values.add(prime, values);
    groups[index].bits += bits(prime);
    groups[index].primes.push(prime);
}

pub(super) fn largest<K>(groups: &[Group<K>]) -> Option<&Group<K>> {
    groups.iter().max_by_key(|group| group.bits)
}

/// log₂, rounded down.
pub(super) fn bits(prime: u64) -> u64 {
    u64::from(63 - prime.leading_zeros())
}

/// The results modulo many primes.
#[derive(Default)]
pub(super) struct Gathered {
    pub(super) primes: Vec<u64>,
    /// Bits of their product.
    bits: u64,
    pub(super) characteristic: Reconstruction,
    pub(super) determinant: Reconstruction,
    pub(super) spectra: Vec<Group<Layout>>,
    pub(super) zeros: Vec<Group<(usize, Vec<usize>)>>,
    /// Rank of the system matrix.
    pub(super) rank: usize,
    pub(super) relative_degrees: Option<Vec<Vec<Option<usize>>>>,
}

impl Gathered {
    /// Modulo so many primes that what is the same modulo most of them is so.
    pub(super) fn new(
        system: &LinearSystem,
        actions: [Option<&Matrix<Rational>>; 2],
        source: &mut Source<'_>,
    ) -> Result<Self, String> {
        let n = system.states.len();
        let for_divisors = norm_bits(&without_ports(system)) + n as u64 + 2;
        let for_minors = norm_bits(system) + 1;
        let [characteristic, determinant] = [Reconstruction::new(), Reconstruction::new()];
        let mut out = Self { characteristic, determinant, ..Self::default() };
        loop {
            let full = out.is_regular(system);
            // There are no whole multiples for zeros; fractions need double the bits.
            let for_zeros = match largest(&out.zeros) {
                Some(group) if !full && !group.key.1.is_empty() => 2 * (for_minors + n as u64) + 2,
                _ => for_minors,
            };
            let spectrum = largest(&out.spectra).map_or(0, |group| group.bits);
            let zeros = if full { out.bits } else { largest(&out.zeros).map_or(0, |group| group.bits) };
            let goal = for_divisors.max(for_zeros);
            let missing = for_divisors.saturating_sub(spectrum).max(for_zeros.saturating_sub(zeros));
            (source.progress)(1.0 - missing as f64 / goal as f64);
            if missing == 0 {
                return Ok(out);
            }
            if out.bits > 2 * goal + 10_000 {
                return Err(format!("no structure is the same modulo enough of {} primes", out.primes.len()));
            }
            for (prime, evidence) in source.batch(missing, |prime| Evidence::of(system, actions, prime)) {
                out.add(prime, evidence);
            }
        }
    }

    /// Whether there are as many outputs as inputs, and the system matrix has full rank.
    pub(super) fn is_regular(&self, system: &LinearSystem) -> bool {
        let (n, inputs, outputs) = (system.states.len(), system.inputs.len(), system.outputs.len());
        inputs == outputs && self.rank == n + inputs
    }

    fn add(&mut self, prime: u64, evidence: Evidence) {
        let evidence = Arc::new(evidence);
        self.primes.push(prime);
        self.bits += bits(prime);
        self.characteristic.add(prime, &evidence.characteristic());
        let values: Vec<u64> = evidence.system_determinant.iter().map(|&x| evidence.field.value(x)).collect();
        self.determinant.add(prime, &values);
        add(&mut self.spectra, evidence.spectrum.layout(), &evidence.divisors(), &evidence);
        let degrees = evidence.zeros.factors.iter().map(|f| f.len() - 1).collect();
        add(&mut self.zeros, (evidence.zeros.rank, degrees), &evidence.zero_factors(), &evidence);
        self.rank = self.rank.max(evidence.zeros.rank);
        self.relative_degrees = Some(least(self.relative_degrees.take(), &evidence.relative_degrees));
    }
}

/// Entry by entry the least relative degree.
fn least(best: Option<Vec<Vec<Option<usize>>>>, found: &[Vec<Option<usize>>]) -> Vec<Vec<Option<usize>>> {
    let Some(mut best) = best else { return found.to_vec() };
    for (x, y) in best.iter_mut().flatten().zip(found.iter().flatten()) {
        *x = match (*x, *y) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
    }
    best
}

/// Where primes come from, and what receives the fraction done.
pub(super) struct Source<'a> {
    pub(super) primes: &'a mut dyn FnMut() -> u64,
    pub(super) progress: &'a dyn Fn(f64),
}

impl Source<'_> {
    /// Works on as many primes at once as there are threads, no more than are missing.
    pub(super) fn batch<T: Send>(&mut self, missing: u64, work: impl Fn(u64) -> Option<T> + Sync) -> Vec<(u64, T)> {
        let threads = rayon::current_num_threads() as u64;
        let count = (missing / 60 + 1).min(4 * threads);
        let chosen: Vec<u64> = (0..count).map(|_| (self.primes)()).collect();
        chosen.into_par_iter().filter_map(|prime| Some((prime, work(prime)?))).collect()
    }
}

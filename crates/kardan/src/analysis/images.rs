use std::sync::Arc;

use super::LinearSystem;
use crate::num::{ModularMatrix, PrimeField, Random, Rational, Reconstruction, Residue, random_prime};

/// A system modulo a prime.
#[derive(Debug, Clone)]
pub(super) struct Image {
    pub field: PrimeField,
    pub c: ModularMatrix,
    pub d: ModularMatrix,
    pub inverse_e: ModularMatrix,
    /// det E.
    pub determinant: Residue,
    /// E⁻¹A.
    pub g: ModularMatrix,
    /// E⁻¹B.
    pub b: ModularMatrix,
}

impl Image {
    /// `None` if E is singular modulo the prime, or the prime divides a denominator.
    pub fn new(system: &LinearSystem, prime: u64) -> Option<Self> {
        let field = PrimeField::new(prime);
        let image = |matrix| ModularMatrix::from_rational(&field, matrix);
        let (e, a, b) = (image(&system.e)?, image(&system.a)?, image(&system.b)?);
        let (inverse_e, determinant) = e.solve(&field, &ModularMatrix::identity(&field, e.rows))?;
        let (g, b) = (inverse_e.multiply(&field, &a), inverse_e.multiply(&field, &b));
        Some(Self { c: image(&system.c)?, d: image(&system.d)?, field, inverse_e, determinant, g, b })
    }
}

/// Most numbers kept in images; further ones are made anew each time.
const MOST_KEPT: usize = 40_000_000;

/// A system modulo as many primes as are asked for.
pub(super) struct Images<'a> {
    pub system: &'a LinearSystem,
    primes: Vec<u64>,
    images: Vec<Arc<Image>>,
    random: Random,
}

impl<'a> Images<'a> {
    /// The same seed gives the same primes.
    pub fn new(system: &'a LinearSystem, seed: u64) -> Self {
        Self { system, primes: Vec::new(), images: Vec::new(), random: Random::new(seed) }
    }

    /// The image modulo the prime of that number; `None` if E is singular modulo eight primes in a row.
    pub fn get(&mut self, number: usize) -> Option<Arc<Image>> {
        while self.primes.len() <= number {
            let next = (0..8).find_map(|_| Image::new(self.system, random_prime(&mut self.random)).map(Arc::new))?;
            self.primes.push(next.field.prime());
            let size = self.system.states.len().pow(2).max(1);
            if self.images.len() < MOST_KEPT / (2 * size) {
                self.images.push(next);
            } else if self.primes.len() > number {
                return Some(next);
            }
        }
        match self.images.get(number) {
            Some(image) => Some(image.clone()),
            None => Image::new(self.system, self.primes[number]).map(Arc::new),
        }
    }

    /// Puts the image of that number first.
    pub fn prefer(&mut self, number: usize, image: &Arc<Image>) {
        self.primes.swap(0, number);
        if number < self.images.len() {
            self.images.swap(0, number);
        } else if let Some(first) = self.images.first_mut() {
            *first = image.clone();
        }
    }

    /// The primes used so far.
    pub fn primes(&self) -> &[u64] {
        &self.primes
    }

    /// Fractions whose images `compute` gives, confirmed modulo one further prime; primes for which it gives none are left
    /// out. `None` if `limit` primes are not enough.
    pub fn reconstruct(&mut self, limit: usize, compute: impl Fn(&Image) -> Option<Vec<u64>>) -> Option<Vec<Rational>> {
        reconstruct(limit, |number| {
            let image = self.get(number)?;
            Some((image.field, compute(&image)))
        })
    }
}

fn reconstruct(
    limit: usize,
    mut images: impl FnMut(usize) -> Option<(PrimeField, Option<Vec<u64>>)>,
) -> Option<Vec<Rational>> {
    let mut all = Reconstruction::new();
    let mut candidate: Option<Vec<Rational>> = None;
    let (mut used, mut next_try) = (0, 1);
    for number in 0..limit {
        let (field, values) = images(number)?;
        let Some(values) = values else { continue };
        if let Some(found) = &candidate {
            let agrees = |(x, &image): (&Rational, &u64)| field.rational(x).map(|x| field.value(x)) == Some(image);
            if found.len() == values.len() && found.iter().zip(&values).all(agrees) {
                return candidate;
            }
        }
        all.add(field.prime(), &values);
        used += 1;
        candidate = None;
        if used == next_try {
            candidate = all.fractions();
            next_try = used + 1 + used / 4;
        }
    }
    None
}

use super::LinearSystem;
use crate::num::{ModularMatrix, PrimeField, Random, Rational, Reconstruction, random_prime};

/// A system modulo a prime.
#[derive(Debug, Clone)]
pub(super) struct Image {
    pub field: PrimeField,
    pub e: ModularMatrix,
    pub a: ModularMatrix,
    pub raw_b: ModularMatrix,
    pub c: ModularMatrix,
    pub d: ModularMatrix,
    pub inverse_e: ModularMatrix,
    /// E⁻¹A.
    pub g: ModularMatrix,
    /// E⁻¹B.
    pub b: ModularMatrix,
}

impl Image {
    fn new(system: &LinearSystem, prime: u64) -> Option<Self> {
        let field = PrimeField::new(prime);
        let image = |matrix| ModularMatrix::from_rational(&field, matrix);
        let (e, a, raw_b) = (image(&system.e)?, image(&system.a)?, image(&system.b)?);
        let inverse_e = e.solve(&field, &ModularMatrix::identity(&field, e.rows))?.0;
        let (g, b) = (inverse_e.multiply(&field, &a), inverse_e.multiply(&field, &raw_b));
        Some(Self { c: image(&system.c)?, d: image(&system.d)?, field, e, a, raw_b, inverse_e, g, b })
    }
}

/// A system modulo as many primes as are asked for.
pub(super) struct Images<'a> {
    pub system: &'a LinearSystem,
    images: Vec<Image>,
    random: Random,
}

impl<'a> Images<'a> {
    /// The same seed gives the same primes.
    pub fn new(system: &'a LinearSystem, seed: u64) -> Self {
        Self { system, images: Vec::new(), random: Random::new(seed) }
    }

    /// The image modulo the prime of that number; `None` if E is singular modulo eight primes in a row.
    pub fn get(&mut self, number: usize) -> Option<&Image> {
        while self.images.len() <= number {
            let next = (0..8).find_map(|_| Image::new(self.system, random_prime(&mut self.random)))?;
            self.images.push(next);
        }
        self.images.get(number)
    }

    /// The primes used so far.
    pub fn primes(&self) -> Vec<u64> {
        self.images.iter().map(|image| image.field.prime()).collect()
    }

    /// Fractions whose images `compute` gives, confirmed modulo one further prime; primes for which it gives none are left
    /// out. `None` if `limit` primes are not enough.
    pub fn reconstruct(&mut self, limit: usize, compute: impl Fn(&Image) -> Option<Vec<u64>>) -> Option<Vec<Rational>> {
        reconstruct(limit, |number| {
            let image = self.get(number)?;
            Some((image.field, compute(image)))
        })
    }

    /// The same for what needs the image of a second system modulo the same prime.
    pub fn reconstruct_with(
        &mut self,
        other: &mut Images<'_>,
        limit: usize,
        compute: impl Fn(&Image, &Image) -> Option<Vec<u64>>,
    ) -> Option<Vec<Rational>> {
        reconstruct(limit, |number| {
            other.get(number)?;
            let (image, other) = (self.get(number)?, &other.images[number]);
            Some((image.field, compute(image, other)))
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

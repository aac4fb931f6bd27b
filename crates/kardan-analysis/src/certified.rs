//! Proofs over the rationals from computations modulo primes.
//!
//! # The argument
//!
//! **Setting.** Rows of `[E, A, B]` and of `[C, D]` are multiplied by their common denominators, which changes no result;
//! all entries are whole now. `S(s) = [sE − A, −B; C, D]`, `χ = det(sE − A)`, `G = E⁻¹A`, n states. Primes that divide
//! det E are left out. Results modulo a prime are certain: no step of the computations below rests on luck.
//!
//! **One tool.** A whole number of size at most M that vanishes modulo primes whose product exceeds M is zero; one of size
//! below M/2 is known from its images modulo primes with product M.
//!
//! **Bound.** A coefficient of a polynomial is at most its largest value on `|s| = 1` (Cauchy), and there a minor of S is at
//! most the product H of the row norms `(Σ (|E_ij| + |A_ij|)² + Σ B_ij²)^½` and `(Σ C_ij² + Σ D_ij²)^½` (Hadamard; rows
//! with norm below 1 count as 1). So H bounds all coefficients of all minors of S, of `sE − A` the part `H_χ ≤ H` without
//! B, C and D. By Parseval the 2-norm of χ is at most H_χ too.
//!
//! **1. χ** has whole coefficients of size at most H_χ: known from enough primes.
//!
//! **2. Divisors of χ.** If q divides χ over ℚ and is monic, `det E · q` has whole coefficients (Gauss), of size at most
//! `2ⁿ H_χ` (Mignotte). So divisors are known from enough primes modulo which they are known.
//!
//! **3. Degrees drop modulo p, never rise.** Let `f_1 | f_2 | … | f_m` be the non-trivial invariant factors of `sE − A`
//! modulo p and `a_1, a_2, …` those over ℚ, *largest first*, `b_1, b_2, … = f_m, f_{m−1}, …`. The gcd D of all minors of
//! order n − k, primitive with whole coefficients, divides those minors over ℤ (Gauss). Its leading coefficient divides
//! det E, so its degree is the same modulo p, where it divides the gcd of the minors modulo p. Hence for all k
//!
//! ```text
//! (U)   Σ_{j>k} deg a_j ≤ Σ_{j>k} deg b_j,     with equality for k = 0 (both are n).
//! ```
//!
//! **4. Nullities rise modulo p, and enough primes prove them.** Let f be a polynomial of degree d with whole coefficients
//! c_k. The equations `E x_{k+1} = A x_k` (k < d − 1), `c_d A x_{d−1} + Σ_k c_k E x_k = 0` have a whole matrix K of order
//! nd; by the first ones `x_k = Gᵏ x_0`, so over any field in which det E ≠ 0 the nullity of K is that of f(G), which is
//! `Σ_j deg gcd(f, a_j)`. If it is at least N modulo primes whose product exceeds the product of the norms of the rows of K
//! (Hadamard again), all minors of order nd − N + 1 vanish over ℚ, and the nullity is at least N over ℚ.
//!
//! **5. Invariant factors.** Let the same `b_j`, monic with rational coefficients, be the invariant factors modulo all
//! primes of a set, and let 4 be used with `f = b_k` for every k ≥ 2. Then over ℚ, since modulo p the nullity is
//! `k deg b_k + Σ_{j>k} deg b_j`,
//!
//! ```text
//! (L)   k deg b_k + Σ_{j>k} deg b_j ≤ Σ_j deg gcd(b_k, a_j) ≤ Σ_{j≤k} deg gcd(b_k, a_j) + Σ_{j>k} deg a_j
//!                                   ≤ k deg b_k + Σ_{j>k} deg a_j ≤ k deg b_k + Σ_{j>k} deg b_j      (by U),
//! ```
//!
//! so they are equal throughout: b_k divides a_j for all j ≤ k, and the sums of the degrees over j > k agree, for every
//! k ≥ 2. Hence deg a_j = deg b_j and a_j = b_j for j ≥ 3; b_2 divides a_2 and by (U) with k = 1 has no smaller degree:
//! a_2 = b_2; and a_1 = b_1 = χ divided by the others. With one factor (U) alone suffices.
//!
//! **6. Uncontrollable part.** Exact rows Y with `Y A = M Y E`, `Y B = 0` (independent, as many as n minus the rank modulo a
//! prime) and that rank show the uncontrollable part: the invariant factors of `[sE − A, B]` are those of sI − M, found as in
//! 1 to 5 (its characteristic polynomial divides χ, so 2 bounds it). The same for the unobservable part, with the transposed
//! system.
//!
//! **7. Square-free factors.** Polynomials q_i, whose product is square-free modulo a prime and hence over ℚ, with
//! exponents such that the products `Π q_i^e` *are* the invariant factors of 5 and 6, checked by multiplying out in whole
//! numbers: all multiplicities and defects can be read off the exponents.
//!
//! **8. Relative degrees.** `C_i (sE − A)⁻¹ B_j + D_ij = N_ij / χ` with N_ij a minor of S; its coefficients vanish above the
//! degree n − r modulo enough primes, hence vanish; the next does not modulo one prime.
//!
//! **9. Zeros.** The rank ρ of S over the rational functions is the largest one modulo a prime: all minors of order ρ + 1
//! vanish modulo enough primes. If S is square and regular, its zeros are those of det S, known from enough primes. If not,
//! the argument of 5 is repeated for S, with K the equations `E x_{k+1} = A x_k + B u_k`,
//! `c_d (A x_{d−1} + B u_{d−1}) + Σ_k c_k E x_k = 0`, `C x_k + D u_k = 0`, whose nullity is
//! `Σ_j deg gcd(f, a_j) + (columns of S − ρ) d` for the invariant polynomials a_j of S. (U) needs another reason, as there
//! is no det E: if the gcd of the minors of order ρ − k had a greater degree than modulo p, p would divide its leading
//! coefficient, which divides that of a minor and is at most H; primes with a product above H cannot all do so. The sum for
//! k = 0 is no longer known beforehand, so (L) is used for k = 1 too. Of the primes whose images the b_j were made from, those
//! count for 4 modulo which the b_j are the factors found; the degrees are the same modulo all of them.
//!
//! **10. Wrong guesses.** 5, 7 and 9 start from the structure modulo most primes. If it cannot be confirmed, the computation is
//! repeated with other primes; after a few attempts it is left open.

mod bounds;
mod evidence;

use dashu_int::IBig;
use kardan_rt::functions::powi;

use super::LinearSystem;
use super::images::Image;
use super::spectrum::SpectrumText;
use super::spectrum::{self, Layout, MOST_EXPANDED, Pattern, factor_text, factors, with_leading_one};
use super::zeros::{self, ZeroStructure};
pub(super) use bounds::{norm_bits, pencil_of};
use bounds::{nullity_bits, whole, without_ports};
use evidence::{Gathered, Group, Source, bits, largest};
use kardan_math::num::modular_polynomial::{derivative, gcd, product};
use kardan_math::num::{Matrix, Polynomial, PrimeField, Rational, Residue, multiply_whole};
use kardan_results::Zeros;

/// Most primes times states³ that are spent on one statement.
const MOST_WORK: f64 = 1e13;

/// How often the search repeats for a structure that cannot be confirmed.
const ATTEMPTS: usize = 4;

/// The proven facts.
#[derive(Default)]
pub(super) struct Facts {
    /// The primes used.
    pub primes: Vec<u64>,
    /// Invariant factors: of the system, of its uncontrollable part, of its unobservable part.
    lists: [Vec<Polynomial>; 3],
    pieces: Vec<(Pattern, Polynomial)>,
    pub relative_degrees: Vec<Vec<Option<usize>>>,
    states: usize,
    /// Rank of S.
    rank: usize,
    zeros: Option<Polynomial>,
    zero_count: usize,
    /// How each claim is proven.
    pub statements: Vec<String>,
    /// Unproven results on multiplicities and invariant factors, with reasons.
    pub open_spectrum: Vec<String>,
    /// The same about zeros.
    pub open_zeros: Vec<String>,
    /// The structure modulo most of the primes was not that over the rationals.
    unlucky: bool,
}

impl Facts {
    /// Eigenvalues as text, if all about them is proven; long polynomials are known but not written out.
    pub fn spectrum(&self) -> Option<SpectrumText> {
        let pieces = self.pieces.iter().map(|(pattern, p)| (pattern, Some(p), p.degree()));
        self.open_spectrum.is_empty().then(|| SpectrumText {
            factors: spectrum::described(pieces),
            invariant_factors: self.lists[0].iter().map(|f| factor_text(Some(f), f.degree())).collect(),
            common: self.lists[0].first().cloned(),
        })
    }

    /// Zeros as text, if they are proven.
    pub fn zeros(&self) -> Option<Zeros> {
        let zeros = self.zeros.as_ref().filter(|p| p.degree() <= MOST_EXPANDED);
        self.open_zeros.is_empty().then(|| zeros::described(self.rank, self.states, self.zero_count, zeros))
    }
}

/// Proves all facts about a system. `actions` are M of [`structure`](super::structure)'s exact rows for the uncontrollable and
/// the unobservable part; the primes must differ from each other.
///
/// # Errors
/// Why only the ranks can be proven.
pub(super) fn prove(
    system: &LinearSystem,
    actions: [Option<&Matrix<Rational>>; 2],
    primes: &mut dyn FnMut() -> u64,
    progress: &dyn Fn(f64),
) -> Result<Facts, String> {
    let system = whole(system);
    for _ in 1..ATTEMPTS {
        let facts = attempt(&system, actions, primes, progress)?;
        if !facts.unlucky {
            return Ok(facts);
        }
    }
    attempt(&system, actions, primes, progress)
}

/// One attempt for a system with whole numbers.
fn attempt(
    system: &LinearSystem,
    actions: [Option<&Matrix<Rational>>; 2],
    primes: &mut dyn FnMut() -> u64,
    progress: &dyn Fn(f64),
) -> Result<Facts, String> {
    // All is done only at the end.
    let mut source = Source { primes, progress: &|fraction: f64| progress(fraction.min(0.99)) };
    let mut gathered = Gathered::new(system, actions, &mut source)?;
    let mut facts = Facts {
        primes: std::mem::take(&mut gathered.primes),
        relative_degrees: gathered.relative_degrees.take().unwrap_or_default(),
        states: system.states.len(),
        rank: gathered.rank,
        ..Facts::default()
    };
    facts.record(&format!("det(sE - A): coefficients known {} twice their bound", modulo(facts.primes.len() as u64)));
    let group = largest(&gathered.spectra).expect("there is a prime that does not divide det E");
    facts.take_spectrum(group, &gathered.characteristic.integers());
    if facts.unlucky {
        facts.open_zeros.push("not searched".into());
        return Ok(facts);
    }
    let pencils = [Some(without_ports(system)), actions[0].map(pencil_of), actions[1].map(pencil_of)];
    for (k, pencil) in pencils.iter().enumerate() {
        if let Some(pencil) = pencil {
            facts.prove_factors(k, pencil, group.bits, &mut source);
        }
    }
    if facts.open_spectrum.is_empty() {
        facts.record(
            "multiplicities and defects: powers of square-free factors multiply to the invariant factors exactly",
        );
    }
    facts.record("relative degrees: earlier coefficients vanish modulo primes with a product above their bound");
    let group = largest(&gathered.zeros).expect("there is a prime that does not divide det E");
    if gathered.is_regular(system) {
        let coefficients = gathered.determinant.integers().into_iter().map(Rational::from).collect();
        let zeros = Polynomial::new(coefficients).monic();
        facts.zero_count = zeros.degree();
        facts.zeros = Some(zeros);
        facts.record("invariant zeros: the determinant of the system matrix, known like det(sE - A)");
    } else {
        facts.prove_zeros(system, group, &mut source);
    }
    progress(1.0);
    Ok(facts)
}

impl Facts {
    fn record(&mut self, what: &str) {
        self.statements.push(format!("{what}; proven"));
    }

    /// Brings the polynomials back and checks that the pieces multiply to the invariant factors and these to the
    /// characteristic polynomials.
    fn take_spectrum(&mut self, group: &Group<Layout>, characteristic: &[IBig]) {
        let (degrees, pieces) = &group.key;
        let scale = Rational::from(characteristic[degrees[0].iter().sum::<usize>()].clone());
        let mut values = group.values.integers().into_iter().map(|x| Rational::from(x) / &scale);
        let mut next = |degree: usize| with_leading_one(values.by_ref().take(degree));
        self.lists = std::array::from_fn(|k| degrees[k].iter().map(|&degree| next(degree)).collect());
        self.pieces = pieces.iter().map(|(pattern, degree)| (pattern.clone(), next(*degree))).collect();
        let integral: Vec<Vec<IBig>> = self.pieces.iter().map(|(_, p)| p.whole_coefficients()).collect();
        let power = |exponent: &dyn Fn(&Pattern) -> usize| {
            let factors = self.pieces.iter().zip(&integral);
            factors.fold(vec![IBig::ONE], |all, ((pattern, _), p)| {
                (0..exponent(pattern)).fold(all, |all, _| multiply_whole(&all, p))
            })
        };
        let mut from = 0;
        let mut right = true;
        for (k, list) in self.lists.iter().enumerate() {
            for (i, f) in list.iter().enumerate() {
                right &= power(&|pattern| pattern[k][i]) == f.whole_coefficients();
            }
            // Each divides the next.
            right &= self.pieces.iter().all(|(pattern, _)| pattern[k].is_sorted());
            let degree: usize = degrees[k].iter().sum();
            let whole = characteristic[from..=from + degree].iter().cloned().map(Rational::from).collect();
            right &= power(&|pattern| pattern[k].iter().sum()) == Polynomial::new(whole).monic().whole_coefficients();
            from += degree + 1;
        }
        let field = &group.sample.field;
        let pieces = group.sample.spectrum.pieces.iter();
        let radical = pieces.fold(vec![field.one()], |all, (_, p)| product(field, &all, p));
        right &= gcd(field, &radical, &derivative(field, &radical)).len() == 1;
        if !right {
            self.unlucky = true;
            self.open_spectrum.push("the factors found do not multiply to the characteristic polynomial".into());
        }
    }

    /// Step 5 of the argument for one list of invariant factors.
    fn prove_factors(&mut self, number: usize, pencil: &LinearSystem, have: u64, source: &mut Source<'_>) {
        let what = ["invariant factors", "uncontrollable part", "unobservable part"][number];
        let list = self.lists[number].clone();
        if list.len() == 1 {
            return self.record(&format!("{what}: one invariant factor, its degree does not drop modulo a prime"));
        }
        let needed = list[..list.len() - 1].iter().map(|f| nullity_bits(pencil, f)).max().unwrap_or(0);
        let same = |prime| {
            let image = Image::new(pencil, prime)?;
            agree(&image.field, &list, &factors(&image.field, &image.g)).then_some(())
        };
        match self.repeat(needed, have, pencil.states.len(), source, same) {
            Ok(count) => self.record(&format!(
                "{what}: the same {} invariant factors {} the bound of the minors for their nullities",
                list.len(),
                modulo(count)
            )),
            Err(why) => self.open_spectrum.push(format!("{what}: {why}")),
        }
    }

    /// Step 9 of the argument where S is not square or not regular.
    fn prove_zeros(&mut self, system: &LinearSystem, group: &Group<(usize, Vec<usize>)>, source: &mut Source<'_>) {
        let (rank, degrees) = &group.key;
        self.zero_count = degrees.iter().sum();
        if *rank < self.rank {
            self.unlucky = true;
            return self.open_zeros.push("invariant zeros: only few primes gave the largest normal rank".into());
        }
        if degrees.is_empty() {
            self.zeros = Some(Polynomial::new(vec![Rational::ONE]));
            return self.record("invariant zeros: none modulo primes with a product above the bound of all minors");
        }
        let Some(values) = group.values.fractions() else {
            self.unlucky = true;
            return self.open_zeros.push("invariant zeros: no fractions within their bound".into());
        };
        // A prime may divide a denominator, or the image of the zeros may be another one there.
        let agreeing = group.primes.iter().filter(|&&prime| group.values.agrees(prime, &values));
        let have = agreeing.map(|&prime| bits(prime)).sum();
        let mut values = values.into_iter();
        let list: Vec<Polynomial> =
            degrees.iter().map(|&degree| with_leading_one(values.by_ref().take(degree))).collect();
        let needed = list.iter().map(|f| nullity_bits(system, f)).max().unwrap_or(0);
        let same = |prime| {
            let image = Image::new(system, prime)?;
            let found = ZeroStructure::of(&image);
            (found.rank == *rank && agree(&image.field, &list, &found.factors)).then_some(())
        };
        match self.repeat(needed, have, system.states.len(), source, same) {
            Ok(count) => self.record(&format!(
                "invariant zeros: the same invariant polynomials {} the bound of their nullities",
                modulo(count)
            )),
            Err(why) => self.open_zeros.push(format!("invariant zeros: {why}")),
        }
        let product = list.iter().fold(vec![IBig::ONE], |all, f| multiply_whole(&all, &f.whole_coefficients()));
        self.zeros = Some(Polynomial::new(product.into_iter().map(Rational::from).collect()).monic());
    }

    /// Takes primes until those that pass have a product above `2^needed`; their number (at least), or why not.
    fn repeat(
        &mut self,
        needed: u64,
        have: u64,
        states: usize,
        source: &mut Source<'_>,
        same: impl Fn(u64) -> Option<()> + Sync,
    ) -> Result<u64, String> {
        let more = needed.saturating_sub(have);
        let work = (more / 60) as f64 * powi(states as f64, 3);
        if work > MOST_WORK {
            return Err(format!("a proof needs {} primes and is not attempted", needed / 60 + 1));
        }
        let (mut found, mut failed) = (0, 0);
        while found < more {
            (source.progress)((have + found) as f64 / needed as f64);
            for (prime, passed) in source.batch(more - found, |prime| Some(same(prime).is_some())) {
                self.primes.push(prime);
                if passed { found += bits(prime) } else { failed += bits(prime) }
            }
            if failed > needed + 600 {
                self.unlucky = true;
                return Err("the structure differs modulo many primes".into());
            }
        }
        Ok(needed.div_ceil(60).max(1))
    }
}

/// `modulo … primes with a product above`, as text.
fn modulo(primes: u64) -> String {
    match primes {
        1 => "modulo one prime above".into(),
        _ => format!("modulo {primes} primes with a product above"),
    }
}

/// Whether polynomials modulo a prime are the images of these.
fn agree(field: &PrimeField, expected: &[Polynomial], found: &[Vec<Residue>]) -> bool {
    let same = |(p, q): (&Polynomial, &Vec<Residue>)| {
        p.coefficients().len() == q.len() && p.coefficients().iter().zip(q).all(|(c, &x)| field.rational(c) == Some(x))
    };
    expected.len() == found.len() && expected.iter().zip(found).all(same)
}

#[cfg(test)]
#[path = "../tests/unit/certified.rs"]
mod tests;

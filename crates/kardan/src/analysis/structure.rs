use dashu_int::ops::BitTest;

use super::LinearSystem;
use super::images::{Image, Images};
use crate::num::modular_polynomial::{divide, gcd, monic, product, shifted, square_free};
use crate::num::{
    Matrix, ModularMatrix, Polynomial, PrimeField, Random, Rational, Residue, Scalar, Span, invariant_factors,
    quotient_action, reachable,
};
use crate::results::{Certificate, Count, Entry, Factor, Invariant, Minor, Structure, Zeros};

/// Why the structure of a system cannot be decided.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StructureError {
    /// There are no states.
    #[error("the system has no states")]
    NoStates,
    /// E is singular, so the equations do not determine the rates of all states.
    #[error("E is singular: its rank is {rank}, the system has {states} states")]
    SingularDescriptor {
        /// Exact rank.
        rank: usize,
        /// Number of states.
        states: usize,
    },
}

/// Largest degree of polynomials whose coefficients are written out.
const MOST_EXPANDED: usize = 64;

/// Most primes for one number: enough for some 12000 digits.
const MOST_PRIMES: usize = 700;

/// Most primes for one number of a system too large for [`MOST_EXPANDED`].
const FEW_PRIMES: usize = 24;

/// The structure of a linear system: ranks, factors, relative degrees, zeros, least numbers of inputs and outputs, exact
/// for the stored numbers, with a certificate.
///
/// Ranks are found modulo random primes near 2⁶⁰. That they are not smaller is proven by a minor that does not vanish
/// modulo the prime; that they are not larger by left vectors that no input reaches, found modulo several primes, brought
/// back to fractions and checked exactly. Polynomials are brought back in the same way and confirmed modulo a further
/// prime; `certificate.statements` says what is proven and `certificate.failure_probability` bounds the rest.
///
/// The least number of inputs is the number of non-trivial invariant factors of `sI − E⁻¹A` \[diss. Theorems 5.2, 5.3\];
/// no eigenvalue is computed for any decision. The fields `uncontrollable` and `unobservable` are left to
/// [`failing_modes`](super::failing_modes). Cost O(n³) per prime.
///
/// ```
/// use kardan::analysis::{LinearSystem, structure};
/// use kardan::num::{Matrix, Rational};
/// let integers = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// // Two equal oscillators; the input acts on the first.
/// let system = LinearSystem::state_space(
///     integers(&[&[0, 1, 0, 0], &[-4, 0, 0, 0], &[0, 0, 0, 1], &[0, 0, -4, 0]]),
///     integers(&[&[0], &[1], &[0], &[0]]),
///     integers(&[&[1, 0, 0, 0]]),
/// );
/// let structure = structure(&system).unwrap();
/// assert_eq!((structure.controllable_rank, structure.min_inputs), (2, 2));
/// assert_eq!(structure.invariant_factors, ["s^2 + 4", "s^2 + 4"]);
/// ```
///
/// # Errors
/// [`StructureError`].
///
/// # Panics
/// If the shapes of the matrices do not fit each other.
pub fn structure(system: &LinearSystem) -> Result<Structure, StructureError> {
    let n = system.states.len();
    if n == 0 {
        return Err(StructureError::NoStates);
    }
    let dual = system.transpose();
    let mut images = Images::new(system, 1);
    // The same seed gives the dual system the same primes.
    let mut dual_images = Images::new(&dual, 1);
    let (Some(first), Some(dual_first)) = (images.get(0).cloned(), dual_images.get(0).cloned()) else {
        let order: Vec<usize> = (0..n).collect();
        return Err(StructureError::SingularDescriptor {
            rank: crate::num::echelon(&system.e, &order).rank(),
            states: n,
        });
    };
    let mut proof = Proof::new(system);
    let reached = Reach::of(&first);
    let seen = Reach::of(&dual_first);
    let unreached = (reached.rank < n).then(|| invariant_rows(&mut images, n - reached.rank));
    let unseen = (seen.rank < n).then(|| invariant_rows(&mut dual_images, n - seen.rank));
    proof.rank("controllability", reached.rank, n, unreached.as_ref().is_none_or(Option::is_some));
    proof.rank("observability", seen.rank, n, unseen.as_ref().is_none_or(Option::is_some));

    let found = Spectrum::of(&first, &dual_first);
    let (factors, invariant_factors, common) = spectrum(&mut images, &mut dual_images, &found, n);
    proof.modular("multiplicities and invariant factors");
    let kind = Kind::of(system);
    let m = found.invariant.len();
    let inputs = count(&mut images, m, common.as_ref(), kind.freedoms.map(|r| (r, true)));
    let outputs = count(&mut dual_images, m, common.as_ref(), kind.freedoms.map(|r| (r, false)));
    proof.count("inputs", m, inputs.as_ref());
    proof.count("outputs", m, outputs.as_ref());
    let zeros = zeros(&mut images);
    proof.modular("invariant zeros");
    let (relative_degrees, proven) = relative_degrees(system, &first);
    if proven {
        proof.statements.push("relative degrees: the leading Markov parameters vanish exactly; proven".into());
    } else {
        proof.modular("relative degrees");
    }
    let mut primes = images.primes();
    primes.extend(dual_images.primes());
    primes.sort_unstable();
    primes.dedup();
    let certificate = Certificate {
        proven: proof.open == 0,
        failure_probability: proof.failure_probability(),
        primes,
        statements: proof.statements,
        pencil: pencil(system),
        inputs,
        outputs,
        unreached: unreached.flatten(),
        unseen: unseen.flatten(),
        reached: Some(reached.minor),
        seen: Some(seen.minor),
    };
    Ok(Structure {
        states: system.states.clone(),
        inputs: system.inputs.clone(),
        outputs: system.outputs.clone(),
        controllable_rank: reached.rank,
        observable_rank: seen.rank,
        factors,
        uncontrollable: Vec::new(),
        unobservable: Vec::new(),
        relative_degrees,
        zeros,
        invariant_factors,
        min_inputs: m,
        min_outputs: m,
        kind: kind.name.into(),
        construction: None,
        certificate,
    })
}

/// The rank of the controllability matrix of `E ẋ = A x + B u`, modulo one random prime: never above the true rank.
///
/// `None` if E is singular.
pub fn controllable_rank(system: &LinearSystem) -> Option<usize> {
    let mut images = Images::new(system, 1);
    images.get(0).map(|image| reachable(&image.field, &image.g, &image.b).span.dimension())
}

/// Which theorem of chapter 5 applies.
struct Kind {
    name: &'static str,
    freedoms: Option<usize>,
}

impl Kind {
    fn of(system: &LinearSystem) -> Self {
        let Some(r) = system.freedoms else { return Self { name: "state space", freedoms: None } };
        let block = |column: usize| (0..r).all(|i| (0..r).all(|j| system.a[(r + i, column + j)].is_zero()));
        let name = match (block(0), block(r)) {
            (true, _) => "pure damping",
            (false, true) => "no damping",
            (false, false) => "general",
        };
        Self { name, freedoms: Some(r) }
    }
}

/// Collects what is proven and what is only very probable.
struct Proof {
    statements: Vec<String>,
    open: usize,
    each: f64,
}

impl Proof {
    fn new(system: &LinearSystem) -> Self {
        // A rank of the block matrix of all [E, −A, B] decides every claim; its minors have at most size² · bits bits.
        let bits = [&system.e, &system.a, &system.b, &system.c, &system.d]
            .iter()
            .flat_map(|matrix| matrix.as_slice())
            .map(|x| x.numerator().clone().into_parts().1.bit_len() + x.denominator().bit_len())
            .max()
            .unwrap_or(1) as f64;
        let size = (system.states.len() + system.inputs.len() + system.outputs.len()) as f64;
        let bad = size * size * (bits + size.log2().max(1.0)) / 60.0;
        Self { statements: Vec::new(), open: 0, each: bad / PrimeField::CHOICES + size * size / (1u64 << 60) as f64 }
    }

    fn modular(&mut self, what: &str) {
        self.open += 1;
        self.statements.push(format!("{what}: modulo random primes; wrong with a probability below {:.0e}", self.each));
    }

    fn rank(&mut self, what: &str, rank: usize, n: usize, proven: bool) {
        if !proven {
            return self.modular(&format!("{what} rank {rank} of {n} (at least {rank} is proven)"));
        }
        self.statements.push(if rank == n {
            format!("{what} rank {n} of {n}: a minor does not vanish modulo a prime; proven")
        } else {
            format!(
                "{what} rank {rank} of {n}: a minor does not vanish modulo a prime, and {} exact left vectors are never \
                 reached; proven",
                n - rank
            )
        });
    }

    fn count(&mut self, what: &str, m: usize, count: Option<&Count>) {
        match count {
            Some(_) if m == 1 => {
                let one = what.trim_end_matches('s');
                self.statements.push(format!("1 {one} is enough: a witness with a non-vanishing minor; proven"));
            }
            Some(count) => self.statements.push(format!(
                "{m} {what} are enough: a witness with a non-vanishing minor; fewer are impossible: {} exact rows on which \
                 the system acts as {m} copies of one companion matrix; proven",
                count.rows.len()
            )),
            None => self.modular(&format!("least number of {what} {m}")),
        }
    }

    fn failure_probability(&self) -> f64 {
        self.open as f64 * self.each
    }
}

/// The reachable part modulo one prime.
struct Reach {
    rank: usize,
    minor: Minor,
}

impl Reach {
    fn of(image: &Image) -> Self {
        let part = reachable(&image.field, &image.g, &image.b);
        let mut span = part.span;
        let rank = span.dimension();
        span.pivots.sort_unstable();
        let value = minor(&image.field, &part.vectors, &span.pivots);
        Self { rank, minor: Minor { prime: image.field.prime(), columns: part.columns, rows: span.pivots, value } }
    }
}

fn minor(field: &PrimeField, vectors: &[Vec<Residue>], rows: &[usize]) -> u64 {
    let square = ModularMatrix::from_fn(rows.len(), rows.len(), |i, j| vectors[j][rows[i]]);
    field.value(square.determinant(field))
}

/// Y with `Y A = M Y E` and `Y B = 0`, found modulo primes, checked exactly; `None` if the fractions are too large.
fn invariant_rows(images: &mut Images<'_>, count: usize) -> Option<Invariant> {
    let system = images.system;
    let n = system.states.len();
    if count * n > 20_000 {
        return None;
    }
    let limit = if n <= MOST_EXPANDED { MOST_PRIMES } else { FEW_PRIMES };
    let flat = images.reconstruct(limit, |image| {
        let field = &image.field;
        let part = reachable(field, &image.g, &image.b);
        let spanning = ModularMatrix::from_fn(part.vectors.len(), n, |i, j| part.vectors[i][j]);
        let rows = spanning.null_space(field).multiply(field, &image.inverse_e).echelon(field).0;
        (rows.rows == count).then(|| values(field, &rows))
    })?;
    let y = Matrix::from_fn(count, n, |i, j| flat[i * n + j].clone());
    let (on_e, on_a) = (multiply_sparse(&y, &system.e), multiply_sparse(&y, &system.a));
    if !multiply_sparse(&y, &system.b).as_slice().iter().all(Scalar::is_zero) {
        return None;
    }
    let pivots = crate::num::echelon(&on_e, &(0..n).collect::<Vec<_>>()).pivots;
    if pivots.len() < count {
        return None;
    }
    let pick = |m: &Matrix<Rational>| Matrix::from_fn(count, count, |i, j| m[(i, pivots[j])].clone());
    let action = pick(&on_e).transpose().solve(&pick(&on_a).transpose())?.transpose();
    (action.multiply(&on_e) == on_a).then(|| Invariant { rows: fractions(&y), action: fractions(&action) })
}

/// A product that skips the zeros of the right factor.
fn multiply_sparse(left: &Matrix<Rational>, right: &Matrix<Rational>) -> Matrix<Rational> {
    let mut out = Matrix::<Rational>::zeros(left.rows(), right.columns());
    for k in 0..right.rows() {
        for j in (0..right.columns()).filter(|&j| !right[(k, j)].is_zero()) {
            for i in (0..left.rows()).filter(|&i| !left[(i, k)].is_zero()) {
                out[(i, j)] = out[(i, j)].plus(&left[(i, k)].times(&right[(k, j)]));
            }
        }
    }
    out
}

fn values(field: &PrimeField, matrix: &ModularMatrix) -> Vec<u64> {
    (0..matrix.rows).flat_map(|i| matrix.row(i).iter().map(|&x| field.value(x))).collect()
}

fn fractions(matrix: &Matrix<Rational>) -> Vec<Vec<String>> {
    (0..matrix.rows()).map(|i| matrix.row(i).iter().map(ToString::to_string).collect()).collect()
}

/// What all roots of a polynomial have in common: algebraic and geometric multiplicity, defects of inputs and outputs.
type Signature = [usize; 4];

/// Eigenvalues modulo a prime: invariant factors, and square-free factors by signature.
struct Spectrum {
    invariant: Vec<Vec<Residue>>,
    factors: Vec<(Signature, Vec<Residue>)>,
}

impl Spectrum {
    fn of(image: &Image, dual: &Image) -> Self {
        let field = &image.field;
        let mut random = Random::new(field.prime());
        let invariant = invariant_factors(field, &image.g, &mut random);
        let missed = |image: &Image, random: &mut Random| {
            let part = reachable(&image.field, &image.g, &image.b);
            invariant_factors(&image.field, &quotient_action(&image.field, &image.g, &part.span), random)
        };
        let unreached = missed(image, &mut random);
        let unseen = missed(dual, &mut random);
        let parts: Vec<Vec<(Vec<Residue>, usize)>> = invariant.iter().map(|f| square_free(field, f)).collect();
        let largest = parts.last().map_or(&[][..], Vec::as_slice);
        let radical = largest.iter().fold(vec![field.one()], |all, (part, _)| product(field, &all, part));
        let mut pieces = vec![radical];
        let all = parts.iter().flatten().map(|(part, _)| part).chain(&unreached).chain(&unseen);
        for splitter in all {
            pieces = pieces
                .into_iter()
                .flat_map(|piece| {
                    let common = gcd(field, &piece, splitter);
                    let rest = divide(field, &piece, &common).0;
                    [common, monic(field, &rest)]
                })
                .filter(|piece| piece.len() > 1)
                .collect();
        }
        let divides = |piece: &[Residue], other: &[Residue]| gcd(field, piece, other).len() == piece.len();
        let mut factors: Vec<(Signature, Vec<Residue>)> = Vec::new();
        for piece in pieces {
            let count = |list: &[Vec<Residue>]| list.iter().filter(|other| divides(&piece, other)).count();
            let algebraic =
                parts.iter().flatten().filter(|(part, _)| divides(&piece, part)).map(|(_, exponent)| exponent).sum();
            let signature = [algebraic, count(&invariant), count(&unreached), count(&unseen)];
            match factors.iter_mut().find(|(other, _)| *other == signature) {
                Some((_, all)) => *all = product(field, all, &piece),
                None => factors.push((signature, piece)),
            }
        }
        factors.sort_by_key(|factor| factor.0);
        Self { invariant, factors }
    }

    /// All coefficients below the leading ones of the polynomials short enough, with the layout.
    fn flat(&self, field: &PrimeField) -> (Vec<(Signature, usize)>, Vec<u64>) {
        let layout = self.factors.iter().map(|(signature, factor)| (*signature, factor.len())).collect();
        let invariant = self.invariant.iter();
        let all =
            invariant.chain(self.factors.iter().map(|(_, factor)| factor)).filter(|p| p.len() <= MOST_EXPANDED + 1);
        (layout, all.flat_map(|p| p[..p.len() - 1].iter().map(|&x| field.value(x))).collect())
    }
}

/// Factors with their roots, invariant factors in words, and the smallest invariant factor.
fn spectrum(
    images: &mut Images<'_>,
    dual: &mut Images<'_>,
    first: &Spectrum,
    n: usize,
) -> (Vec<Factor>, Vec<String>, Option<Polynomial>) {
    let layout = first.flat(&images.get(0).expect("the first image is there").field).0;
    let limit = if n <= MOST_EXPANDED { MOST_PRIMES } else { FEW_PRIMES };
    let flat = images.reconstruct_with(dual, limit, |image, dual| {
        let (found, values) = Spectrum::of(image, dual).flat(&image.field);
        (found == layout).then_some(values)
    });
    let mut coefficients = flat.as_ref().map(|flat| flat.iter().cloned());
    let mut next = |length: usize| {
        let coefficients = coefficients.as_mut().filter(|_| length <= MOST_EXPANDED + 1)?;
        let lower: Vec<Rational> = coefficients.take(length - 1).collect();
        Some(Polynomial::new(lower.into_iter().chain([Rational::ONE]).collect()))
    };
    let in_words = |p: &Option<Polynomial>, length: usize| match p {
        Some(p) => p.to_string(),
        None => format!("(degree {}, not written out)", length - 1),
    };
    let mut common = None;
    let mut invariant = Vec::new();
    for (k, factor) in first.invariant.iter().enumerate() {
        let polynomial = next(factor.len());
        invariant.push(in_words(&polynomial, factor.len()));
        if k == 0 {
            common = polynomial;
        }
    }
    let mut factors = Vec::new();
    for ([algebraic, geometric, input_defect, output_defect], factor) in &first.factors {
        let whole = next(factor.len());
        let pieces = whole.as_ref().map_or_else(|| vec![None], |p| p.simple_factors().into_iter().map(Some).collect());
        for piece in pieces {
            factors.push(Factor {
                polynomial: in_words(&piece, factor.len()),
                roots: piece.as_ref().map(Polynomial::roots).unwrap_or_default(),
                algebraic: *algebraic,
                geometric: *geometric,
                input_defect: *input_defect,
                output_defect: *output_defect,
            });
        }
    }
    (factors, invariant, common)
}

/// The proof that m inputs are enough and, by way of the common factor, that fewer are not.
///
/// With `force = Some((r, true))` the witness acts as forces on r degrees of freedom; with `false` (the dual system) as
/// sensors of their positions.
fn count(
    images: &mut Images<'_>,
    m: usize,
    common: Option<&Polynomial>,
    force: Option<(usize, bool)>,
) -> Option<Count> {
    let system = images.system;
    let n = system.states.len();
    let first = images.get(0)?.clone();
    let field = first.field;
    let mut random = Random::new(5);
    let (mut witness, mut proof) = (Vec::new(), None);
    for attempt in 0..30 {
        let (rows, at) = match force {
            Some((r, true)) => (r, r),
            Some((r, false)) => (r, 0),
            None => (n, 0),
        };
        witness = vec![vec![0i64; m]; n];
        for row in &mut witness[at..at + rows] {
            row.iter_mut().for_each(|x| *x = random.small(1 + 3 * attempt));
        }
        let raw = ModularMatrix::from_fn(n, m, |i, j| field.integer(witness[i][j]));
        let part = reachable(&field, &first.g, &first.inverse_e.multiply(&field, &raw));
        if part.span.dimension() == n {
            let rows: Vec<usize> = (0..n).collect();
            let value = minor(&field, &part.vectors, &rows);
            proof = Some(Minor { prime: field.prime(), columns: part.columns, rows, value });
            break;
        }
    }
    let minor = proof?;
    if m == 1 {
        return Some(Count { number: 1, witness, minor, ..Count::default() });
    }
    let common = common?;
    let degree = common.degree();
    if m * degree * n > 20_000 {
        return None;
    }
    let combinations = generators(&first, m, common)?;
    let limit = if n <= MOST_EXPANDED { MOST_PRIMES } else { FEW_PRIMES };
    let flat = images.reconstruct(limit, |image| {
        let rows = chains(image, common, &combinations)?;
        Some(values(&image.field, &rows.multiply(&image.field, &image.inverse_e)))
    })?;
    let count = m * degree;
    let y = Matrix::from_fn(count, n, |i, j| flat[i * n + j].clone());
    let (on_e, on_a) = (multiply_sparse(&y, &system.e), multiply_sparse(&y, &system.a));
    let acts = (0..count).all(|i| {
        (0..n).all(|j| {
            if (i + 1) % degree != 0 {
                return on_a[(i, j)] == on_e[(i + 1, j)];
            }
            let sum = (0..degree).fold(Rational::ZERO, |sum, k| {
                sum.minus(&common.coefficients()[k].times(&on_e[(i + 1 - degree + k, j)]))
            });
            on_a[(i, j)] == sum
        })
    });
    let independent = ModularMatrix::from_rational(&field, &y)?.echelon(&field).1.len() == count;
    (acts && independent).then(|| Count {
        number: m,
        witness,
        minor,
        common_factor: common.coefficients().iter().map(ToString::to_string).collect(),
        rows: fractions(&y),
    })
}

/// A basis of the left kernel of `q(G)`.
fn left_kernel(image: &Image, q: &Polynomial) -> Option<ModularMatrix> {
    let (field, n) = (&image.field, image.g.rows);
    let mut value = ModularMatrix::zeros(n, n);
    for c in q.coefficients().iter().rev() {
        value = value.multiply(field, &image.g).plus(field, field.rational(c)?, &ModularMatrix::identity(field, n));
    }
    Some(value.transpose().null_space(field))
}

/// Combinations of the left kernel of `q(G)` that generate m independent chains.
fn generators(image: &Image, m: usize, q: &Polynomial) -> Option<Vec<Vec<i64>>> {
    let field = &image.field;
    let kernel = left_kernel(image, q)?;
    let mut random = Random::new(9);
    let mut chosen: Vec<Vec<i64>> = Vec::new();
    let mut span = Span::default();
    for attempt in 0..kernel.rows + 200 {
        let combination: Vec<i64> = (0..kernel.rows)
            .map(|k| if attempt < kernel.rows { i64::from(k == attempt) } else { random.small(4) })
            .collect();
        let mut next = span.clone();
        if chain(image, &kernel, &combination, q.degree()).iter().all(|w| next.insert(field, w).is_none()) {
            span = next;
            chosen.push(combination);
        }
        if chosen.len() == m {
            return Some(chosen);
        }
    }
    None
}

fn chain(image: &Image, kernel: &ModularMatrix, combination: &[i64], degree: usize) -> Vec<Vec<Residue>> {
    let field = &image.field;
    let mut w = vec![0; kernel.columns];
    for (k, &c) in combination.iter().enumerate() {
        field.subtract(&mut w, field.integer(-c), kernel.row(k));
    }
    let transposed = image.g.transpose();
    let mut out = vec![w];
    while out.len() < degree {
        out.push(transposed.apply(field, &out[out.len() - 1]));
    }
    out
}

fn chains(image: &Image, q: &Polynomial, combinations: &[Vec<i64>]) -> Option<ModularMatrix> {
    let kernel = left_kernel(image, q)?;
    let all: Vec<Vec<Residue>> = combinations
        .iter()
        .filter(|combination| combination.len() == kernel.rows)
        .flat_map(|combination| chain(image, &kernel, combination, q.degree()))
        .collect();
    let complete = all.len() == combinations.len() * q.degree();
    complete.then(|| ModularMatrix::from_fn(all.len(), kernel.columns, |i, j| all[i][j]))
}

/// Invariant zeros with multiplicity: roots of the product of the invariant polynomials of `[sE − A, −B; C, D]`.
fn zeros(images: &mut Images<'_>) -> Zeros {
    let system = images.system;
    let n = system.states.len();
    let Some(first) = images.get(0).cloned() else { return Zeros::default() };
    let (rank, polynomial) = zero_polynomial(&first);
    let normal_rank = rank - n;
    let degree = polynomial.len().saturating_sub(1);
    let unknown = Zeros { polynomial: format!("(degree {degree}, not written out)"), values: Vec::new(), normal_rank };
    if degree > MOST_EXPANDED || n > 2 * MOST_EXPANDED {
        return unknown;
    }
    let lower = images.reconstruct(MOST_PRIMES, |image| {
        let (also, polynomial) = zero_polynomial(image);
        let same = also == rank && polynomial.len() == degree + 1;
        same.then(|| polynomial[..degree].iter().map(|&x| image.field.value(x)).collect())
    });
    let Some(lower) = lower else { return unknown };
    let whole = Polynomial::new(lower.into_iter().chain([Rational::ONE]).collect());
    // Roots of the square-free parts, each as often as its exponent.
    let mut values = Vec::new();
    for (part, exponent) in exact_square_free(&whole) {
        for root in part.roots() {
            values.extend(std::iter::repeat_n(root, exponent));
        }
    }
    values.sort_by(|a, b| a.0.hypot(a.1).total_cmp(&b.0.hypot(b.1)).then(a.1.total_cmp(&b.1)));
    Zeros { polynomial: whole.to_string(), values, normal_rank }
}

/// `(square-free part, exponent)` over the rationals, by repeated division with the greatest common divisor.
fn exact_square_free(p: &Polynomial) -> Vec<(Polynomial, usize)> {
    let slope = |p: &Polynomial| {
        let terms = p.coefficients().iter().enumerate().skip(1);
        Polynomial::new(terms.map(|(k, c)| c.times(&Rational::from(k as u64))).collect())
    };
    let common = |a: &Polynomial, b: &Polynomial| {
        let (mut a, mut b) = (a.clone(), b.clone());
        while !b.coefficients().is_empty() {
            let rest = a.divide(&b).1;
            let leading = rest.coefficients().last().cloned();
            let rest = match leading {
                Some(l) => Polynomial::new(rest.coefficients().iter().map(|c| c.over(&l)).collect()),
                None => rest,
            };
            a = std::mem::replace(&mut b, rest);
        }
        a
    };
    let mut out = Vec::new();
    let mut rest = p.clone();
    let mut radical = p.divide(&common(p, &slope(p))).0;
    let mut exponent = 0;
    while radical.degree() > 0 {
        exponent += 1;
        rest = rest.divide(&radical).0;
        let still = if rest.degree() > 0 { common(&radical, &rest) } else { Polynomial::new(vec![Rational::ONE]) };
        let part = radical.divide(&still).0;
        if part.degree() > 0 {
            out.push((part, exponent));
        }
        radical = still;
    }
    out
}

/// Normal rank of the system matrix and its zero polynomial, monic, modulo a prime.
fn zero_polynomial(image: &Image) -> (usize, Vec<Residue>) {
    let field = &image.field;
    let (n, inputs, outputs) = (image.g.rows, image.raw_b.columns, image.c.rows);
    let mut random = Random::new(field.prime() ^ 0x5a);
    let shift = random.below(field.prime());
    let at = ModularMatrix::from_fn(n + outputs, n + inputs, |i, j| match (i < n, j < n) {
        (true, true) => field.minus(field.times(shift, image.e.row(i)[j]), image.a.row(i)[j]),
        (true, false) => field.negate(image.raw_b.row(i)[j - n]),
        (false, true) => image.c.row(i - n)[j],
        (false, false) => image.d.row(i - n)[j - n],
    });
    let slope =
        ModularMatrix::from_fn(n + outputs, n + inputs, |i, j| if i < n && j < n { image.e.row(i)[j] } else { 0 });
    let rank = at.clone().echelon(field).1.len();
    if rank == n + inputs && rank == n + outputs {
        return (rank, determinant_polynomial(field, &at, &slope, shift));
    }
    // The greatest common divisor of two random combinations of the minors of full rank is that of all of them.
    let mut common = Vec::new();
    for _ in 0..2 {
        let left = ModularMatrix::random(field, rank, n + outputs, &mut random);
        let right = ModularMatrix::random(field, n + inputs, rank, &mut random);
        let squeeze = |m: &ModularMatrix| left.multiply(field, m).multiply(field, &right);
        common = gcd(field, &common, &determinant_polynomial(field, &squeeze(&at), &squeeze(&slope), shift));
    }
    (rank, common)
}

/// `det(P + (s − shift) Q)`, monic: with Z = P⁻¹Q it is det P · det(I + tZ), t = s − shift, and the latter is the
/// characteristic polynomial of Z read backwards.
fn determinant_polynomial(field: &PrimeField, p: &ModularMatrix, q: &ModularMatrix, shift: Residue) -> Vec<Residue> {
    let Some((z, _)) = p.solve(field, q) else { return Vec::new() };
    let mut backwards = z.characteristic_polynomial(field);
    backwards.reverse();
    for x in backwards.iter_mut().skip(1).step_by(2) {
        *x = field.negate(*x);
    }
    monic(field, &shifted(field, &backwards, field.negate(shift)))
}

/// Relative degree of every input-output pair, and whether the vanishing of what comes before is proven exactly.
fn relative_degrees(system: &LinearSystem, image: &Image) -> (Vec<Vec<Option<usize>>>, bool) {
    let (n, field) = (system.states.len(), &image.field);
    let columns = image.g.transpose();
    let inputs = image.b.transpose();
    let mut table = Vec::new();
    for output in 0..system.outputs.len() {
        let mut row: Vec<Option<usize>> =
            image.d.row(output).iter().map(|&x| if x == 0 { None } else { Some(0) }).collect();
        let mut v = image.c.row(output).to_vec();
        for degree in 1..=n {
            if row.iter().all(Option::is_some) || v.iter().all(|&x| x == 0) {
                break;
            }
            for (input, entry) in row.iter_mut().enumerate() {
                if entry.is_none() && field.dot(&v, inputs.row(input)) != 0 {
                    *entry = Some(degree);
                }
            }
            v = columns.apply(field, &v);
        }
        table.push(row);
    }
    let proven = n <= MOST_EXPANDED && vanish_exactly(system, &table);
    (table, proven)
}

/// Whether `C (E⁻¹A)ᵏ E⁻¹B = 0` for all powers below the relative degrees.
fn vanish_exactly(system: &LinearSystem, table: &[Vec<Option<usize>>]) -> bool {
    let n = system.states.len();
    let transposed = system.e.transpose();
    let mut v = system.c.transpose();
    let deepest = table.iter().flatten().map(|degree| degree.unwrap_or(n + 1)).max().unwrap_or(0);
    for degree in 1..deepest {
        // Column i of v: the row C_i (E⁻¹A)^(degree−1) E⁻¹.
        let Some(next) = transposed.solve(&v) else { return false };
        let markov = multiply_sparse(&next.transpose(), &system.b);
        for (i, row) in table.iter().enumerate() {
            for (j, found) in row.iter().enumerate() {
                if found.is_none_or(|found| degree < found) && !markov[(i, j)].is_zero() {
                    return false;
                }
            }
        }
        v = multiply_sparse(&next.transpose(), &system.a).transpose();
    }
    true
}

/// The matrices as sparse fractions.
fn pencil(system: &LinearSystem) -> Vec<(String, Vec<Entry>)> {
    [("E", &system.e), ("A", &system.a), ("B", &system.b), ("C", &system.c), ("D", &system.d)]
        .into_iter()
        .map(|(name, matrix)| {
            let entries = (0..matrix.rows())
                .flat_map(|i| (0..matrix.columns()).map(move |j| (i, j)))
                .filter(|&at| !matrix[at].is_zero())
                .map(|(i, j)| (i, j, matrix[(i, j)].to_string()))
                .collect();
            (name.to_string(), entries)
        })
        .collect()
}

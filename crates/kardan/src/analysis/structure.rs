use std::cmp::Ordering;
use std::sync::Arc;

use super::images::{Image, Images, Seen, fingerprint};
use super::spectrum::{MOST_EXPANDED, Spectrum, factors, in_words, quotient_factors, with_leading_one};
use super::zeros::ZeroStructure;
use super::{LinearSystem, certified, spectrum, zeros};
use crate::num::modular_polynomial::product;
use crate::num::{
    Matrix, ModularMatrix, Operator, Polynomial, PrimeField, Primes, Random, Rational, Residue, Scalar, Span,
    exact_rank, reachable,
};
use crate::results::{
    Certificate, Count, Entry, Factor, Invariant, Minor, MinorColumn, SparseMatrix, Structure, Undecided, Zeros,
};

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

/// Most primes for one number: enough for some 12000 digits.
const MOST_PRIMES: usize = 700;

/// Least of the numbers of primes that are tried for one number of a large system.
const FEW_PRIMES: usize = 24;

/// Most primes for one number where a proof is asked for.
const PRIMES_FOR_PROOF: usize = 20_000;

/// Primes that are looked at where inputs do not reach all.
const LOOKS: usize = 3;

/// Most numbers in one proof by exact rows, where speed is asked for.
const MOST_NUMBERS: usize = 20_000;

/// The structure of a linear system: ranks, factors, relative degrees, zeros, least numbers of inputs and outputs, exact
/// for the stored numbers, with a certificate.
///
/// Ranks are found modulo random primes near 2⁶⁰. That they are not smaller is proven by a minor that does not vanish
/// modulo the prime; that they are not larger by left vectors that no input reaches, found modulo several primes, brought
/// back to fractions and checked exactly. Polynomials are brought back in the same way and confirmed modulo a further
/// prime; `certificate.statements` says what is proven and `certificate.failure_probability` bounds the rest.
/// [`certified_structure`] leaves no rest.
///
/// The bound holds for every system, also for one that was written to mislead: the primes that it is about are others each
/// time ([`Primes::unforeseen`]), and appear nowhere in the result. The primes in the certificate, whose minors are proofs
/// with any prime, follow from the numbers of the system.
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
    decide(system, None)
}

/// The same as [`structure`], every answer proven over the rationals: `certificate.proven` is true and the probability of
/// failure zero.
///
/// The polynomials, multiplicities, defects, zeros and relative degrees follow from the same computation modulo so many
/// primes that numbers below a bound of Hadamard's kind must be what they look like; `analysis/certified.rs` holds the
/// argument. For n states with numbers of b bits that takes about `n (b + 1) / 60` primes for systems without a double
/// eigenvalue; for eigenvalues with several eigenvectors, roots of a factor of degree d, about d times as many. `progress`
/// hears the fraction done. Should the number of primes needed be beyond reach, `certificate.proven` is false and a
/// statement says what is open and why.
///
/// ```
/// use kardan::analysis::{LinearSystem, certified_structure};
/// use kardan::num::{Matrix, Rational};
/// let integers = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// let system = LinearSystem::state_space(
///     integers(&[&[0, 1], &[-2, -3]]),
///     integers(&[&[0], &[1]]),
///     integers(&[&[1, 0]]),
/// );
/// let structure = certified_structure(&system, &|_| ()).unwrap();
/// assert!(structure.certificate.proven && structure.controllable());
/// assert_eq!(structure.invariant_factors, ["s^2 + 3 s + 2"]);
/// ```
///
/// # Errors
/// [`StructureError`].
///
/// # Panics
/// If the shapes of the matrices do not fit each other.
pub fn certified_structure(system: &LinearSystem, progress: &dyn Fn(f64)) -> Result<Structure, StructureError> {
    decide(system, Some(progress))
}

/// With `certify` everything is proven, and it hears the fraction done.
fn decide(system: &LinearSystem, certify: Option<&dyn Fn(f64)>) -> Result<Structure, StructureError> {
    let seed = fingerprint(system);
    let limits = Limits::new(system.states.len(), certify.is_some());
    decide_modulo(system, certify, [Primes::unforeseen(seed), Primes::new(seed)], &limits)
}

/// `drawn` are the primes that decide what is not proven; with `own`, which follow from the system, all is proven that the
/// certificate shows.
fn decide_modulo(
    system: &LinearSystem,
    certify: Option<&dyn Fn(f64)>,
    [drawn, mut own]: [Primes; 2],
    limits: &Limits,
) -> Result<Structure, StructureError> {
    let n = system.states.len();
    if n == 0 {
        return Err(StructureError::NoStates);
    }
    let dual = system.transpose();
    // Both skip the same primes.
    let mut images = Images::new(system, drawn.clone());
    let mut dual_images = Images::new(&dual, drawn);
    if images.get(0).is_none() {
        let rank = exact_rank(&system.e);
        if rank < n {
            return Err(StructureError::SingularDescriptor { rank, states: n });
        }
        while images.get(0).is_none() {}
        while dual_images.get(0).is_none() {}
    }
    let mut next_own = || loop {
        let prime = own.next().expect("primes are many");
        if let [Some(image), Some(dual)] = [system, &dual].map(|s| Image::new(s, prime)) {
            return Look::of(Arc::new(image), Arc::new(dual));
        }
    };
    let mut stated = next_own();
    let (found, unreached, unseen) = loop {
        let mut looks = 0;
        let mut look = || {
            let pair = images.get(looks).zip(dual_images.get(looks)).expect("E is regular, and primes are many");
            looks += 1;
            pair
        };
        let found = if stated.is_full() {
            // Full rank needs no second opinion.
            let (image, dual) = look();
            Look { image, dual, ..stated.clone() }
        } else {
            let mut best: Option<Look> = None;
            for _ in 0..limits.looks {
                let (image, dual) = look();
                let next = Look::of(image, dual);
                let full = next.is_full();
                if best.as_ref().is_none_or(|best| best.sum() < next.sum()) {
                    best = Some(next);
                }
                if full {
                    break;
                }
            }
            best.expect("one look at least")
        };
        while !stated.reaches(&found) {
            stated = next_own();
        }
        let rows = |images: &mut Images<'_>, rank: usize| match n - rank {
            0 => Ok(None),
            missing => invariant_rows(images, missing, limits),
        };
        if found.reaches(&stated)
            && let Ok(unreached) = rows(&mut images, found.reached.rank)
            && let Ok(unseen) = rows(&mut dual_images, found.seen.rank)
        {
            break (found, unreached, unseen);
        }
        // What was seen modulo these primes is not so.
        images.forget(looks);
        dual_images.forget(looks);
    };
    let Look { image: first, dual: dual_first, reached, seen } = found;
    let decided = [(reached.rank, &unreached), (seen.rank, &unseen)].map(|(rank, rows)| rank == n || rows.is_some());
    let mut proof = Proof::new(system);
    let undecided = decided.map(|decided| certify.is_some() && !decided);
    for (what, rank, k) in [("controllability", reached.rank, 0), ("observability", seen.rank, 1)] {
        if undecided[k] {
            proof.undecided(what, rank, n, limits.primes);
        } else {
            proof.rank(what, rank, n, decided[k]);
        }
    }
    let complete = decided == [true; 2];
    if certify.is_some() && !complete {
        proof.statements.push("no proof of the rest: it needs the exact left vectors".into());
    }
    let facts = certify.filter(|_| complete).and_then(|progress| {
        let actions = [&unreached, &unseen].map(|rows| rows.as_ref().map(|rows| &rows.action));
        let facts = certified::prove(system, actions, &mut || own.next().expect("primes are many"), progress);
        facts.map_err(|why| proof.statements.push(format!("no proof of the rest: {why}"))).ok()
    });

    // What is not proven is found modulo random primes.
    let known = facts.as_ref().and_then(certified::Facts::spectrum);
    let proven = known.is_some();
    let spectrum = known.unwrap_or_else(|| spectrum(&mut images, &first, &reached, &dual_first, &seen, limits));
    let known = facts.as_ref().and_then(certified::Facts::zeros);
    let zeros_proven = known.is_some();
    let zeros = known.unwrap_or_else(|| zeros(&mut images, &first, limits));
    let table = facts.as_ref().map_or_else(|| relative_degrees(&first), |facts| facts.relative_degrees.clone());
    let m = spectrum.invariant_factors.len();
    let common = spectrum.common.as_ref();
    let kind = Kind::of(system);
    let (inputs, outputs) = rayon::join(
        || count(&mut images, &first, (&stated.image, &own), m, common, kind.freedoms.map(|r| (r, true)), proven),
        || {
            count(
                &mut dual_images,
                &dual_first,
                (&stated.dual, &own),
                m,
                common,
                kind.freedoms.map(|r| (r, false)),
                proven,
            )
        },
    );
    if let Some(facts) = &facts {
        proof.statements.extend(facts.statements.iter().cloned());
        let open = facts.open_spectrum.iter().chain(&facts.open_zeros);
        proof.statements.extend(open.map(|why| format!("no proof: {why}")));
    }
    if !proven {
        proof.modular("multiplicities and invariant factors");
    }
    proof.count("inputs", m, inputs.as_ref(), proven);
    proof.count("outputs", m, outputs.as_ref(), proven);
    if !zeros_proven {
        proof.modular("invariant zeros");
    }
    if facts.is_none() {
        if n <= MOST_EXPANDED && vanish_exactly(system, &table) {
            proof.statements.push("relative degrees: the leading Markov parameters vanish exactly; proven".into());
        } else {
            proof.modular("relative degrees");
        }
    }
    let minors =
        inputs.iter().chain(&outputs).map(|count| &count.minor).chain([&stated.reached.minor, &stated.seen.minor]);
    let mut primes: Vec<u64> = minors.map(|minor| minor.prime).collect();
    primes.extend(facts.iter().flat_map(|facts| &facts.primes));
    primes.sort_unstable();
    primes.dedup();
    let certificate = Certificate {
        proven: proof.open == 0 && undecided == [false; 2],
        failure_probability: proof.failure_probability(),
        primes,
        statements: proof.statements,
        pencil: pencil(system),
        inputs,
        outputs,
        unreached: unreached.map(Left::into_fractions),
        unseen: unseen.map(Left::into_fractions),
        reached: Some(stated.reached.minor),
        seen: Some(stated.seen.minor),
    };
    Ok(Structure {
        states: system.states.clone(),
        inputs: system.inputs.clone(),
        outputs: system.outputs.clone(),
        controllable_rank: reached.rank,
        observable_rank: seen.rank,
        undecided: Undecided { controllability: undecided[0], observability: undecided[1] },
        factors: spectrum.factors,
        uncontrollable: Vec::new(),
        unobservable: Vec::new(),
        relative_degrees: table,
        zeros,
        invariant_factors: spectrum.invariant_factors,
        min_inputs: m,
        min_outputs: m,
        kind: kind.name.into(),
        construction: None,
        certificate,
    })
}

/// Eigenvalues in words, and the smallest invariant factor.
pub(super) struct SpectrumInWords {
    pub factors: Vec<Factor>,
    pub invariant_factors: Vec<String>,
    pub common: Option<Polynomial>,
}

/// How much work is done for one answer.
struct Limits {
    /// Most primes.
    primes: usize,
    /// Most numbers in exact rows.
    numbers: usize,
    /// How many images are looked at where inputs do not reach all.
    looks: usize,
}

impl Limits {
    fn new(n: usize, certify: bool) -> Self {
        if certify {
            return Self { primes: PRIMES_FOR_PROOF, numbers: usize::MAX, looks: LOOKS };
        }
        Self { primes: most_primes(n), numbers: MOST_NUMBERS, looks: LOOKS }
    }
}

/// How many primes are tried for one number of a system with n states: as many as take a few seconds.
fn most_primes(n: usize) -> usize {
    ((2e9 / (n as f64).powi(3)) as usize).clamp(FEW_PRIMES, MOST_PRIMES)
}

/// The rank of the controllability matrix of `E ẋ = A x + B u`, the largest one modulo a few random primes: never above the
/// true rank, and n only if it is n.
///
/// `None` if E is singular.
pub fn controllable_rank(system: &LinearSystem) -> Option<usize> {
    let mut images = Images::unforeseen(system);
    let mut best = 0;
    for number in 0..LOOKS {
        let image = images.get(number)?;
        best = best.max(reachable(&image.field, &image.g, &image.b).span.dimension());
        if best == image.g.rows {
            break;
        }
    }
    Some(best)
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
    /// Every claim holds unless a prime that was drawn divides one of a few whole numbers other than zero. With minors of S
    /// of at most H bits (see the bound in [`certified`]) these are: a minor of the block matrix of all [E, −A, B], n H bits;
    /// for the invariant factors of the system, of what is not reached and of what is not seen, and for the zeros, minors for
    /// the nullities, 2 n (H + n) bits, and leading coefficients of gcds of minors, n H bits, each; the discriminant of the
    /// square-free part, 2 n (H + 2 n) bits; numerators of differences between a coefficient and the candidates for it,
    /// 100 (H + n) bits. For each claim that is less than 32 (size + 4) (H + size) bits altogether.
    fn new(system: &LinearSystem) -> Self {
        let size = (system.states.len() + system.inputs.len() + system.outputs.len()) as f64;
        let norm = certified::norm_bits(&certified::whole(system)) as f64;
        let bad = 32.0 * (size + 4.0) * (norm + size) / 60.0;
        Self { statements: Vec::new(), open: 0, each: (bad / PrimeField::CHOICES).min(1.0) }
    }

    fn modular(&mut self, what: &str) {
        self.open += 1;
        self.statements.push(format!("{what}: modulo random primes; wrong with a probability below {:.0e}", self.each));
    }

    fn undecided(&mut self, what: &str, rank: usize, n: usize, primes: usize) {
        self.statements.push(format!(
            "{what} rank: not decided; it is at least {rank} of {n}, and exact left vectors for a proof that it is not more \
             were not found modulo {primes} primes"
        ));
    }

    fn rank(&mut self, what: &str, rank: usize, n: usize, proven: bool) {
        if !proven {
            return self.modular(&format!("{what} rank {rank} of {n} (at least {rank} is proven)"));
        }
        self.statements.push(if rank == n {
            format!("{what} rank {n} of {n}: a minor does not vanish modulo a prime; proven")
        } else {
            format!(
                "{what} rank {rank} of {n}: a minor does not vanish modulo a prime, and {} never reached; proven",
                match n - rank {
                    1 => "an exact left vector is".into(),
                    many => format!("{many} exact left vectors are"),
                }
            )
        });
    }

    fn count(&mut self, what: &str, m: usize, count: Option<&Count>, proven: bool) {
        match count {
            Some(_) if m == 1 => {
                let one = what.trim_end_matches('s');
                self.statements.push(format!("1 {one} is enough: a witness with a non-vanishing minor; proven"));
            }
            Some(count) if count.rows.is_empty() => self.statements.push(format!(
                "{m} {what} are enough: a witness with a non-vanishing minor; fewer are impossible: there are {m} \
                 invariant factors; proven"
            )),
            Some(count) => self.statements.push(format!(
                "{m} {what} are enough: a witness with a non-vanishing minor; fewer are impossible: {} exact rows on which \
                 the system acts as {m} copies of one companion matrix; proven",
                count.rows.len()
            )),
            None if proven => self.statements.push(format!(
                "least number of {what} {m}: the number of non-trivial invariant factors; proven"
            )),
            None => self.modular(&format!("least number of {what} {m}")),
        }
    }

    fn failure_probability(&self) -> f64 {
        (self.open as f64 * self.each).min(1.0)
    }
}

/// What is reached and seen modulo one prime.
#[derive(Clone)]
struct Look {
    image: Arc<Image>,
    /// The image of the transposed system.
    dual: Arc<Image>,
    reached: Reach,
    seen: Reach,
}

impl Look {
    fn of(image: Arc<Image>, dual: Arc<Image>) -> Self {
        let (reached, seen) = rayon::join(|| Reach::of(&image), || Reach::of(&dual));
        Self { image, dual, reached, seen }
    }

    fn is_full(&self) -> bool {
        [self.reached.rank, self.seen.rank] == [self.image.g.rows; 2]
    }

    fn sum(&self) -> usize {
        self.reached.rank + self.seen.rank
    }

    /// Whether no rank is below that of another look.
    fn reaches(&self, other: &Self) -> bool {
        self.reached.rank >= other.reached.rank && self.seen.rank >= other.seen.rank
    }
}

/// The reachable part modulo one prime.
#[derive(Clone)]
struct Reach {
    rank: usize,
    minor: Minor,
    span: Span,
}

impl Reach {
    fn of(image: &Image) -> Self {
        let part = reachable(&image.field, &image.g, &image.b);
        let rank = part.span.dimension();
        Self { rank, minor: minor(&image.field, part.columns, &part.span), span: part.span }
    }
}

fn minor(field: &PrimeField, columns: Vec<(usize, usize)>, span: &Span) -> Minor {
    let columns = columns.into_iter().map(|(input, power)| MinorColumn { input, power }).collect();
    let mut rows = span.pivots.clone();
    rows.sort_unstable();
    Minor { prime: field.prime(), columns, rows, value: field.value(span.minor(field)) }
}

/// Independent rows Y with `Y A = M Y E` and `Y B = 0`, exact.
struct Left {
    rows: Matrix<Rational>,
    action: Matrix<Rational>,
}

impl Left {
    fn into_fractions(self) -> Invariant {
        Invariant { rows: fractions(&self.rows), action: fractions(&self.action) }
    }
}

/// What primes have shown is not so over the rationals.
struct Misled;

/// Y and M, found modulo primes, checked exactly; `None` if the fractions are too large.
///
/// # Errors
/// If some prime shows fewer such rows, or what several of them agree on is wrong.
fn invariant_rows(images: &mut Images<'_>, count: usize, limits: &Limits) -> Result<Option<Left>, Misled> {
    let system = images.system;
    let n = system.states.len();
    if count * (n + count) > limits.numbers {
        return Ok(None);
    }
    let larger = std::cell::Cell::new(false);
    let modular = |image: &Image| {
        let field = &image.field;
        let part = reachable(field, &image.g, &image.b);
        let spanning = ModularMatrix::from_fn(part.vectors.len(), n, |i, j| part.vectors[i][j]);
        spanning.null_space(field).multiply(field, &image.inverse_e).echelon(field).0
    };
    let all = |image: &Image, rows: ModularMatrix| {
        let field = &image.field;
        let on_e = rows.multiply(field, &ModularMatrix::from_rational(field, &system.e)?);
        let on_a = on_e.multiply(field, &image.g);
        let pivots = on_e.clone().echelon(field).1;
        let pick = |m: &ModularMatrix| ModularMatrix::from_fn(count, count, |i, j| m.row(j)[pivots[i]]);
        let action = pick(&on_e).solve(field, &pick(&on_a))?.0.transpose();
        Some([values(field, &rows), values(field, &action)].concat())
    };
    let flat = images.reconstruct_if(limits.primes, |image| {
        let rows = modular(image);
        match rows.rows.cmp(&count) {
            Ordering::Less => {
                larger.set(true);
                Seen::Impossible
            }
            Ordering::Equal => all(image, rows).map_or(Seen::Nothing, Seen::Values),
            Ordering::Greater => Seen::Nothing,
        }
    });
    if larger.get() {
        return Err(Misled);
    }
    let Some(flat) = flat else { return Ok(None) };
    let rows = Matrix::from_fn(count, n, |i, j| flat[i * n + j].clone());
    let action = Matrix::from_fn(count, count, |i, j| flat[count * n + i * count + j].clone());
    let (on_e, on_a) = (multiply_sparse(&rows, &system.e), multiply_sparse(&rows, &system.a));
    // The rows are in echelon form, hence independent.
    let leads = (0..count).map(|i| rows.row(i).iter().position(|x| !x.is_zero())).collect::<Option<Vec<_>>>();
    let independent = leads.is_some_and(|leads| leads.is_sorted_by(|a, b| a < b));
    let unreached = multiply_sparse(&rows, &system.b).as_slice().iter().all(Scalar::is_zero);
    let proven = independent && unreached && multiply_sparse(&action, &on_e) == on_a;
    if proven { Ok(Some(Left { rows, action })) } else { Err(Misled) }
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

/// Factors with their roots, invariant factors in words, and the smallest invariant factor.
fn spectrum(
    images: &mut Images<'_>,
    first: &Image,
    reached: &Reach,
    dual: &Image,
    seen: &Reach,
    limits: &Limits,
) -> SpectrumInWords {
    let n = first.g.rows;
    let missed = |image: &Image, reach: &Reach| quotient_factors(&image.field, &image.g, &reach.span);
    let lists = [factors(&first.field, &first.g), missed(first, reached), missed(dual, seen)];
    let found = Spectrum::new(&first.field, lists);
    let (layout, limit) = (found.layout(), limits.primes);
    // Long polynomials are not brought back, but for the common factor, which is needed.
    let few = found.lists[0].len();
    let wanted = |k: usize, p: &[Residue]| p.len() <= MOST_EXPANDED + 1 || k == 0 && few > 1;
    let degrees: Vec<usize> = found.polynomials().map(|p| p.len() - 1).collect();
    let chosen: Vec<usize> = found.polynomials().enumerate().filter(|(k, p)| wanted(*k, p)).map(|(k, _)| k).collect();
    let flat = (!chosen.is_empty())
        .then(|| {
            images.reconstruct(limit, |image| {
                let field = &image.field;
                let rest = |rank: usize, g: &ModularMatrix, b: &ModularMatrix| match rank == n {
                    true => Vec::new(),
                    false => quotient_factors(field, g, &reachable(field, g, b).span),
                };
                let seen_by = |rank: usize| match rank == n {
                    true => Vec::new(),
                    false => rest(rank, &image.g.transpose(), &image.c.transpose()),
                };
                let lists = [factors(field, &image.g), rest(reached.rank, &image.g, &image.b), seen_by(seen.rank)];
                let also = Spectrum::new(field, lists);
                let all: Vec<&Vec<Residue>> = also.polynomials().collect();
                let lower = |k: &usize| all[*k][..all[*k].len() - 1].iter().map(|&x| field.value(x));
                (also.layout() == layout).then(|| chosen.iter().flat_map(lower).collect())
            })
        })
        .flatten();
    let mut polynomials: Vec<Option<Polynomial>> = vec![None; degrees.len()];
    if let Some(flat) = flat {
        let mut rest = flat.into_iter();
        for k in chosen {
            polynomials[k] = Some(with_leading_one(rest.by_ref().take(degrees[k])));
        }
    }
    let pieces = polynomials.len() - found.pieces.len();
    let described =
        found.pieces.iter().zip(pieces..).map(|((pattern, _), k)| (pattern, polynomials[k].as_ref(), degrees[k]));
    SpectrumInWords {
        factors: spectrum::described(described),
        invariant_factors: (0..few).map(|k| in_words(polynomials[k].as_ref(), degrees[k])).collect(),
        common: polynomials[0].clone(),
    }
}

/// The proof that m inputs are enough and, by way of the common factor, that fewer are not.
///
/// With `force = Some((r, true))` the witness acts as forces on r degrees of freedom; with `false` (the dual system) as
/// sensors of their positions.
///
/// `stated` is the image that the minor is about; should nothing be found modulo its prime, others of `spare` follow.
fn count(
    images: &mut Images<'_>,
    first: &Image,
    (stated, spare): (&Arc<Image>, &Primes),
    m: usize,
    common: Option<&Polynomial>,
    force: Option<(usize, bool)>,
    proven: bool,
) -> Option<Count> {
    let system = images.system;
    let others = spare.clone().take(8).filter_map(|prime| Image::new(system, prime).map(Arc::new));
    let (witness, minor) = std::iter::once(stated.clone()).chain(others).find_map(|image| witness(&image, m, force))?;
    if m == 1 {
        return Some(Count { number: 1, witness, minor, ..Count::default() });
    }
    let common = common?;
    let common_factor = common.coefficients().iter().map(ToString::to_string).collect();
    let rows = companion_rows(images, first, m, common);
    (proven || rows.is_some()).then(|| {
        let rows = rows.map_or_else(Vec::new, |rows| fractions(&rows));
        Count { number: m, witness, minor, common_factor, rows }
    })
}

/// An input matrix of whole numbers with m columns that reaches everything, and its minor.
fn witness(image: &Image, m: usize, force: Option<(usize, bool)>) -> Option<(Vec<Vec<i64>>, Minor)> {
    let (field, n) = (&image.field, image.g.rows);
    let mut random = Random::new(5);
    (0..30).find_map(|attempt| {
        let (rows, at) = match force {
            Some((r, true)) => (r, r),
            Some((r, false)) => (r, 0),
            None => (n, 0),
        };
        let mut witness = vec![vec![0i64; m]; n];
        for row in &mut witness[at..at + rows] {
            row.iter_mut().for_each(|x| *x = random.small(1 + 3 * attempt));
        }
        let raw = ModularMatrix::from_fn(n, m, |i, j| field.integer(witness[i][j]));
        let part = reachable(field, &image.g, &image.inverse_e.multiply(field, &raw));
        (part.span.dimension() == n).then(|| (witness, minor(field, part.columns, &part.span)))
    })
}

/// Independent rows Y with `Y A = (I ⊗ companion(q)) Y E`, m blocks of them, exact.
fn companion_rows(images: &mut Images<'_>, first: &Image, m: usize, common: &Polynomial) -> Option<Matrix<Rational>> {
    let (system, field) = (images.system, first.field);
    let (n, degree) = (system.states.len(), common.degree());
    if m * degree * n > MOST_NUMBERS {
        return None;
    }
    let combinations = generators(first, m, common)?;
    let flat = images.reconstruct(most_primes(n), |image| {
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
    (acts && independent).then_some(y)
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
fn zeros(images: &mut Images<'_>, first: &Image, limits: &Limits) -> Zeros {
    let n = first.g.rows;
    let found = ZeroStructure::of(first);
    let degree = found.degree();
    let lower = match degree {
        0 => Some(Vec::new()),
        _ if degree > MOST_EXPANDED => None,
        _ => images.reconstruct(limits.primes, |image| {
            let (field, also) = (&image.field, ZeroStructure::of(image));
            let polynomial = also.factors.iter().fold(vec![field.one()], |all, f| product(field, &all, f));
            let same = also.rank == found.rank && also.degree() == degree;
            same.then(|| polynomial[..degree].iter().map(|&x| field.value(x)).collect())
        }),
    };
    zeros::described(found.rank, n, degree, lower.map(with_leading_one).as_ref())
}

/// Relative degree of every input-output pair modulo a prime: never below the true one.
pub(super) fn relative_degrees(image: &Image) -> Vec<Vec<Option<usize>>> {
    let (n, field) = (image.g.rows, &image.field);
    let columns = Operator::new(&image.g.transpose());
    let inputs = image.b.transpose();
    let mut table = Vec::new();
    for output in 0..image.c.rows {
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
    table
}

/// Whether D and `C (E⁻¹A)ᵏ E⁻¹B` vanish for all powers below the relative degrees.
fn vanish_exactly(system: &LinearSystem, table: &[Vec<Option<usize>>]) -> bool {
    let n = system.states.len();
    let through = |i: usize, j: usize| table[i][j] != Some(0) && !system.d[(i, j)].is_zero();
    if (0..table.len()).any(|i| (0..table[i].len()).any(|j| through(i, j))) {
        return false;
    }
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
fn pencil(system: &LinearSystem) -> Vec<SparseMatrix> {
    [("E", &system.e), ("A", &system.a), ("B", &system.b), ("C", &system.c), ("D", &system.d)]
        .into_iter()
        .map(|(name, matrix)| {
            let entries = (0..matrix.rows())
                .flat_map(|i| (0..matrix.columns()).map(move |j| (i, j)))
                .filter(|&at| !matrix[at].is_zero())
                .map(|(row, column)| Entry { row, column, value: matrix[(row, column)].to_string() })
                .collect();
            SparseMatrix { name: name.to_string(), entries }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::prime_below;

    fn matrix(rows: &[&[&Rational]]) -> Matrix<Rational> {
        Matrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j].clone())
    }

    /// `A = diag(0, x)`, `B = (1, 1)`, `C = (1, 0)`, with x a multiple of these primes: modulo each of them one state is
    /// reached, over the rationals both are.
    fn misleading(primes: &[u64]) -> LinearSystem {
        let x = primes.iter().fold(Rational::ONE, |all, &p| all * Rational::from(p));
        let (none, one) = (Rational::ZERO, Rational::ONE);
        LinearSystem::state_space(
            matrix(&[&[&none, &none], &[&none, &x]]),
            matrix(&[&[&one], &[&one]]),
            matrix(&[&[&one, &none]]),
        )
    }

    fn silent(_: f64) {}

    /// The very primes that the analysis will draw divide the entries: it goes on to further ones.
    #[test]
    fn the_primes_in_use_do_not_mislead() {
        for count in [1, LOOKS, 2 * LOOKS, 20] {
            let primes: Vec<u64> =
                std::iter::successors(Some((1 << 61) - 1), |&p| Some(prime_below(p))).take(count).collect();
            let system = misleading(&primes);
            for certify in [None, Some(&silent as &dyn Fn(f64))] {
                let drawn = [1, 2].map(|seed| Primes::new(seed).after(&primes));
                let found = decide_modulo(&system, certify, drawn, &Limits::new(2, certify.is_some())).unwrap();
                let ranks = (found.controllable_rank, found.observable_rank, found.min_inputs);
                assert_eq!(ranks, (2, 1, 1), "{count} {:#?}", found.certificate.statements);
                assert_eq!(found.undecided, Undecided::default());
                assert!(found.certificate.primes.iter().all(|p| !primes.contains(p) || certify.is_some()));
                assert!(found.certificate.proven || certify.is_none());
            }
            // A descriptor matrix that seems singular modulo all of them.
            let x = primes.iter().fold(Rational::ONE, |all, &p| all * Rational::from(p));
            let descriptor = LinearSystem {
                e: matrix(&[&[&x]]),
                ..LinearSystem::state_space(
                    matrix(&[&[&Rational::ONE]]),
                    matrix(&[&[&Rational::ONE]]),
                    matrix(&[&[&Rational::ONE]]),
                )
            };
            let drawn = [1, 2].map(|seed| Primes::new(seed).after(&primes));
            let found = decide_modulo(&descriptor, Some(&silent), drawn, &Limits::new(1, true)).unwrap();
            assert_eq!((found.controllable_rank, found.observable_rank), (1, 1));
        }
    }

    /// Where a proof is asked for and not found, there is no verdict.
    #[test]
    fn what_is_not_proven_is_not_decided() {
        // The vector that is not reached has 200 digits, and one prime is allowed.
        let large = Rational::from_parts(1.into(), dashu_int::UBig::from(7u8).pow(240));
        let (none, one) = (Rational::ZERO, Rational::ONE);
        let system = LinearSystem::state_space(
            matrix(&[&[&none, &none], &[&none, &none]]),
            matrix(&[&[&one], &[&large]]),
            matrix(&[&[&one, &none], &[&none, &one]]),
        );
        let limits = |certify| Limits { primes: 2, ..Limits::new(2, certify) };
        let both = || [Primes::unforeseen(1), Primes::new(1)];
        let found = decide_modulo(&system, Some(&silent), both(), &limits(true)).unwrap();
        assert_eq!(
            (found.undecided, found.controllability(), found.observability()),
            (Undecided { controllability: true, observability: false }, None, Some(true))
        );
        assert_eq!((found.minimality(), found.controllable()), (None, false));
        assert!(!found.certificate.proven);
        let said = found.certificate.statements.join("\n");
        assert!(said.contains("controllability rank: not decided; it is at least 1 of 2"), "{said}");
        // Where no proof was asked for, it is told with its probability.
        let fast = decide_modulo(&system, None, both(), &limits(false)).unwrap();
        assert_eq!((fast.undecided, fast.controllability()), (Undecided::default(), Some(false)));
        assert!(fast.certificate.failure_probability > 0.0 && fast.certificate.failure_probability < 1e-6);
        assert!(fast.certificate.statements[0].contains("probability"), "{:?}", fast.certificate.statements);
        // With primes enough it is decided.
        assert!(certified_structure(&system, &silent).unwrap().certificate.proven);
    }

    /// Equal systems have equal fingerprints, others do not: signs, places and the matrix that an entry stands in count.
    #[test]
    fn fingerprints_tell_systems_apart() {
        let system = misleading(&[7]);
        assert_eq!(fingerprint(&system), fingerprint(&system.clone()));
        let mut seen = vec![fingerprint(&system)];
        for change in 0..6 {
            let mut other = system.clone();
            match change {
                0 => other.a[(1, 1)] = Rational::from(-7),
                1 => other.a[(1, 1)] = Rational::ONE.over(&Rational::from(7)),
                2 => other.b[(0, 0)] = Rational::ZERO,
                3 => other.c[(0, 0)] = Rational::from(256),
                4 => other.d[(0, 0)] = Rational::ONE,
                _ => other.e[(0, 1)] = Rational::ONE,
            }
            seen.push(fingerprint(&other));
        }
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), 7);
    }
}

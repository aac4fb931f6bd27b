//! The spectrum of a system by square-free factors, with multiplicities.

use kardan_math::num::modular_polynomial::{divide, gcd, monic, product, square_free};
use kardan_math::num::{
    ModularMatrix, Polynomial, PrimeField, Rational, Residue, Span, invariant_factors, quotient_action,
};
use kardan_results::{Complex, Factor};

/// Largest degree of polynomials whose coefficients are written out.
pub(super) const MOST_EXPANDED: usize = 64;

/// Exponents of a square-free factor in the invariant factors of the system, of what no input reaches, and of what no
/// output shows: the same for all its roots, hence all about their multiplicities.
pub(super) type Pattern = [Vec<usize>; 3];

/// Algebraic and geometric multiplicity, defects of inputs and outputs.
pub(super) fn signature(pattern: &Pattern) -> [usize; 4] {
    let blocks = |list: &[usize]| list.iter().filter(|&&exponent| exponent > 0).count();
    [pattern[0].iter().sum(), blocks(&pattern[0]), blocks(&pattern[1]), blocks(&pattern[2])]
}

/// [`Spectrum`] without its coefficients: degrees of the invariant factors, patterns with degrees.
pub(super) type Layout = ([Vec<usize>; 3], Vec<(Pattern, usize)>);

/// Eigenvalues modulo a prime; polynomials are monic with coefficients of 1, s, s², …
#[derive(Debug, Clone)]
pub(super) struct Spectrum {
    /// Non-trivial invariant factors of the system, of its uncontrollable part, of its unobservable part.
    pub lists: [Vec<Vec<Residue>>; 3],
    /// Coprime square-free factors of the characteristic polynomial, one for each pattern, and s of its own.
    pub pieces: Vec<(Pattern, Vec<Residue>)>,
}

/// Eigenvalues as text, and the smallest invariant factor.
pub(super) struct SpectrumText {
    pub factors: Vec<Factor>,
    pub invariant_factors: Vec<String>,
    pub common: Option<Polynomial>,
}

/// The invariant factors of the action of G on what a reachable part leaves.
pub(super) fn quotient_factors(field: &PrimeField, g: &ModularMatrix, span: &Span) -> Vec<Vec<Residue>> {
    if span.dimension() == g.rows {
        return Vec::new();
    }
    factors(field, &quotient_action(field, g, span))
}

/// The non-trivial invariant factors of a matrix.
pub(super) fn factors(field: &PrimeField, g: &ModularMatrix) -> Vec<Vec<Residue>> {
    invariant_factors(field, g, &mut kardan_math::num::Random::new(field.prime()))
}

impl Spectrum {
    /// Splits the characteristic polynomial by what its roots have in common.
    pub fn new(field: &PrimeField, lists: [Vec<Vec<Residue>>; 3]) -> Self {
        let parts = |list: &Vec<Vec<Residue>>| list.iter().map(|f| square_free(field, f)).collect::<Vec<_>>();
        let parts = [parts(&lists[0]), parts(&lists[1]), parts(&lists[2])];
        let largest = parts[0].last().map_or(&[][..], Vec::as_slice);
        let radical = largest.iter().fold(vec![field.one()], |all, (part, _)| product(field, &all, part));
        let mut pieces = vec![radical];
        // The root zero is separate.
        let zero = (vec![0, field.one()], 1);
        for (splitter, _) in parts.iter().flatten().flatten().chain([&zero]) {
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
        let mut all: Vec<(Pattern, Vec<Residue>)> = Vec::new();
        for piece in pieces {
            let exponent = |f: &Vec<(Vec<Residue>, usize)>| {
                f.iter().filter(|(part, _)| divides(&piece, part)).map(|(_, exponent)| *exponent).sum()
            };
            let pattern = std::array::from_fn(|k| parts[k].iter().map(exponent).collect());
            let is_zero = |piece: &[Residue]| piece[0] == 0;
            match all.iter_mut().find(|(other, found)| *other == pattern && is_zero(found) == is_zero(&piece)) {
                Some((_, found)) => *found = product(field, found, &piece),
                None => all.push((pattern, piece)),
            }
        }
        all.sort_by_cached_key(|(pattern, piece)| (signature(pattern), pattern.clone(), piece[0] != 0));
        Self { lists, pieces: all }
    }

    pub fn layout(&self) -> Layout {
        let degrees = |list: &Vec<Vec<Residue>>| list.iter().map(|f| f.len() - 1).collect();
        let pieces = self.pieces.iter().map(|(pattern, piece)| (pattern.clone(), piece.len() - 1)).collect();
        (std::array::from_fn(|k| degrees(&self.lists[k])), pieces)
    }

    /// All polynomials: the three lists, then the pieces.
    pub fn polynomials(&self) -> impl Iterator<Item = &Vec<Residue>> {
        self.lists.iter().flatten().chain(self.pieces.iter().map(|(_, piece)| piece))
    }
}

/// A polynomial as text, if it is known and not too long.
pub(super) fn factor_text(polynomial: Option<&Polynomial>, degree: usize) -> String {
    match polynomial.filter(|p| p.degree() <= MOST_EXPANDED) {
        Some(p) => p.to_string(),
        None => format!("(degree {degree}, not written out)"),
    }
}

/// The factors with their roots, split further where a rational factor of degree one or two is found.
pub(super) fn described<'a>(pieces: impl Iterator<Item = (&'a Pattern, Option<&'a Polynomial>, usize)>) -> Vec<Factor> {
    let mut out = Vec::new();
    for (pattern, whole, degree) in pieces {
        let [algebraic, geometric, input_defect, output_defect] = signature(pattern);
        let whole = whole.filter(|p| p.degree() <= MOST_EXPANDED);
        let parts = whole.map_or_else(
            || vec![(factor_text(None, degree), Vec::new())],
            |p| {
                p.simple_factors_with_roots()
                    .into_iter()
                    .map(|(part, roots)| (part.to_string(), Complex::list(roots)))
                    .collect()
            },
        );
        out.extend(parts.into_iter().map(|(polynomial, roots)| Factor {
            polynomial,
            roots,
            algebraic,
            geometric,
            input_defect,
            output_defect,
        }));
    }
    out
}

/// A monic polynomial from its coefficients below the leading one.
pub(super) fn with_leading_one(lower: impl IntoIterator<Item = Rational>) -> Polynomial {
    Polynomial::new(lower.into_iter().chain([Rational::ONE]).collect())
}

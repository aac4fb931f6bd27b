//! Where the poles of an exact linear system lie: the one place that decides whether it is stable.

use kardan_rt::functions::atan2;

use kardan_math::num::{
    Matrix, Polynomial, Rational, cayley, characteristic_polynomial, exact_rank, from_cayley, root_sides,
};
use kardan_results::{BorderMotion, Stability, StabilityEvidence, StabilityVerdict};

/// The border of stability.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plane {
    /// The imaginary axis.
    Continuous,
    /// The unit circle.
    Discrete,
}

/// Whether roots are outside the border, and square-free polynomials of those on it with how often each root is one; none where some are
/// outside.
fn sides(polynomial: &Polynomial, plane: Plane) -> (bool, Vec<(Polynomial, usize)>) {
    if plane == Plane::Continuous {
        let found = root_sides(polynomial);
        return (found.right > 0, found.on_border);
    }
    let transformed = cayley(polynomial);
    // Roots at −1 have gone to infinity.
    let at_minus_one = polynomial.degree() - transformed.degree();
    let found = root_sides(&transformed);
    let mut on_border: Vec<(Polynomial, usize)> =
        found.on_border.iter().map(|(part, times)| (from_cayley(part), *times)).collect();
    if at_minus_one > 0 && found.right == 0 {
        on_border.push((Polynomial::from_roots(&[Rational::NEG_ONE]), at_minus_one));
    }
    (found.right > 0, on_border)
}

/// The frequency of the motion of a root, rad/s (per sample of a discrete system).
fn frequency((re, im): (f64, f64), plane: Plane) -> f64 {
    match plane {
        Plane::Continuous => im.abs(),
        Plane::Discrete => atan2(im.abs(), re),
    }
}

/// A part of the characteristic polynomial on the border, with its growth by `growth`.
fn motions(
    on_border: &[(Polynomial, usize)],
    plane: Plane,
    growth: impl Fn(&Polynomial, usize) -> usize,
) -> Vec<BorderMotion> {
    let mut out = Vec::new();
    for (part, times) in on_border {
        for factor in part.simple_factors() {
            let growth = if *times == 1 { 0 } else { growth(&factor, *times) };
            let roots = factor.roots();
            // The upper one of a pair represents both.
            for root in roots.iter().filter(|root| root.1 >= 0.0) {
                let both = if root.1 > 0.0 { 2 } else { 1 };
                let frequency = frequency(*root, plane);
                out.push(BorderMotion { frequency, poles: both * times, growth_exponent: growth, uncontrolled: false });
            }
        }
    }
    out.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    out
}

/// Decides whether `ẋ = A x`, or `x⁺ = A x`, is stable, exactly.
///
/// Method: roots of the characteristic polynomial on each side ([`root_sides`], in discrete time behind `z = (1 + w)/(1 − w)`). Where none
/// is outside, the ranks of the powers of each factor g on the border of multiplicity m determine the lengths of its chains: the least k with
/// `dim ker g(A)ᵏ = m deg g` makes a motion that grows like `t^(k − 1)`.
///
/// ```
/// use kardan_analysis::{Plane, stability_of};
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_results::Stability;
/// let a = |rows: [[i64; 2]; 2]| Matrix::from_fn(2, 2, |i, j| Rational::from(rows[i][j]));
/// assert_eq!(stability_of(&a([[0, 1], [-4, 0]]), Plane::Continuous).word, Stability::Marginal);
/// // Two integrators beside each other, and one behind the other.
/// assert_eq!(stability_of(&a([[0, 0], [0, 0]]), Plane::Continuous).word, Stability::Marginal);
/// assert_eq!(stability_of(&a([[0, 1], [0, 0]]), Plane::Continuous).word, Stability::Unstable);
/// ```
///
/// # Panics
/// If the matrix is not square.
pub fn stability_of(a: &Matrix<Rational>, plane: Plane) -> StabilityVerdict {
    let n = a.rows();
    assert_eq!(n, a.columns(), "stability of a matrix that is not square");
    let (outside, on_border) = sides(&characteristic_polynomial(a), plane);
    let growth = |factor: &Polynomial, times: usize| {
        let once = value_at(factor, a);
        let (mut power, mut length) = (once.clone(), 1);
        while n - exact_rank(&power) < times * factor.degree() {
            power = power.multiply(&once);
            length += 1;
        }
        length - 1
    };
    StabilityVerdict::exact(outside, motions(&on_border, plane, growth))
}

/// The polynomial of a matrix (Horner).
fn value_at(polynomial: &Polynomial, a: &Matrix<Rational>) -> Matrix<Rational> {
    let n = a.rows();
    let identity = Matrix::<Rational>::identity(n);
    let coefficients = polynomial.coefficients().iter().rev();
    coefficients.fold(Matrix::zeros(n, n), |sum, c| sum.multiply(a).plus(&identity.scale(c)))
}

/// The same of a polynomial alone: for a repeated root on the border it does not determine how many motions the root has.
///
/// ```
/// use kardan_analysis::{Plane, stability_of_roots};
/// use kardan_math::num::{Polynomial, Rational};
/// use kardan_results::Stability;
/// let word = |c: &[i64]| {
///     let p = Polynomial::new(c.iter().map(|&c| Rational::from(c)).collect());
///     stability_of_roots(&p, Plane::Continuous).word
/// };
/// assert_eq!(word(&[10_000_000, 2060, 11]), Stability::Stable);
/// assert_eq!(word(&[0, 10_000, 1]), Stability::Marginal);
/// assert_eq!(word(&[-1, 0, 1]), Stability::Unstable);
/// assert_eq!(word(&[0, 0, 1]), Stability::Undecided);
/// ```
///
/// # Panics
/// If the polynomial is zero.
pub fn stability_of_roots(polynomial: &Polynomial, plane: Plane) -> StabilityVerdict {
    let (outside, on_border) = sides(polynomial, plane);
    let border = motions(&on_border, plane, |_, _| 0);
    if !outside && on_border.iter().any(|(_, times)| *times > 1) {
        let why = "a root on the stability boundary is repeated, and the number of its motions is unknown";
        return StabilityVerdict { border, ..StabilityVerdict::undecided(why) };
    }
    StabilityVerdict::exact(outside, border)
}

/// The verdict on numbers some of which are rounded: the one of the numbers as they are if it is the same, with the same motions on the
/// border, for others within their last digits.
pub fn despite_rounding(
    found: StabilityVerdict,
    perturbed: impl IntoIterator<Item = StabilityVerdict>,
) -> StabilityVerdict {
    let shape = |verdict: &StabilityVerdict| {
        let border =
            verdict.border.iter().map(|motion| (motion.poles, motion.growth_exponent, motion.frequency == 0.0));
        (verdict.word, border.collect::<Vec<_>>())
    };
    if found.word == Stability::Undecided || perturbed.into_iter().all(|candidate| shape(&candidate) == shape(&found)) {
        let evidence = match found.evidence {
            StabilityEvidence::Exactly | StabilityEvidence::Certified => StabilityEvidence::DespiteRounding,
            evidence => evidence,
        };
        return StabilityVerdict { evidence, ..found };
    }
    StabilityVerdict::undecided("it depends on the last digits of rounded numbers")
}

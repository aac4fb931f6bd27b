//! On which side of the imaginary axis, or of the unit circle, the roots of an exact polynomial lie.

use std::cmp::Ordering;

use super::{Polynomial, Rational, Scalar};

/// The roots of a polynomial on each side of the imaginary axis, with multiplicity.
#[derive(Debug, Clone, PartialEq)]
pub struct RootSides {
    /// How many lie left of the axis.
    pub left: usize,
    /// How many lie on it.
    pub border: usize,
    /// How many lie right of it.
    pub right: usize,
    /// Where none lies right of it: square-free polynomials, coprime, whose roots are those on the axis, and how often each root is one.
    pub on_border: Vec<(Polynomial, usize)>,
}

/// Counts the roots on each side of the imaginary axis, exactly.
///
/// Method: the common factor of `p(s)` and `p(−s)`, `sᵏ q(s²)`, has all roots that lie symmetrically to the origin, those on the axis
/// among them: k and the negative roots of q, which Sturm's chain counts. The others follow from the Cauchy index of
/// `p(jω)` (Hermite, Hurwitz), to which symmetric roots do not contribute.
///
/// ```
/// use kardan_math::num::{Polynomial, Rational, root_sides};
/// // (s + 1)(s − 2)(s² + 4)²
/// let p = |c: &[i64]| Polynomial::new(c.iter().map(|&c| Rational::from(c)).collect());
/// let q = p(&[4, 0, 1]);
/// let found = root_sides(&p(&[-2, -1, 1]).times(&q).times(&q));
/// assert_eq!((found.left, found.border, found.right), (1, 4, 1));
/// ```
///
/// # Panics
/// If the polynomial is zero.
pub fn root_sides(polynomial: &Polynomial) -> RootSides {
    assert!(!polynomial.is_zero(), "the zero polynomial has every number as a root");
    let degree = polynomial.degree();
    let symmetric = polynomial.gcd(&mirrored(polynomial));
    let at_zero = symmetric.coefficients().iter().take_while(|c| Scalar::is_zero(*c)).count();
    let even = Polynomial::new(symmetric.coefficients()[at_zero..].iter().step_by(2).cloned().collect());
    let parts = if even.degree() > 0 { even.square_free() } else { Vec::new() };
    let border = at_zero + parts.iter().map(|(part, times)| 2 * times * negative_roots(part)).sum::<usize>();
    let difference = left_minus_right(polynomial);
    let sides = degree - border;
    let right = (sides as isize - difference).unsigned_abs() / 2;
    let mut on_border = Vec::new();
    if right == 0 {
        let zero = Polynomial::from_roots(&[Rational::ZERO]);
        on_border.extend((at_zero > 0).then_some((zero, at_zero)));
        on_border.extend(parts.into_iter().map(|(part, times)| (of_squares(&part), times)));
    }
    RootSides { left: sides - right, border, right, on_border }
}

/// `(1 − w)ⁿ p((1 + w) / (1 − w))`: the inside of the unit circle becomes the left half-plane; roots at −1 go to infinity, so that the
/// degree falls by as many.
pub fn cayley(polynomial: &Polynomial) -> Polynomial {
    transformed(polynomial, [[1, 1], [1, -1]])
}

/// `(z + 1)ⁿ p((z − 1) / (z + 1))`: back from the half-plane to the circle.
pub fn from_cayley(polynomial: &Polynomial) -> Polynomial {
    transformed(polynomial, [[-1, 1], [1, 1]])
}

/// `(c + d x)ⁿ p((a + b x) / (c + d x))`
fn transformed(polynomial: &Polynomial, [up, down]: [[i64; 2]; 2]) -> Polynomial {
    let linear = |[constant, slope]: [i64; 2]| Polynomial::new(vec![constant.into(), slope.into()]);
    let (up, down) = (linear(up), linear(down));
    // Horner, with one more power of the denominator for each step.
    let mut power = Polynomial::constant(Rational::ONE);
    let mut out = Polynomial::default();
    for c in polynomial.coefficients().iter().rev() {
        out = out.times(&up).plus(&power.scale(c));
        power = power.times(&down);
    }
    out
}

/// p(−s)
fn mirrored(polynomial: &Polynomial) -> Polynomial {
    let sign = |(k, c): (usize, &Rational)| if k % 2 == 0 { c.clone() } else { -c.clone() };
    Polynomial::new(polynomial.coefficients().iter().enumerate().map(sign).collect())
}

/// p(s²)
pub(super) fn of_squares(polynomial: &Polynomial) -> Polynomial {
    let spread = polynomial.coefficients().iter().flat_map(|c| [c.clone(), Rational::ZERO]);
    Polynomial::new(spread.collect())
}

/// How many more roots lie left of the axis than right of it.
fn left_minus_right(polynomial: &Polynomial) -> isize {
    // p(jω) = R(ω) + j I(ω): jᵏ is 1, j, −1, −j.
    let part = |odd: usize| {
        let entry = |(k, c): (usize, &Rational)| match k % 4 {
            k if k % 2 != odd => Rational::ZERO,
            k if k < 2 => c.clone(),
            _ => -c.clone(),
        };
        Polynomial::new(polynomial.coefficients().iter().enumerate().map(entry).collect())
    };
    let degree = polynomial.degree();
    // The part with the highest power is the denominator; half a turn to the left counts one.
    let index = cauchy_index(part(degree % 2), part(1 - degree % 2));
    if degree % 2 == 1 { index } else { -index }
}

/// How often `lower / upper` jumps from −∞ to ∞ less how often it jumps back, over all real numbers (Sturm).
fn cauchy_index(upper: Polynomial, lower: Polynomial) -> isize {
    let chain = sturm_chain(upper, lower);
    changes(chain.iter().map(sign_far_below)) - changes(chain.iter().map(leading_sign))
}

/// Number of different real roots below zero, of a square-free polynomial that does not vanish at zero (Sturm).
fn negative_roots(polynomial: &Polynomial) -> usize {
    let chain = sturm_chain(polynomial.clone(), derivative(polynomial));
    let at_zero = changes(chain.iter().map(|p| sign(&p.coefficient(0))));
    (changes(chain.iter().map(sign_far_below)) - at_zero).unsigned_abs()
}

/// Remainders of repeated division with the opposite sign, times positive numbers; zeros are left out.
fn sturm_chain(first: Polynomial, second: Polynomial) -> Vec<Polynomial> {
    let mut chain = vec![first, second];
    while let [.., before, last] = &chain[..]
        && !last.is_zero()
    {
        let rest = positive_part(&before.divide(last).1);
        chain.push(rest.scale(&Rational::NEG_ONE));
    }
    chain.retain(|p| !p.is_zero());
    chain
}

/// The sign at numbers far above zero.
fn leading_sign(polynomial: &Polynomial) -> i32 {
    sign(&polynomial.coefficient(polynomial.degree()))
}

/// The sign at numbers far below zero.
fn sign_far_below(polynomial: &Polynomial) -> i32 {
    if polynomial.degree().is_multiple_of(2) { leading_sign(polynomial) } else { -leading_sign(polynomial) }
}

/// The same times a positive number, with short coefficients.
fn positive_part(polynomial: &Polynomial) -> Polynomial {
    match polynomial.coefficients().last() {
        Some(leading) if *leading < Rational::ZERO => polynomial.primitive().scale(&Rational::NEG_ONE),
        Some(_) => polynomial.primitive(),
        None => Polynomial::default(),
    }
}

fn sign(x: &Rational) -> i32 {
    match x.cmp(&Rational::ZERO) {
        Ordering::Less => -1,
        Ordering::Equal => 0,
        Ordering::Greater => 1,
    }
}

/// Changes of sign, zeros left out.
fn changes(signs: impl Iterator<Item = i32>) -> isize {
    let signs: Vec<i32> = signs.filter(|sign| *sign != 0).collect();
    signs.windows(2).filter(|pair| pair[0] != pair[1]).count() as isize
}

fn derivative(polynomial: &Polynomial) -> Polynomial {
    let terms = polynomial.coefficients().iter().enumerate().skip(1);
    Polynomial::new(terms.map(|(k, c)| Rational::from(k).times(c)).collect())
}

#[cfg(test)]
#[path = "../../tests/unit/num/root_sides.rs"]
mod tests;

//! Linear observers of exact plants: observability, and gains for given poles.

use dashu_int::UBig;

use kardan_math::num::{
    Matrix, Polynomial, Rational, Scalar, characteristic_polynomial, echelon, exact_zoh, rational_from_f64,
};
use kardan_schema::schema::ExactPole;

/// A plant `ẋ = A x + …` with measurements `y = C x + …`, or the same from one sample to the next.
pub(super) struct Plant {
    /// A, states × states.
    pub a: Matrix<Rational>,
    /// C, measurements × states.
    pub c: Matrix<Rational>,
}

impl Plant {
    /// The observability matrix: C, C A, C A², …
    fn observability(&self) -> Matrix<Rational> {
        let (n, m) = (self.a.rows(), self.c.rows());
        let mut rows = Matrix::<Rational>::zeros(n * m, n);
        let mut last = self.c.clone();
        for k in 0..n {
            (0..m).for_each(|i| rows.row_mut(k * m + i).clone_from_slice(last.row(i)));
            last = last.multiply(&self.a);
        }
        rows
    }

    /// Unobservable motions of the states, one column for each; exact.
    pub fn unobservable(&self) -> Matrix<Rational> {
        let order: Vec<usize> = (0..self.a.rows()).collect();
        echelon(&self.observability(), &order).kernel()
    }

    /// The gain L that gives `A − L C` this polynomial, exact: Ackermann's formula `L = p(A) O⁻¹ eₙ`. One measurement; `None` if it does
    /// not show all states.
    pub fn gain(&self, polynomial: &Polynomial) -> Option<Matrix<Rational>> {
        let n = self.a.rows();
        let last = Matrix::from_fn(n, 1, |i, _| if i + 1 == n { Rational::ONE } else { Rational::ZERO });
        let direction = self.observability().solve(&last)?;
        let mut coefficients = polynomial.coefficients().iter().rev();
        let leading = coefficients.next()?;
        Some(coefficients.fold(direction.scale(leading), |sum, c| self.a.multiply(&sum).plus(&direction.scale(c))))
    }

    /// `A − L C`
    pub fn error(&self, gain: &Matrix<Rational>) -> Matrix<Rational> {
        self.a.plus(&gain.multiply(&self.c).scale(&Rational::from(-1)))
    }
}

/// `Π (s − p)` of factors of one or two poles, each by its real part and the square of its imaginary part.
fn product(factors: impl Iterator<Item = Polynomial>) -> Polynomial {
    factors.fold(Polynomial::constant(Rational::ONE), |all, factor| all.times(&factor))
}

/// `Π (s − pole)`; with a time `Π (z − e^{pole T})`, to more digits than those of a double. `None` if a complex pole has no conjugate.
pub(super) fn of_poles(poles: &[ExactPole], sample_time: Option<&Rational>) -> Option<Polynomial> {
    let mut open: Vec<&ExactPole> = poles.iter().collect();
    let mut factors = Vec::new();
    while let Some((real, imaginary)) = open.pop() {
        let (re, im) = (real.to_rational(), imaginary.to_rational());
        let turning = !imaginary.is_zero();
        if turning {
            let conjugate = open.iter().position(|(candidate, part)| candidate == real && *part == -imaginary)?;
            open.remove(conjugate);
        }
        // The pole as a matrix: [re im; −im re], or [re].
        let opposite = Rational::ZERO.minus(&im);
        let entry = |i: usize, j: usize| [[&re, &im], [&opposite, &re]][i][j].clone();
        let order = if turning { 2 } else { 1 };
        let pole = Matrix::from_fn(order, order, entry);
        let pole = match sample_time {
            Some(time) => {
                let [transition, _] = exact_zoh(&pole, time)?;
                transition
            }
            None => pole,
        };
        factors.push(characteristic_polynomial(&pole));
    }
    Some(product(factors.into_iter()))
}

/// The roots at which an error does not decay: those of `det(s − F)` with a real part that is not below zero, of a sampled F those of a
/// magnitude that is not below one. The decision is exact.
pub(super) fn staying(error: &Matrix<Rational>, sampled: bool) -> Vec<(f64, f64)> {
    let polynomial = characteristic_polynomial(error);
    if !sampled {
        return polynomial.roots().into_iter().filter(|root| root.0 >= 0.0).collect();
    }
    // z = (1 + w)/(1 − w) maps the inside of the circle to the left half plane, and −1 to infinity.
    let (n, factor) = (polynomial.degree(), |sign: i32| Polynomial::new([1, sign].map(Rational::from).to_vec()));
    let power = |base: Polynomial, count: usize| product((0..count).map(|_| base.clone()));
    let moved = (0..=n).fold(Polynomial::constant(Rational::ZERO), |sum, k| {
        let term = power(factor(1), k).times(&power(factor(-1), n - k));
        sum.plus(&term.scale(&polynomial.coefficient(k)))
    });
    let mut out: Vec<(f64, f64)> = vec![(-1.0, 0.0); n - moved.degree()];
    for (x, y) in moved.roots().into_iter().filter(|root| root.0 >= 0.0) {
        // (1 + w)/(1 − w)
        let size = (1.0 - x) * (1.0 - x) + y * y;
        out.push(((1.0 - x * x - y * y) / size, 2.0 * y / size));
    }
    out
}

/// Binary digits below which the result of a sum is the rounding of its terms.
const ROUNDING: usize = 45;
/// Above this growth, cancellation in the sums leaves no significant digit.
const TOO_MUCH: i32 = 4096;

/// `e^{A T}` with entries of zero where their terms cancel to rounding: half a period of an oscillation contains no information on its speed.
///
/// The reference is `e^{M T}`, M being A with the magnitudes of its off-diagonal entries, which no entry exceeds.
pub(super) fn settled(transition: Matrix<Rational>, a: &Matrix<Rational>, time: &Rational) -> Matrix<Rational> {
    let n = a.rows();
    let size = |x: &Rational| if *x < Rational::ZERO { Rational::ZERO.minus(x) } else { x.clone() };
    let sizes = Matrix::from_fn(n, n, |i, j| if i == j { a[(i, i)].clone() } else { size(&a[(i, j)]) });
    let steady = exact_zoh(&sizes, time).filter(|[bound, _]| (0..n).all(|i| bound[(i, i)] < Rational::from(TOO_MUCH)));
    let Some([largest, _]) = steady else { return transition };
    let scale = Rational::from(UBig::ONE << ROUNDING);
    Matrix::from_fn(n, n, |i, j| match size(&transition[(i, j)]).times(&scale) < largest[(i, j)] {
        true => Rational::ZERO,
        false => transition[(i, j)].clone(),
    })
}

/// Each entry rounded once, to the nearest double.
pub(super) fn rounded(matrix: &Matrix<Rational>) -> Option<Matrix<Rational>> {
    let all: Option<Vec<Rational>> = matrix.to_f64().as_slice().iter().map(|x| rational_from_f64(*x)).collect();
    let all = all?;
    Some(Matrix::from_fn(matrix.rows(), matrix.columns(), |i, j| all[i * matrix.columns() + j].clone()))
}

#[cfg(test)]
#[path = "../../tests/unit/block/estimate.rs"]
mod tests;

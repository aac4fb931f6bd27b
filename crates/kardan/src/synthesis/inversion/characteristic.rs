use super::polynomial_matrix::{constant, derivative, plus, scaled};
use crate::num::{Matrix, Polynomial, Rational, Scalar};

/// det(sI − M), exact.
///
/// Method: Hessenberg form by elimination, then the recurrence over its leading blocks (La Budde); O(n³) operations.
pub(super) fn characteristic_polynomial(matrix: &Matrix<Rational>) -> Polynomial {
    let n = matrix.rows();
    let h = hessenberg(matrix.clone());
    let mut leading = vec![constant(Rational::ONE)];
    for k in 0..n {
        let last = &leading[k];
        let mut next = plus(&derivative(last), &scaled(last, &Rational::ZERO.minus(&h[(k, k)])));
        let mut product = Rational::ONE;
        for i in (0..k).rev() {
            product = product.times(&h[(i + 1, i)]);
            if product.is_zero() {
                break;
            }
            next = plus(&next, &scaled(&leading[i], &Rational::ZERO.minus(&product.times(&h[(i, k)]))));
        }
        leading.push(next);
    }
    leading.pop().unwrap_or_default()
}

/// A similar matrix with zeros below the first subdiagonal.
fn hessenberg(mut m: Matrix<Rational>) -> Matrix<Rational> {
    let n = m.rows();
    for k in 0..n.saturating_sub(2) {
        let Some(pivot) = (k + 1..n).find(|&i| !m[(i, k)].is_zero()) else { continue };
        m.swap_rows(k + 1, pivot);
        for i in 0..n {
            let x = m[(i, k + 1)].clone();
            m[(i, k + 1)] = m[(i, pivot)].clone();
            m[(i, pivot)] = x;
        }
        for i in k + 2..n {
            if m[(i, k)].is_zero() {
                continue;
            }
            let factor = m[(i, k)].over(&m[(k + 1, k)]);
            for j in k..n {
                m[(i, j)] = m[(i, j)].minus(&factor.times(&m[(k + 1, j)]));
            }
            for j in 0..n {
                m[(j, k + 1)] = m[(j, k + 1)].plus(&factor.times(&m[(j, i)]));
            }
        }
    }
    m
}

/// Whether all roots are in the open left half plane, decided exactly (Routh). Constants other than zero are.
pub(in crate::synthesis) fn is_hurwitz(polynomial: &Polynomial) -> bool {
    let coefficients = polynomial.monic().coefficients().to_vec();
    if coefficients.is_empty() {
        return false;
    }
    // Coefficients of every other power, highest first.
    let row = |offset: usize| coefficients.iter().rev().skip(offset).step_by(2).cloned().collect::<Vec<_>>();
    let (mut upper, mut lower) = (row(0), row(1));
    for _ in 0..polynomial.degree() {
        let Some(lead) = lower.first().filter(|x| **x > Rational::ZERO).cloned() else { return false };
        let factor = upper[0].over(&lead);
        let next =
            (1..upper.len()).map(|k| upper[k].minus(&factor.times(lower.get(k).unwrap_or(&Rational::ZERO)))).collect();
        upper = std::mem::replace(&mut lower, next);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polynomial(coefficients: &[i64]) -> Polynomial {
        Polynomial::new(coefficients.iter().map(|&c| Rational::from(c)).collect())
    }

    #[test]
    fn characteristic_polynomials() {
        let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows.len(), |i, j| Rational::from(rows[i][j]));
        assert_eq!(characteristic_polynomial(&matrix(&[])), polynomial(&[1]));
        // (s − 1)(s − 2)(s² + 3), hidden by a similarity; a zero subdiagonal entry on the way.
        let m = matrix(&[&[0, 0, 1, 0], &[0, 1, 0, 5], &[-3, 0, 0, 7], &[0, 0, 0, 2]]);
        assert_eq!(characteristic_polynomial(&m), polynomial(&[6, -9, 5, -3, 1]));
        let t = matrix(&[&[1, 2, 0, 1], &[0, 1, -1, 3], &[1, 2, 1, 1], &[0, 0, 0, 1]]);
        let similar = t.solve(&m.multiply(&t)).unwrap();
        assert_eq!(characteristic_polynomial(&similar), polynomial(&[6, -9, 5, -3, 1]));
    }

    #[test]
    fn hurwitz_is_decided_at_the_border() {
        for (p, stable) in [
            (&[1][..], true),
            (&[], false),
            (&[5000, 1], true),
            (&[0, 1], false),
            (&[1, 0, 1], false),
            (&[-6, -11, -6, -1], true),
            (&[1, 1, 1, 1], false),
            (&[1, 1, 2, 1], true),
            (&[2, 1, 1, 1], false),
            (&[1, 4, 6, 4, 1], true),
        ] {
            assert_eq!(is_hurwitz(&polynomial(p)), stable, "{p:?}");
        }
    }
}

//! Tests of `src/num/elimination.rs`.

use super::*;
use proptest::prelude::*;

fn rational(values: &[i64], rows: usize, columns: usize) -> Matrix<Rational> {
    Matrix::from_fn(rows, columns, |i, j| Rational::from(values[i * columns + j]))
}

fn quadratic(m: &Matrix<Rational>, x: &[Rational]) -> Rational {
    let mut sum = Rational::zero();
    for i in 0..x.len() {
        for j in 0..x.len() {
            sum = sum.plus(&x[i].times(&m[(i, j)]).times(&x[j]));
        }
    }
    sum
}

proptest! {
    /// form = transform · original, pivot columns are unit vectors, and the dependencies annihilate the rows.
    #[test]
    fn echelon_is_what_it_says(values in prop::collection::vec(-3i64..4, 12)) {
        let m = rational(&values, 4, 3);
        let e = echelon(&m, &[2, 0, 1]);
        prop_assert_eq!(&e.transform.multiply(&m), &e.form);
        for (row, &pivot) in e.pivots.iter().enumerate() {
            for i in 0..4 {
                let expected = if i == row { Rational::one() } else { Rational::zero() };
                prop_assert_eq!(&e.form[(i, pivot)], &expected);
            }
        }
        for i in e.rank()..4 {
            prop_assert!(e.form.row(i).iter().all(|x| x.is_zero()));
        }
        prop_assert_eq!(e.dependent_rows().len(), 4 - e.rank());
    }

    /// The witness proves the verdict.
    #[test]
    fn definiteness_has_a_witness(values in prop::collection::vec(-3i64..4, 9), shift in 0i64..4) {
        let a = rational(&values, 3, 3);
        let mut m = a.transpose().multiply(&a);
        m[(0, 0)] = m[(0, 0)].minus(&Rational::from(shift));
        match definiteness(&m) {
            Definiteness::Positive => {
                // All leading minors positive (Sylvester).
                let d1 = m[(0, 0)].clone();
                let d2 = m[(0, 0)].times(&m[(1, 1)]).minus(&m[(0, 1)].times(&m[(1, 0)]));
                prop_assert!(d1 > Rational::zero() && d2 > Rational::zero());
            }
            Definiteness::PositiveSemi { direction } => {
                prop_assert!(direction.iter().any(|x| !x.is_zero()));
                let x = Matrix::from_fn(3, 1, |i, _| direction[i].clone());
                prop_assert!(m.multiply(&x).as_slice().iter().all(|v| v.is_zero()));
            }
            Definiteness::Indefinite { witness } => prop_assert!(quadratic(&m, &witness) < Rational::zero()),
        }
    }
}

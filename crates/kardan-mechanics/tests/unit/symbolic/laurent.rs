//! Tests of `src/symbolic/laurent.rs`.

use super::*;
use proptest::prelude::*;

fn some() -> impl Strategy<Value = Laurent> {
    let term = (-2i32..3, -2i32..3, -3i64..4);
    prop::collection::vec(term, 1..5).prop_map(|terms| {
        let monomial = |a, b| [(0, a), (1, b)].into_iter().filter(|(_, power)| *power != 0).collect();
        Laurent::of(terms.into_iter().map(|(a, b, number)| (monomial(a, b), number.into())))
    })
}

proptest! {
    /// Division undoes multiplication, and values are those of numbers.
    #[test]
    fn quotients_and_values(a in some(), b in some(), x in 1i64..9, y in 1i64..9) {
        let product = a.times(&b);
        if !b.is_zero() {
            prop_assert_eq!(product.divided_by(&b), Some(a.clone()));
        }
        let at = |of: &Laurent| of.value(&|letter| Rational::from(if letter == 0 { x } else { y }));
        prop_assert_eq!(at(&product), at(&a) * at(&b));
        prop_assert_eq!(at(&a.minus(&b)), at(&a) - at(&b));
    }
}

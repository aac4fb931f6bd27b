//! Tests of `src/symbolic/collected.rs`.

use super::*;
use proptest::prelude::*;

fn value(of: &Collected, at: &dyn Fn(Letter) -> Rational) -> Rational {
    of.factors.iter().fold(of.number.clone(), |product, (base, power)| {
        let own = match base {
            Base::Letter(letter) => at(*letter),
            Base::Sum(members) => members.iter().fold(Rational::ZERO, |sum, one| sum + value(one, at)),
        };
        product * own.pow(*power as isize)
    })
}

proptest! {
    /// However it is written, it is the same number.
    #[test]
    fn what_is_collected_has_the_same_value(
        a in prop::collection::vec((prop::collection::vec(-2i32..3, 5), -3i64..4), 1..5),
        b in prop::collection::vec((prop::collection::vec(0i32..3, 5), -3i64..4), 1..4),
    ) {
        let mut letters = Letters::default();
        let symbols = [
            Symbol::Value("i".into()), Symbol::Value("J".into()), Symbol::Of("C", "joint".into()), Symbol::Speed(0),
            Symbol::Value("d".into()),
        ];
        for symbol in symbols {
            letters.letter(symbol);
        }
        let sum = |terms: Vec<(Vec<i32>, i64)>| Laurent::of(terms.into_iter().map(|(powers, number)| {
            let monomial = (0..).zip(powers).filter(|one| one.1 != 0).collect();
            (monomial, Rational::from(number))
        }));
        let product = sum(a).times(&sum(b));
        let text = collected(&product, &letters, &|name| name == "i");
        for k in 1i64..4 {
            let at = |letter: Letter| Rational::from_parts((7 * i64::from(letter) + 5 * k).into(), 11u8.into());
            // A sum below the line does not come from products of sums.
            prop_assert_eq!(value(&text, &at), product.value(&at));
        }
    }
}

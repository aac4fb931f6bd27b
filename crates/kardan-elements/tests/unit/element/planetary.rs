//! Tests of `src/element/planetary.rs`.

use super::*;
use kardan_schema::schema::Resolved;

/// Willis: (w_s - w_c)/(w_r - w_c) = -z_r/z_s, for all speeds of ring and carrier; and the same row by its coefficients.
#[test]
fn equation_of_willis() {
    let mut values = Values::default();
    SHAFTS.iter().for_each(|key| values.insert(key, Resolved::Word((*key).into())));
    for (key, tooth_count) in TEETH.into_iter().zip([17, 61]) {
        values.insert(key, Resolved::Exact(Exact::from_integer(tooth_count)));
    }
    assert_eq!(check(&values), []);
    let named = terms("p", &values);
    let [Term::Constraint { direction, .. }] = named.as_slice() else { panic!("one constraint expected") };
    for (ring, carrier) in [(3.0, 0.0), (0.0, 2.0), (-5.0, 7.0)] {
        let sun = carrier - 61.0 / 17.0 * (ring - carrier);
        let speed =
            |shaft: &str| [("sun", sun), ("ring", ring), ("carrier", carrier)].into_iter().find(|x| x.0 == shaft);
        let sum: f64 =
            direction.entries.iter().map(|(name, x)| x.to_f64() * speed(name).map_or(f64::NAN, |x| x.1)).sum();
        assert!(sum.abs() < 1e-12, "{sum}");
    }
    let mut by_hand = Values::default();
    by_hand.insert("coefficients", Resolved::Map(direction.entries.clone()));
    let again = terms("p", &by_hand);
    assert!(check(&by_hand).is_empty());
    assert!(matches!(&again[..], [Term::Constraint { direction: same, .. }] if same == direction));
}

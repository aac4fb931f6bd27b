//! Tests of `src/num/size.rs`.

use super::*;

#[test]
fn lengths_scale_exactly() {
    let values = [0.1, -0.7, 3.0, 1e-3];
    let size = length(&values);
    assert!((size - values.iter().map(|x| x * x).sum::<f64>().sqrt()).abs() <= 2.0 * f64::EPSILON * size);
    for power in [-990, -540, 540, 990] {
        let factor = powi(2.0, power);
        assert_eq!(length(&values.map(|x| x * factor)), size * factor, "{power}");
    }
}

#[test]
fn roots_are_above() {
    for (count, power) in [(2, 0), (1, 0), (7, -2400), (5, 3000)] {
        let x = Rational::from(count) * power_of_two(power) / Rational::from(3);
        let root = root_above(&x);
        let square = &root * &root;
        assert!(square >= x && square <= &x * (Rational::ONE + power_of_two(-48)), "{x}");
    }
    let tiny = power_of_two(-1200);
    assert_eq!((above(&tiny), below(&tiny)), (f64::from_bits(1), 0.0));
    assert_eq!((above(&-tiny.clone()), below(&-tiny)), (-0.0, -f64::from_bits(1)));
    let huge = power_of_two(1100);
    assert_eq!((above(&huge), below(&huge)), (f64::INFINITY, f64::MAX));
}

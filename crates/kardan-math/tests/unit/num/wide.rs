//! Tests of `src/num/wide.rs`.

use kardan_rt::functions::powi;

use super::*;

#[test]
fn sizes_do_not_overflow() {
    let huge = Size::new(1.5, 100_000);
    assert_eq!(huge.times(huge), Size::new(1.125, 200_001));
    assert_eq!(huge.over(huge), Size::ONE);
    assert_eq!(Size::ONE.plus(Size::ONE).less(Size::ONE), Size::ONE);
    assert!(Size::ZERO < Size::ONE && Size::ONE < huge && huge < Size::LARGEST && huge.to_f64().is_none());
    assert_eq!(Size::ONE.plus(Size::ZERO), Size::ONE);
    assert_eq!(Wide::ONE.plus(Wide::ZERO), Wide::ONE);
    let j = Wide::new(0.0, 1.0, 0);
    assert_eq!(j.times(j), Wide::new(-1.0, 0.0, 0));
    assert_eq!(Wide::ONE.over(j), Wide::new(0.0, -1.0, 0));
}

#[test]
fn points_are_exact_until_they_are_cut() {
    let (third, one) = (Point::from_wide(Wide::new(1.0 / 3.0, -3.0, 0)), Point::real(IBig::ONE, 0));
    let large = Point { x: IBig::ZERO, y: IBig::ONE, exponent: 200 };
    assert_eq!(third.plus(&large).minus(&large).wide(), Wide::new(1.0 / 3.0, -3.0, 0));
    assert_eq!(third.times(&one).minus(&third).bits(), 0);
    assert_eq!(third.sum(&large, 64), large);
    assert_eq!(large.times(&large).wide(), Wide::new(-1.0, 0.0, 400));
}

#[test]
fn doubles_at_the_ends_of_their_range() {
    let x = IBig::from((1i64 << 53) - 1);
    assert_eq!(nearest(&x, -53), 1.0 - f64::EPSILON / 2.0);
    assert_eq!(nearest(&x, 971), f64::MAX);
    assert_eq!(nearest(&x, 5000), f64::MAX);
    assert_eq!(nearest(&-x.clone(), -5000), -f64::from_bits(1));
    assert_eq!(nearest(&x, -53 - 1060), (1.0 - f64::EPSILON / 2.0) * powi(2.0, -1060));
    assert_eq!(nearest(&IBig::ZERO, 0), 0.0);
}

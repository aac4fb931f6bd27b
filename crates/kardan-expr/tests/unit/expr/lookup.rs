//! Tests of `src/expr/lookup.rs`.

use super::*;

fn exact(list: &[f64]) -> Vec<Rational> {
    list.iter().map(|x| rational_from_f64(*x).unwrap()).collect()
}

/// A bilinear function is its own surface, also outside the grid; a cubic row passes through its points and is monotone between them.
#[test]
fn surfaces_are_those_of_their_points() {
    let (x, y) = ([-1.0, 0.5, 2.0], [0.0, 0.25, 1.0, 3.0]);
    let f = |x: f64, y: f64| 1.0 + 2.0 * x - 3.0 * y + 0.5 * x * y;
    let values: Vec<f64> = y.iter().flat_map(|y| x.map(|x| f(x, *y))).collect();
    let none = [Dimension::NONE; 2];
    let grid = || [exact(&x), exact(&y)];
    let straight =
        Lookup::surface(none, Dimension::NONE, grid(), &exact(&values), false, Extrapolation::Straight).unwrap();
    for (x, y) in [(-3.0, 5.0), (0.0, 0.5), (1.7, 2.9), (4.0, -1.0)] {
        assert!((straight.value(&[x, y]) - f(x, y)).abs() < 1e-13, "{x} {y}");
    }
    let values = [0.0, 1.0, 1.5, 0.0, -1.0, -4.0, 3.0, 3.0, 4.0, 1.0, 0.0, 9.0];
    let cubic = Lookup::surface(none, Dimension::NONE, grid(), &exact(&values), true, Extrapolation::Level).unwrap();
    for (k, value) in values.iter().enumerate() {
        assert!((cubic.value(&[x[k % 3], y[k / 3]]) - value).abs() < 1e-15, "{k}");
    }
    let row: Vec<f64> = (0..=60).map(|k| cubic.value(&[-1.5 + f64::from(k) / 15.0, 0.25])).collect();
    assert!(row.windows(2).all(|pair| pair[1] <= pair[0] + 1e-15), "{row:?}");
    assert_eq!(cubic.value(&[7.0, 9.0]), 9.0);
    assert!(Lookup::surface(none, Dimension::NONE, grid(), &exact(&values[1..]), true, Extrapolation::Level).is_none());
    let falling = [(Rational::ONE, Rational::ZERO), (Rational::ONE, Rational::ONE)];
    assert!(Lookup::curve(Dimension::NONE, Dimension::NONE, &falling, false, Extrapolation::Level).is_none());
}

//! Tests of `src/num/bracket.rs`.

use kardan_rt::functions::{cbrt, sin};

use super::*;

/// Where the ends are as small as numbers get, and the tolerance vanishes.
#[test]
fn ends_may_be_as_small_as_numbers_are() {
    for least in [f64::MIN_POSITIVE, 5e-324, 1e-310] {
        let f = |x: f64| x - 0.7 * least;
        let [low, high] = bracket([(0.0, f(0.0)), (least, f(least))], f64::EPSILON * least, f);
        assert!(f(low) < 0.0 && f(high) >= 0.0 && 0.5 * (low + high) <= high, "{least:e}: {low:e} {high:e}");
    }
}

/// Steps, steep and flat functions, either way round: the sign changes between the two places, at the cost of halving at most.
#[test]
fn signs_change_between_the_places() {
    type Named = (&'static str, fn(f64) -> f64);
    let functions: [Named; 6] = [
        ("step", |x| if x < 0.7311 { -1.0 } else { 1.0 }),
        ("infinite beyond", |x| if x < 0.7311 { x - 0.7311 } else { f64::INFINITY }),
        ("flat", |x| powi(x - 0.3, 9)),
        ("steep", |x| cbrt(x - 0.9)),
        ("bent", |x| if x < 0.5 { x - 0.5 } else { 1e6 * (x - 0.5) }),
        ("wave", |x| sin(40.0 * x) + 8.0 * (x - 0.4)),
    ];
    for (name, f) in functions {
        for mirrored in [false, true] {
            let f = |x: f64| if mirrored { f(1.0 - x) } else { f(x) };
            let ends = [0.0, 1.0].map(|x| (x, f(x)));
            let ends = if mirrored { [ends[1], ends[0]] } else { ends };
            let mut count = 0;
            let [low, high] = bracket(ends, 1e-13, |x| {
                count += 1;
                f(x)
            });
            assert!(f(low) < 0.0 && f(high) >= 0.0 && (high - low).abs() <= 1e-13, "{name}: {low} {high}");
            assert!(count <= 46, "{name}: {count}");
        }
    }
}

//! Elementary functions against digits that whole numbers give.

mod digits;

use digits::Digits;
use kardan_rt::functions as f;

/// Random numbers with a given begin.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// From −1 to 1.
    fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// All magnitudes within powers of two alike.
    fn magnitude(&mut self, least: f64, most: f64) -> f64 {
        let size = (least + (most - least) * 0.5 * (self.uniform() + 1.0)).exp2();
        if self.bits() & 1 == 0 { size } else { -size }
    }
}

const SAMPLES: usize = 2000;

/// The largest error of a function, in units in the last place, and where.
fn largest(arguments: impl IntoIterator<Item = f64>, found: fn(f64) -> f64, expected: fn(f64) -> Digits) -> (f64, f64) {
    let errors = arguments.into_iter().map(|x| (expected(x).error_of(found(x)), x));
    errors.fold((0.0, 0.0), |most, own| if own.0 > most.0 { own } else { most })
}

fn is_small(name: &str, most: (f64, f64), bound: f64) {
    println!("{name}: {:.3} units in the last place at {:e}", most.0, most.1);
    assert!(most.0 <= bound, "{name}: {} units in the last place at {:e}", most.0, most.1);
}

/// Angles of all sizes, near multiples of π/2, and those that come closest to one (Muller, Handbook of Floating-Point Arithmetic).
fn angles() -> Vec<f64> {
    let mut random = Random(17);
    let mut all = vec![f64::MIN_POSITIVE, 5e-324, f64::MAX, 6_381_956_970_095_103.0 * 797_f64.exp2(), 1e22];
    all.extend([3.0, 355.0, 5_419_351.0 / 1_725_033.0, 45.55, 411_557_987.0, 16_367_173.0 * 72_f64.exp2()]);
    all.extend([1_646_999.9, 1_647_000.1, 6433.5, std::f64::consts::FRAC_PI_4, std::f64::consts::FRAC_PI_4.next_up()]);
    for _ in 0..SAMPLES {
        all.extend([random.uniform(), 1000.0 * random.uniform(), 2e6 * random.uniform()]);
        let multiple = (1e6 * random.uniform()).round() * std::f64::consts::FRAC_PI_2;
        all.extend([multiple, multiple * (1.0 + f64::EPSILON), random.magnitude(-60.0, 3.0)]);
    }
    for _ in 0..SAMPLES / 10 {
        all.extend([random.magnitude(-1070.0, 0.0), random.magnitude(20.0, 1023.0)]);
    }
    all
}

#[test]
fn sines_and_cosines() {
    is_small("sin", largest(angles(), f::sin, |x| digits::sin_cos(x)[0].clone()), 0.85);
    is_small("cos", largest(angles(), f::cos, |x| digits::sin_cos(x)[1].clone()), 0.85);
}

#[test]
fn tangents() {
    is_small("tan", largest(angles(), f::tan, digits::tan), 0.6);
}

#[test]
fn exponentials() {
    let mut random = Random(23);
    let mut all = vec![709.782_712_893_383_9, -708.4, -745.1, -740.3, 1e-300, 5e-324, 7.538_247_879_418_26e-10];
    for _ in 0..2 * SAMPLES {
        all.extend([random.uniform(), 30.0 * random.uniform(), random.magnitude(-60.0, 3.0)]);
        all.push(-708.0 * random.uniform().abs());
        all.push(709.0 * random.uniform());
    }
    is_small("exp", largest(all, f::exp, digits::exp), 0.7);
    // Two roundings where digits are few.
    let large_negative = (0..SAMPLES).map(|_| -708.4 - 36.7 * random.uniform().abs());
    is_small("exp below 1e-308", largest(large_negative, f::exp, digits::exp), 1.0);
}

#[test]
fn logarithms() {
    let mut random = Random(29);
    let mut all = vec![5e-324, 1e-310, f64::MIN_POSITIVE, f64::MAX, 2.0, 0.5, 1.0 + f64::EPSILON, 1.0 - f64::EPSILON];
    for _ in 0..2 * SAMPLES {
        all.extend([
            1.0 + 0.5 * random.uniform(),
            2.0 + 2.0 * random.uniform(),
            random.magnitude(-1074.0, 1023.9).abs(),
        ]);
        all.extend([1.0 + random.magnitude(-50.0, -2.0), random.magnitude(-3.0, 3.0).abs()]);
    }
    all.retain(|x| *x > 0.0 && *x != 1.0);
    is_small("ln", largest(all, f::ln, digits::ln), 0.85);
}

#[test]
fn arcs() {
    let mut random = Random(31);
    let mut sides = vec![1.0, -1.0, 0.5, 0.500_000_000_000_000_1, 5e-324, 1e-300, 0.999_999_999_999_999_9];
    let mut ratios = vec![1.0, f64::MAX, 5e-324, 0.414_213_562_373_095_03, 2.414_213_562_373_095];
    for _ in 0..SAMPLES / 4 {
        sides.extend([random.uniform(), 1.0 - random.magnitude(-50.0, -1.0).abs(), random.magnitude(-40.0, 0.0)]);
        ratios.extend([random.uniform(), 3.0 * random.uniform(), random.magnitude(-60.0, 60.0)]);
    }
    is_small("asin", largest(sides.clone(), f::asin, digits::asin), 0.7);
    is_small("acos", largest(sides, f::acos, digits::acos), 0.7);
    is_small("atan", largest(ratios, f::atan, |t| digits::atan2(t, 1.0)), 0.7);
}

#[test]
fn angles_of_points() {
    let mut random = Random(37);
    let tiny = 5e-324;
    let mut points =
        vec![(tiny, tiny), (tiny, 1.5), (1.5, tiny), (f64::MAX, f64::MAX), (f64::MAX, tiny), (tiny, f64::MAX)];
    for _ in 0..SAMPLES / 4 {
        points.push((random.uniform(), random.uniform()));
        points.push((random.magnitude(-1074.0, 1023.9), random.magnitude(-1074.0, 1023.9)));
        let size = random.magnitude(-1060.0, 1022.0);
        points.push((size * random.uniform(), size));
        points.push((size, size * random.uniform()));
        // Quotients of few digits, which a rest may not spoil.
        points.push((tiny * (random.bits() >> 40) as f64, 1.0 + random.uniform().abs()));
        points.push((random.magnitude(-1074.0, -900.0), random.magnitude(-120.0, 0.0).abs()));
    }
    points.retain(|(y, x)| *y != 0.0 && *x != 0.0);
    for (y, x) in points {
        let error = digits::atan2(y, x).error_of(f::atan2(y, x));
        // Where the angle is below the least normal number, a quotient is rounded to few digits.
        assert!(error <= 0.7, "atan2({y:e}, {x:e}): {error} units in the last place");
    }
}

#[test]
fn edges() {
    let (nan, inf, pi) = (f64::NAN, f64::INFINITY, std::f64::consts::PI);
    let same = |found: f64, expected: f64| {
        assert!(
            found.to_bits() == expected.to_bits() || (found.is_nan() && expected.is_nan()),
            "{found} and not {expected}"
        );
    };
    for x in [nan, inf, -inf] {
        same(f::sin(x), nan);
        same(f::cos(x), nan);
        same(f::tan(x), nan);
    }
    for zero in [0.0, -0.0] {
        for odd in [f::sin, f::tan, f::asin, f::atan] {
            same(odd(zero), zero);
        }
        same(f::atan2(zero, 1.0), zero);
        same(f::atan2(zero, 0.0), zero);
        same(f::atan2(zero, -0.0), pi.copysign(zero));
        same(f::atan2(zero, -1.0), pi.copysign(zero));
        same(f::ln(zero), -inf);
    }
    same(f::exp(0.0), 1.0);
    same(f::exp(inf), inf);
    same(f::exp(-inf), 0.0);
    same(f::exp(800.0), inf);
    same(f::exp(-800.0), 0.0);
    same(f::exp(nan), nan);
    same(f::ln(1.0), 0.0);
    same(f::ln(inf), inf);
    for x in [-1.0, -inf, nan] {
        same(f::ln(x), nan);
    }
    for x in [1.000_000_1, -2.0, inf, nan] {
        same(f::asin(x), nan);
        same(f::acos(x), nan);
    }
    same(f::acos(1.0), 0.0);
    same(f::acos(-1.0), pi);
    same(f::asin(1.0), pi / 2.0);
    same(f::atan(inf), pi / 2.0);
    same(f::atan(-inf), -pi / 2.0);
    same(f::atan2(inf, inf), pi / 4.0);
    same(f::atan2(-inf, -inf), -0.75 * pi);
    same(f::atan2(1e308, inf), 0.0);
    same(f::atan2(1e308, -inf), pi);
    same(f::atan2(inf, -1e308), pi / 2.0);
    for (y, x) in [(nan, 1.0), (1.0, nan), (nan, nan)] {
        same(f::atan2(y, x), nan);
    }
    same(f::powi(2.0, -3), 0.125);
    same(f::powi(-3.0, 3), -27.0);
    same(f::powi(7.0, 0), 1.0);
    same(f::powi(2.0, -1060), 8.095e-320);
}

/// Each number of single precision is compared by the example `all_f32`; here one in 4001.
#[test]
fn single_precision() {
    type Pair = (&'static str, fn(f32) -> f32, fn(f64) -> f64);
    let functions: [Pair; 8] = [
        ("sin", f::sin, f::sin),
        ("cos", f::cos, f::cos),
        ("tan", f::tan, f::tan),
        ("exp", f::exp, f::exp),
        ("ln", f::ln, f::ln),
        ("asin", f::asin, f::asin),
        ("acos", f::acos, f::acos),
        ("atan", f::atan, f::atan),
    ];
    for (name, single, double) in functions {
        let mut most = (0.0, 0.0);
        for bits in (0..=u32::MAX).step_by(4001) {
            let x = f32::from_bits(bits);
            let (found, expected) = (single(x), double(f64::from(x)));
            if !found.is_finite() || !expected.is_finite() || expected.abs() > f64::from(f32::MAX) {
                assert!(found.is_nan() == expected.is_nan(), "{name} of {x:e}: {found}, not {expected}");
                assert!(found.is_nan() || f64::from(found) == expected || found.is_infinite(), "{name} of {x:e}");
                continue;
            }
            let place = (f64::from(found.abs().max(f32::MIN_POSITIVE)).log2().floor() - 23.0).exp2();
            let error = (f64::from(found) - expected).abs() / place;
            if error > most.0 {
                most = (error, f64::from(x));
            }
        }
        is_small(name, most, 1.0);
    }
}

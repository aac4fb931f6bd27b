//! Roots of polynomials against an exact implementation of its own: the digits are right to the last place, the counts of
//! real roots those of Sturm's chain, and the sides of the imaginary axis those of an exact count.

use kardan::analysis::{LinearSystem, certified_structure, structure};
use kardan::num::{Polynomial, Random, Rational, Scalar, rational_from_f64};
use kardan::results::{Analysis, Design, Pole};
use kardan::study::{self, AnalyzeSettings, DesignSettings, Silent};
use proptest::prelude::*;

type P = Vec<Rational>;

fn r(x: f64) -> Rational {
    rational_from_f64(x).expect("finite")
}

fn ratio(n: i64, d: u64) -> Rational {
    Rational::from_parts(n.into(), d.into())
}

fn times(a: &P, b: &P) -> P {
    let mut out = vec![Rational::ZERO; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            out[i + j] = &out[i + j] + x * y;
        }
    }
    out
}

fn trimmed(mut p: P) -> P {
    while p.last().is_some_and(Rational::is_zero) {
        p.pop();
    }
    p
}

fn at(p: &P, x: &Rational) -> Rational {
    p.iter().rev().fold(Rational::ZERO, |sum, c| sum * x + c)
}

fn derivative(p: &P) -> P {
    p.iter().enumerate().skip(1).map(|(k, c)| c * Rational::from(k)).collect()
}

fn remainder(a: &P, b: &P) -> P {
    let mut out = a.clone();
    while out.len() >= b.len() {
        let factor = &out[out.len() - 1] / &b[b.len() - 1];
        let shift = out.len() - b.len();
        for (k, y) in b.iter().enumerate() {
            out[shift + k] = &out[shift + k] - &factor * y;
        }
        out.pop();
        out = trimmed(out);
    }
    out
}

/// Sturm's chain; its last entry is the greatest common divisor of the first two.
fn chain(p: &P, q: P) -> Vec<P> {
    let mut out = vec![p.clone(), q];
    loop {
        let next = remainder(&out[out.len() - 2], &out[out.len() - 1]);
        let Some(leading) = next.last().cloned() else { return out };
        // Positive factors change no sign.
        let scale = if leading < Rational::ZERO { leading } else { -leading };
        let next = next.iter().map(|c| c / &scale).collect();
        out.push(next);
    }
}

fn variations(signs: impl Iterator<Item = Rational>) -> i64 {
    let signs: Vec<bool> = signs.filter(|x| !x.is_zero()).map(|x| x > Rational::ZERO).collect();
    signs.windows(2).filter(|pair| pair[0] != pair[1]).count() as i64
}

/// Different real roots between a and b, a excluded, b included; neither may be a multiple root.
fn sturm(p: &P, a: &Rational, b: &Rational) -> i64 {
    let chain = chain(p, derivative(p));
    variations(chain.iter().map(|q| at(q, a))) - variations(chain.iter().map(|q| at(q, b)))
}

/// Roots right of the imaginary axis less those left of it, and those on it or opposite to each other (the degree of what
/// p(s) and p(−s) have in common): the Cauchy index of odd over even part, by a chain of its own.
fn sides(p: &P) -> (i64, usize) {
    // p(jω) = u(ω) + j v(ω)
    let sign = |k: usize| if k % 4 < 2 { Rational::ONE } else { -Rational::ONE };
    let part = |odd: usize| {
        trimmed(p.iter().enumerate().map(|(k, c)| if k % 2 == odd { c * sign(k) } else { Rational::ZERO }).collect())
    };
    let (u, v) = (part(0), part(1));
    if u.is_empty() || v.is_empty() {
        return (0, p.len() - 1);
    }
    // The argument of p(jω) turns by π (left − right) from −∞ to ∞: minus the index of v/u, with odd degree plus the turn of
    // the fraction that does not vanish at infinity.
    let (first, second, orientation) = if u.len() > v.len() { (u, v, -1) } else { (v, u, 1) };
    let chain = chain(&first, second);
    let end = |side: i64| {
        variations(chain.iter().map(|q| {
            let leading = q[q.len() - 1].clone();
            if side < 0 && q.len() % 2 == 0 { -leading } else { leading }
        }))
    };
    // The index of second/first is V(−∞) − V(∞).
    let index = end(1) - end(-1);
    (orientation * index, chain[chain.len() - 1].len() - 1)
}

/// The neighbouring double.
fn next(x: f64, up: bool) -> f64 {
    if up { x.next_up() } else { x.next_down() }
}

/// p(x + jy), exact: real and imaginary part.
fn complex_at(p: &P, x: &Rational, y: &Rational) -> [Rational; 2] {
    p.iter().rev().fold([Rational::ZERO, Rational::ZERO], |[a, b], c| [&a * x - &b * y + c, &a * y + &b * x])
}

/// Upper bound of the distance from a point to the nearest root: `n |p/p′|`, squared.
fn nearness(p: &P, x: &Rational, y: &Rational) -> Option<Rational> {
    let n = Rational::from(p.len() - 1);
    let size = |[a, b]: [Rational; 2]| &a * &a + &b * &b;
    let slope = size(complex_at(&derivative(p), x, y));
    (!slope.is_zero()).then(|| &n * &n * size(complex_at(p, x, y)) / slope)
}

/// Everything that is promised of the roots of a square-free polynomial that does not vanish at zero.
fn check(p: &P) {
    let polynomial = Polynomial::new(p.clone());
    let roots = polynomial.proven_roots().expect("isolated");
    let n = p.len() - 1;
    assert_eq!(roots.len(), n, "{polynomial}: {roots:?}");
    assert_eq!(roots, polynomial.roots());
    // Real roots: as many as Sturm counts, and between neighbouring doubles there is one for each.
    let real: Vec<f64> = roots.iter().filter(|root| root.1 == 0.0).map(|root| root.0).collect();
    let bound = p
        .iter()
        .map(|c| (c / &p[n]).clone())
        .fold(Rational::ONE, |sum, c| if c < Rational::ZERO { sum - c } else { sum + c });
    assert_eq!(sturm(p, &-&bound, &bound), real.len() as i64, "{polynomial}: {roots:?}");
    for x in &real {
        let same = real.iter().filter(|other| *other == x).count() as i64;
        let enclosed = sturm(p, &r(next(*x, false)), &r(next(*x, true)));
        assert!(enclosed >= same, "{polynomial}: {x} is not a root to the last place");
        assert!(*x != 0.0);
    }
    // The others: in conjugate pairs, each nearer to an exact root than half a unit in the last place of either part.
    for &(re, im) in roots.iter().filter(|root| root.1 != 0.0) {
        assert!(roots.contains(&(re, -im)));
        let better = refined(p, re, im);
        for (printed, exact) in [(re, &better.0), (im, &better.1)] {
            let unit = r(next(printed.abs(), true)) - r(printed.abs());
            let off = r(printed) - exact;
            assert!(&off * &off <= ratio(26, 100) * &unit * &unit, "{polynomial}: {re} {im}");
        }
        let error_bound = nearness(p, &better.0, &better.1).expect("a simple root");
        let size = [re, im].map(f64::abs).into_iter().filter(|x| *x > 0.0).fold(f64::MAX, f64::min);
        assert!(error_bound <= r(size) * r(size) * Rational::from(2).pow(-120), "{polynomial}: {re} {im} not refined");
    }
    // Sides of the imaginary axis.
    let count = |side: fn(f64) -> bool| roots.iter().filter(|root| side(root.0)).count() as i64;
    let (difference, symmetric) = sides(p);
    assert_eq!(count(|x| x > 0.0) - count(|x| x < 0.0), difference, "{polynomial}: {roots:?}");
    if symmetric == 0 {
        assert_eq!(count(|x| x == 0.0), 0);
    }
}

/// Newton steps over the rationals, cut to 200 bits beyond the smaller part; a part that is printed as zero stays zero.
fn refined(p: &P, re: f64, im: f64) -> (Rational, Rational) {
    let (mut x, mut y) = (r(re), r(im));
    let slope = derivative(p);
    let smallest = [re, im].map(f64::abs).into_iter().filter(|x| *x > 0.0).fold(f64::MAX, f64::min);
    let grid = Rational::from(2).pow((160.0 - smallest.log2()) as isize);
    for _ in 0..9 {
        let ([a, b], [c, d]) = (complex_at(p, &x, &y), complex_at(&slope, &x, &y));
        let size = &c * &c + &d * &d;
        x = ((x - (&a * &c + &b * &d) / &size) * &grid).round() / &grid;
        y = ((y - (&b * &c - &a * &d) / &size) * &grid).round() / &grid;
        if re == 0.0 {
            x = Rational::ZERO;
        }
    }
    (x, y)
}

fn quadratic(re: &Rational, im: &Rational) -> P {
    vec![re * re + im * im, Rational::from(-2) * re, Rational::ONE]
}

fn linear(root: &Rational) -> P {
    vec![-root, Rational::ONE]
}

#[test]
fn an_imaginary_part_of_1e_8_is_retained() {
    let p: P = vec![Rational::ONE + ratio(1, 10_000_000_000_000_000), Rational::from(2), Rational::ONE];
    check(&p);
    assert_eq!(Polynomial::new(p).roots(), [(-1.0, -1e-8), (-1.0, 1e-8)]);
}

/// J s² + d s + k with d next to 2 √(J k): as doubles, and as decimals of 15 digits.
#[test]
fn critically_damped() {
    for k in 1..=174u32 {
        for (inertia, spring) in [(1.0, f64::from(k)), (1e-3 * f64::from(k), 57.0)] {
            let exact = 2.0 * (inertia * spring).sqrt();
            let decimal = |x: f64, digits: i32| {
                let places = digits - 1 - x.log10().floor() as i32;
                ratio((x * 10f64.powi(places)).round() as i64, 10u64.pow(places as u32))
            };
            for damper in [r(exact), decimal(exact, 15), decimal(exact, 6)] {
                let p: P = vec![r(spring), damper.clone(), r(inertia)];
                let roots = Polynomial::new(p.clone()).proven_roots().expect("isolated");
                let discriminant = &damper * &damper - Rational::from(4) * r(inertia) * r(spring);
                if discriminant.is_zero() {
                    let double = Scalar::to_f64(&(-damper / (Rational::from(2) * r(inertia))));
                    assert_eq!(roots, [(double, 0.0); 2]);
                } else {
                    check(&p);
                    assert_eq!(roots[0].1 == 0.0, discriminant > Rational::ZERO);
                }
            }
        }
    }
}

/// Two bodies on springs to the ground and between them, everything nearly critically damped: the roots come in clusters.
#[test]
fn clusters_of_critically_damped_pairs() {
    for k in [57.0f64, 3.0, 1000.0, 0.02] {
        let damper = 2.0 * k.sqrt();
        let one: P = vec![r(k), r(damper), Rational::ONE];
        let other: P = vec![r(k), ratio((damper * 1e9).round() as i64, 1_000_000_000), Rational::ONE];
        let third: P = vec![r(k.next_up()), r(damper), Rational::ONE];
        check(&times(&times(&one, &other), &third));
    }
}

#[test]
fn wilkinson_and_its_kin() {
    let up_to = |n: i64, scale: &Rational| {
        (1..=n).fold(vec![Rational::ONE], |p, k| times(&p, &linear(&(Rational::from(k) * scale))))
    };
    for scale in [Rational::ONE, ratio(1, 1_000_000_000_000), Rational::from(1_000_000_000_000i64), ratio(-1, 3)] {
        let p = up_to(20, &scale);
        check(&p);
        let expected: Vec<f64> = (1..=20).map(|k| Scalar::to_f64(&(Rational::from(k) * &scale))).collect();
        let mut found: Vec<f64> = Polynomial::new(p).roots().iter().map(|root| root.0).collect();
        found.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        assert_eq!(found, expected);
    }
    // His perturbation: −2⁻²³ at s¹⁹ makes ten of them complex.
    let mut p = up_to(20, &Rational::ONE);
    p[19] = &p[19] - ratio(1, 1 << 23);
    check(&p);
    let roots = Polynomial::new(p).roots();
    assert_eq!(roots.iter().filter(|root| root.1 != 0.0).count(), 10);
    assert!(roots.iter().any(|root| (root.0 - 16.730_737_466).abs() < 1e-9 && (root.1 - 2.812_624_897).abs() < 3e-9));
}

/// sⁿ − 2 (a s − 1)²: two real roots at a distance of about a^(−n/2 − 1).
#[test]
fn mignotte() {
    for (n, a) in [(5, 10i64), (9, 100), (17, 1000), (30, 30)] {
        let mut p = vec![Rational::ZERO; n + 1];
        p[n] = Rational::ONE;
        for (k, c) in [-2, 4 * a, -2 * a * a].into_iter().enumerate() {
            p[k] = &p[k] + Rational::from(c);
        }
        check(&p);
    }
}

/// Roots at 10⁻¹² and 10¹² in one polynomial, of degree 64 too; pairs with hardly any damping.
#[test]
fn wide_scales() {
    let mut p: P = vec![Rational::ONE];
    for k in 0..4isize {
        let size = Rational::from(10).pow(8 * k) / Rational::from(10).pow(12);
        p = times(&p, &linear(&-&size));
        p = times(&p, &quadratic(&(-&size * ratio(1, 1_000_000_000)), &(&size * ratio(3, 2))));
        p = times(&p, &quadratic(&Rational::ZERO, &(&size * ratio(7, 3))));
    }
    check(&p);
    let roots = Polynomial::new(p).roots();
    assert_eq!(roots.iter().filter(|root| root.0 == 0.0).count(), 8);
    let unity: P = (0..=64).map(|k| Rational::from(i32::from(k % 64 == 0))).collect();
    let roots = Polynomial::new(unity).proven_roots().unwrap();
    assert_eq!(roots.len(), 64);
    assert!(roots.iter().all(|root| (root.0.hypot(root.1) - 1.0).abs() < 1e-15 && root.0 * root.1 != 0.0));
}

/// Beyond the range of doubles nothing becomes zero or infinite.
#[test]
fn roots_out_of_the_range_of_doubles() {
    let huge = Rational::from(10).pow(400);
    let small = Rational::ONE / &huge;
    let p = times(&linear(&-&small), &quadratic(&-&small, &huge));
    let roots = Polynomial::new(p).proven_roots().unwrap();
    let smallest = f64::from_bits(1);
    assert_eq!(roots, [(-smallest, 0.0), (-smallest, -f64::MAX), (-smallest, f64::MAX)]);
}

#[test]
fn multiple_roots_and_zeros_are_counted() {
    let p = times(&times(&quadratic(&ratio(-1, 3), &Rational::ONE), &linear(&ratio(1, 7))), &linear(&Rational::ZERO));
    let cube = Polynomial::new(times(&p, &times(&p, &p)));
    let roots = cube.roots();
    assert_eq!(roots.len(), 12);
    assert_eq!(roots[..6], [[(0.0, 0.0); 3], [(1.0 / 7.0, 0.0); 3]].concat());
    for pair in [(-1.0 / 3.0, 1.0), (-1.0 / 3.0, -1.0)] {
        assert_eq!(roots.iter().filter(|root| **root == pair).count(), 3);
    }
    assert_eq!(Polynomial::new(vec![Rational::from(3)]).roots(), []);
    assert_eq!(Polynomial::new(linear(&Rational::ZERO)).roots(), [(0.0, 0.0)]);
    assert_eq!(Polynomial::new(linear(&ratio(1, 3))).roots(), [(1.0 / 3.0, 0.0)]);
}

/// Characteristic polynomials of matrices with planted eigenvalues, hidden by a similarity.
#[test]
fn similarity_transforms() {
    let mut random = Random::new(57);
    let mut draw = |n: u64| (random.next_u64() % n) as i64;
    for _ in 0..170 {
        // Factors that nearly coincide: real pairs, complex pairs, and both with a distance of 10⁻⁸ to 10⁻¹⁵.
        let near = ratio(1, 10u64.pow(8 + draw(8) as u32));
        let (a, b) = (ratio(draw(40) - 20, 1 + draw(9) as u64), ratio(1 + draw(20), 1 + draw(9) as u64));
        let mut parts: Vec<P> = match draw(4) {
            0 => vec![linear(&a), linear(&(&a + &near))],
            1 => vec![quadratic(&a, &b), quadratic(&(&a + &near), &b)],
            2 => vec![quadratic(&a, &near), linear(&a)],
            _ => vec![quadratic(&near, &b), quadratic(&-&near, &(&b + &near))],
        };
        parts.push(linear(&ratio(draw(30) - 15, 7)));
        // Block diagonal companions, then rows and columns added to others.
        let n: usize = parts.iter().map(|p| p.len() - 1).sum();
        let mut m = vec![vec![Rational::ZERO; n]; n];
        let mut first = 0;
        for p in &parts {
            let size = p.len() - 1;
            for k in 0..size {
                m[first + size - 1][first + k] = -&p[k];
                if k + 1 < size {
                    m[first + k][first + k + 1] = Rational::ONE;
                }
            }
            first += size;
        }
        for _ in 0..2 * n {
            let (i, j, f) = (draw(n as u64) as usize, draw(n as u64) as usize, Rational::from(draw(7) - 3));
            if i != j {
                for k in 0..n {
                    m[i][k] = &m[i][k] + &f * &m[j][k];
                }
                for row in &mut m {
                    row[j] = &row[j] - &f * &row[i];
                }
            }
        }
        let p = parts.iter().fold(vec![Rational::ONE], times_into);
        let matrix = kardan::num::Matrix::from_fn(n, n, |i, j| m[i][j].clone());
        let found = kardan::num::characteristic_polynomial(&matrix);
        assert_eq!(found, Polynomial::new(p.clone()));
        let zeros = p.iter().take_while(|c| c.is_zero()).count();
        assert_eq!(found.roots().len(), n);
        for (part, _) in Polynomial::new(p[zeros..].to_vec()).square_free() {
            check(&part.coefficients().to_vec());
        }
    }
}

fn times_into(a: P, b: &P) -> P {
    times(&a, b)
}

/// Two bodies of 1 kg m² with a spring and a damper between; a motor on the first.
fn two_bodies(spring: &str, damper: &str) -> String {
    format!(
        "[model]\nname = \"two\"\n[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n\
         [spring_damper.bar]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"{spring} N m/rad\"\n\
         damping = \"{damper} N m s/rad\"\n[motor.m]\nshaft = \"a\"\n[scenario]\nduration = \"1 s\"\n"
    )
}

fn analysed(source: &str, certify: bool) -> Analysis {
    let settings = AnalyzeSettings {
        certify,
        inputs: vec!["m".into()],
        outputs: vec!["a.phi".into()],
        ..AnalyzeSettings::default()
    };
    study::analyze(source, &settings, &Silent).unwrap_or_else(|reported| panic!("{reported:?}"))
}

fn decoupled(source: &str) -> Design {
    let settings = DesignSettings {
        law: Some("decoupling".into()),
        inputs: vec!["m".into()],
        outputs: vec!["a.phi".into()],
        ..DesignSettings::default()
    };
    study::design(source, &settings, &Silent).unwrap_or_else(|reported| panic!("{reported:?}"))
}

/// Two bodies with a damper next to the critical one: with the motor and the sensor on one of them, the other swings in the
/// spring, J s² + d s + k. The zeros are what the exact roots of that say, in every command, and never on the right.
#[test]
fn nearly_critical_damping_is_minimum_phase_everywhere() {
    for (spring, damper) in
        [("57", "15.0996688705415"), ("57", "15.0996688705414"), ("57", "15.09966887054"), ("4", "4")]
    {
        let source = two_bodies(spring, damper);
        let number = |text: &str| {
            let (whole, part) = text.split_once('.').unwrap_or((text, ""));
            ratio(format!("{whole}{part}").parse().unwrap(), 10u64.pow(part.len() as u32))
        };
        let p: P = vec![number(spring), number(damper), Rational::ONE];
        let expected = Polynomial::new(p.clone()).proven_roots().expect("isolated");
        let mut sorted = expected.clone();
        sorted.sort_by(|a, b| a.partial_cmp(b).unwrap());
        for certify in [false, true] {
            let zeros = analysed(&source, certify).structure.zeros;
            assert_eq!((zeros.values, zeros.growing), (Pole::list(expected.clone()), Some(0)), "{damper}");
        }
        let design = decoupled(&source);
        let mut modes: Vec<(f64, f64)> =
            design.zero_dynamics.modes.iter().map(|mode| (mode.pole.re, mode.pole.im)).collect();
        modes.sort_by(|a, b| a.partial_cmp(b).unwrap());
        let mut upper = sorted.clone();
        upper.retain(|root| root.1 >= 0.0);
        assert_eq!(modes, upper);
        assert!(design.zero_dynamics.is_stable() && design.exact_poles);
        assert!(design.zero_dynamics.modes.iter().all(|mode| mode.warning.is_none()), "{:?}", design.zero_dynamics);
        assert!(design.warnings.iter().all(|text| !text.contains("unstable")), "{:?}", design.warnings);
        assert!(design.closed_loop_poles.iter().all(|pole| pole.re < 0.0), "{:?}", design.closed_loop_poles);
    }
}

/// A zero at +10⁻¹³ is on the right, one at −10⁻¹³ is not, and one at zero is at zero, whether proven or not.
#[test]
fn zeros_next_to_the_axis_are_on_their_side() {
    for (at, growing) in [(1i64, 1), (0, 0), (-1, 0)] {
        let zero = ratio(at, 10_000_000_000_000);
        // (s − zero)/((s + 1)(s + 2)) in controllable form.
        let a = kardan::num::Matrix::from_fn(2, 2, |i, j| Rational::from([[0, 1], [-2, -3]][i][j]));
        let b = kardan::num::Matrix::from_fn(2, 1, |i, _| Rational::from(i as i64));
        let c = kardan::num::Matrix::from_fn(1, 2, |_, j| if j == 0 { -zero.clone() } else { Rational::ONE });
        let system = LinearSystem::state_space(a, b, c);
        let found = [structure(&system).unwrap(), certified_structure(&system, &|_| ()).unwrap()];
        for zeros in found.map(|found| found.zeros) {
            assert_eq!((zeros.values, zeros.growing), (vec![Pole::new(at as f64 * 1e-13, 0.0)], Some(growing)));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Products of known factors with scales from 10⁻¹² to 10¹², some of them on the imaginary axis, some opposite to others.
    #[test]
    fn products_of_prescribed_factors(
        factors in proptest::collection::vec((0u8..5, -50i64..50, 1i64..50, 1u64..30, -12i32..=12), 1..7),
    ) {
        let mut p: P = vec![Rational::ONE];
        for (kind, a, b, d, exponent) in factors {
            let ten = Rational::from(10).pow(exponent.unsigned_abs() as isize);
            let scale = if exponent < 0 { Rational::ONE / ten } else { ten };
            let (x, y) = (ratio(a, d) * &scale, ratio(b, d) * &scale);
            let factor = match kind {
                0 if a != 0 => linear(&x),
                1 => quadratic(&Rational::ZERO, &y),
                2 if a != 0 => times(&linear(&x), &linear(&-&x)),
                3 => times(&quadratic(&x, &y), &quadratic(&-&x, &y)),
                _ => quadratic(&x, &y),
            };
            p = times(&p, &factor);
        }
        let whole = Polynomial::new(p.clone());
        prop_assert_eq!(whole.roots().len(), p.len() - 1);
        for (part, _) in whole.square_free() {
            check(&part.coefficients().to_vec());
        }
    }

    /// Any coefficients.
    #[test]
    fn polynomials_of_any_kind(coefficients in proptest::collection::vec(-1000i64..1000, 2..14)) {
        let whole = Polynomial::new(coefficients.into_iter().map(Rational::from).collect());
        prop_assume!(!whole.is_zero());
        for (part, _) in whole.square_free() {
            let zeros = part.coefficients().iter().take_while(|c| c.is_zero()).count();
            if part.degree() > zeros {
                check(&part.coefficients()[zeros..].to_vec());
            }
        }
    }
}

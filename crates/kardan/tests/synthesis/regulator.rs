//! Pole placement, quadratic cost, Lyapunov equations, sampling: defining equations, closed forms, and every refusal.

use crate::common::built_in;
use kardan::analysis::LinearSystem;
use kardan::num::{
    Matrix, Rational, Scalar, characteristic_polynomial, discretise, eigenvalues, exponential, rational_from_f64,
};
use kardan::results::{Complex, Pole};
use kardan::synthesis::regulator::{
    LyapunovError, PlacementError, RiccatiError, SteadyStateError, Weights, lqr, lyapunov, place_poles, steady_state,
    unreached,
};
use proptest::prelude::*;

fn integers(rows: &[&[i64]]) -> Matrix<Rational> {
    Matrix::from_fn(rows.len(), rows.first().map_or(0, |row| row.len()), |i, j| Rational::from(rows[i][j]))
}

fn system(a: &[&[i64]], b: &[&[i64]]) -> LinearSystem {
    LinearSystem::state_space(integers(a), integers(b), Matrix::identity(a.len()))
}

/// A built-in model as a linear system with these inputs and angles as outputs.
/// A random system with entries of thousandths.
fn random(n: usize, m: usize, seed: u64) -> LinearSystem {
    let mut random = kardan::num::Random::new(seed);
    let mut entry = |_, _| Rational::from_parts((random.below(2001) as i64 - 1000).into(), 500u32.into());
    let a = Matrix::from_fn(n, n, &mut entry);
    LinearSystem::state_space(a, Matrix::from_fn(n, m, &mut entry), Matrix::identity(n))
}

fn norm(m: &Matrix<f64>) -> f64 {
    m.as_slice().iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn minus(a: &Matrix<f64>, b: &Matrix<f64>) -> Matrix<f64> {
    a.minus(b)
}

/// Characteristic polynomial of a float matrix, exactly.
fn polynomial(m: &Matrix<f64>) -> Vec<f64> {
    let exact = Matrix::from_fn(m.rows(), m.columns(), |i, j| rational_from_f64(m[(i, j)]).unwrap());
    characteristic_polynomial(&exact).coefficients().iter().map(Scalar::to_f64).collect()
}

/// Π (s − p), of 1, s, s², …
fn product(poles: &[Pole]) -> Vec<f64> {
    let mut all: Vec<(f64, f64)> = vec![(1.0, 0.0)];
    for Pole { re, im } in poles {
        let mut next = vec![(0.0, 0.0); all.len() + 1];
        for (k, c) in all.iter().enumerate() {
            next[k + 1] = (next[k + 1].0 + c.0, next[k + 1].1 + c.1);
            next[k] = (next[k].0 - (c.0 * re - c.1 * im), next[k].1 - (c.0 * im + c.1 * re));
        }
        all = next;
    }
    all.into_iter().map(|c| c.0).collect()
}

/// n poles in the left half plane, some of them pairs.
fn random_poles(n: usize, seed: u64) -> Vec<Pole> {
    let mut random = kardan::num::Random::new(seed);
    let mut out = Vec::new();
    while out.len() < n {
        let (re, im) = (-0.5 - 3.0 * random.unit(), 0.2 + 3.0 * random.unit());
        if out.len() + 1 < n && random.unit() < 0.5 {
            out.extend([Pole::new(re, im), Pole::new(re, -im)]);
        } else {
            out.push(Pole::new(re, 0.0));
        }
    }
    out
}

/// Eigenvalues of A − BK are the wishes, for random systems up to twelve states. With several inputs to 1e-9; a single
/// input leaves no choice, and what it costs in digits is the condition of the eigenvectors.
#[test]
fn poles_are_where_they_are_requested() {
    let mut worst = [0.0f64; 2];
    for n in 1..=12 {
        for m in 1..=n.min(4) {
            for seed in 0..6 {
                let s = random(n, m, 1000 * n as u64 + 10 * m as u64 + seed);
                let poles = random_poles(n, seed + 77 * n as u64);
                let placement = place_poles(&s, &poles).unwrap_or_else(|e| panic!("{n} {m} {seed}: {e}"));
                let gain = norm(&placement.gain);
                let limit = 1e-14 * placement.condition * (1.0 + gain) * n as f64;
                assert!(placement.residual < limit.max(1e-12), "{n} {m} {seed}: {placement:?}");
                if m > 1 {
                    assert!(placement.residual < 1e-9, "{n} {m} {seed}: {:e}", placement.residual);
                }
                let single = usize::from(m == 1);
                worst[single] = worst[single].max(placement.residual);
                // An independent look: the exact characteristic polynomial of A − BK with the floats of K.
                let closed = minus(&s.a.to_f64(), &s.b.to_f64().multiply(&placement.gain));
                let (found, expected) = (polynomial(&closed), product(&poles));
                let scale = expected.iter().fold(0.0f64, |max, x| max.max(x.abs()));
                let error = found.iter().zip(&expected).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max) / scale;
                assert!(error < 1e-13 * (1.0 + gain) * placement.condition.max(1e3), "{n} {m} {seed}: {error:e}");
            }
        }
    }
    println!("largest error: several inputs {:e}, one input {:e}", worst[0], worst[1]);
}

/// As many inputs as states: the eigenvectors can be orthogonal.
#[test]
fn free_choice_gives_orthogonal_eigenvectors() {
    let s = random(5, 5, 3);
    let placement = place_poles(
        &s,
        &[
            Complex::new(-1.0, 0.0),
            Complex::new(-2.0, 1.0),
            Complex::new(-2.0, -1.0),
            Complex::new(-3.0, 0.0),
            Complex::new(-3.0, 0.0),
        ],
    )
    .unwrap();
    assert!(placement.condition < 1.0 + 1e-6, "{}", placement.condition);
    assert!(placement.residual < 1e-13);
}

/// Poles repeated as often as there are inputs, with independent eigenvectors.
#[test]
fn repeated_poles() {
    let s = random(6, 3, 5);
    let pair = [(-2.0, 1.0), (-2.0, -1.0)].map(Pole::from);
    let placement = place_poles(&s, &[pair, pair, pair].concat()).unwrap();
    assert!(placement.residual < 1e-11, "{:e}", placement.residual);
    let placement = place_poles(
        &s,
        &[
            Complex::new(-1.0, 0.0),
            Complex::new(-1.0, 0.0),
            Complex::new(-1.0, 0.0),
            Complex::new(-4.0, 0.0),
            Complex::new(-4.0, 0.0),
            Complex::default(),
        ],
    )
    .unwrap();
    assert!(placement.residual < 1e-11, "{:e}", placement.residual);
    // Chains of 3 and 1 states: −1, −1, −2, −2 would need a Jordan block.
    let s =
        system(&[&[0, 1, 0, 0], &[0, 0, 1, 0], &[0, 0, 0, 0], &[0, 0, 0, 0]], &[&[0, 0], &[0, 0], &[1, 0], &[0, 1]]);
    let repeated = [(-1.0, 0.0), (-1.0, 0.0), (-2.0, 0.0), (-2.0, 0.0)].map(Pole::from);
    assert_eq!(place_poles(&s, &repeated), Err(PlacementError::Repeated { inputs: 1, needed: 3, actual: 2 }));
    assert!(
        place_poles(
            &s,
            &[Complex::new(-1.0, 0.0), Complex::new(-1.0, 0.0), Complex::new(-2.0, 0.0), Complex::new(-3.0, 0.0)]
        )
        .unwrap()
        .residual
            < 1e-12
    );
}

/// The harmonic drive in SI units: inertias of 1e-4 and 1e-2 kg m², poles at the millisecond.
#[test]
fn mechanical_systems_in_mixed_units() {
    let s = built_in("harmonic-drive", &["wg_motor", "cs_motor"], &["wg", "cs"]);
    let poles = [(-50.0, 0.0), (-1000.0, 0.0), (-300.0, 400.0), (-300.0, -400.0)].map(Pole::from);
    let placement = place_poles(&s, &poles).unwrap();
    assert!(placement.residual < 1e-11, "{:e}", placement.residual);
    let s = built_in("sia-steering", &["wg_motor", "rk_motor"], &["rk", "fs"]);
    let poles = [(-14.0, 14.28), (-14.0, -14.28), (-20.0, 0.0), (-25.0, 0.0), (-700.0, 700.0), (-700.0, -700.0)]
        .map(Pole::from);
    let placement = place_poles(&s, &poles).unwrap();
    assert!(placement.residual < 1e-10, "{:e}", placement.residual);
    println!("steering column: error {:e}, condition {:.1}", placement.residual, placement.condition);
}

#[test]
fn fixed_modes_must_be_requested() {
    // x₂ decays on its own with −3; the input reaches x₁ + x₃ only.
    let s = system(&[&[1, 2, 0], &[0, -3, 0], &[0, 0, -5]], &[&[1], &[0], &[0]]);
    let error =
        place_poles(&s, &[Complex::new(-1.0, 0.0), Complex::new(-2.0, 0.0), Complex::new(-3.0, 0.0)]).unwrap_err();
    let PlacementError::FixedModes { modes, polynomial, combinations } = &error else { panic!("{error}") };
    assert_eq!(
        (modes.as_slice(), polynomial.as_str()),
        (&[Pole::new(-3.0, 0.0), Pole::new(-5.0, 0.0)][..], "s^2 + 8 s + 15")
    );
    assert_eq!(combinations, &["x2", "x3"]);
    assert!(error.to_string().contains("the modes -3 and -5 stay as they are"), "{error}");
    let placement =
        place_poles(&s, &[Complex::new(-5.0, 0.0), Complex::new(-7.0, 0.0), Complex::new(-3.0, 0.0)]).unwrap();
    assert!(placement.residual < 1e-14 && (placement.gain[(0, 0)] - 8.0).abs() < 1e-13);
    // Nothing is reached at all.
    let idle = system(&[&[-2]], &[&[0]]);
    assert_eq!(place_poles(&idle, &[Complex::new(-2.0, 0.0)]).unwrap().gain[(0, 0)], 0.0);
    // The wave generator alone: the motion that its motor does not reach stays.
    let drive = built_in("harmonic-drive", &["wg_motor"], &["wg"]);
    let unreachable = unreached(&drive.explicit().unwrap()).unwrap();
    assert_eq!(unreachable.polynomial.to_string(), "s");
    println!("not reached: {:?}", unreachable.combinations);
}

#[test]
fn invalid_poles_are_refused() {
    let s = system(&[&[0, 1], &[0, 0]], &[&[0], &[1]]);
    let error = |poles: &[(f64, f64)]| place_poles(&s, &Pole::list(poles.to_vec())).unwrap_err();
    assert_eq!(error(&[(-1.0, 0.0)]), PlacementError::WrongNumber { actual: 1, states: 2 });
    assert_eq!(error(&[(-1.0, 0.0); 3]), PlacementError::WrongNumber { actual: 3, states: 2 });
    assert_eq!(error(&[(-1.0, 1.0), (-1.0, 1.0)]), PlacementError::NotSelfConjugate { pole: Complex::new(-1.0, 1.0) });
    assert_eq!(error(&[(-1.0, 0.0); 2]), PlacementError::TooOften { pole: Complex::new(-1.0, 0.0), times: 2, rank: 1 });
    assert_eq!(error(&[(f64::NAN, 0.0), (-1.0, 0.0)]), PlacementError::NotFinite);
    assert_eq!(error(&[(-1.0, f64::INFINITY), (-1.0, f64::NEG_INFINITY)]), PlacementError::NotFinite);
    let singular = LinearSystem { e: integers(&[&[1, 0], &[0, 0]]), ..s.clone() };
    assert_eq!(
        place_poles(&singular, &[Complex::new(-1.0, 0.0), Complex::new(-2.0, 0.0)]),
        Err(PlacementError::Singular)
    );
}

/// AᵀX + XA + Q − (XB + N) R⁻¹ (XB + N)ᵀ, with arithmetic of its own, over the sum of the norms.
fn care(s: &LinearSystem, w: &Weights, x: &Matrix<f64>) -> f64 {
    let (a, b) = (s.a.to_f64(), s.b.to_f64());
    let xa = x.multiply(&a);
    let mut xb = x.multiply(&b);
    if let Some(n) = &w.cross {
        xb = xb.plus(n);
    }
    let quadratic = xb.multiply(&w.input.solve(&xb.transpose()).unwrap());
    let residual = minus(&xa.plus(&xa.transpose()).plus(&w.state), &quadratic);
    norm(&residual) / (2.0 * norm(&xa) + norm(&w.state) + norm(&quadratic))
}

#[test]
fn riccati_equations_hold_and_the_loop_is_stable() {
    let mut worst = 0.0f64;
    for n in 1..=12 {
        for m in 1..=n.min(3) {
            let s = random(n, m, 31 * n as u64 + m as u64);
            let mut noise = kardan::num::Random::new(n as u64);
            let mut factor = |r: usize, c: usize| Matrix::from_fn(r, c, |_, _| noise.unit() - 0.5);
            // [Q N; Nᵀ R] = GᵀG + I on the inputs
            let g = factor(n + m, n + m);
            let whole = g.transpose().multiply(&g);
            let part = |i0: usize, j0: usize, r: usize, c: usize| Matrix::from_fn(r, c, |i, j| whole[(i0 + i, j0 + j)]);
            let weights = Weights {
                state: part(0, 0, n, n),
                input: part(n, n, m, m).plus(&Matrix::identity(m)),
                cross: (m != 2).then(|| part(0, n, n, m)),
            };
            let regulator = lqr(&s, &weights).unwrap_or_else(|e| panic!("{n} {m}: {e}"));
            let residual = care(&s, &weights, &regulator.solution);
            worst = worst.max(residual);
            assert!(residual < 1e-13 && regulator.residual < 1e-13, "{n} {m}: {residual:e} {:e}", regulator.residual);
            assert!(regulator.poles.iter().all(|p| p.re < 0.0));
            let x = &regulator.solution;
            assert!((0..n).all(|i| (0..n).all(|j| (x[(i, j)] - x[(j, i)]).abs() <= 1e-14 * norm(x))));
            assert!(eigenvalues(x).unwrap().iter().all(|p| p.0 > -1e-12 * norm(x)), "{n} {m}: X is not semidefinite");
            // Optimal: any change of the gain costs more; X of the changed loop from a Lyapunov equation is larger.
            let change = factor(m, n);
            let other = regulator.gain.plus(&change.scale(&1e-3));
            let (a, b) = (s.a.to_f64(), s.b.to_f64());
            let closed = minus(&a, &b.multiply(&other));
            let cross = weights.cross.clone().unwrap_or_else(|| Matrix::zeros(n, m)).multiply(&other);
            let cost = other.transpose().multiply(&weights.input).multiply(&other).plus(&weights.state);
            let cost = minus(&minus(&cost, &cross), &cross.transpose());
            let dearer = lyapunov(&closed.transpose(), &cost).unwrap().solution;
            let more = minus(&dearer, x);
            assert!((0..n).all(|i| more[(i, i)] > -1e-12 * norm(x)), "{n} {m}");
        }
    }
    println!("largest relative residual of a Riccati equation: {worst:e}");
}

/// Closed forms: a first-order system; a double integrator with k₁ = √(q/r), k₂ = √(2k₁ + …); an unstable one with Q = 0,
/// whose pole is mirrored; and an undamped oscillator.
#[test]
fn riccati_closed_forms() {
    for (a, b, q, r) in [(3.0f64, 2.0f64, 5.0f64, 7.0f64), (-0.5, 1e-3, 1e6, 1e-6), (1e4, 1.0, 1e-8, 1.0)] {
        let exact = |x: f64| Matrix::from_fn(1, 1, |_, _| rational_from_f64(x).unwrap());
        let s = LinearSystem::state_space(exact(a), exact(b), exact(1.0));
        let k = lqr(&s, &Weights::diagonal(&[q], &[r])).unwrap().gain[(0, 0)];
        let closed = (a + (a * a + b * b * q / r).sqrt()) / b;
        assert!((k - closed).abs() < 1e-13 * closed, "{k} {closed}");
    }
    for (q, r) in [(1.0f64, 1.0f64), (400.0, 1e-4), (1e-6, 1e6)] {
        let s = system(&[&[0, 1], &[0, 0]], &[&[0], &[1]]);
        let gain = lqr(&s, &Weights::diagonal(&[q, 0.0], &[r])).unwrap().gain;
        let k = (q / r).sqrt();
        assert!((gain[(0, 0)] - k).abs() < 1e-13 * k && (gain[(0, 1)] - (2.0 * k).sqrt()).abs() < 1e-13 * k.sqrt());
    }
    let s = system(&[&[0, 1], &[6, 1]], &[&[0], &[1]]);
    let regulator = lqr(&s, &Weights::diagonal(&[0.0, 0.0], &[2.0])).unwrap();
    assert!((regulator.poles[0].re + 2.0).abs() < 1e-13 && (regulator.poles[1].re + 3.0).abs() < 1e-13);
    // ω = 3: k₁ = √(81 + 1) − 9 …
    let s = system(&[&[0, 1], &[-9, 0]], &[&[0], &[1]]);
    let gain = lqr(&s, &Weights::diagonal(&[1.0, 0.0], &[1.0])).unwrap().gain;
    let k = 82f64.sqrt() - 9.0;
    assert!((gain[(0, 0)] - k).abs() < 1e-14 && (gain[(0, 1)] - (2.0 * k).sqrt()).abs() < 1e-14);
}

/// A fixed mode that decays is no obstacle; mixed units and very unequal weights neither.
#[test]
fn riccati_with_fixed_modes_and_mixed_units() {
    let s = system(&[&[1, 2, 0], &[0, -3, 0], &[0, 0, -5]], &[&[1], &[0], &[0]]);
    let regulator = lqr(&s, &Weights::diagonal(&[1.0, 1.0, 0.0], &[1.0])).unwrap();
    assert!(regulator.poles.iter().any(|p| (p.re + 5.0).abs() < 1e-12));
    let s = built_in("sia-steering", &["wg_motor", "rk_motor"], &["rk", "fs"]);
    let mut worst = 0.0f64;
    for input in [1e-6, 1.0, 1e6] {
        let regulator = lqr(&s, &Weights::diagonal(&[1e4, 1e4, 1.0, 1.0, 1.0, 1e-3], &[input, 3.0 * input])).unwrap();
        worst = worst.max(regulator.residual);
    }
    assert!(worst < 1e-12, "{worst:e}");
    println!("steering column: largest residual {worst:e}");
}

#[test]
fn riccati_refusals() {
    let s = system(&[&[0, 1], &[0, 0]], &[&[0], &[1]]);
    let with = |state: &[&[f64]], input: f64| Weights {
        state: Matrix::from_fn(2, 2, |i, j| state[i][j]),
        input: Matrix::from_fn(1, 1, |_, _| input),
        cross: None,
    };
    let one: &[&[f64]] = &[&[1.0, 0.0], &[0.0, 1.0]];
    let error = |w: &Weights| lqr(&s, w).unwrap_err();
    assert_eq!(error(&with(one, 0.0)), RiccatiError::InputWeight { direction: "u1".into() });
    assert_eq!(error(&with(one, -1.0)), RiccatiError::InputWeight { direction: "u1".into() });
    assert_eq!(error(&with(one, f64::NAN)), RiccatiError::NotFinite("inputs"));
    assert_eq!(error(&with(&[&[1.0, 0.0], &[f64::INFINITY, 1.0]], 1.0)), RiccatiError::NotFinite("states"));
    assert_eq!(error(&with(&[&[1.0, 0.0], &[0.5, 1.0]], 1.0)), RiccatiError::NotSymmetric("states"));
    assert!(
        matches!(error(&with(&[&[1.0, 2.0], &[2.0, 1.0]], 1.0)), RiccatiError::StateWeight { value, .. } if value < -0.9)
    );
    assert!(matches!(
        error(&Weights::diagonal(&[1.0], &[1.0])),
        RiccatiError::Shape { what: "states", actual: (1, 1), expected: (2, 2) }
    ));
    assert!(matches!(
        error(&Weights { cross: Some(Matrix::zeros(1, 1)), ..with(one, 1.0) }),
        RiccatiError::Shape { .. }
    ));
    // Too much of the product: Q − N R⁻¹ Nᵀ < 0.
    let cross = Weights { cross: Some(Matrix::from_fn(2, 1, |i, _| 2.0 * i as f64)), ..with(one, 1.0) };
    assert!(matches!(error(&cross), RiccatiError::StateWeight { .. }));
    // The angle costs nothing and drifts.
    let blind = error(&with(&[&[0.0, 0.0], &[0.0, 1.0]], 1.0));
    assert_eq!(blind, RiccatiError::NotDetectable { modes: vec![Complex::default()], motions: vec!["x1".into()] });
    // x₂ grows and nothing reaches it.
    let wild = system(&[&[1, 0], &[0, 2]], &[&[1], &[0]]);
    let error = lqr(&wild, &with(one, 1.0)).unwrap_err();
    assert_eq!(
        error,
        RiccatiError::NotStabilisable { modes: vec![Complex::new(2.0, 0.0)], combinations: vec!["x2".into()] }
    );
    assert!(error.to_string().contains("no input reaches the modes 2 of x2"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    /// A X + X Aᵀ + Q = 0 for any A without eigenvalues that add up to zero.
    #[test]
    fn lyapunov_equations_hold(values in prop::collection::vec(-1.0f64..1.0, 98), n in 1usize..8, shift in -2.0f64..2.0) {
        let a = Matrix::from_fn(n, n, |i, j| values[7 * i + j] + if i == j { shift } else { 0.0 });
        let q = Matrix::from_fn(n, n, |i, j| values[49 + 7 * i + j]);
        if let Ok(found) = lyapunov(&a, &q) {
            let x = &found.solution;
            let remainder = a.multiply(x).plus(&x.multiply(&a.transpose())).plus(&q);
            prop_assert!(norm(&remainder) < 1e-13 * (2.0 * norm(&a) * norm(x) + norm(&q)), "{:e}", norm(&remainder));
            prop_assert!(found.residual < 1e-12);
        }
    }

    /// e^A e^−A = I, e^{A(s+t)} = e^{As} e^{At}, det e^A = e^{tr A}.
    #[test]
    fn exponential_identities(values in prop::collection::vec(-3.0f64..3.0, 36), n in 1usize..7, s in 0.0f64..1.0) {
        let a = Matrix::from_fn(n, n, |i, j| values[6 * i + j]);
        let e = exponential(&a).unwrap();
        let back = exponential(&a.scale(&-1.0)).unwrap();
        let unit = minus(&e.multiply(&back), &Matrix::identity(n));
        prop_assert!(norm(&unit) < 1e-13 * norm(&e) * norm(&back));
        let (first, second) = (exponential(&a.scale(&s)).unwrap(), exponential(&a.scale(&(1.0 - s))).unwrap());
        prop_assert!(norm(&minus(&first.multiply(&second), &e)) < 1e-13 * norm(&first) * norm(&second));
        // Σ Aᵏ/k!, in a second way
        let mut sum = Matrix::<f64>::identity(n);
        let mut term = Matrix::<f64>::identity(n);
        for k in 1..120 {
            term = term.multiply(&a).scale(&(1.0 / f64::from(k)));
            sum = sum.plus(&term);
        }
        let cancellation = exponential(&Matrix::from_fn(n, n, |i, j| a[(i, j)].abs())).unwrap();
        prop_assert!(norm(&minus(&sum, &e)) < 1e-13 * norm(&cancellation));
    }

    /// Sampling twice with T/2 is sampling with T; for a regular A, B_d = A⁻¹(A_d − I)B; one step of a fine Runge-Kutta.
    #[test]
    fn sampling_agrees_with_other_ways(values in prop::collection::vec(-2.0f64..2.0, 48), n in 1usize..7, t in 0.01f64..2.0) {
        let a = Matrix::from_fn(n, n, |i, j| values[6 * i + j]);
        let b = Matrix::from_fn(n, 2, |i, j| 1e4 * values[36 + 2 * i + j]);
        let whole = discretise(&a, &b, t).unwrap();
        let half = discretise(&a, &b, t / 2.0).unwrap();
        let two_halves = half.a.multiply(&half.b).plus(&half.b);
        // The two halves may cancel: an oscillation sampled once a turn has B_d = 0.
        let difference = norm(&minus(&two_halves, &whole.b));
        prop_assert!(difference <= 1e-12 * (norm(&half.a) + 1.0) * norm(&half.b), "{difference:e}");
        prop_assert!(norm(&minus(&half.a.multiply(&half.a), &whole.a)) < 1e-13 * norm(&half.a) * norm(&half.a));
        // A B_d = (A_d − I) B
        let left = a.multiply(&whole.b);
        let right = minus(&whole.a, &Matrix::identity(n)).multiply(&b);
        prop_assert!(norm(&minus(&left, &right)) <= 1e-12 * norm(&a) * (norm(&half.a) + 1.0) * norm(&half.b));
    }
}

#[test]
fn exponential_closed_forms() {
    // A nilpotent matrix is a polynomial; large entries of one sign of the diagonal lose nothing.
    let nilpotent = Matrix::from_fn(3, 3, |i, j| if j == i + 1 { 1e3 } else { 0.0 });
    let e = exponential(&nilpotent).unwrap();
    assert!((e[(0, 2)] - 5e5).abs() < 1e-9 && e[(0, 1)] == 1e3 && e[(2, 0)] == 0.0);
    // Rotation by 100 rad/s over 1 s with damping 1: e^{-1}(cos 100, sin 100).
    let a = Matrix::from_fn(2, 2, |i, j| [[-1.0, 100.0], [-100.0, -1.0]][i][j]);
    let e = exponential(&a).unwrap();
    let decay = (-1.0f64).exp();
    assert!((e[(0, 0)] - decay * 100f64.cos()).abs() < 1e-14 && (e[(0, 1)] - decay * 100f64.sin()).abs() < 1e-14);
    // Badly scaled: [0 1e8; -1e-8 0] turns by one radian.
    let a = Matrix::from_fn(2, 2, |i, j| [[0.0, 1e8], [-1e-8, 0.0]][i][j]);
    let e = exponential(&a).unwrap();
    assert!((e[(0, 0)] - 1f64.cos()).abs() < 1e-15 && (e[(0, 1)] / 1e8 - 1f64.sin()).abs() < 1e-15);
    // Stiff: −1e6 and −1.
    let a = Matrix::from_fn(2, 2, |i, j| [[-1e6, 1e6], [0.0, -1.0]][i][j]);
    let e = exponential(&a).unwrap();
    assert!((e[(1, 1)] - decay).abs() < 1e-10 && (e[(0, 1)] - decay * 1e6 / (1e6 - 1.0)).abs() < 1e-9, "{e:?}");
    for bad in [f64::NAN, f64::INFINITY, 1e4] {
        assert_eq!(exponential(&Matrix::from_fn(1, 1, |_, _| bad)), None, "{bad}");
    }
    let one = Matrix::<f64>::identity(1);
    for time in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(discretise(&one, &one, time), None);
    }
    assert_eq!(discretise(&one, &one.scale(&f64::NAN), 1.0), None);
}

#[test]
fn lyapunov_refusals() {
    let rotation = Matrix::from_fn(2, 2, |i, j| [[0.0, 2.0], [-2.0, 0.0]][i][j]);
    let one = Matrix::<f64>::identity(2);
    assert!(matches!(lyapunov(&rotation, &one), Err(LyapunovError::Singular(..))));
    assert_eq!(lyapunov(&rotation, &Matrix::identity(3)), Err(LyapunovError::Shape));
    assert_eq!(lyapunov(&one.scale(&f64::NAN), &one), Err(LyapunovError::NotFinite));
    // Mirrored eigenvalues 1 and −1.
    let saddle = Matrix::from_fn(2, 2, |i, j| [[1.0, 0.0], [0.0, -1.0]][i][j]);
    assert!(matches!(lyapunov(&saddle, &one), Err(LyapunovError::Singular(..))));
}

/// At rest the outputs are the references, for any stabilising gain; zeros at the origin are named.
#[test]
fn references_are_reached() {
    let s = built_in("sia-steering", &["wg_motor", "rk_motor"], &["rk", "fs"]);
    let poles = [(-14.0, 14.28), (-14.0, -14.28), (-20.0, 0.0), (-25.0, 0.0), (-700.0, 700.0), (-700.0, -700.0)]
        .map(Pole::from);
    let gain = place_poles(&s, &poles).unwrap().gain;
    let reference = steady_state(&s).unwrap().reference_gain(&gain);
    let explicit = s.explicit().unwrap();
    let (a, b, c) = (explicit.a.to_f64(), explicit.b.to_f64(), explicit.c.to_f64());
    let closed = minus(&a, &b.multiply(&gain));
    let response = c.multiply(&closed.scale(&-1.0).solve(&b.multiply(&reference)).unwrap());
    assert!(norm(&minus(&response, &Matrix::identity(2))) < 1e-9, "{response:?}");
    // A speed cannot be held through a spring to the ground; both ends of one shaft are never different.
    let m = |rows: &[&[i64]]| integers(rows);
    let spring = LinearSystem::state_space(m(&[&[0, 1], &[-4, -1]]), m(&[&[0], &[1]]), m(&[&[0, 1]]));
    assert_eq!(steady_state(&spring), Err(SteadyStateError::Zero { unheld: "y1 is zero at every equilibrium".into() }));
    let same = LinearSystem::state_space(m(&[&[0, 1], &[-4, -1]]), m(&[&[0, 1], &[1, 1]]), m(&[&[1, 0], &[2, 0]]));
    assert_eq!(
        steady_state(&same),
        Err(SteadyStateError::Zero { unheld: "y1 - 1/2 y2 is zero at every equilibrium".into() })
    );
    let idle = LinearSystem::state_space(m(&[&[0]]), m(&[&[0]]), m(&[&[1]]));
    assert_eq!(steady_state(&idle), Err(SteadyStateError::Zero { unheld: "x1 never changes".into() }));
    let wide = LinearSystem::state_space(m(&[&[0]]), m(&[&[1, 1]]), m(&[&[1]]));
    assert_eq!(steady_state(&wide), Err(SteadyStateError::NotSquare { outputs: 1, inputs: 2 }));
}

/// No states, no inputs: no panic, and an answer where there is one.
#[test]
fn empty_systems() {
    let free = LinearSystem::state_space(integers(&[&[-1]]), Matrix::zeros(1, 0), Matrix::zeros(0, 1));
    assert_eq!(place_poles(&free, &[Complex::new(-1.0, 0.0)]).unwrap().gain.rows(), 0);
    assert!(matches!(place_poles(&free, &[Complex::new(-2.0, 0.0)]), Err(PlacementError::FixedModes { .. })));
    let cost = lqr(&free, &Weights::diagonal(&[2.0], &[])).unwrap();
    assert!((cost.solution[(0, 0)] - 1.0).abs() < 1e-15);
    assert!(steady_state(&free).is_ok());
    let nothing = LinearSystem::state_space(Matrix::zeros(0, 0), Matrix::zeros(0, 0), Matrix::zeros(0, 0));
    assert!(place_poles(&nothing, &[]).is_ok() && lqr(&nothing, &Weights::diagonal(&[], &[])).is_ok());
    assert!(steady_state(&nothing).is_ok());
    let none = Matrix::<f64>::zeros(0, 0);
    assert!(lyapunov(&none, &none).is_ok() && exponential(&none).is_some() && discretise(&none, &none, 1.0).is_some());
}

/// The gain of a single input is exact but for one rounding: the exact roots of the characteristic polynomial of A − BK are
/// nearer to the wishes than what an eigenvalue iteration finds, which is all that the certificate can see.
#[test]
fn single_inputs_are_placed_exactly() {
    for n in [4usize, 8, 12] {
        for seed in 0..4 {
            let s = random(n, 1, 1000 * n as u64 + 10 + seed);
            let poles = random_poles(n, seed + 77 * n as u64);
            let placement = place_poles(&s, &poles).unwrap();
            let gain = Matrix::from_fn(1, n, |i, j| rational_from_f64(placement.gain[(i, j)]).unwrap());
            let closed = s.a.plus(&s.b.multiply(&gain).scale(&Rational::from(-1)));
            let roots = characteristic_polynomial(&closed).roots();
            let distance = |pole: &Pole| {
                let nearest = roots.iter().map(|r| (r.0 - pole.re).hypot(r.1 - pole.im)).fold(f64::INFINITY, f64::min);
                nearest / pole.abs()
            };
            let worst = poles.iter().map(distance).fold(0.0, f64::max);
            assert!(worst <= placement.residual.max(1e-13), "{n} {seed}: {worst:e} {:e}", placement.residual);
            let rounding = f64::EPSILON * placement.condition * (1.0 + norm(&placement.gain));
            assert!(worst < rounding.max(1e-13), "{n} {seed}: {worst:e} {rounding:e}");
        }
    }
    // Two inputs in the same direction share the command.
    let s = system(&[&[0, 1], &[0, 0]], &[&[0, 0], &[1, 3]]);
    let gain = place_poles(&s, &[Complex::new(-1.0, 0.0), Complex::new(-2.0, 0.0)]).unwrap().gain;
    assert_eq!(gain.as_slice(), [0.2, 0.3, 0.6, 0.9]);
}

//! The certified mode: the right answers, proven, also for systems made to mislead computations modulo primes.

use kardan::analysis::{LinearSystem, certified_structure, structure};
use kardan::model;
use kardan::num::{Matrix, Polynomial, Random, Rational, Scalar, random_prime};
use kardan::results::Structure;
use kardan::study::{self, AnalyzeSettings};

fn integers(rows: &[&[i64]]) -> Matrix<Rational> {
    Matrix::from_fn(rows.len(), rows.first().map_or(0, |row| row.len()), |i, j| Rational::from(rows[i][j]))
}

fn whole(x: u64) -> Rational {
    Rational::from(x)
}

/// Proven, and nothing in it sounds otherwise.
fn certified(system: &LinearSystem) -> Structure {
    let found = certified_structure(system, &|fraction| assert!((0.0..=1.0).contains(&fraction))).unwrap();
    assert!(found.certificate.proven, "{:#?}", found.certificate.statements);
    assert_eq!(found.certificate.failure_probability, 0.0);
    assert!(found.certificate.statements.iter().all(|s| s.contains("proven") && !s.contains("probability")));
    found
}

/// All answers, without the certificate.
fn strip_certificate(structure: &Structure) -> Structure {
    Structure { certificate: Default::default(), ..structure.clone() }
}

#[test]
fn built_in_models_are_proven() {
    for name in ["sia-steering", "harmonic-drive", "harmonic-drive-spring", "two-bodies", "rlc-ladder"] {
        let source = model::builtin(name).unwrap().source;
        let fast = study::analyze(source, &AnalyzeSettings::default(), &study::Silent).unwrap();
        let settings = AnalyzeSettings { certify: true, ..AnalyzeSettings::default() };
        let sure = study::analyze(source, &settings, &study::Silent).unwrap();
        assert!(sure.structure.certificate.proven, "{name}: {:#?}", sure.structure.certificate.statements);
        assert_eq!(strip_certificate(&sure.structure), strip_certificate(&fast.structure), "{name}");
        assert_eq!((&sure.modes, &sure.placement), (&fast.modes, &fast.placement), "{name}");
    }
}

/// Two equal bodies (appendix B) with inertia J, coupling spring s, damping d of each against the ground and half of it
/// between them: `λ²J + λd' + s'` over the symmetric and antisymmetric motion.
fn two_bodies(j: i64, s: i64, d: i64) -> LinearSystem {
    LinearSystem {
        e: integers(&[&[1, 0, 0, 0], &[0, 1, 0, 0], &[0, 0, j, 0], &[0, 0, 0, j]]),
        degrees_of_freedom: Some(2),
        ..LinearSystem::state_space(
            integers(&[&[0, 0, 1, 0], &[0, 0, 0, 1], &[-s, s, -2 * d, d], &[s, -s, d, -2 * d]]),
            integers(&[&[0], &[0], &[0], &[1]]),
            integers(&[&[0, 1, 0, 0]]),
        )
    }
}

/// Symmetric motion: `λ (Jλ + d)`; antisymmetric motion: `Jλ² + 3dλ + 2s`.
#[test]
fn appendix_b_is_proven() {
    type Case = ((i64, i64, i64), usize, usize, &'static [&'static str]);
    let cases: [Case; 6] = [
        ((1, 0, 1), 2, 3, &["s", "s^3 + 4 s^2 + 3 s"]),
        ((2, 8, 4), 2, 3, &["s + 2", "s^3 + 6 s^2 + 8 s"]),
        ((1, 1, 1), 2, 3, &["s + 1", "s^3 + 3 s^2 + 2 s"]),
        ((2, 9, 4), 1, 4, &["s^4 + 8 s^3 + 21 s^2 + 18 s"]),
        ((1, 1, 0), 1, 4, &["s^4 + 2 s^2"]),
        ((1, 0, 0), 2, 2, &["s^2", "s^2"]),
    ];
    for ((j, s, d), inputs, rank, factors) in cases {
        let system = two_bodies(j, s, d);
        let found = certified(&system);
        assert_eq!((found.min_inputs, found.min_outputs), (inputs, inputs), "{j} {s} {d}");
        assert_eq!((found.controllable_rank, found.observable_rank), (rank, rank), "{j} {s} {d}");
        assert_eq!(found.invariant_factors, factors, "{j} {s} {d}");
        assert_eq!(found.relative_degrees, [[Some(2)]]);
        assert_eq!(strip_certificate(&found), strip_certificate(&structure(&system).unwrap()));
    }
}

fn times(p: &[i64], q: &[i64]) -> Vec<i64> {
    let mut out = vec![0; p.len() + q.len() - 1];
    for (i, x) in p.iter().enumerate() {
        for (j, y) in q.iter().enumerate() {
            out[i + j] += x * y;
        }
    }
    out
}

fn polynomial_text(p: &[i64]) -> String {
    Polynomial::new(p.iter().map(|&c| Rational::from(c)).collect()).to_string()
}

/// Companion blocks, hidden by a similarity with whole numbers, a fraction as time scale and a descriptor matrix.
fn hidden(blocks: &[Vec<i64>], random: &mut Random) -> LinearSystem {
    let n: usize = blocks.iter().map(|b| b.len() - 1).sum();
    let mut f = Matrix::<Rational>::zeros(n, n);
    let mut at = 0;
    for block in blocks {
        let d = block.len() - 1;
        for k in 0..d {
            if k + 1 < d {
                f[(at + k, at + k + 1)] = Rational::ONE;
            }
            f[(at + d - 1, at + k)] = Rational::from(-block[k]);
        }
        at += d;
    }
    let mut regular = || loop {
        let t = Matrix::from_fn(n, n, |_, _| Rational::from(random.below(7) as i64 - 3));
        if let Some(inverse) = t.solve(&Matrix::identity(n)) {
            return (t, inverse);
        }
    };
    let ((t, inverse), (e, _)) = (regular(), regular());
    // The first state of every block but the smallest is driven and measured.
    let mut first = Vec::new();
    let mut at = 0;
    for block in blocks {
        first.push(at);
        at += block.len() - 1;
    }
    let last = |k: usize| if k + 1 < first.len() { first[k + 1] - 1 } else { n - 1 };
    let b = Matrix::from_fn(n, 1, |i, _| if i == last(blocks.len() - 1) { Rational::ONE } else { Rational::ZERO });
    let c = Matrix::from_fn(1, n, |_, j| if j == first[blocks.len() - 1] { Rational::ONE } else { Rational::ZERO });
    let similar = t.multiply(&f).multiply(&inverse);
    LinearSystem {
        e: e.clone(),
        ..LinearSystem::state_space(e.multiply(&similar), e.multiply(&t.multiply(&b)), c.multiply(&inverse))
    }
}

/// Only the largest block is driven and measured: what is not reached, and not seen, are the other blocks.
#[test]
fn hidden_invariant_factors_are_proven() {
    let mut random = Random::new(2024);
    for round in 0..12 {
        let mut linear = || vec![-random.small(4), 1];
        let first = linear();
        let second = times(&first, &linear());
        // Jordan blocks {1, 1, 3}, {1, 2, 2} and the like, and a quadratic factor without rational roots.
        let third = match round % 3 {
            0 => times(&second, &times(&first, &first)),
            1 => times(&second, &[2, 0, 1]),
            _ => second.clone(),
        };
        let blocks = [first.clone(), second.clone(), third.clone()];
        let system = hidden(&blocks, &mut random);
        let found = certified(&system);
        assert_eq!(
            found.invariant_factors,
            [polynomial_text(&first), polynomial_text(&second), polynomial_text(&third)]
        );
        assert_eq!((found.min_inputs, found.min_outputs), (3, 3));
        let reached = third.len() - 1;
        assert_eq!((found.controllable_rank, found.observable_rank), (reached, reached));
        // Roots of the first factor are in all three blocks, two of which are neither reached nor seen.
        let root = found.factors.iter().find(|f| f.polynomial == polynomial_text(&first)).unwrap();
        assert_eq!((root.geometric, root.input_defect, root.output_defect), (3, 2, 2));
        assert_eq!(found.relative_degrees, [[Some(reached)]]);
        // The zeros are the eigenvalues neither reached nor seen (the reached part has none).
        assert_eq!(found.zeros.polynomial, polynomial_text(&times(&first, &second)));
        assert_eq!(strip_certificate(&found), strip_certificate(&structure(&system).unwrap()));
    }
}

/// Systems without input or output, with the zero transfer function, with more outputs than inputs.
#[test]
fn zeros_of_all_shapes_are_proven() {
    let diagonal = integers(&[&[-1, 0, 0], &[0, -2, 0], &[0, 0, -3]]);
    let system = |b: &[&[i64]], c: &[&[i64]]| LinearSystem::state_space(diagonal.clone(), integers(b), integers(c));
    // The third state is neither driven nor measured: -3 is a zero, whatever the shape.
    let tall = certified(&system(&[&[1], &[1], &[0]], &[&[1, 0, 0], &[0, 1, 0]]));
    assert_eq!((tall.zeros.polynomial.as_str(), tall.zeros.normal_rank), ("s + 3", 1));
    // Nothing from the first state to the second: no path, S has rank 3 and a constant minor of order 3 but for -3.
    let dead = certified(&system(&[&[1], &[0], &[0]], &[&[0, 1, 0]]));
    assert_eq!((dead.zeros.polynomial.as_str(), dead.zeros.normal_rank), ("s + 3", 0));
    assert_eq!(dead.relative_degrees, [[None]]);
    // 1/(s+1) + 1/(s+2) = (2s + 3)/…, times the mode that is left out.
    let square = certified(&system(&[&[1], &[1], &[0]], &[&[1, 1, 0]]));
    assert_eq!((square.zeros.polynomial.as_str(), square.zeros.normal_rank), ("s^2 + 9/2 s + 9/2", 1));
    // Two decoupled copies of (s + 5)/((s + 1)(s + 2)), each measured twice: -5 is a zero of every row, doubly.
    let copy = |k: usize, i: usize| if i / 2 == k { 1 } else { 0 };
    let a = Matrix::from_fn(4, 4, |i, j| Rational::from(if i == j { [-1, -2][i % 2] } else { 0 }));
    let b = Matrix::from_fn(4, 2, |i, k| Rational::from(copy(k, i) * [4, -3][i % 2]));
    let c = Matrix::from_fn(3, 4, |k, j| Rational::from(if k == 2 { 2 * copy(0, j) } else { copy(k, j) }));
    let doubled = certified(&LinearSystem::state_space(a, b, c));
    assert_eq!((doubled.zeros.polynomial.as_str(), doubled.zeros.normal_rank), ("s^2 + 10 s + 25", 2));
    // No ports at all.
    let no_ports = certified(&LinearSystem::state_space(diagonal.clone(), Matrix::zeros(3, 0), Matrix::zeros(0, 3)));
    assert_eq!((no_ports.controllable_rank, no_ports.min_inputs), (0, 1));
}

/// Entries that are multiples of the primes that are used: everything seems to fall apart modulo those.
#[test]
fn unlucky_primes_do_not_mislead() {
    let first = random_prime(&mut Random::new(1));
    let largest = (1u64 << 61) - 1;
    for p in [whole(first), whole(largest), whole(first).times(&whole(largest))] {
        let matrix = |rows: [[i64; 2]; 2]| {
            let at = |x: i64| if x == 9 { p.clone() } else { Rational::from(x) };
            Matrix::from_fn(2, 2, |i, j| at(rows[i][j]))
        };
        let one = integers(&[&[0], &[1]]);
        // A chain whose link is p.
        let chain = certified(&LinearSystem::state_space(matrix([[0, 9], [0, 0]]), one.clone(), integers(&[&[1, 0]])));
        assert_eq!((chain.controllable_rank, chain.observable_rank, chain.min_inputs), (2, 2, 1));
        assert_eq!(chain.invariant_factors, ["s^2"]);
        assert_eq!(chain.relative_degrees, [[Some(2)]]);
        assert_eq!((chain.zeros.polynomial.as_str(), chain.zeros.normal_rank), ("1", 1));
        // Two eigenvalues that agree modulo p.
        let both = integers(&[&[1], &[1]]);
        let pair = certified(&LinearSystem::state_space(matrix([[0, 0], [0, 9]]), both, integers(&[&[1, 1]])));
        assert_eq!((pair.controllable_rank, pair.min_inputs), (2, 1));
        assert_eq!(pair.factors.len(), 2);
        assert!(pair.factors.iter().all(|f| (f.algebraic, f.geometric, f.input_defect) == (1, 1, 0)));
        // A descriptor matrix that is singular modulo p, and a feedthrough that vanishes.
        let descriptor = LinearSystem {
            e: matrix([[9, 0], [0, 1]]),
            d: Matrix::from_fn(1, 1, |_, _| p.clone()),
            ..LinearSystem::state_space(matrix([[0, 1], [-2, -3]]), one, integers(&[&[1, 0]]))
        };
        let found = certified(&descriptor);
        assert_eq!((found.controllable_rank, found.relative_degrees[0][0]), (2, Some(0)));
        assert_eq!(found.zeros.values.len(), 2);
    }
}

/// `ẋ` in companion form for a characteristic polynomial with these coefficients of 1, s, …, driven at the end.
fn chain(coefficients: &[i64], c: Matrix<Rational>) -> LinearSystem {
    let n = coefficients.len();
    let a = Matrix::from_fn(n, n, |i, j| match (i + 1 == n, i + 1 == j) {
        (true, _) => Rational::from(-coefficients[j]),
        (false, yes) => {
            if yes {
                Rational::ONE
            } else {
                Rational::ZERO
            }
        }
    });
    let b = Matrix::from_fn(n, 1, |i, _| if i + 1 == n { Rational::ONE } else { Rational::ZERO });
    LinearSystem::state_space(a, b, c)
}

/// `s² + a s + b` with `a² − 4 b = 3 (2⁶¹ − 1)`: a double root modulo the only prime that the bound asks for.
#[test]
fn a_double_root_modulo_the_first_prime_is_none() {
    let found = certified(&chain(&[939_872_593, 2_630_119_585], integers(&[&[1, 0]])));
    assert_eq!(found.factors.iter().map(|f| f.algebraic).collect::<Vec<_>>(), [1]);
    assert_eq!(found.invariant_factors, ["s^2 + 2630119585 s + 939872593"]);
}

/// Outputs `(p s − 1) s` and `(p s − 1) (s − p)` of one input: modulo p = 2⁶¹ − 1 the common zero is 0 instead of 1/p.
#[test]
fn a_zero_with_the_first_prime_as_denominator_is_proven() {
    let p = whole((1 << 61) - 1);
    let other = Rational::ZERO.minus(&p.times(&p).plus(&Rational::ONE));
    let rows = [[Rational::ZERO, Rational::from(-1), p.clone()], [p.clone(), other, p.clone()]];
    let found = certified(&chain(&[3, 2, 1], Matrix::from_fn(2, 3, |i, j| rows[i][j].clone())));
    assert_eq!((found.zeros.polynomial.as_str(), found.zeros.normal_rank), ("s - 1/2305843009213693951", 1));
}

/// A feedthrough that vanishes modulo the prime of the fast mode: it does not say that it has proven relative degree one.
#[test]
fn a_hidden_feedthrough_is_not_denied() {
    let p = whole(random_prime(&mut Random::new(1)));
    let system = LinearSystem {
        d: Matrix::from_fn(1, 1, |_, _| p.clone()),
        ..LinearSystem::state_space(integers(&[&[-1]]), integers(&[&[1]]), integers(&[&[1]]))
    };
    assert_eq!(certified(&system).relative_degrees, [[Some(0)]]);
    let fast = structure(&system).unwrap();
    let statement = fast.certificate.statements.iter().find(|s| s.starts_with("relative degrees")).unwrap();
    assert!(fast.relative_degrees == [[Some(0)]] || !statement.ends_with("proven"), "{statement}");
}

/// One prime, one left vector.
#[test]
fn statements_count_to_one() {
    let system =
        LinearSystem::state_space(integers(&[&[-1, 0], &[0, -2]]), integers(&[&[1], &[0]]), integers(&[&[1, 0]]));
    let statements = certified(&system).certificate.statements.join("\n");
    assert!(statements.contains("modulo one prime above") && statements.contains("an exact left vector is"));
    assert!(!statements.contains(" 1 primes") && !statements.contains(" 1 exact"));
}

/// Ports at their limits: no input, no output, one state, numbers of 10³⁰⁰ and 10⁻³⁰⁰, all entries zero.
#[test]
fn extreme_systems_are_proven() {
    let huge = Rational::from_parts(dashu_int::UBig::from(10u8).pow(300).into(), dashu_int::UBig::ONE);
    let tiny = Rational::ONE.over(&huge);
    for x in [huge.clone(), tiny.clone(), Rational::ZERO] {
        let a = Matrix::from_fn(2, 2, |i, j| if i == 0 && j == 1 { x.clone() } else { Rational::ZERO });
        let (b, c) = (Matrix::from_fn(2, 1, |i, _| Rational::from(i as u64)), integers(&[&[1, 0], &[0, 0]]));
        let found = certified(&LinearSystem {
            e: Matrix::from_fn(2, 2, |i, j| match i == j {
                true => huge.clone(),
                false => Rational::ZERO,
            }),
            ..LinearSystem::state_space(a, b, c)
        });
        let linked = !Scalar::is_zero(&x);
        let (rank, inputs) = if linked { (2, 1) } else { (1, 2) };
        assert_eq!((found.controllable_rank, found.min_inputs), (rank, inputs));
        assert_eq!(found.relative_degrees, [[linked.then_some(2)], [None]]);
    }
    for (inputs, outputs) in [(0, 0), (0, 2), (2, 0), (3, 2)] {
        let zero = LinearSystem::state_space(Matrix::zeros(1, 1), Matrix::zeros(1, inputs), Matrix::zeros(outputs, 1));
        let found = certified(&zero);
        assert_eq!((found.controllable_rank, found.observable_rank, found.min_inputs), (0, 0, 1));
        // Neither reached nor seen: the eigenvalue is an invariant zero of [s, 0; 0, 0].
        assert_eq!((found.zeros.polynomial.as_str(), found.zeros.normal_rank), ("s", 0));
    }
}

/// Eigenvalues that differ by 10⁻³⁰ of their size, and the same ones made equal.
#[test]
fn nearly_equal_is_not_equal() {
    let tiny = Rational::from_parts(1.into(), dashu_int::UBig::from(10u8).pow(30));
    for (gap, inputs) in [(tiny, 1), (Rational::ZERO, 2)] {
        let a = Matrix::from_fn(2, 2, |i, j| match (i, j) {
            (0, 0) => Rational::ONE,
            (1, 1) => Rational::ONE.plus(&gap),
            _ => Rational::ZERO,
        });
        let found = certified(&LinearSystem::state_space(a, integers(&[&[1], &[1]]), integers(&[&[1, 1]])));
        assert_eq!(
            (found.min_inputs, found.controllable_rank, found.observable_rank),
            (inputs, 3 - inputs, 3 - inputs)
        );
    }
}

/// A hub with four equal arms of three masses each: the antisymmetric motions of the arms are three equal copies.
#[test]
fn a_star_of_equal_arms_is_proven() {
    let (arms, length) = (4, 3);
    let r = 1 + arms * length;
    let mut stiffness = Matrix::<Rational>::zeros(r, r);
    let mut couple = |i: usize, j: usize, s: i64| {
        for (x, y, sign) in [(i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)] {
            stiffness[(x, y)] = stiffness[(x, y)].plus(&Rational::from(sign * s));
        }
    };
    for arm in 0..arms {
        for k in 0..length {
            let body = 1 + arm * length + k;
            couple(if k == 0 { 0 } else { body - 1 }, body, 3 + k as i64);
        }
    }
    let n = 2 * r;
    let one = |yes: bool| if yes { Rational::ONE } else { Rational::ZERO };
    let a = Matrix::from_fn(n, n, |i, j| match (i < r, j < r) {
        (true, _) => one(j == r + i),
        (false, true) => Rational::ZERO.minus(&stiffness[(i - r, j)]),
        (false, false) => Rational::ZERO,
    });
    let system = LinearSystem {
        degrees_of_freedom: Some(r),
        ..LinearSystem::state_space(
            a,
            Matrix::from_fn(n, 1, |i, _| one(i == r)),
            Matrix::from_fn(1, n, |_, j| one(j == 0)),
        )
    };
    let found = certified(&system);
    // An arm clamped at the hub: S = [[7, -4, 0], [-4, 9, -5], [0, -5, 5]], det(x + S) with x = s².
    let arm = "s^6 + 21 s^4 + 102 s^2 + 60";
    assert_eq!(found.invariant_factors[..2], [arm, arm]);
    assert_eq!((found.min_inputs, found.min_outputs), (3, 3));
    // Motor and sensor at the hub reach and see the symmetric motion: hub and one arm.
    assert_eq!((found.controllable_rank, found.observable_rank), (8, 8));
    // Zeros: the hub held still, all four arms; as four copies of the arm over the three that are not reached.
    assert_eq!(found.zeros.values.len(), 24);
    assert_eq!(strip_certificate(&found), strip_certificate(&structure(&system).unwrap()));
}

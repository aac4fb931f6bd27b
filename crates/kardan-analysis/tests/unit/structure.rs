//! Tests of `src/structure/mod.rs`.

use super::*;
use kardan_math::num::{Matrix, Rational, Scalar, prime_below};

fn matrix(rows: &[&[&Rational]]) -> Matrix<Rational> {
    Matrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j].clone())
}

/// `A = diag(0, x)`, `B = (1, 1)`, `C = (1, 0)`, with x a multiple of these primes: modulo each of them one state is
/// reached, over the rationals both are.
fn misleading(primes: &[u64]) -> LinearSystem {
    let x = primes.iter().fold(Rational::ONE, |all, &p| all * Rational::from(p));
    let (none, one) = (Rational::ZERO, Rational::ONE);
    LinearSystem::state_space(
        matrix(&[&[&none, &none], &[&none, &x]]),
        matrix(&[&[&one], &[&one]]),
        matrix(&[&[&one, &none]]),
    )
}

fn silent(_: f64) {}

/// The very primes that the analysis will draw divide the entries: it takes further ones.
#[test]
fn the_primes_in_use_do_not_mislead() {
    for count in [1, RANK_TRIALS, 2 * RANK_TRIALS, 20] {
        let primes: Vec<u64> =
            std::iter::successors(Some((1 << 61) - 1), |&p| Some(prime_below(p))).take(count).collect();
        let system = misleading(&primes);
        for certify in [None, Some(&silent as &dyn Fn(f64))] {
            let drawn = [1, 2].map(|seed| Primes::new(seed).after(&primes));
            let found = decide_modulo(&system, certify, drawn, &Limits::new(2, certify.is_some())).unwrap();
            let ranks = (found.controllable_rank, found.observable_rank, found.min_inputs);
            assert_eq!(ranks, (2, 1, 1), "{count} {:#?}", found.certificate.statements);
            assert_eq!(found.undecided, Undecided::default());
            assert!(found.certificate.primes.iter().all(|p| !primes.contains(p) || certify.is_some()));
            assert!(found.certificate.proven || certify.is_none());
        }
        // A descriptor matrix that seems singular modulo all of them.
        let x = primes.iter().fold(Rational::ONE, |all, &p| all * Rational::from(p));
        let descriptor = LinearSystem {
            e: matrix(&[&[&x]]),
            ..LinearSystem::state_space(
                matrix(&[&[&Rational::ONE]]),
                matrix(&[&[&Rational::ONE]]),
                matrix(&[&[&Rational::ONE]]),
            )
        };
        let drawn = [1, 2].map(|seed| Primes::new(seed).after(&primes));
        let found = decide_modulo(&descriptor, Some(&silent), drawn, &Limits::new(1, true)).unwrap();
        assert_eq!((found.controllable_rank, found.observable_rank), (1, 1));
    }
}

/// Where a proof is requested and not found, there is no verdict.
#[test]
fn what_is_not_proven_is_not_decided() {
    // The vector that is not reached has 200 digits, and one prime is allowed.
    let large = Rational::from_parts(1.into(), dashu_int::UBig::from(7u8).pow(240));
    let (none, one) = (Rational::ZERO, Rational::ONE);
    let system = LinearSystem::state_space(
        matrix(&[&[&none, &none], &[&none, &none]]),
        matrix(&[&[&one], &[&large]]),
        matrix(&[&[&one, &none], &[&none, &one]]),
    );
    let limits = |certify| Limits { primes: 2, ..Limits::new(2, certify) };
    let both = || [Primes::unforeseen(1), Primes::new(1)];
    let found = decide_modulo(&system, Some(&silent), both(), &limits(true)).unwrap();
    assert_eq!(
        (found.undecided, found.controllability(), found.observability()),
        (Undecided { controllability: true, observability: false }, None, Some(true))
    );
    assert_eq!((found.minimality(), found.controllable()), (None, false));
    assert!(!found.certificate.proven);
    let statements = found.certificate.statements.join("\n");
    assert!(statements.contains("controllability rank: not decided; it is at least 1 of 2"), "{statements}");
    // Where no proof was requested, the statement has its probability.
    let fast = decide_modulo(&system, None, both(), &limits(false)).unwrap();
    assert_eq!((fast.undecided, fast.controllability()), (Undecided::default(), Some(false)));
    assert!(fast.certificate.failure_probability > 0.0 && fast.certificate.failure_probability < 1e-6);
    assert!(fast.certificate.statements[0].contains("probability"), "{:?}", fast.certificate.statements);
    // With primes enough it is decided.
    assert!(certified_structure(&system, &silent).unwrap().certificate.proven);
}

/// Equal systems have equal fingerprints, others do not: signs, places and the matrix of an entry count.
#[test]
fn fingerprints_distinguish_systems() {
    let system = misleading(&[7]);
    assert_eq!(fingerprint(&system), fingerprint(&system.clone()));
    let mut prints = vec![fingerprint(&system)];
    for change in 0..6 {
        let mut changed = system.clone();
        match change {
            0 => changed.a[(1, 1)] = Rational::from(-7),
            1 => changed.a[(1, 1)] = Rational::ONE.over(&Rational::from(7)),
            2 => changed.b[(0, 0)] = Rational::ZERO,
            3 => changed.c[(0, 0)] = Rational::from(256),
            4 => changed.d[(0, 0)] = Rational::ONE,
            _ => changed.e[(0, 1)] = Rational::ONE,
        }
        prints.push(fingerprint(&changed));
    }
    prints.sort_unstable();
    prints.dedup();
    assert_eq!(prints.len(), 7);
}

//! Chapter 5 and appendix B against exact golden values, counterexamples and independent checks.

use crate::common::built_in;
use kardan::analysis::{LinearSystem, structure};
use kardan::num::{Matrix, Rational};
use kardan::results::Structure;

fn integers(rows: &[&[i64]]) -> Matrix<Rational> {
    Matrix::from_fn(rows.len(), rows.first().map_or(0, |row| row.len()), |i, j| Rational::from(rows[i][j]))
}

fn multiplicities(structure: &Structure) -> Vec<(String, usize)> {
    let mut out: Vec<_> = structure.factors.iter().map(|f| (f.polynomial.clone(), f.geometric)).collect();
    out.sort();
    out
}

/// Two equal bodies, appendix B: (J, s, d) → what golden.json `analysis.appendix_B` states.
fn two_bodies(j: i64, s: i64, d: (i64, u32)) -> LinearSystem {
    let d = Rational::from_parts(d.0.into(), d.1.into());
    let (j, s, two) = (Rational::from(j), Rational::from(s), Rational::from(2));
    let zero = Rational::ZERO;
    let (minus_s, minus_two_d) = (&zero - &s, &zero - &two * &d);
    let rows = [
        [zero.clone(), zero.clone(), Rational::ONE, zero.clone()],
        [zero.clone(), zero.clone(), zero.clone(), Rational::ONE],
        [minus_s.clone(), s.clone(), minus_two_d.clone(), d.clone()],
        [s, minus_s, d, minus_two_d],
    ];
    LinearSystem {
        e: Matrix::from_fn(4, 4, |i, k| match (i == k, i < 2) {
            (true, true) => Rational::ONE,
            (true, false) => j.clone(),
            _ => Rational::ZERO,
        }),
        degrees_of_freedom: Some(2),
        ..LinearSystem::state_space(
            Matrix::from_fn(4, 4, |i, k| rows[i][k].clone()),
            integers(&[&[0], &[0], &[0], &[1]]),
            integers(&[&[0, 1, 0, 0]]),
        )
    }
}

/// System, least number of inputs, rank, and geometric multiplicity by factor.
type Case = (LinearSystem, usize, usize, &'static [(&'static str, usize)]);

#[test]
fn appendix_b_in_full() {
    let cases: [Case; 7] = [
        (two_bodies(1, 2, (1, 2)), 1, 4, &[("s", 1), ("s + 1/2", 1), ("s^2 + 3/2 s + 4", 1)]),
        (two_bodies(1, 0, (1, 1)), 2, 3, &[("s", 2), ("s + 1", 1), ("s + 3", 1)]),
        (two_bodies(2, 8, (4, 1)), 2, 3, &[("s", 1), ("s + 2", 2), ("s + 4", 1)]),
        (two_bodies(1, 1, (1, 1)), 2, 3, &[("s", 1), ("s + 1", 2), ("s + 2", 1)]),
        (two_bodies(2, 9, (4, 1)), 1, 4, &[("s", 1), ("s + 2", 1), ("s + 3", 1)]),
        (two_bodies(1, 1, (0, 1)), 1, 4, &[("s", 1), ("s^2 + 2", 1)]),
        (two_bodies(1, 0, (0, 1)), 2, 2, &[("s", 2)]),
    ];
    for (system, min_inputs, rank, expected) in cases {
        let s = structure(&system).unwrap();
        let expected: Vec<(String, usize)> = expected.iter().map(|(f, m)| (f.to_string(), *m)).collect();
        assert_eq!((s.min_inputs, s.min_outputs, s.controllable_rank), (min_inputs, min_inputs, rank), "{expected:?}");
        assert_eq!(multiplicities(&s), expected);
    }
    let s = structure(&two_bodies(2, 8, (4, 1))).unwrap();
    assert_eq!(s.invariant_factors, ["s + 2", "s^3 + 6 s^2 + 8 s"]);
    let uncontrollable: Vec<_> =
        s.factors.iter().filter(|f| f.input_defect > 0).map(|f| f.polynomial.as_str()).collect();
    assert_eq!(uncontrollable, ["s + 2"]);
}

/// golden.json `analysis.ranks.sia`: ranks for every set of motors and sensors, and the zeros.
#[test]
fn steering_column() {
    for (inputs, outputs, controllable, observable) in [
        (&["wg_motor", "rk_motor"][..], &["rk"][..], 6, 5),
        (&["wg_motor"], &["rk", "fs"], 5, 6),
        (&["rk_motor"], &["rk", "cs"], 5, 5),
        (&["driver"], &["cs", "wg"], 5, 6),
        (&["driver", "wg_motor"], &["fs", "cs", "wg"], 6, 6),
    ] {
        let s = structure(&built_in("sia-steering", inputs, outputs)).unwrap();
        assert_eq!((s.controllable_rank, s.observable_rank), (controllable, observable), "{inputs:?} {outputs:?}");
        assert_eq!(s.min_inputs, 2);
    }
    let s = structure(&built_in("sia-steering", &["rk_motor", "wg_motor"], &["rk", "fs"])).unwrap();
    assert_eq!(s.zeros.polynomial, "s^2 + 2060/11 s + 10000000/11");
    assert!((s.zeros.values[1].re + 93.636_363_636_363_64).abs() < 1e-12);
    assert!((s.zeros.values[1].im - 948.853_592_761_216_1).abs() < 1e-11);
    assert_eq!(s.relative_degrees.iter().map(|row| *row.iter().flatten().min().unwrap()).collect::<Vec<_>>(), [2, 2]);
    let s = structure(&built_in("sia-steering", &["rk_motor", "wg_motor"], &["fs", "cj"])).unwrap();
    assert_eq!(s.zeros.polynomial, "s + 5000");
}

/// golden.json `analysis.ranks.hd` and `.hds`.
#[test]
fn harmonic_drives() {
    let s = structure(&built_in("harmonic-drive", &["wg_motor", "cs_motor"], &["wg", "cs"])).unwrap();
    assert_eq!((s.min_inputs, s.controllable_rank, s.observable_rank), (2, 4, 4));
    let zero = s.factors.iter().find(|f| f.polynomial == "s").unwrap();
    assert_eq!((zero.algebraic, zero.geometric), (2, 2));
    let one = structure(&built_in("harmonic-drive", &["wg_motor"], &["wg"])).unwrap();
    assert_eq!((one.controllable_rank, one.observable_rank), (3, 3));
    for (inputs, rank) in [(&["wg_motor", "rk_motor"][..], 6), (&["wg_motor"], 4), (&["rk_motor"], 5)] {
        let s = structure(&built_in("harmonic-drive-spring", inputs, &["rk"])).unwrap();
        assert_eq!((s.controllable_rank, s.observable_rank, s.min_inputs), (rank, 5, 2), "{inputs:?}");
    }
}

/// The counterexample to the printed construction of Theorem 5.2: b = (0, 2, 1) leaves λ = 3 uncontrollable.
#[test]
fn counterexample_to_theorem_5_2() {
    let a = integers(&[&[3, 0, 0], &[0, 2, 0], &[2, -1, 1]]);
    let s = structure(&LinearSystem::state_space(a, integers(&[&[0], &[2], &[1]]), integers(&[&[1, 1, 1]]))).unwrap();
    assert_eq!((s.min_inputs, s.controllable_rank), (1, 2));
    let uncontrollable: Vec<_> =
        s.factors.iter().filter(|f| f.input_defect > 0).map(|f| f.polynomial.as_str()).collect();
    assert_eq!(uncontrollable, ["s - 3"]);
}

//! What follows from the structure, and the same system in other coordinates: exact identities, SLICOT, systems known by hand.

use kardan::analysis::LinearSystem;
use kardan::export::{realisations_json, realisations_mat};
use kardan::model::read_state_space;
use kardan::num::{Matrix, Polynomial, Rational};
use kardan::results::{Analysis, PolynomialRoots, TransformedSystem};
use kardan::study;
use serde_json::{Value, json};

fn analysis(system: &Value) -> Analysis {
    let found = study::analyze_state_space(system.to_string().as_bytes(), &Default::default(), &study::Silent);
    found.unwrap_or_else(|diagnostics| panic!("{diagnostics:?}"))
}

/// Of another program: zeros, orders at infinity, the minimal order (`tests/state_space/zeros/`).
#[test]
fn slicot_finds_the_same() {
    let all: Value = serde_json::from_str(include_str!("../state_space/zeros/systems.json")).unwrap();
    for system in all["systems"].as_array().unwrap() {
        let matrices = json!({"A": system["A"], "B": system["B"], "C": system["C"], "D": system["D"]});
        let found = analysis(&matrices);
        let properties = found.properties.as_ref().unwrap();
        assert_eq!(json!(properties.infinite_zeros), system["infinite"], "{matrices}");
        assert_eq!(json!(properties.minimal_order), system["minimal"], "{matrices}");
        assert_eq!(json!(found.structure.zeros.normal_rank), system["rank"], "{matrices}");
        assert_eq!(found.structure.zeros.values.len(), system["zeros"].as_array().unwrap().len(), "{matrices}");
    }
}

/// `C (sI − A)⁻¹ B + D` at a rational s.
fn transfer([a, b, c, d]: [&Matrix<Rational>; 4], s: &Rational) -> Option<Matrix<Rational>> {
    let n = a.rows();
    let resolvent = Matrix::<Rational>::identity(n).scale(s).minus(a);
    if n == 0 {
        return Some(d.clone());
    }
    Some(c.multiply(&resolvent.solve(b)?).plus(d))
}

fn is_zero(matrix: &Matrix<Rational>, rows: std::ops::Range<usize>, columns: std::ops::Range<usize>) -> bool {
    rows.into_iter().all(|i| columns.clone().all(|j| matrix[(i, j)].is_zero()))
}

fn starts(form: &TransformedSystem) -> Vec<usize> {
    let mut out = vec![0];
    form.blocks.iter().for_each(|block| out.push(out[out.len() - 1] + block.states));
    out
}

#[test]
fn forms_are_the_same_system_in_other_coordinates() {
    let all: Value = serde_json::from_str(include_str!("../state_space/zeros/systems.json")).unwrap();
    for system in all["systems"].as_array().unwrap() {
        let matrices = json!({"A": system["A"], "B": system["B"], "C": system["C"], "D": system["D"]});
        let LinearSystem { a, b, c, d, .. } = read_state_space(matrices.to_string().as_bytes()).unwrap().system;
        let found = analysis(&matrices).realisations.unwrap();
        let n = a.rows();
        for form in [&found.kalman, &found.staircase] {
            let t = &form.transformation;
            assert_eq!((t.multiply(&form.a), t.multiply(&form.b)), (a.multiply(t), b.clone()));
            assert_eq!((&form.c, &form.d), (&c.multiply(t), &d));
            assert!(t.solve(&Matrix::identity(n)).is_some(), "T is regular");
        }
        let (kalman, at) = (&found.kalman, starts(&found.kalman));
        assert_eq!(at[4], n);
        let zero = |i: usize, j: usize| is_zero(&kalman.a, at[i]..at[i + 1], at[j]..at[j + 1]);
        assert!([(1, 0), (2, 0), (3, 0), (2, 1), (3, 1), (1, 2), (3, 2)].iter().all(|&(i, j)| zero(i, j)));
        assert!(is_zero(&kalman.b, at[2]..n, 0..b.columns()));
        assert!([0, 2].iter().all(|&k| is_zero(&kalman.c, 0..c.rows(), at[k]..at[k + 1])));
        // Block Hessenberg.
        let (stairs, at) = (&found.staircase, starts(&found.staircase));
        let last = at.len() - 2;
        for k in 0..last {
            assert!(is_zero(&stairs.a, at[(k + 2).min(last)].max(at[k + 1])..n, at[k]..at[k + 1]) || k + 2 > last);
            assert!(is_zero(&stairs.a, at[last]..n, at[k]..at[k + 1]));
        }
        assert!(last == 0 || is_zero(&stairs.b, at[1]..n, 0..b.columns()));
        // The minimal realisation has the same transfer matrix.
        let minimal = &found.minimal;
        for s in ["7/3", "-11/5", "101"] {
            let s = kardan::units::parse_number(s).unwrap().rational;
            let of = |m: [&Matrix<Rational>; 4]| transfer(m, &s).expect("no pole is there");
            assert_eq!(of([&a, &b, &c, &d]), of([&minimal.a, &minimal.b, &minimal.c, &minimal.d]));
        }
    }
}

fn roots(found: &Option<PolynomialRoots>) -> &str {
    &found.as_ref().unwrap().polynomial
}

/// Four states: reached and seen (−1), reached only (−2), seen only (−3), neither (4); a zero of the minimal part at −5.
#[test]
fn decoupling_zeros_stand_beside_transmission_zeros() {
    let system = json!({
        "A": [[-1, 0, 0, 0, 0], [0, -2, 0, 0, 0], [0, 0, -3, 0, 0], [0, 0, 0, 4, 0], [0, 0, 0, 0, -6]],
        "B": [4, 1, 0, 0, 1], "C": [1, 0, 1, 0, 1],
    });
    // 4/(s + 1) + 1/(s + 6) = 5 (s + 5)/((s + 1)(s + 6)).
    let found = analysis(&system).properties.unwrap();
    assert_eq!(found.minimal_order, Some(2));
    assert_eq!(roots(&found.transmission_zeros), "s + 5");
    assert_eq!(roots(&found.input_decoupling_zeros), "s^2 - s - 12");
    assert_eq!(roots(&found.output_decoupling_zeros), "s^2 - 2 s - 8");
    assert_eq!(roots(&found.input_output_decoupling_zeros), "s - 4");
    assert_eq!(
        (found.stability.is_stable(), found.stabilisable, found.detectable),
        (Some(false), Some(false), Some(false))
    );
    assert_eq!((found.controllability_indices, found.observability_indices), (Some(vec![3]), Some(vec![3])));
    assert_eq!(found.infinite_zeros, Some(vec![1]));
}

#[test]
fn what_is_not_reached_must_die_away() {
    let of = |unreached: Value, extra: Value| {
        let mut system = json!({"A": [[1, 0], [0, unreached]], "B": [1, 0], "C": [1, 1]});
        system.as_object_mut().unwrap().extend(extra.as_object().unwrap().clone());
        let found = analysis(&system).properties.unwrap();
        (found.stability.is_stable(), found.stabilisable, found.detectable)
    };
    assert_eq!(of(json!(-2), json!({})), (Some(false), Some(true), Some(true)));
    assert_eq!(of(json!(0), json!({})).1, Some(false), "on the axis nothing dies away");
    for (unreached, dies) in
        [(json!("1/2"), true), (json!(-1), false), (json!("-999/1000"), true), (json!(0), true), (json!(1.5), false)]
    {
        // The reached state 1 lies on the circle and is seen.
        let found = of(unreached.clone(), json!({"Ts": 0.1, "B": [1, 0], "C": [[1, 0], [0, 1]]}));
        assert_eq!(found, (Some(false), Some(dies), Some(true)), "{unreached}");
    }
    let stable = analysis(&json!({"A": [[0, 1], ["-1/2", 0]], "B": [0, 1], "C": [1, 0], "dt": 1}));
    assert_eq!(stable.properties.unwrap().stability.is_stable(), Some(true));
    assert_eq!(stable.discrete.unwrap().sample_time, Some(1.0));
}

/// Files of the forms: JSON exact, MAT rounded.
#[test]
fn forms_are_written_exactly() {
    let matrices = json!({"A": [[0, 1, 0], [-2, -3, 0], [1, 0, "-1/3"]], "B": [0, 1, 0], "C": [1, 0, 0]});
    let found = analysis(&matrices).realisations.unwrap();
    let json: Value = serde_json::from_str(&realisations_json(&found)).unwrap();
    for (name, form) in [("kalman", &found.kalman), ("minimal", &found.minimal), ("staircase", &found.staircase)] {
        let one = &json[name];
        let plain = json!({"A": one["A"], "B": one["B"], "C": one["C"], "D": one["D"]});
        let read = read_state_space(plain.to_string().as_bytes()).unwrap().system;
        assert_eq!((&read.a, &read.b, &read.c), (&form.a, &form.b, &form.c), "{name}");
        assert_eq!(one["T"].as_array().unwrap().len(), 3);
    }
    assert_eq!(found.minimal.a.rows(), 2);
    assert!(realisations_mat(&found).unwrap().starts_with(b"MATLAB 5.0"));
}

/// Of one input and one output in companion form the zeros are the roots of the polynomial in C: as many as chosen lie in the right half-plane, those on
/// the axis do not.
#[test]
fn zeros_in_the_right_half_plane_are_counted() {
    for roots in [vec![-1, -2], vec![1, -2, 3], vec![0, 0, 4], vec![5, 5, 5, -1], vec![]] {
        let zeros = Polynomial::from_roots(&roots.iter().map(|x| Rational::from(*x)).collect::<Vec<_>>());
        let n = roots.len() + 2;
        let row: Vec<String> = (0..n).map(|k| zeros.coefficient(k).to_string()).collect();
        let unit = |i: usize| (0..n).map(|j| if j == i { 1 } else { 0 }).collect::<Vec<i64>>();
        let a: Vec<Vec<i64>> = (1..n).map(unit).chain([vec![-1; n]]).collect();
        let b: Vec<i64> = unit(n - 1);
        let found = analysis(&json!({"A": a, "B": b, "C": [row]})).structure.zeros;
        assert_eq!(found.growing, Some(roots.iter().filter(|x| **x > 0).count()), "{roots:?}");
        assert_eq!(found.values.len(), roots.len());
    }
}

//! Tests of `src/study/requests/correlated.rs`.

use super::*;

/// The factor gives the correlations back, of singular matrices too; zero pivots give zeros.
#[test]
fn factors_give_their_matrix_back() {
    let of = |text: &str, n: usize| parse_matrix(text, (0..n).map(|k| format!("p{k}")).collect()).unwrap();
    for (text, n) in
        [("1 0.5; 0.5 1", 2), ("1 1 0; 1 1 0; 0 0 1", 3), ("1, -1; -1, 1", 2), ("1 .8 .6; .8 1 0; .6 0 1", 3)]
    {
        let correlation = of(text, n);
        assert!(!matches!(definiteness(&correlation.matrix), Definiteness::Indefinite { .. }), "{text}");
        let factor = factor(&correlation.matrix);
        let product = factor.multiply(&factor.transpose());
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            assert!((product[(i, j)] - rational_to_f64(&correlation.matrix[(i, j)])).abs() < 1e-15, "{text}");
        }
    }
}

/// What a file has rounded below zero by a bit is taken; what is not semidefinite by more has its witness.
#[test]
fn files_may_be_rounded() {
    let low = 1.0 + 2e-16;
    let text = |c: f64| format!("{{\"names\": [\"a\", \"b\"], \"covariance\": [[1.0, {c:?}], [{c:?}, 1.0]]}}");
    let decide = |c: f64| {
        let (correlation, mut out) = (of_file(&text(c), &[]).unwrap(), Vec::new());
        (decided(&correlation, &Table::default(), "it", &mut out), out)
    };
    assert!(matches!(definiteness(&of_file(&text(low), &[]).unwrap().matrix), Definiteness::Indefinite { .. }));
    let (found, out) = decide(low);
    assert!(out.is_empty() && (found.unwrap()[(1, 0)] - 1.0).abs() < 1e-11);
    let (found, out) = decide(1.01);
    assert!(found.is_none() && out[0].message.contains("negative variance"), "{out:?}");
}

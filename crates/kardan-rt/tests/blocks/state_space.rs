//! The linear dynamic block against sums written out here.

use kardan_rt::StateSpace;

/// Numbers in ±1, the same in every run.
pub(crate) fn numbers(seed: u64, length: usize) -> Vec<f64> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    (0..length).map(|_| next()).collect()
}

/// M x, entry by entry.
fn times(matrix: &[f64], x: &[f64]) -> Vec<f64> {
    matrix.chunks(x.len()).map(|row| row.iter().zip(x).map(|(a, b)| a * b).sum()).collect()
}

fn sum(x: &[f64], y: &[f64]) -> Vec<f64> {
    x.iter().zip(y).map(|(x, y)| x + y).collect()
}

fn close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (x, y) in found.iter().zip(expected) {
        // At most 20 products of numbers below 1 in another order.
        assert!((x - y).abs() < 20.0 * f64::EPSILON * 20.0, "{x} against {y}");
    }
}

#[test]
fn outputs_rates_and_steps_are_the_matrix_products() {
    for (states, signals, outputs) in [(1, 1, 1), (8, 5, 4), (3, 7, 2), (5, 2, 9)] {
        let a = numbers(1, states * states);
        let b = numbers(2, states * signals);
        let c = numbers(3, outputs * states);
        let d = numbers(4, outputs * signals);
        let block = StateSpace::new(&a, &b, &c, &d, states, signals).expect("shapes");
        let (mut state, s) = (numbers(5, states), numbers(6, signals));
        let (mut rates, mut out, mut next) = (vec![f64::NAN; states], vec![f64::NAN; outputs], vec![7.0; states]);
        assert!(block.rates(&state, &s, &mut rates));
        assert!(block.outputs(&state, &s, &mut out));
        close(&rates, &sum(&times(&a, &state), &times(&b, &s)));
        close(&out, &sum(&times(&c, &state), &times(&d, &s)));
        assert!(block.step(&mut state, &s, &mut next));
        assert_eq!(state, rates, "the same sum, the same bits");
    }
}

/// Without outputs, states or signals a block still is one.
#[test]
fn empty_parts_are_allowed() {
    let autonomous = StateSpace::new(&[0.5], &[], &[2.0, 3.0], &[], 1, 0).expect("no signals");
    let (mut state, mut next, mut out) = ([4.0], [0.0], [0.0; 2]);
    assert!(autonomous.outputs(&state, &[], &mut out));
    assert_eq!(out, [8.0, 12.0]);
    assert!(autonomous.step(&mut state, &[], &mut next));
    assert_eq!(state, [2.0]);
    let gain = StateSpace::new(&[], &[], &[], &[1.0, 2.0, 3.0, 4.0], 0, 2).expect("no states");
    assert!(gain.outputs(&[], &[1.0, 10.0], &mut out));
    assert_eq!(out, [21.0, 43.0]);
    assert!(gain.step(&mut [], &[1.0, 10.0], &mut []));
    let silent = StateSpace::new(&[0.5], &[1.0], &[], &[], 1, 1).expect("no outputs");
    assert!(silent.outputs(&[1.0], &[1.0], &mut []));
    assert!(StateSpace::<f64>::new(&[], &[], &[], &[], 0, 0).is_none(), "nothing at all");
}

#[test]
fn shapes_that_do_not_fit_are_refused() {
    let m = [0.0; 12];
    for (a, b, c, d, states, signals) in
        [(3, 2, 2, 1, 2, 1), (4, 3, 2, 1, 2, 1), (4, 2, 3, 1, 2, 1), (4, 2, 2, 2, 2, 1), (4, 2, 2, 1, 1, 2)]
    {
        assert!(StateSpace::new(&m[..a], &m[..b], &m[..c], &m[..d], states, signals).is_none());
    }
    assert!(StateSpace::new(&m[..4], &m[..2], &m[..2], &m[..1], 2, 1).is_some());
    assert!(StateSpace::new(&m, &m, &m, &m, usize::MAX, usize::MAX).is_none(), "no overflow");
}

/// A bad reading is dropped, the state stays; short slices do not panic.
#[test]
fn bad_readings_and_short_slices() {
    let block = StateSpace::new(&[0.5, 0.1, 0.0, 0.5], &[1.0, 1.0], &[1.0, 0.0], &[0.0], 2, 1).expect("shapes");
    let (mut state, mut next) = ([1.0, 2.0], [0.0; 2]);
    for bad in [f64::NAN, f64::INFINITY] {
        assert!(!block.step(&mut state, &[bad], &mut next));
        assert_eq!(state, [1.0, 2.0]);
    }
    assert!(block.step(&mut state, &[0.0], &mut next));
    assert_eq!(state, [0.7, 1.0]);
    assert!(block.outputs(&state[..1], &[], &mut []));
    assert!(block.step(&mut state[..1], &[], &mut next[..1]));
}

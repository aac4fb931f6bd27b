//! What is shown to contract does, decided by exact roots; and most of what contracts is shown to.

use kardan::analysis::{Plane, stability_of};
use kardan::num::{Matrix, Random, Rational, contracts};
use kardan::results::Stability;

fn rational(numerator: i64, denominator: u64) -> Rational {
    Rational::from_parts(numerator.into(), denominator.into())
}

/// A regular change of coordinates and its inverse, with small whole numbers.
fn change(random: &mut Random, n: usize) -> [Matrix<Rational>; 2] {
    loop {
        let change = Matrix::from_fn(n, n, |_, _| Rational::from(random.small(3)));
        if let Some(inverse) = change.solve(&Matrix::identity(n)) {
            return [change, inverse];
        }
    }
}

/// Random maps on either side of the border, and on it.
#[test]
fn contraction_agrees_with_exact_roots() {
    let mut random = Random::new(11);
    let [mut shown, mut stable] = [0, 0];
    for trial in 0..400 {
        let n = 1 + trial % 7;
        let denominator = 2 + (trial as u64 * 7) % 40;
        let map = Matrix::from_fn(n, n, |_, _| rational(random.small(5), denominator));
        let exact = stability_of(&map, Plane::Discrete).word == Stability::Stable;
        let found = contracts(&map, -100.0, 0);
        assert!(exact || !found, "{n} {map:?}");
        shown += usize::from(found);
        stable += usize::from(exact);
    }
    assert!(stable > 100 && shown + 4 >= stable, "{shown} of {stable}");
}

/// Motions at one, in chains or not, beside others: those are shown to decay if they do, whatever the coordinates.
#[test]
fn motions_at_one_are_split_off() {
    let mut random = Random::new(12);
    let [mut shown, mut stable] = [0, 0];
    for trial in 0..200 {
        let (at_one, other_count) = (1 + trial % 3, 1 + trial % 5);
        let n = at_one + other_count;
        let chained = trial % 2 == 0;
        let denominator = 2 + trial as u64 % 20;
        let map = Matrix::from_fn(n, n, |i, j| match (i < at_one, j < at_one) {
            (true, true) if i == j => Rational::ONE,
            (true, true) if chained && j == i + 1 => rational(1, 1000),
            (false, false) => rational(random.small(4), denominator),
            _ => Rational::ZERO,
        });
        let other_block = Matrix::from_fn(other_count, other_count, |i, j| map[(at_one + i, at_one + j)].clone());
        let exact = stability_of(&other_block, Plane::Discrete).word == Stability::Stable;
        let [change, inverse] = change(&mut random, n);
        let hidden = change.multiply(&map).multiply(&inverse);
        let found = contracts(&hidden, -120.0, at_one);
        assert!(exact || !found, "{at_one} {map:?}");
        assert!(!contracts(&hidden, -120.0, 0), "{at_one} {map:?}");
        shown += usize::from(found);
        stable += usize::from(exact);
    }
    assert!(stable > 60 && 10 * shown > 9 * stable, "{shown} of {stable}");
}

/// How far a map is off counts: what may lie on the border is not shown to contract.
#[test]
fn what_may_reach_the_border_is_not_shown() {
    let map = Matrix::from_fn(1, 1, |_, _| rational(999_999, 1_000_000));
    assert!(contracts(&map, -30.0, 0) && !contracts(&map, -19.0, 0));
    // Three decays in series, all beside the border.
    let slow = Matrix::from_fn(3, 3, |i, j| match (i, j) {
        (i, j) if i == j => rational(999, 1000),
        (i, j) if j == i + 1 => Rational::ONE,
        _ => Rational::ZERO,
    });
    assert!(contracts(&slow, -60.0, 0) && !contracts(&slow, -25.0, 0));
    // As far off as 1e-9, in the corner, three poles meet the border: (1e-3)³.
    let mut moved = slow;
    moved[(2, 0)] = rational(1, 1_000_000_000);
    assert!(!contracts(&moved, -100.0, 0));
    assert!(!contracts(&Matrix::identity(2), -100.0, 0) && contracts(&Matrix::identity(2), -100.0, 2));
}

/// Beside a motion at one, how far a map is off counts in the coupling of both: with 1/4 the second pole of diag(1, 1/2) may be at one, too.
#[test]
fn coupled_motions_may_meet_at_one() {
    let map = Matrix::from_fn(2, 2, |i, j| match (i, j) {
        (0, 0) => Rational::ONE,
        (1, 1) => rational(1, 2),
        _ => Rational::ZERO,
    });
    assert!(contracts(&map, -20.0, 1) && !contracts(&map, -2.0, 1));
    // Two motions in a chain need more: 1/(z - 1)² is larger.
    let chained = Matrix::from_fn(3, 3, |i, j| match (i, j) {
        (i, j) if i == j && i < 2 => Rational::ONE,
        (0, 1) => Rational::ONE,
        (2, 2) => rational(1, 2),
        _ => Rational::ZERO,
    });
    assert!(contracts(&chained, -40.0, 2) && !contracts(&chained, -6.0, 2));
}

//! Tests of `src/parity.rs`.

use super::*;

fn matrix(rows: &[&[i64]]) -> Matrix<Rational> {
    let columns = rows.first().map_or(0, |row| row.len());
    Matrix::from_fn(rows.len(), columns, |i, j| Rational::from(rows[i][j]))
}

/// The circuits of a span are its vectors of least support: compared with the definition, set by set.
#[test]
fn circuits_are_the_least_sets() {
    let mut random = kardan_math::num::Random::new(5);
    for _ in 0..200 {
        let (k, columns) = (2 + random.below(5) as usize, random.below(4) as usize + 1);
        let rows = Matrix::from_fn(k, columns, |_, _| Rational::from(random.small(2)));
        let rank = |set: &[usize]| {
            let part = Matrix::from_fn(set.len(), columns, |i, j| rows[(set[i], j)].clone());
            kardan_math::num::exact_rank(&part)
        };
        let dependent = |set: &[usize]| rank(set) < set.len();
        let minimal = |set: &Vec<usize>| {
            let less = |k: usize| set.iter().copied().filter(|&j| j != k).collect::<Vec<_>>();
            dependent(set) && set.iter().all(|&k| !dependent(&less(k)))
        };
        let expected: Vec<Vec<usize>> = (1..=k).flat_map(|size| subsets(k, size)).filter(minimal).collect();
        let (found, all) = circuits(&left_null(&rows));
        let support = |row: &Vec<Rational>| (0..k).filter(|&j| !row[j].is_zero()).collect::<Vec<_>>();
        let mut found: Vec<Vec<usize>> = found.iter().map(support).collect();
        let mut expected = expected;
        found.sort();
        expected.sort();
        assert!(all && found == expected, "{rows:?}: {found:?}, {expected:?}");
    }
}

/// A mass on an integrator, position and velocity read: p' = v is a relation of order one, and v' = u as well.
#[test]
fn relations_of_a_double_integrator() {
    let system =
        LinearSystem::state_space(matrix(&[&[0, 1], &[0, 0]]), matrix(&[&[0], &[1]]), matrix(&[&[1, 0], &[0, 1]]));
    assert_eq!(static_relations(&system, &[0]).relations, []);
    let found =
        relations(&system, &[ParitySignal::Output(0), ParitySignal::Output(1), ParitySignal::Input(0)], &[0], &[]);
    let of = |terms: &[(ParitySignal, usize, i64)]| {
        Some(Relation { terms: terms.iter().map(|(k, d, x)| (*k, *d, Rational::from(*x))).collect() })
    };
    let [y, v, u] = [ParitySignal::Output(0), ParitySignal::Output(1), ParitySignal::Input(0)];
    let found: Vec<Option<Relation>> = found.into_iter().map(|one| Some(one?.relation)).collect();
    assert_eq!(found[0], of(&[(y, 1, 1), (v, 0, -1)]));
    assert_eq!(found[2], of(&[(v, 1, 1), (u, 0, -1)]));
    // With the input unknown no relation shows its own fault.
    let found = relations(&system, &[ParitySignal::Output(1), ParitySignal::Input(0)], &[], &[0]);
    let found: Vec<Option<Relation>> = found.into_iter().map(|one| Some(one?.relation)).collect();
    assert_eq!(found, [of(&[(y, 1, 1), (v, 0, -1)]), None]);
}

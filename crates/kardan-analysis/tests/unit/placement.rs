//! Tests of `src/placement.rs`.

use super::*;

fn chain() -> LinearSystem {
    // Three decoupled integrators with rates 0, −1, −2.
    let a = Matrix::from_fn(3, 3, |i, j| if i == j { Rational::from(-(i as i64)) } else { Rational::ZERO });
    LinearSystem::state_space(a, Matrix::zeros(3, 0), Matrix::zeros(0, 3))
}

fn candidate(name: &str, cost: f64, column: [i64; 3]) -> Candidate {
    Candidate { name: name.into(), cost, column: column.iter().map(|&x| Rational::from(x)).collect() }
}

#[test]
fn the_smallest_sets_are_found_and_ranked() {
    let places =
        [candidate("first", 1.0, [1, 0, 0]), candidate("others", 1.0, [0, 1, 1]), candidate("weak", 1.0, [0, 1, 2])];
    let scaling = Measure::SmallestEigenvalue(vec![1.0; 3]);
    let found = place(&chain(), Side::Inputs, &places, 1, 1.0, &scaling).unwrap();
    let sets: Vec<String> = found.sets.iter().map(|set| set.places.join("+")).collect();
    assert_eq!(sets.len(), 2);
    assert!(sets.contains(&"first+others".to_string()) && sets.contains(&"first+weak".to_string()));
    assert!(found.exhaustive && found.sets[0].score >= found.sets[1].score && found.sets[1].score > 0.0);
    assert_eq!(found.method, "2 of the 3 places are needed: 2 of the 3 possible sets of 2 are enough (all were tried)");
}

#[test]
fn no_set_is_no_panic() {
    let found =
        place(&chain(), Side::Inputs, &[candidate("first", 1.0, [1, 0, 0])], 1, 1.0, &Measure::Energy(vec![1.0; 3]))
            .unwrap();
    assert!(found.sets.is_empty());
    assert!(place(&chain(), Side::Outputs, &[], 1, 1.0, &Measure::Energy(vec![0.0; 3])).unwrap().sets.is_empty());
}

/// A set is efficient if every set with a better score costs more, by definition.
#[test]
fn efficient_sets_are_those_that_nothing_surpasses() {
    for seed in 0u64..200 {
        let number = |k: u64, of: u64| ((seed * 7919 + k * 104_729) / 13 % of) as f64;
        let mut sets: Vec<PlacedSet> = (0..8)
            .map(|k| PlacedSet { score: number(k, 5), cost: number(k + 11, 4), ..PlacedSet::default() })
            .collect();
        sets.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.cost.total_cmp(&b.cost)));
        mark_efficient(&mut sets);
        for set in &sets {
            let surpassed = sets.iter().any(|rival| {
                (rival.score >= set.score && rival.cost < set.cost)
                    || (rival.score > set.score && rival.cost <= set.cost)
            });
            assert_eq!(set.efficient, !surpassed, "{set:?} of {sets:?}");
        }
    }
}

/// A scalar integrator: W = T, so the energy to reach 2 in T = 4 is 4/4.
#[test]
fn the_energy_of_an_integrator() {
    let a = Matrix::zeros(1, 1);
    let system = LinearSystem::state_space(a, Matrix::zeros(1, 0), Matrix::zeros(0, 1));
    let one = Candidate { name: "u".into(), cost: 3.0, column: vec![Rational::ONE] };
    let found = place(&system, Side::Inputs, &[one], 1, 4.0, &Measure::Energy(vec![2.0])).unwrap();
    assert!((found.sets[0].score - 1.0).abs() < 1e-12);
    assert_eq!(found.sets[0].cost, 3.0);
}

#[test]
fn sets_are_counted() {
    assert_eq!((subsets(5, 2).count(), choices(5, 2), choices(500, 250)), (10, Some(10), None));
}

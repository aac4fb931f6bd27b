//! Distances of plain matrices to a loss of controllability: bounds from both sides, and a warning where the last digit of the
//! data does not tell.

use kardan::analysis::{LinearSystem, Side, distance_of_matrices, structure};
use kardan::num::{Matrix, Rational, Scalar, rational_from_f64};
use kardan::results::{Analysis, MatrixDistance};
use kardan::study;
use serde_json::{Value, json};

fn analysis(system: &Value) -> Analysis {
    let found = study::analyze_state_space(system.to_string().as_bytes(), &Default::default(), &study::Silent);
    found.unwrap_or_else(|diagnostics| panic!("{diagnostics:?}"))
}

fn q(text: &str) -> Rational {
    kardan::units::parse_number(text).unwrap().rational
}

fn floats(rows: &[Vec<f64>]) -> Matrix<Rational> {
    Matrix::from_fn(rows.len(), rows[0].len(), |i, j| rational_from_f64(rows[i][j]).unwrap())
}

/// The system with the change of a proof, exactly `−Yᵀ (Y Yᵀ)⁻¹ [Y A − M Y, Y B]`.
fn changed(system: &LinearSystem, found: &MatrixDistance) -> LinearSystem {
    let exact = |rows: &[Vec<String>]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| q(&rows[i][j]));
    let (y, m) = (exact(&found.proof.rows), exact(&found.proof.action));
    let pseudo_inverse = y.multiply(&y.transpose()).solve(&y).unwrap().transpose();
    let minus = Rational::NEG_ONE;
    let on_a = y.multiply(&system.a).plus(&m.multiply(&y).scale(&minus));
    let a = system.a.plus(&pseudo_inverse.multiply(&on_a).scale(&minus));
    let b = system.b.plus(&pseudo_inverse.multiply(&y.multiply(&system.b)).scale(&minus));
    // What the result says of the change is that change.
    for (rounded, exact, from) in [(&found.change_of_a, &a, &system.a), (&found.change_of_b, &b, &system.b)] {
        for (i, row) in rounded.iter().enumerate() {
            for (j, x) in row.iter().enumerate() {
                assert!((x - Scalar::to_f64(&exact[(i, j)].minus(&from[(i, j)]))).abs() <= 1e-15 * found.upper);
            }
        }
    }
    LinearSystem { a, b, ..system.clone() }
}

/// Of thirty rotated systems with a lost mode, exactly controllable as numbers, all are warned of, with that mode; SLICOT
/// finds the same thirty (`tests/state_space/rotated/`).
#[test]
fn rotated_systems_are_warned_of() {
    let all: Value = serde_json::from_str(include_str!("../state_space/rotated/systems.json")).unwrap();
    let systems = all["systems"].as_array().unwrap();
    assert_eq!(systems.len(), 30);
    for system in systems {
        let found = analysis(&json!({"A": system["A"], "B": system["B"]}));
        let n = system["A"].as_array().unwrap().len();
        assert_eq!(system["reached"].as_u64(), Some(n as u64 - 1), "SLICOT misses a mode");
        // By accident a rotation may be exact; then the verdict says so.
        if !found.structure.controllable() {
            continue;
        }
        let near = found.matrix_distance.unwrap().controllability.unwrap();
        assert!(near.within_data_uncertainty && near.upper < 1e-13 && near.lower <= near.upper, "{near:?}");
        let expected = system["lost"].as_f64().unwrap();
        assert!((near.eigenvalue.re - expected).abs() < 1e-9 && near.eigenvalue.im == 0.0, "{near:?}");
    }
}

/// After the change of the proof exactly that many states are not reached; its size is the upper bound; other values of λ do
/// not come below the lower one.
#[test]
fn both_bounds_hold() {
    let mut seed = 3u64;
    let mut unit = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    for n in [1usize, 2, 3, 4, 6, 9] {
        for inputs in [1, 2] {
            let mut random = |rows: usize, columns: usize| -> Vec<Vec<f64>> {
                (0..rows).map(|_| (0..columns).map(|_| unit()).collect()).collect()
            };
            let (a, b) = (random(n, n), random(n, inputs));
            let system = LinearSystem::state_space(floats(&a), floats(&b), Matrix::zeros(0, n));
            let found = distance_of_matrices(&system, Side::Inputs).unwrap();
            assert!(0.0 < found.lower && found.lower <= found.upper, "{n} {inputs} {found:?}");
            let near = changed(&system, &found);
            let near_structure = structure(&near).unwrap();
            assert_eq!(near_structure.controllable_rank, n - found.proof.rows.len(), "{n} {inputs}");
            let entries = near.a.as_slice().iter().zip(system.a.as_slice());
            let entries = entries.chain(near.b.as_slice().iter().zip(system.b.as_slice()));
            let size = entries.map(|(x, y)| Scalar::to_f64(&x.minus(y)).powi(2)).sum::<f64>().sqrt();
            assert!((size / found.upper - 1.0).abs() < 1e-12, "{size} {}", found.upper);
            // The dual has the same distance.
            let dual = distance_of_matrices(&system.transpose(), Side::Outputs).unwrap();
            assert!((dual.upper / found.upper - 1.0).abs() < 1e-9);
        }
    }
}

/// A chain of n integrators: `[A − λI, b] [A − λI, b]ᴴ` is tridiagonal with `1 + |λ|²` and `λ`, its least eigenvalue
/// `1 + |λ|² − 2 |λ| cos(π/(n + 1))` is least for `|λ| = cos(π/(n + 1))`: the distance is `sin(π/(n + 1))`.
#[test]
fn the_distance_of_a_chain_is_a_sine() {
    for n in [2usize, 3, 7, 20, 40] {
        let a = Matrix::from_fn(n, n, |i, j| if j == i + 1 { Rational::ONE } else { Rational::ZERO });
        let b = Matrix::from_fn(n, 1, |i, _| if i + 1 == n { Rational::ONE } else { Rational::ZERO });
        let found = distance_of_matrices(&LinearSystem::state_space(a, b, Matrix::zeros(0, n)), Side::Inputs).unwrap();
        let sine = (std::f64::consts::PI / (n as f64 + 1.0)).sin();
        assert!((found.upper / sine - 1.0).abs() < 1e-6, "{n}: {} {sine}", found.upper);
        assert!(found.lower <= sine && found.lower >= 0.9 * sine, "{n}: {} {sine}", found.lower);
    }
}

/// A random system with one mode that the input reaches by δ only, turned by a reflection: the distance is at most δ. The
/// bounds are within a factor of two of each other, as far as the rounding of the data lets them.
#[test]
fn a_planted_loss_is_bounded_from_both_sides() {
    let mut seed = 5u64;
    let mut unit = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    for (n, delta) in [(5usize, 1e-2), (5, 1e-6), (12, 1e-4), (24, 1e-3), (12, 1e-9)] {
        let mut a: Vec<Vec<f64>> = (0..n).map(|_| (0..n).map(|_| unit()).collect()).collect();
        let mut b: Vec<Vec<f64>> = (0..n).map(|_| vec![unit()]).collect();
        (0..n - 1).for_each(|j| a[n - 1][j] = 0.0);
        b[n - 1][0] = delta;
        // I − 2 v vᵀ/(vᵀv) on both sides.
        let v: Vec<f64> = (0..n).map(|_| unit()).collect();
        let size = v.iter().map(|x| x * x).sum::<f64>();
        let reflection = |i: usize, j: usize| f64::from(u8::from(i == j)) - 2.0 * v[i] * v[j] / size;
        let product = |one: &dyn Fn(usize, usize) -> f64, other: &dyn Fn(usize, usize) -> f64, width: usize| {
            let entry = |i, j| (0..n).map(|k| one(i, k) * other(k, j)).sum::<f64>();
            (0..n).map(|i| (0..width).map(|j| entry(i, j)).collect()).collect::<Vec<Vec<f64>>>()
        };
        let half = product(&reflection, &|i, j| a[i][j], n);
        let (a, b) = (product(&|i, j| half[i][j], &reflection, n), product(&reflection, &|i, j| b[i][j], 1));
        let system = LinearSystem::state_space(floats(&a), floats(&b), Matrix::zeros(0, n));
        let found = distance_of_matrices(&system, Side::Inputs).unwrap();
        assert!(found.upper <= delta * (1.0 + 1e-6) + 1e-13, "{n} {delta}: {}", found.upper);
        assert!(found.lower >= 0.45 * found.upper, "{n} {delta}: {} {}", found.lower, found.upper);
    }
}

/// One state: `[a − λ, b]` is nearest at λ = a, the distance is |b|.
#[test]
fn the_distance_of_one_state_is_that_of_its_input() {
    let one = |x: &str| Matrix::from_fn(1, 1, |_, _| q(x));
    let system = LinearSystem::state_space(one("-3"), one("0.25"), Matrix::zeros(0, 1));
    let found = distance_of_matrices(&system, Side::Inputs).unwrap();
    assert!(
        (found.upper - 0.25).abs() < 1e-15 && found.lower >= 0.9 * 0.25 && found.eigenvalue.re == -3.0,
        "{found:?}"
    );
}

/// Decimals by hand: half a unit of the last digit; the same numbers as fractions are meant exactly.
#[test]
fn the_last_digit_of_decimals_decides() {
    let near = |b: Value| {
        let found = analysis(&json!({"A": [[0, 1, 0], [-2, -3, 0], [0, 0, -5]], "B": b, "C": [[1, 0, 0.5]]}));
        found.matrix_distance.unwrap().controllability.unwrap()
    };
    assert!(near(json!([0, 1, 0.04])).upper > 0.005 && !near(json!([0, 1, 0.04])).within_data_uncertainty);
    let warned = near(json!([0.0, 1.1, 0.02]));
    assert!(warned.within_data_uncertainty && warned.upper <= warned.data_uncertainty, "{warned:?}");
    assert!((warned.data_uncertainty - 0.05f64.hypot(0.005)).abs() < 1e-12);
    assert!((warned.eigenvalue.re + 5.0).abs() < 1e-2 && warned.states[0].name == "x3");
    let exact = near(json!([0, "11/10", "1/50"]));
    assert!(!exact.within_data_uncertainty && exact.data_uncertainty == 0.0);
}

/// Above the states that are bounded from below the upper bound is still exhibited: a mode that the input reaches by 1e-7 in a system
/// of 120 states is found, and the changed system loses exactly the rows of the proof.
#[test]
fn many_states_are_bounded_from_above() {
    let n = 120;
    let mut seed = 9u64;
    let mut unit = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let mut a: Vec<Vec<f64>> = (0..n).map(|_| (0..n).map(|_| unit()).collect()).collect();
    let mut b: Vec<Vec<f64>> = (0..n).map(|_| vec![unit()]).collect();
    (0..n).filter(|&j| j != 40).for_each(|j| a[40][j] = 0.0);
    b[40][0] = 1e-7;
    let system = LinearSystem::state_space(floats(&a), floats(&b), Matrix::zeros(0, n));
    let found = distance_of_matrices(&system, Side::Inputs).unwrap();
    assert!(found.upper <= 1e-7 * (1.0 + 1e-9) && found.lower == 0.0, "{} {}", found.lower, found.upper);
    let near = changed(&system, &found);
    let near_structure = structure(&near).unwrap();
    assert_eq!(near_structure.controllable_rank, n - found.proof.rows.len());
    // A chain of integrators, whose only eigenvector leads to no minimum: not above ten times the sine of its distance.
    let a = Matrix::from_fn(n, n, |i, j| if j == i + 1 { Rational::ONE } else { Rational::ZERO });
    let b = Matrix::from_fn(n, 1, |i, _| if i + 1 == n { Rational::ONE } else { Rational::ZERO });
    let found = distance_of_matrices(&LinearSystem::state_space(a, b, Matrix::zeros(0, n)), Side::Inputs).unwrap();
    let sine = (std::f64::consts::PI / (n as f64 + 1.0)).sin();
    assert!(found.upper >= sine && found.upper <= 10.0 * sine, "{} {sine}", found.upper);
}

/// Systems times powers of two: both bounds, the change and the eigenvalue are those powers times what they were, exactly, down to 2^-1000 and up to
/// 2^1000, where no square is a number of floating point.
#[test]
fn distances_scale_exactly() {
    let systems = [
        (floats(&[vec![1.0, 0.0], vec![0.0, 2.0]]), floats(&[vec![1.0], vec![1.0]])),
        (
            floats(&[vec![0.1, 1.3, 0.0], vec![0.25, -1.0, 0.5], vec![-1.0, 0.0, 0.75]]),
            floats(&[vec![1.0], vec![0.2], vec![0.0]]),
        ),
        (floats(&[vec![0.0, 1.0], vec![-1.0, 0.0]]), floats(&[vec![0.0, 0.3], vec![1.0, 0.1]])),
        // What is lost is far below the rest: its square is beyond floating point at any scale.
        (floats(&[vec![1.0, 0.0], vec![0.0, 2.0]]), floats(&[vec![1.0], vec![1e-200]])),
    ];
    for (a, b) in systems {
        let n = a.rows();
        let at = |power: i64| {
            let factor = kardan::num::power_of_two(power);
            let system = LinearSystem::state_space(a.scale(&factor), b.scale(&factor), Matrix::zeros(0, n));
            distance_of_matrices(&system, Side::Inputs).unwrap()
        };
        let one = at(0);
        assert!(one.upper > 0.0 && one.lower <= one.upper);
        for power in [-1000, -548, -300, 1, 300, 548, 1000] {
            let found = at(power);
            let factor = 2f64.powi(power as i32);
            let tiny = one.upper < 1e-100 && power < -300;
            if tiny {
                // Beyond the smallest number: not below the true one, and not zero.
                assert!(found.upper > 0.0 && found.lower <= found.upper, "{power}: {found:?}");
                continue;
            }
            assert_eq!((found.upper, found.lower), (one.upper * factor, one.lower * factor), "{power}");
            assert_eq!(found.eigenvalue.re, one.eigenvalue.re * factor, "{power}");
            assert_eq!(found.proof.rows, one.proof.rows);
            for (row, before) in found.change_of_b.iter().zip(&one.change_of_b) {
                assert!(row.iter().zip(before).all(|(x, y)| *x == y * factor), "{power}");
            }
        }
    }
    // The matrices of which the change was said to be of size zero.
    let small = analysis(&json!({"A": [["1e-165", 0], [0, "2e-165"]], "B": [["1e-165"], ["1e-165"]]}));
    let near = small.matrix_distance.unwrap().controllability.unwrap();
    assert!(near.lower > 1e-166 && near.upper < 1e-165 && !near.within_data_uncertainty, "{near:?}");
    let large =
        analysis(&json!({"A": [["1e165", 0], [0, "2e165"]], "B": [["1e165"], ["1e165"]], "C": [["1e165", "3e165"]]}));
    let near = large.matrix_distance.unwrap();
    assert!(
        [near.controllability, near.observability]
            .into_iter()
            .flatten()
            .all(|one| one.lower > 1e164 && one.upper < 1e166)
    );
}

/// A Gramian is quadratic in its inputs: scaled by a power of two its factor is, exactly, and its residual stays.
#[test]
fn gramians_scale_exactly() {
    let a = faer::Mat::from_fn(2, 2, |i, j| [[-1.0, 0.5], [0.25, -3.0]][i][j]);
    let at = |power: i32| {
        kardan::analysis::gramian(&a, &faer::Mat::from_fn(2, 1, |i, _| [1.0, 0.7][i] * 2f64.powi(power)), 2.0).unwrap()
    };
    let one = at(0);
    assert!(one.residual > 0.0 && one.residual < 1e-13);
    for power in [-1000, -548, 548, 1000] {
        let found = at(power);
        assert_eq!(found.residual, one.residual, "{power}");
        let factor = 2f64.powi(power);
        assert!((0..2).all(|i| (0..2).all(|j| found.factor[(i, j)] == one.factor[(i, j)] * factor)), "{power}");
        // What is reached is not called unreachable, however large or small the numbers are.
        let energy = kardan::analysis::transfer_energy(&found, &[1.0, 0.0]);
        assert!(energy.is_finite(), "{power}: {energy}");
        assert!(kardan::analysis::smallest_eigenvalue(&found, &[1.0; 2]).unwrap() > 0.0, "{power}");
    }
}

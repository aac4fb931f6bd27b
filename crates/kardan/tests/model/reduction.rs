//! Reduction in floating point against closed forms and against the defining equations: theorems 4.1 to 4.5 and appendix A
//! of the source, modes, Gramians and null vectors.
//!
//! Random systems have up to six shafts, inertias between 0.1 and 2, stiffnesses between 1 and 30, dampings between 0.01 and
//! 0.5 and constraint coefficients up to 3 in size: matrices with entries up to about 1e3 and a condition below about 1e4.
//! Sums of a few dozen products then carry an error of at most 1e-14 of their largest term, and solutions one of 1e-11.
//! Tolerances that follow from this are not explained again.

use std::collections::BTreeSet;

use crate::common::*;
use faer::{Mat, c64};
use kardan::analysis::{
    BasisError, ConstrainedSystem, Gramian, bases, constraint_forces, eigenvalue_bounds, gram_schmidt, gramian, modes,
    modes_of_pencil, reduction, smallest_eigenvalue, transfer_energy,
};
use kardan::assemble::DirectionalTerm;
use kardan::model;
use kardan::num::{Matrix, Rational, null_vectors, project};
use kardan::results::{
    Basis, Complex, EigenvalueBounds, ElementShare, EnergyKind, Mode, NamedMatrix, ShapePart, StoredShare,
};
use proptest::prelude::*;

// ---- systems ------------------------------------------------------------------------------------------------------

fn directional_term<T>(element: &str, row: &[(usize, Q)], value: T) -> DirectionalTerm<T> {
    let mut row: Vec<(usize, Rational)> =
        row.iter().filter(|(_, x)| *x != int(0)).map(|(j, x)| (*j, x.rational())).collect();
    row.sort_by_key(|(j, _)| *j);
    DirectionalTerm { element: element.to_string(), row, value }
}

fn term(element: &str, row: &[(usize, Q)], value: Q) -> DirectionalTerm<Rational> {
    directional_term(element, row, value.rational())
}

#[derive(Debug, Clone)]
struct Random {
    system: ConstrainedSystem,
    preferred: Vec<usize>,
}

/// Bodies, couplings between them and to the housing, independent constraints.
fn systems(damped: bool) -> impl Strategy<Value = Random> {
    (2usize..7).prop_flat_map(move |n| {
        (
            prop::collection::vec(1i128..20, n), // inertias, tenths
            prop::collection::vec((0..n, 0..n, -2i128..3, 1i128..30, 1i128..50), 1..8), // couplings
            prop::collection::vec(prop::collection::vec(-3i128..4, n), 0..n - 1), // constraints
            Just((0..n).collect::<Vec<_>>()).prop_shuffle(),
        )
            .prop_map(move |(inertias, couplings, constraints, order)| {
                let mut system =
                    ConstrainedSystem { coordinates: (0..n).map(|k| format!("s{k}")).collect(), ..Default::default() };
                for (k, x) in inertias.iter().enumerate() {
                    system.inertias.push(term(&format!("s{k}"), &[(k, int(1))], frac(*x, 10)));
                }
                for (k, (a, b, ratio, stiffness, damping)) in couplings.iter().enumerate() {
                    let row = if a == b { vec![(*a, int(1))] } else { vec![(*a, int(1)), (*b, int(*ratio))] };
                    let name = format!("c{k}");
                    system.springs.push(term(&name, &row, int(*stiffness)));
                    if k % 2 == 0 {
                        system.inertias.push(term(&name, &row, frac(1, 10)));
                    }
                    if damped && k % 3 != 0 {
                        system.dampers.push(term(&name, &row, frac(*damping, 100)));
                    }
                }
                // The shaft that each row begins with stands in no other row: independent.
                let m = constraints.len();
                for (k, coefficients) in constraints.iter().enumerate() {
                    let mut row = vec![(order[k], int(1))];
                    row.extend((m..n).map(|j| (order[j], int(coefficients[j]))));
                    system.constraints.push(directional_term(&format!("g{k}"), &row, ()));
                }
                system.inputs.push(directional_term("first", &[(0, int(1))], ()));
                system.inputs.push(directional_term("between", &[(0, int(-1)), (n - 1, int(2))], ()));
                let preferred = order.into_iter().rev().take(2).collect();
                Random { system, preferred }
            })
    })
}

/// The harmonic drive with a spring, section 6.2; shafts wg, cs, fs, rk as in the source.
fn drive(i: Q, [jwg, jcs, jfs, jrk]: [Q; 4], [dwg, dcs, dfs, drk]: [Q; 4], ssp: Q, dsp: Q) -> ConstrainedSystem {
    let names = ["wg", "cs", "fs", "rk"];
    let bodies = |values: [Q; 4]| -> Vec<_> {
        (0..4).filter(|k| values[*k] != int(0)).map(|k| term(names[k], &[(k, int(1))], values[k])).collect()
    };
    let bar = [(1, int(1)), (3, int(-1))];
    let mut dampers = bodies([dwg, dcs, dfs, drk]);
    dampers.push(term("torsion_bar", &bar, dsp));
    ConstrainedSystem {
        coordinates: names.map(String::from).to_vec(),
        inertias: bodies([jwg, jcs, jfs, jrk]),
        dampers,
        springs: vec![term("torsion_bar", &bar, ssp)],
        loads: Vec::new(),
        constraints: vec![directional_term("hd", &[(0, int(1)), (1, -(i + int(1))), (2, i)], ())],
        inputs: vec![
            directional_term("wg_motor", &[(0, int(1))], ()),
            directional_term("rk_motor", &[(3, int(1))], ()),
        ],
    }
}

/// Table 6.3.
fn table() -> ConstrainedSystem {
    let inertias = [frac(1, 10_000), int(0), frac(1, 20), frac(1, 20)];
    drive(int(50), inertias, [frac(1, 2000), int(0), frac(1, 100), frac(1, 100)], int(100), frac(1, 100))
}

// ---- plain arithmetic ---------------------------------------------------------------------------------------------

type Rows = Vec<Vec<f64>>;

fn times(a: &Rows, b: &Rows) -> Rows {
    let columns = flipped(b);
    a.iter().map(|row| columns.iter().map(|column| dot(row, column)).collect()).collect()
}

fn flipped(a: &Rows) -> Rows {
    (0..a.first().map_or(0, Vec::len)).map(|j| a.iter().map(|row| row[j]).collect()).collect()
}

fn largest(a: &Rows) -> f64 {
    a.iter().flatten().fold(0.0, |max, x| max.max(x.abs()))
}

fn rows_of(m: &Mat<f64>) -> Rows {
    (0..m.nrows()).map(|i| (0..m.ncols()).map(|j| m[(i, j)]).collect()).collect()
}

fn mat(rows: &Rows) -> Mat<f64> {
    Mat::from_fn(rows.len(), rows.first().map_or(0, Vec::len), |i, j| rows[i][j])
}

#[track_caller]
fn near(a: &Rows, b: &Rows, tolerance: f64, what: &str) {
    assert_eq!((a.len(), a[0].len()), (b.len(), b[0].len()), "{what}: shape");
    for (i, (x, y)) in a.iter().zip(b).enumerate() {
        for (j, (x, y)) in x.iter().zip(y).enumerate() {
            assert!((x - y).abs() <= tolerance, "{what} ({i}, {j}): {x} against {y}");
        }
    }
}

/// `Kᵀ M K` over the rationals.
fn congruent(k: &Matrix<Rational>, m: &Matrix<Rational>) -> Rows {
    k.transpose().multiply(m).multiply(k).to_rows()
}

/// Accelerations and multipliers of `[H −Cᵀ; C 0] [q̈; λ] = [f; 0]`, the defining equations (4.36), (4.48).
fn constrained_motion(system: &ConstrainedSystem, force: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (h, c) = (system.inertia_matrix().to_rows(), system.constraint_matrix().to_rows());
    let (n, m) = (h.len(), c.len());
    let entry = |i: usize, j: usize| match (i < n, j < n) {
        (true, true) => h[i][j],
        (true, false) => -c[j - n][i],
        (false, true) => c[i - n][j],
        (false, false) => 0.0,
    };
    let matrix: Rows = (0..n + m).map(|i| (0..n + m).map(|j| entry(i, j)).collect()).collect();
    let right: Vec<f64> = force.iter().copied().chain(vec![0.0; m]).collect();
    let mut motion = solve(&matrix, &right);
    let multipliers = motion.split_off(n);
    (motion, multipliers)
}

// ---- theorem 4.1 --------------------------------------------------------------------------------------------------

proptest! {
    /// C annihilates K, and K is the identity on the coordinates, dense and sparse; the reduced matrices are the congruent
    /// ones (4.39); the reduced equation moves the shafts as the constrained one does.
    #[test]
    fn theorem_4_1(random in systems(true)) {
        let system = &random.system;
        let reduced = reduction(system, &random.preferred);
        let (coordinates, k) = system.explicit_basis(&random.preferred);
        prop_assert_eq!(&reduced.coordinates, &coordinates);
        for constraint in &system.constraints {
            prop_assert_eq!(project(&constraint.row, &reduced.basis), vec![]);
        }
        for (row, &shaft) in coordinates.iter().enumerate() {
            for column in 0..coordinates.len() {
                let expected = if row == column { Rational::ONE } else { Rational::ZERO };
                prop_assert_eq!(&k[(shaft, column)], &expected);
            }
        }
        for (i, row) in reduced.basis.iter().enumerate() {
            for j in 0..coordinates.len() {
                let entry = row.iter().find(|(column, _)| *column == j).map_or(Rational::ZERO, |(_, x)| x.clone());
                prop_assert_eq!(&entry, &k[(i, j)]);
            }
        }
        let scale = 1e-13 * (1.0 + largest(&congruent(&k, &system.stiffness_matrix())));
        near(&rows_of(&reduced.inertia()), &congruent(&k, &system.inertia_matrix()), scale, "H_r");
        near(&rows_of(&reduced.damping()), &congruent(&k, &system.damping_matrix()), scale, "D_r");
        near(&rows_of(&reduced.stiffness()), &congruent(&k, &system.stiffness_matrix()), scale, "S_r");
        let force: Vec<f64> = (0..system.coordinates.len()).map(|i| 1.0 + i as f64).collect();
        let k = k.to_rows();
        let reduced_force: Vec<f64> = flipped(&k).iter().map(|column| dot(column, &force)).collect();
        let acceleration = solve(&rows_of(&reduced.inertia()), &reduced_force);
        let (expected, _) = constrained_motion(system, &force);
        for (row, expected) in k.iter().zip(expected) {
            prop_assert!((dot(row, &acceleration) - expected).abs() < 1e-9);
        }
    }
}

// ---- theorems 4.2 to 4.4 ------------------------------------------------------------------------------------------

/// What Geršgorin and Weyl say of a symmetric matrix; `rounding` covers the eigenvalue solver.
fn check_bounds(bounds: &EigenvalueBounds, rounding: f64) -> Result<(), TestCaseError> {
    let discs = || bounds.centres.iter().zip(&bounds.radii);
    for value in &bounds.eigenvalues {
        let inside = discs().any(|(centre, radius)| (value - centre).abs() <= radius + rounding);
        prop_assert!(inside, "{value} lies in no disc of {bounds:?}");
    }
    prop_assert!(bounds.eigenvalues.is_sorted());
    let mut centres = bounds.centres.clone();
    centres.sort_by(f64::total_cmp);
    let radius = bounds.radii.iter().fold(0.0f64, |max, x| max.max(*x));
    for (value, centre) in bounds.eigenvalues.iter().zip(&centres) {
        prop_assert!((value - centre).abs() <= radius + rounding, "{value} and {centre} in {bounds:?}");
    }
    let (sum, trace): (f64, f64) = (bounds.eigenvalues.iter().sum(), bounds.centres.iter().sum());
    prop_assert!((sum - trace).abs() <= bounds.eigenvalues.len() as f64 * rounding);
    Ok(())
}

fn is_congruent(basis: &Basis, system: &ConstrainedSystem) -> Result<(), TestCaseError> {
    let k = &basis.basis.values;
    let cases = [
        (&basis.inertia, system.inertia_matrix()),
        (&basis.damping, system.damping_matrix()),
        (&basis.stiffness, system.stiffness_matrix()),
    ];
    for (matrix, full) in cases {
        let expected = times(&times(&flipped(k), &full.to_rows()), k);
        near(&matrix.values, &expected, 1e-12 * (1.0 + largest(&expected)), &matrix.title);
    }
    let input = times(&flipped(k), &system.input_matrix().to_rows());
    near(&basis.input.values, &input, 1e-12 * (1.0 + largest(&input)), "F_r");
    let constraint = system.constraint_matrix().to_rows();
    if !constraint.is_empty() {
        prop_assert!(largest(&times(&constraint, k)) < 1e-11, "C K is not zero");
    }
    Ok(())
}

proptest! {
    /// Items 1 to 3 with the bound of the erratum, theorem 4.3, and theorem 4.4: the inertia becomes the identity.
    #[test]
    fn theorems_4_2_to_4_4(random in systems(true)) {
        let all = bases(&random.system, &random.preferred).expect("every shaft has inertia");
        let [chosen, orthogonal, orthonormal] = all.as_slice() else { panic!("three bases") };
        for basis in &all {
            is_congruent(basis, &random.system)?;
            for bounds in &basis.bounds {
                let size = bounds.eigenvalues.iter().fold(1.0f64, |max, x| max.max(x.abs()));
                check_bounds(bounds, 1e-13 * size)?;
            }
        }
        let r = chosen.inertia.columns.len();
        for i in 0..r {
            for j in 0..r {
                let (unit, value) = (f64::from(u8::from(i == j)), orthonormal.inertia.values[i][j]);
                prop_assert!((value - unit).abs() < 1e-13, "H_r ({i}, {j}) = {value}");
                let (row, column) = (&orthogonal.inertia.values[i][i], &orthogonal.inertia.values[j][j]);
                let off = orthogonal.inertia.values[i][j].abs();
                prop_assert!(i == j || off < 1e-13 * (row * column).sqrt(), "({i}, {j}) = {off:e}");
            }
        }
        prop_assert!(orthogonal.orthogonality < 1e-13 && orthonormal.orthogonality < 1e-13);
        // Item 2: the eigenvalues are the squared norms.
        let mut norms: Vec<f64> = orthogonal.bounds[0].centres.clone();
        norms.sort_by(f64::total_cmp);
        for (value, norm) in orthogonal.bounds[0].eigenvalues.iter().zip(norms) {
            prop_assert!((value - norm).abs() < 1e-12 * orthogonal.bounds[0].eigenvalues[r - 1]);
        }
        // Algorithm 1 only adds earlier columns: u_k − b_k is a combination of b_1 … b_{k−1}, and u_1 = b_1.
        let first = |m: &NamedMatrix| m.values.iter().map(|row| row[0]).collect::<Vec<_>>();
        prop_assert_eq!(first(&chosen.basis), first(&orthogonal.basis));
        for k in 0..r {
            for column in k..r {
                // On the coordinates, b is the identity.
                let at = |name: &str| chosen.basis.rows.iter().position(|row| row == name).expect("a shaft");
                let entry = orthogonal.basis.values[at(&chosen.inertia.columns[column])][k];
                let expected = f64::from(u8::from(column == k));
                prop_assert!((entry - expected).abs() < 1e-12, "u{k} at coordinate {column}: {entry}");
            }
        }
    }

    /// A basis with condition 1e7, whose Gram matrix (condition 1e14) no Cholesky factor would survive well.
    #[test]
    fn nearly_dependent_bases_become_orthonormal(
        inertias in prop::collection::vec(0.1f64..10.0, 5),
        directions in prop::collection::vec(-1.0f64..1.0, 15),
    ) {
        let coupling = [0.5, -1.0, 0.25, 0.0, 2.0];
        let h = Mat::from_fn(5, 5, |i, j| f64::from(u8::from(i == j)) * inertias[i] + coupling[i] * coupling[j]);
        let basis = Mat::from_fn(5, 4, |i, j| {
            let noise = if j == 0 { 0.0 } else { 1e-7 * directions[5 * (j - 1) + i] };
            1.0 + i as f64 + noise
        });
        let Ok((orthogonal, orthonormal)) = gram_schmidt(&h, &basis) else {
            // Random directions that are themselves nearly dependent.
            return Ok(());
        };
        let gram = orthonormal.transpose() * &h * &orthonormal;
        for i in 0..4 {
            for j in 0..4 {
                let unit = f64::from(u8::from(i == j));
                // Entries of H up to 15, of e up to about 3: a sum of 25 products, each rounded, below 1e-13.
                prop_assert!((gram[(i, j)] - unit).abs() < 1e-13, "({i}, {j}): {}", gram[(i, j)] - unit);
            }
        }
        // The columns still span the basis: b_k = u_k + Σ ⟨e_i, b_k⟩ e_i, to the rounding of b_k (entries up to 5).
        let shares = orthonormal.transpose() * &h * &basis;
        for k in 0..4 {
            for i in 0..5 {
                let sum: f64 = (0..k).map(|j| orthonormal[(i, j)] * shares[(j, k)]).sum();
                prop_assert!((sum + orthogonal[(i, k)] - basis[(i, k)]).abs() < 1e-13);
            }
        }
    }
}

#[test]
fn gram_schmidt_says_why_it_cannot() {
    let h = mat(&vec![vec![2.0, 0.0, 0.0], vec![0.0, 3.0, 0.0], vec![0.0, 0.0, 0.0]]);
    let basis = mat(&vec![vec![1.0, 1.0, 3.0], vec![0.0, 1.0, 1.0], vec![0.0, 0.0, 0.0]]);
    let Err(BasisError::BasisDependent { column, combination }) = gram_schmidt(&h, &basis) else {
        panic!("the third column is 2 b1 + b2");
    };
    assert_eq!(column, 2);
    let sum = &basis * mat(&combination.iter().map(|x| vec![*x]).collect());
    assert!(combination[2] == 1.0 && sum.norm_max() < 1e-15, "{combination:?}");
    let basis = mat(&vec![vec![1.0, 1.0], vec![0.0, 0.0], vec![0.0, 1.0]]);
    let Err(BasisError::InertiaNotDefinite { direction, energy }) = gram_schmidt(&h, &basis) else {
        panic!("the third shaft is massless");
    };
    near(&vec![direction], &vec![vec![0.0, 0.0, 1.0]], 1e-15, "direction");
    assert!(energy < 1e-30);
    let nan = mat(&vec![vec![f64::NAN]]);
    assert_eq!(gram_schmidt(&nan, &mat(&vec![vec![1.0]])), Err(BasisError::NotFinite { matrix: "inertia" }));
    let massless = ConstrainedSystem { coordinates: vec!["a".into()], ..Default::default() };
    assert!(matches!(bases(&massless, &[]), Err(BasisError::InertiaNotDefinite { .. })));
    let refused = constraint_forces(&massless);
    assert_eq!(refused, Err(BasisError::InertiaNotDefinite { direction: vec![1.0], energy: 0.0 }));
    assert_eq!(modes(&massless, &reduction(&massless, &[])), None);
}

/// Erratum to (4.43): discs 1 and 2 of this Gram matrix, both [1, 3], hold only the eigenvalue 2.
#[test]
fn no_numbering_puts_every_eigenvalue_into_its_disc() {
    let gram = mat(&vec![vec![2.0, 0.0, 1.0], vec![0.0, 2.0, 1.0], vec![1.0, 1.0, 2.0]]);
    let bounds = eigenvalue_bounds("inertia", "kg m^2", &gram).expect("finite");
    let expected = &golden()["analysis"]["counterexample_4_43"];
    for (value, expected) in bounds.eigenvalues.iter().zip(list(&expected["eig"])) {
        // Golden numbers carry an error of some ulp themselves.
        close(*value, expected, 1e-14, "eigenvalue");
    }
    assert_eq!((&bounds.centres, &bounds.radii), (&list(&expected["centre"]), &list(&expected["radius"])));
    check_bounds(&bounds, 1e-14).expect("the corrected bounds hold");
    let fits =
        |value: usize, disc: usize| (bounds.eigenvalues[value] - bounds.centres[disc]).abs() <= bounds.radii[disc];
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    assert!(!orders.iter().any(|order| (0..3).all(|k| fits(order[k], k))));
    // The same matrix as that of a mechanical system with three bodies and two couplings.
    let coupling = |j: usize| term("coupling", &[(j, int(1)), (2, int(1))], int(1));
    let system = ConstrainedSystem {
        coordinates: ["a", "b", "c"].map(String::from).to_vec(),
        inertias: vec![coupling(0), coupling(1), term("a", &[(0, int(1))], int(1)), term("b", &[(1, int(1))], int(1))],
        ..Default::default()
    };
    let basis = &bases(&system, &[]).expect("definite")[0];
    assert_eq!(basis.inertia.values, rows_of(&gram));
}

// ---- theorem 4.5 --------------------------------------------------------------------------------------------------

/// P is a projector with the right range, torques and multipliers are those of the constrained equations of motion.
fn check_constraint_forces(system: &ConstrainedSystem, tolerance: f64) -> Result<(), TestCaseError> {
    let forces = constraint_forces(system).expect("definite on the motions that are possible");
    let p = &forces.projector.values;
    prop_assert!(forces.idempotence_residual < tolerance);
    let (_, k) = system.explicit_basis(&[]);
    prop_assert!(largest(&times(&flipped(p), &k.to_rows())) < tolerance, "PᵀK");
    prop_assert_eq!(forces.rank, system.constraints.len());
    // The rank of a projector is its trace.
    let trace: f64 = (0..p.len()).map(|i| p[i][i]).sum();
    prop_assert!((trace - forces.rank as f64).abs() < tolerance * p.len() as f64);
    for (k, column) in flipped(&system.input_matrix().to_rows()).iter().enumerate() {
        let (acceleration, multipliers) = constrained_motion(system, column);
        for (row, constraint) in forces.input_to_multiplier.values.iter().zip(&multipliers) {
            prop_assert!((row[k] - constraint).abs() < tolerance, "λ = {} against {constraint}", row[k]);
        }
        // τ_c = H q̈ − F τ.
        for (i, row) in system.inertia_matrix().to_rows().iter().enumerate() {
            let torque = dot(row, &acceleration) - column[i];
            let found = forces.input_to_torque.values[i][k];
            prop_assert!((found - torque).abs() < tolerance, "τ_c = {found} against {torque}");
        }
    }
    Ok(())
}

proptest! {
    #[test]
    fn theorem_4_5(random in systems(true)) {
        let system = &random.system;
        check_constraint_forces(system, 1e-9)?;
        // Where H is regular, (4.56) holds as printed.
        if system.constraints.is_empty() {
            return Ok(());
        }
        let (h, c) = (system.inertia_matrix(), system.constraint_matrix());
        let mobility = h.solve(&c.transpose()).expect("every shaft has inertia"); // H⁻¹Cᵀ
        let middle = c.multiply(&mobility).solve(&mobility.transpose()).expect("lemma 4.1");
        let printed = c.transpose().multiply(&middle).to_rows();
        let p = constraint_forces(system).expect("definite").projector.values;
        // Both are exact before they are rounded.
        near(&p, &printed, 1e-15 * (1.0 + largest(&printed)), "P");
    }
}

/// The circular spline of Table 6.3 is massless: H is singular and (4.56) does not exist, P does.
#[test]
fn a_massless_shaft_has_constraint_forces() {
    check_constraint_forces(&table(), 1e-11).expect("the massless shaft is no obstacle");
}

/// Above 24 shafts the computation is in floating point; a chain of 40 with a gear in every five.
#[test]
fn many_shafts_have_constraint_forces_in_floating_point() {
    let system = chain(40);
    // Coefficients of 51 make (CCᵀ) a matrix with a condition of some thousand.
    check_constraint_forces(&system, 1e-9).expect("as exact as the small ones");
    let massless = ConstrainedSystem { inertias: system.inertias[1..].to_vec(), ..system.clone() };
    let Err(BasisError::InertiaNotDefinite { direction, energy }) = constraint_forces(&massless) else {
        panic!("the first body has no inertia and no gear");
    };
    assert!(energy.abs() < 1e-12 && (direction[0].abs() - 1.0).abs() < 1e-12, "{direction:?}");
}

/// Bodies with springs and dampers between neighbours and gears `q_a = 51 q_b − 50 q_c`.
fn chain(n: usize) -> ConstrainedSystem {
    let between = |i: usize| [(i, int(1)), (i + 1, int(-1))];
    let gear = |k: usize| {
        directional_term(&format!("g{k}"), &[(5 * k + 1, int(1)), (5 * k + 2, int(-51)), (5 * k + 4, int(50))], ())
    };
    ConstrainedSystem {
        coordinates: (0..n).map(|i| format!("b{i:04}")).collect(),
        inertias: (0..n).map(|i| term(&format!("b{i:04}"), &[(i, int(1))], frac(1 + i as i128 % 7, 100))).collect(),
        dampers: (1..n - 1).map(|i| term(&format!("s{i}"), &between(i), frac(1 + i as i128 % 5, 50))).collect(),
        springs: (0..n - 1).map(|i| term(&format!("s{i}"), &between(i), int(90 + i as i128 % 11))).collect(),
        loads: Vec::new(),
        constraints: (0..n / 5).map(gear).collect(),
        inputs: vec![directional_term("first", &[(0, int(1))], ()), directional_term("last", &[(n - 1, int(1))], ())],
    }
}

// ---- appendix A ---------------------------------------------------------------------------------------------------

/// (A.1) to (A.8), with the errata to (A.1), (A.8a) (`J_rk` for `J_sp`) and (A.8b), entry (2, 2).
fn check_appendix_a(i: Q, inertias: [Q; 4], dampings: [Q; 4], ssp: Q, dsp: Q) {
    let ([jwg, jcs, jfs, jrk], [dwg, dcs, dfs, drk]) = (inertias, dampings);
    let system = drive(i, inertias, dampings, ssp, dsp);
    // b1 = (0, 0, 0, 1), b2 = (−i, 0, 1, 0), b3 = (i + 1, 1, 0, 0): coordinates rk, fs, cs.
    let all = bases(&system, &[3, 2, 1]).expect("definite");
    let [chosen, orthogonal, orthonormal] = all.as_slice() else { panic!("three bases") };
    let (zero, one) = (int(0), int(1));
    let exact = |rows: &[[Q; 3]]| -> Rows { rows.iter().map(|row| row.map(|x| x.f64()).to_vec()).collect() };
    let b = [[zero, -i, i + one], [zero, zero, one], [zero, one, zero], [one, zero, zero]];
    assert_eq!(chosen.basis.values, exact(&b), "b1, b2, b3");
    let n = jfs + i * i * jwg;
    let u3 = [(i + one) * jfs / n, one, i * (i + one) * jwg / n, zero]; // (A.4)
    let projection = [(-i * -(i * (i + one) * jwg)) / n, zero, -(i * (i + one) * jwg) / n, zero]; // (A.3)
    for k in 0..4 {
        assert_eq!(b[k][2] - projection[k], u3[k], "(A.3), (A.4): u3 = b3 − P b3");
    }
    let u = [[zero, -i, u3[0]], [zero, zero, one], [zero, one, u3[2]], [one, zero, zero]];
    // Relative 1e-13: a dozen roundings; entries are at most 51.
    near(&orthogonal.basis.values, &exact(&u), 51.0 * 1e-13, "u1, u2, u3 (A.1), (A.2), (A.4)");
    let third = jcs + (i + one) * (i + one) * jfs * jwg / n;
    let norms = [jrk, n, third]; // (A.1), (A.2), (A.5)
    let lengths = norms.map(|x| x.f64().sqrt());
    let e: Rows =
        exact(&u).iter().map(|row| row.iter().zip(&lengths).map(|(x, length)| x / length).collect()).collect();
    near(&orthonormal.basis.values, &e, 1e-12 * largest(&e), "e1, e2, e3 (A.1), (A.2), (A.6)");
    // (A.6) as printed: one common root in the denominator.
    let root = (jcs * n * n + (i + one) * (i + one) * jfs * jwg * n).f64().sqrt();
    for (row, entry) in [(i + one) * jfs, n, i * (i + one) * jwg, zero].iter().enumerate() {
        close(orthonormal.basis.values[row][2], entry.f64() / root, 1e-12, "(A.6)");
    }
    // K' = [u2 u3 u1] (A.7).
    let order = [1, 2, 0];
    let reordered =
        |m: &NamedMatrix| -> Rows { order.iter().map(|&a| order.iter().map(|&b| m.values[a][b]).collect()).collect() };
    let h = exact(&[[n, zero, zero], [zero, third, zero], [zero, zero, jrk]]); // (A.8a)
    near(&reordered(&orthogonal.inertia), &h, 1e-13 * largest(&h), "(A.8a)");
    let coupling = i * (i + one) * (jwg * dfs - jfs * dwg) / n;
    let middle = dcs + (i + one) * (i + one) * (i * i * jwg * jwg * dfs + jfs * jfs * dwg) / (n * n) + dsp;
    let d = exact(&[[dfs + i * i * dwg, coupling, zero], [coupling, middle, -dsp], [zero, -dsp, drk + dsp]]); // (A.8b)
    near(&reordered(&orthogonal.damping), &d, 1e-13 * largest(&d), "(A.8b)");
    let printed = dcs + i * i * (i + one) * (i + one) * (jwg * jwg * dfs + jfs * jfs * dwg) / (n * n) + dsp;
    assert!((printed.f64() - d[1][1]).abs() > 0.1 * d[1][1], "erratum: the printed entry is another number");
    let s = exact(&[[zero, zero, zero], [zero, ssp, -ssp], [zero, -ssp, ssp]]); // (A.8c)
    near(&reordered(&orthogonal.stiffness), &s, 1e-13 * largest(&s), "(A.8c)");
    let identity = exact(&[[one, zero, zero], [zero, one, zero], [zero, zero, one]]);
    near(&orthonormal.inertia.values, &identity, 1e-13, "H' = I");
}

#[test]
fn appendix_a() {
    let inertias = [frac(1, 10_000), int(0), frac(1, 20), frac(1, 20)];
    let dampings = [frac(1, 2000), int(0), frac(1, 100), frac(1, 100)];
    check_appendix_a(int(50), inertias, dampings, int(100), frac(1, 100)); // Table 6.3
    let inertias = [frac(1, 8), frac(3, 5), frac(7, 10), frac(2, 3)]; // no two alike, so that a mix-up shows
    let dampings = [frac(1, 9), frac(2, 7), frac(3, 11), frac(1, 6)];
    check_appendix_a(frac(17, 3), inertias, dampings, frac(13, 2), frac(1, 12));
}

/// The built-in model has Table 6.3 and the reduced matrices of the independent reference.
#[test]
fn the_built_in_model_is_that_of_table_6_3() {
    let variant = first(model::builtin("harmonic-drive-spring").expect("built in").source);
    let position = vec![0.0; variant.reduced.degrees_of_freedom()];
    let inputs = ["wg_motor".to_string(), "rk_motor".to_string()];
    let system = ConstrainedSystem::at(&variant.reduced, &position, &BTreeSet::new(), &inputs);
    let number = |name: &str| system.coordinates.iter().position(|shaft| shaft == name).expect("a shaft");
    let reference = &golden()["hds"];
    let reduced = reduction(&system, &["wg", "rk", "fs"].map(number));
    for (matrix, key) in [(reduced.inertia(), "Hr"), (reduced.damping(), "Dr"), (reduced.stiffness(), "Sr")] {
        let expected = rows(&reference[key]);
        near(&rows_of(&matrix), &expected, 1e-14 * largest(&expected), key); // 16 digits
    }
    let all = bases(&system, &["rk", "fs", "cs"].map(number)).expect("definite");
    // Golden number of the erratum to (A.8b), rounded to four digits.
    let damping = all[1].damping.values[2][2];
    assert!((damping - reference["ell_D22_table6_3_Jcs0"].as_f64().expect("a number")).abs() < 5e-6, "{damping}");
    let found = modes(&system, &reduced).expect("regular");
    // The reference has each conjugate root; eigenvalues there and here are off by the rounding of a matrix of norm 5e3
    // against separations above 0.1: below 1e-11.
    let mut expected: Vec<Vec<f64>> = rows(&reference["open_loop_eigs_state6"]);
    expected.retain(|root| root[1] >= 0.0);
    expected.sort_by(|a, b| a[0].hypot(a[1]).total_cmp(&b[0].hypot(b[1])));
    assert_eq!(found.len(), expected.len());
    for (mode, root) in found.iter().zip(&expected) {
        assert!(
            (mode.eigenvalue.re - root[0]).abs() < 1e-11 && (mode.eigenvalue.im - root[1]).abs() < 1e-11,
            "{root:?}"
        );
    }
    assert_eq!(
        (found[0].eigenvalue, found[1].eigenvalue),
        (Complex::default(), Complex::default()),
        "rigid motions are exact"
    );
}

// ---- modes --------------------------------------------------------------------------------------------------------

fn roots(modes: &[Mode]) -> usize {
    modes.iter().map(|mode| if mode.eigenvalue.im > 0.0 { 2 } else { 1 }).sum()
}

/// Residual of `λ²H + λD + S` and of the constraints, shares, and what follows for the sum of all roots.
fn check_modes(system: &ConstrainedSystem, found: &[Mode], tolerance: f64) -> Result<(), TestCaseError> {
    let (coordinates, k) = system.explicit_basis(&[]);
    let matrices = [system.inertia_matrix(), system.damping_matrix(), system.stiffness_matrix()];
    let [h, d, s] = matrices.map(|m| congruent(&k, &m));
    let k = k.to_rows();
    prop_assert_eq!(roots(found), 2 * coordinates.len());
    let mut sum = 0.0;
    for mode in found {
        let value = c64::new(mode.eigenvalue.re, mode.eigenvalue.im);
        prop_assert!(value.im >= 0.0 && (mode.natural_frequency - value.norm()).abs() <= 1e-15 * value.norm());
        let expected = if value.norm() > 0.0 { -value.re / value.norm() } else { 1.0 };
        prop_assert!((mode.damping_ratio - expected).abs() < 1e-15);
        sum += if value.im > 0.0 { 2.0 * value.re } else { value.re };
        let shape: Vec<c64> =
            mode.shape.iter().map(|ShapePart { name: _, value: Complex { re, im } }| c64::new(*re, *im)).collect();
        let size = shape.iter().fold(0.0f64, |max, x| max.max(x.norm()));
        prop_assert!((size - 1.0).abs() < 1e-14 && shape.iter().any(|x| (x - c64::ONE).norm() < 1e-14));
        let v: Vec<c64> = coordinates.iter().map(|&shaft| shape[shaft]).collect();
        for (row, expected) in k.iter().zip(&shape) {
            let motion: c64 = row.iter().zip(&v).map(|(x, v)| v * *x).sum();
            prop_assert!((motion - expected).norm() < tolerance, "the shape breaks a constraint");
        }
        let scale = value.norm_sqr() * largest(&h) + value.norm() * largest(&d) + largest(&s);
        for i in 0..v.len() {
            let pencil = |j: usize| value * value * h[i][j] + value * d[i][j] + s[i][j];
            let residual: c64 = (0..v.len()).map(|j| pencil(j) * v[j]).sum();
            prop_assert!(residual.norm() <= tolerance * scale, "residual {residual} of {value} in {scale}");
        }
        let stored: f64 = mode.stored.iter().map(|StoredShare { share, .. }| share).sum();
        prop_assert!(mode.stored.is_empty() || (stored - 1.0).abs() < 1e-13, "stored {stored}");
        let negative = system.springs.iter().any(|spring| spring.value < Rational::ZERO);
        prop_assert!(negative || !mode.stored.is_empty(), "no energy");
        let dissipated: f64 = mode.dissipated.iter().map(|ElementShare { share, .. }| share).sum();
        prop_assert!(mode.dissipated.is_empty() || (dissipated - 1.0).abs() < 1e-13, "lost {dissipated}");
    }
    prop_assert!(found.is_sorted_by(|a, b| a.natural_frequency <= b.natural_frequency));
    // The sum of all roots is −tr H⁻¹D.
    let columns = flipped(&d);
    let trace: f64 = (0..columns.len()).map(|j| solve(&h, &columns[j])[j]).sum();
    prop_assert!((sum + trace).abs() < 1e-9 * (1.0 + trace.abs()), "{sum} against {trace}");
    Ok(())
}

fn share(mode: &Mode, kind: EnergyKind) -> f64 {
    mode.stored.iter().filter(|StoredShare { energy: of, .. }| *of == kind).map(|StoredShare { share, .. }| share).sum()
}

proptest! {
    /// Residual 1e-10: rounding of 1e-15 times the condition of K and H, which the change of coordinates brings in.
    #[test]
    fn modes_solve_the_quadratic_eigenproblem(random in systems(true)) {
        let found = modes(&random.system, &reduction(&random.system, &random.preferred)).expect("regular");
        check_modes(&random.system, &found, 1e-10)?;
    }

    /// Without damping nothing decays, and kinetic and potential energy are equal on average.
    #[test]
    fn undamped_modes_swing(random in systems(false)) {
        let found = modes(&random.system, &reduction(&random.system, &random.preferred)).expect("regular");
        check_modes(&random.system, &found, 1e-10)?;
        for mode in &found {
            prop_assert_eq!(mode.eigenvalue.re, 0.0);
            prop_assert!(mode.dissipated.is_empty());
            // ω² is off by the rounding of the largest ω², which is at most some 1e4 times the smallest.
            let potential = if mode.eigenvalue.im > 0.0 { 0.5 } else { 0.0 };
            prop_assert!((share(mode, EnergyKind::Potential) - potential).abs() < 1e-9, "{mode:?}");
        }
    }

    /// As a plain state space, where free motions stay double roots: these vectors need the check of their residual.
    #[test]
    fn the_pencil_has_the_same_roots(random in systems(true)) {
        let reduced = reduction(&random.system, &random.preferred);
        let (a, _) = reduced.state_space().expect("definite");
        let n = a.nrows();
        let states: Vec<String> = (0..n).map(|k| format!("x{k}")).collect();
        let e = Matrix::from_fn(n, n, |i, j| if i == j { 2.0 } else { 0.0 });
        let found = modes_of_pencil(&states, &e, &Matrix::from_fn(n, n, |i, j| 2.0 * a[(i, j)])).expect("regular");
        prop_assert_eq!(roots(&found), n);
        for mode in &found {
            let value = c64::new(mode.eigenvalue.re, mode.eigenvalue.im);
            let v: Vec<c64> = mode.shape.iter().map(|ShapePart { name: _, value: Complex { re, im } }| c64::new(*re, *im)).collect();
            for i in 0..n {
                let residual: c64 = (0..n).map(|j| v[j] * a[(i, j)]).sum::<c64>() - value * v[i];
                // Relative to the size of A; balancing bounds the error of each entry in its own scale, up to 1e4 apart.
                prop_assert!(residual.norm() < 1e-9 * (1.0 + a.norm_max()), "residual {residual} of {value}");
            }
        }
        let sum: f64 = found.iter().map(|m| if m.eigenvalue.im > 0.0 { 2.0 * m.eigenvalue.re } else { m.eigenvalue.re }).sum();
        let trace: f64 = (0..n).map(|i| a[(i, i)]).sum();
        prop_assert!((sum - trace).abs() < 1e-9 * (1.0 + a.norm_max()));
    }
}

/// Appendix B: `s (2s + 1) (2s² + 3s + 8)` for J = 1, s = 2, d = 1/2; both bodies turn together in the first two modes.
#[test]
fn two_bodies() {
    let bodies = |value: Q| -> Vec<_> { (0..2).map(|k| term(&format!("body{k}"), &[(k, int(1))], value)).collect() };
    let between = [(0, int(1)), (1, int(-1))];
    let mut system = ConstrainedSystem {
        coordinates: vec!["body0".into(), "body1".into()],
        inertias: bodies(int(1)),
        dampers: bodies(frac(1, 2)),
        springs: vec![term("spring", &between, int(2))],
        ..Default::default()
    };
    system.dampers.push(term("spring", &between, frac(1, 2)));
    let found = modes(&system, &reduction(&system, &[])).expect("regular");
    check_modes(&system, &found, 1e-14).expect("two bodies");
    let expected = [(0.0, 0.0), (-0.5, 0.0), (-0.75, 55.0f64.sqrt() / 4.0)];
    for (mode, root) in found.iter().zip(expected) {
        close(mode.eigenvalue.re, root.0, 1e-14, "real part");
        close(mode.eigenvalue.im, root.1, 1e-14, "imaginary part");
    }
    assert_eq!(
        found[0].shape,
        ["body0", "body1"].map(|name| ShapePart { name: name.into(), value: Complex::new(1.0, 0.0) })
    );
    assert!(found[0].dissipated.is_empty() && found[0].stored.len() == 2);
    // Shares of the pair, v = (1, −1), |λ|² = 4: kinetic ½·4·(1 + 1) = 4, potential ½·2·4 = 4; loss 4·(½ + ½ + ½·4) = 12.
    let names: Vec<&str> = found[2].dissipated.iter().map(|ElementShare { element: name, .. }| name.as_str()).collect();
    assert_eq!(names, ["body0", "body1", "spring"]);
    for (ElementShare { share, .. }, expected) in found[2].dissipated.iter().zip([1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0]) {
        close(*share, expected, 1e-14, "loss");
    }
    for (StoredShare { share, .. }, expected) in found[2].stored.iter().zip([0.25, 0.25, 0.5]) {
        close(*share, expected, 1e-14, "stored");
    }
}

/// A periodic chain has clusters of close eigenvalues, for some of which the solver returns wrong vectors.
#[test]
fn close_eigenvalues_have_right_shapes() {
    let n = 120;
    let inertia = |i: usize| if i.is_multiple_of(4) { int(1) } else { frac(1, 100) };
    let between = |i: usize| [(i, int(1)), (i + 1, int(-1))];
    let system = ConstrainedSystem {
        inertias: (0..n).map(|i| term(&format!("b{i:04}"), &[(i, int(1))], inertia(i))).collect(),
        springs: (0..n - 1).map(|i| term(&format!("s{i}"), &between(i), int(100))).collect(),
        dampers: (0..n - 1).map(|i| term(&format!("s{i}"), &between(i), frac(1 + (i % 3) as i128, 50))).collect(),
        constraints: Vec::new(),
        ..chain(n)
    };
    let found = modes(&system, &reduction(&system, &[])).expect("regular");
    check_modes(&system, &found, 1e-10).expect("the chain");
}

/// A free motion is a double root 0 with one eigenvector; rounding would move it by the root of the rounding unit.
#[test]
fn free_motions_are_exact_double_roots() {
    let system = chain(40); // no damper on the first spring
    let found = modes(&system, &reduction(&system, &[])).expect("regular");
    check_modes(&system, &found, 1e-10).expect("the chain");
    assert_eq!((found[0].eigenvalue, found[1].eigenvalue), (Complex::default(), Complex::default()));
    assert!(found[2].natural_frequency > 1.0, "{}", found[2].natural_frequency);
    assert!(
        found[0].shape.iter().all(|ShapePart { name: _, value: Complex { re, im } }| (*re, *im) == (1.0, 0.0)),
        "all turn together, exactly"
    );
    assert!((share(&found[0], EnergyKind::Kinetic) - 1.0).abs() < 1e-14);
    // Nothing at all but inertia.
    let free = ConstrainedSystem { dampers: vec![], springs: vec![], ..chain(10) };
    let found = modes(&free, &reduction(&free, &[])).expect("regular");
    assert!(found.len() == 16 && found.iter().all(|mode| mode.eigenvalue == Complex::default()));
}

/// A negative spring that cancels another: the zero is not split off, but is found and gives no NaN.
#[test]
fn negative_coefficients_are_allowed() {
    for damped in [false, true] {
        let spring = |k: usize, value: i128| term("s", &[(k, int(1))], int(value));
        let mut system = ConstrainedSystem {
            coordinates: vec!["a".into(), "b".into()],
            inertias: (0..2).map(|k| term("j", &[(k, int(1))], int(1))).collect(),
            springs: vec![spring(0, 2), spring(0, -2), spring(1, -4)],
            ..Default::default()
        };
        if damped {
            system.dampers.push(term("d", &[(1, int(1))], int(3)));
        }
        let found = modes(&system, &reduction(&system, &[])).expect("regular");
        check_modes(&system, &found, 1e-12).expect("two shafts");
        // λ² + 3 λ − 4 = (λ + 4)(λ − 1), or λ² − 4.
        let expected = if damped { [1.0, -4.0] } else { [-2.0, 2.0] };
        for (mode, root) in found[2..].iter().zip(expected) {
            close(mode.eigenvalue.re, root, 1e-14, "real root");
        }
        assert!(found[0].natural_frequency < 1e-14 && found[1].natural_frequency < 1e-14);
    }
}

/// A nilpotent chain of 60 integrators: back substitution overflows, the answer must not.
#[test]
fn long_jordan_blocks_have_finite_shapes() {
    let n = 60;
    let states: Vec<String> = (0..n).map(|k| format!("x{k}")).collect();
    let a = Matrix::from_fn(n, n, |i, j| if j == i + 1 { 1.0 } else { 0.0 });
    let found = modes_of_pencil(&states, &Matrix::identity(n), &a).expect("finite");
    assert_eq!(roots(&found), n);
    for mode in &found {
        assert!(
            mode.shape.iter().all(|ShapePart { name: _, value: Complex { re, im } }| re.is_finite() && im.is_finite())
        );
        assert!(mode.shape[0].value.re == 1.0 && mode.natural_frequency == 0.0, "{:?}", mode.shape);
    }
    assert_eq!(modes_of_pencil(&states[..1], &Matrix::zeros(1, 1), &Matrix::identity(1)), None, "E is singular");
}

// ---- Gramian ------------------------------------------------------------------------------------------------------

#[track_caller]
fn the_gramian(a: &Rows, b: &Rows, horizon: f64) -> Gramian {
    gramian(&mat(a), &mat(b), horizon).expect("finite")
}

proptest! {
    /// `W = [T³/3, T²/2; T²/2, T]`; from rest to rest over the angle 1: `12/T³`.
    #[test]
    fn double_integrator(horizon in 0.01f64..1000.0) {
        let t = horizon;
        let w = the_gramian(&vec![vec![0.0, 1.0], vec![0.0, 0.0]], &vec![vec![0.0], vec![1.0]], t);
        let expected = [[t.powi(3) / 3.0, t * t / 2.0], [t * t / 2.0, t]];
        for i in 0..2 {
            for j in 0..2 {
                // Each of up to 20 doublings rounds a few times.
                prop_assert!((w.matrix()[(i, j)] / expected[i][j] - 1.0).abs() < 1e-13);
            }
        }
        prop_assert!(w.residual < 1e-14);
        let energy = transfer_energy(&w, &[1.0, 0.0]);
        prop_assert!((energy * t.powi(3) / 12.0 - 1.0).abs() < 1e-12, "{energy}");
        // States in units of T^1.5 and T^0.5: [1/3, 1/2; 1/2, 1] has the eigenvalues (4 ± √13)/6.
        let smallest = smallest_eigenvalue(&w, &[t.powf(-1.5), t.powf(-0.5)]).expect("finite");
        prop_assert!((smallest - (4.0 - 13.0f64.sqrt()) / 6.0).abs() < 1e-13, "{smallest}");
    }

    /// `W = b² (e^{2aT} − 1) / 2a`, from very stable to unstable.
    #[test]
    fn scalar(a in -1e6f64..20.0, slow in -20.0f64..20.0, b in 0.1f64..10.0, horizon in 0.1f64..2.0) {
        for a in [a, slow] {
            let w = the_gramian(&vec![vec![a]], &vec![vec![b]], horizon);
            let expected = b * b * (2.0 * a * horizon).exp_m1() / (2.0 * a);
            // k squarings multiply the rounding of e^{ah} by 2^k = 2|a|T, which shows where e^{aT} matters: |a|T < 40.
            prop_assert!((w.matrix()[(0, 0)] / expected - 1.0).abs() < 1e-13, "{} {expected}", w.matrix()[(0, 0)]);
            prop_assert!((transfer_energy(&w, &[2.0]) * expected / 4.0 - 1.0).abs() < 1e-12);
            prop_assert!(w.residual < 1e-13);
        }
    }

    /// Against Simpson's rule on transition matrices of its own, and `A W + W Aᵀ + B Bᵀ = e^{AT} B Bᵀ e^{AᵀT}`.
    #[test]
    fn any_system(entries in prop::collection::vec(-2.0f64..2.0, 16), input in prop::collection::vec(-1.0f64..1.0, 8)) {
        let a: Rows = entries.chunks(4).map(|row| row.to_vec()).collect();
        let b: Rows = input.chunks(2).map(|row| row.to_vec()).collect();
        let (steps, horizon) = (400, 1.0);
        let h = horizon / steps as f64;
        let unit: Rows = (0..4).map(|i| (0..4).map(|j| f64::from(u8::from(i == j))).collect()).collect();
        let sum = |x: &Rows, y: &Rows, factor: f64| -> Rows {
            x.iter().zip(y).map(|(x, y)| x.iter().zip(y).map(|(x, y)| x + factor * y).collect()).collect()
        };
        // ‖Ah‖ ≤ 0.02: the tenth term is below 1e-23.
        let step = (1..=10).rev().fold(unit.clone(), |inner, k| sum(&unit, &times(&a, &inner), h / k as f64));
        let mut state = b.clone();
        let mut expected = vec![vec![0.0; 4]; 4];
        for k in 0..=steps {
            let weight = if k == 0 || k == steps { 1.0 } else if k % 2 == 1 { 4.0 } else { 2.0 };
            expected = sum(&expected, &times(&state, &flipped(&state)), weight * h / 3.0);
            if k < steps {
                state = times(&step, &state);
            }
        }
        let w = the_gramian(&a, &b, horizon);
        let matrix = rows_of(&w.matrix());
        // Simpson: h⁴/180 times the fourth derivative, (2‖A‖)⁴ W ≤ 16⁴ W: 2e-11 · 16⁴/180 · … below 1e-7 of W.
        near(&matrix, &expected, 1e-7 * largest(&expected), "W");
        let half = times(&a, &matrix);
        let lyapunov = sum(&sum(&half, &flipped(&half), 1.0), &times(&b, &flipped(&b)), 1.0);
        let end = times(&state, &flipped(&state)); // e^{AT} B B' e^{A'T}, 400 steps of rounding
        near(&lyapunov, &end, 1e-11 * (1.0 + largest(&matrix) + largest(&end)), "identity");
        prop_assert!(w.residual < 1e-14, "{}", w.residual);
    }
}

/// Fast and slow at once: `W_ij = b_i b_j (e^{(λi + λj) T} − 1) / (λi + λj)`.
#[test]
fn both_stiff_and_unstable() {
    let rates = [-1e5, -1.0, 3.0];
    let a: Rows = (0..3).map(|i| (0..3).map(|j| if i == j { rates[i] } else { 0.0 }).collect()).collect();
    let w = the_gramian(&a, &vec![vec![1.0], vec![2.0], vec![3.0]], 2.0);
    for i in 0..3 {
        for j in 0..3 {
            let sum = rates[i] + rates[j];
            let expected = (i + 1) as f64 * (j + 1) as f64 * (sum * 2.0).exp_m1() / sum;
            // The fast rate dictates h: 18 doublings multiply the rounding of the slow transitions, 2^18 · 1e-16.
            assert!((w.matrix()[(i, j)] / expected - 1.0).abs() < 1e-10, "({i}, {j})");
        }
    }
    assert!(w.residual < 1e-13);
    assert!(gramian(&mat(&vec![vec![1e4]]), &mat(&vec![vec![1.0]]), 1.0).is_none(), "e^10000 is not finite");
    assert!(gramian(&mat(&vec![vec![1.0]]), &mat(&vec![vec![1.0]]), 0.0).is_none());
}

#[test]
fn what_cannot_be_reached_costs_infinite_energy() {
    let twins = vec![vec![-1.0, 0.0], vec![0.0, -1.0]];
    let w = the_gramian(&twins, &vec![vec![1.0], vec![1.0]], 1.0);
    assert_eq!(transfer_energy(&w, &[1.0, -1.0]), f64::INFINITY);
    let expected = 2.0 / (1.0 - (-2.0f64).exp());
    close(transfer_energy(&w, &[1.0, 1.0]), expected, 1e-13, "energy");
    // Rounding of the factor, squared.
    assert!(smallest_eigenvalue(&w, &[1.0, 1.0]).expect("finite") < 1e-30);
    let w = the_gramian(&twins, &vec![vec![1.0], vec![0.0]], 1.0);
    assert_eq!(transfer_energy(&w, &[0.0, 1.0]), f64::INFINITY);
    assert_eq!(transfer_energy(&w, &[0.0, 0.0]), 0.0);
    close(transfer_energy(&w, &[1.0, 0.0]), expected, 1e-13, "energy");
    // Each input reaches one of them; together they reach all.
    let other = the_gramian(&twins, &vec![vec![0.0], vec![1.0]], 1.0);
    let both = Gramian::sum(&[&w, &other]).expect("alike");
    close(transfer_energy(&both, &[1.0, 1.0]), 2.0 * expected, 1e-13, "energy");
    close(smallest_eigenvalue(&both, &[1.0, 2.0]).expect("finite"), 1.0 / expected, 1e-13, "eigenvalue");
    assert!(Gramian::sum(&[]).is_none());
}

/// The Gramian of the harmonic drive with a spring: nothing but the identity to compare with, over six orders of magnitude.
#[test]
fn gramian_of_the_harmonic_drive() {
    let (a, b) = reduction(&table(), &[0, 3, 2]).state_space().expect("definite");
    for horizon in [1e-3, 1.0, 30.0] {
        let w = gramian(&a, &b, horizon).expect("finite");
        // Rounding in 18 doublings at most.
        assert!(w.residual < 1e-12, "{}", w.residual);
        let energy = transfer_energy(&w, &[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        assert!(energy.is_finite() && energy > 0.0, "both motors reach every state");
    }
}

// ---- null vectors -------------------------------------------------------------------------------------------------

proptest! {
    /// A 5 × 5 matrix of rank 3 has two null vectors, orthonormal.
    #[test]
    fn null_vectors_of_rank_3_matrices(
        left in prop::collection::vec(-1.0f64..1.0, 30),
        right in prop::collection::vec(-1.0f64..1.0, 30)
    ) {
        let matrix = Mat::from_fn(5, 5, |i, j| {
            (0..3)
                .map(|k| c64::new(left[6 * i + 2 * k], left[6 * i + 2 * k + 1]) * c64::new(right[6 * j + 2 * k], right[6 * j + 2 * k + 1]))
                .sum::<c64>()
        });
        let null = null_vectors(matrix.as_ref(), 2).expect("finite");
        prop_assert_eq!(null.vectors.len(), 2);
        for vector in &null.vectors {
            for i in 0..5 {
                let image: c64 = (0..5).map(|j| matrix[(i, j)] * c64::new(vector[j].0, vector[j].1)).sum();
                prop_assert!(image.norm() < 1e-14); // a few ulp of a matrix of norm at most 30
            }
        }
        for (a, first) in null.vectors.iter().enumerate() {
            for (b, second) in null.vectors.iter().enumerate() {
                let inner: c64 = first.iter().zip(second).map(|(x, y)| c64::new(x.0, -x.1) * c64::new(y.0, y.1)).sum();
                prop_assert!((inner - f64::from(u8::from(a == b))).norm() < 1e-14);
            }
        }
        prop_assert!(null.residuals.is_sorted() && null.residuals[1] < 1e-14 && null.next >= null.residuals[1]);
    }
}

#[test]
fn null_vectors_of_wide_and_empty_requests() {
    let row = Mat::from_fn(1, 3, |_, j| c64::new(j as f64, 0.0));
    let null = null_vectors(row.as_ref(), 2).expect("finite");
    assert!(null.residuals == [0.0, 0.0] && (null.next - 5.0f64.sqrt()).abs() < 1e-15);
    assert_eq!(null_vectors(row.as_ref(), 3).expect("finite").next, f64::INFINITY);
    assert!(null_vectors(row.as_ref(), 4).is_none());
    assert!(null_vectors(row.as_ref(), 0).expect("finite").vectors.is_empty());
    assert!(null_vectors(Mat::from_fn(1, 1, |_, _| c64::new(f64::NAN, 0.0)).as_ref(), 1).is_none());
}

/// The machine code of all built-in models has the bits of their lists of operations.
#[test]
fn machine_code_has_the_bits_of_the_plan() {
    use kardan::reduce::Dynamics;
    use kardan_native::Native;
    for builtin in kardan::model::BUILTIN {
        let (prepared, _) = kardan::study::prepare(builtin.source);
        for variant in &prepared.variants {
            let (dynamics, _) = Dynamics::new(&variant.reduced);
            let plan = &dynamics.plan().plan;
            let Some(native) = Native::<f64>::new(&plan.block()) else { continue };
            let (mut one, mut other) = (plan.memory(), plan.memory());
            for sample in 0..20 {
                let number = |k: usize| ((sample * 31 + k * 17) as f64 * 0.7).sin() * (1 + 20 * sample) as f64;
                for (k, input) in (0..plan.inputs.len()).enumerate() {
                    (one[input], other[input]) = (number(k), number(k));
                }
                assert!(plan.block().evaluate(&mut one) && native.evaluate(&mut other));
                let bits = |storage: &[f64]| storage.iter().map(|x| x.to_bits()).collect::<Vec<u64>>();
                assert_eq!(bits(&one), bits(&other), "{} {}", builtin.name, variant.name);
            }
        }
    }
}

/// The plan of the motion against the kinematics evaluated shaft by shaft and against the block of the runtime.
#[test]
fn plans_of_motion_agree_with_other_ways() {
    use kardan::reduce::{Dynamics, Kinematics, MechanismData};
    let mut compared = 0;
    for builtin in kardan::model::BUILTIN {
        let (prepared, _) = kardan::study::prepare(builtin.source);
        for variant in &prepared.variants {
            let reduced = &variant.reduced;
            // What is evaluated shaft by shaft knows no time, and rows that are kept, and of brakes and locks, stand among those of friction.
            let equations = &reduced.equations;
            if !(equations.moving.is_empty()
                && equations.multiplier_constraints.is_empty()
                && equations.unilaterals.is_empty())
            {
                continue;
            }
            let r = reduced.degrees_of_freedom();
            let (dynamics, mut work) = Dynamics::new(reduced);
            let mut kinematics = Kinematics::new(reduced);
            for sample in 0..5 {
                let number = |k: usize| ((sample * 31 + k * 17) as f64 * 0.7).sin() * (1 + 20 * sample) as f64;
                let position: Vec<f64> = (0..r).map(number).collect();
                let speed: Vec<f64> = (0..r).map(|k| number(k + 5)).collect();
                assert!(dynamics.update(&position, &speed, &mut work));
                kinematics.update(&position, &speed);
                let near = |what: &str, found: &[f64], expected: &[f64]| {
                    assert_eq!(found.len(), expected.len(), "{} {}: {what}", builtin.name, variant.name);
                    let size = expected.iter().fold(1e-300, |size: f64, x| size.max(x.abs()));
                    for (k, (a, b)) in found.iter().zip(expected).enumerate() {
                        let name = &variant.name;
                        assert!((a - b).abs() <= 1e-12 * size, "{} {name}: {what} {k}: {a} {b}", builtin.name);
                    }
                };
                near("angle", &work.kinematics.angles, &kinematics.angles);
                near("speed", &work.kinematics.speeds, &kinematics.speeds);
                near("basis", &work.kinematics.basis, &kinematics.basis);
                near("bias", &work.kinematics.bias, &kinematics.bias);
                let row_dot = |row: &[(usize, f64)]| -> Vec<f64> {
                    let entry = |i: usize| row.iter().map(|(shaft, c)| c * kinematics.row(*shaft)[i]).sum();
                    (0..r).map(entry).collect()
                };
                let frictions: Vec<f64> =
                    reduced.equations.frictions.iter().flat_map(|term| row_dot(&term.row_f64())).collect();
                near("friction", &work.friction_rows, &frictions);
                let inputs: Vec<f64> =
                    reduced.equations.inputs.iter().flat_map(|term| row_dot(&term.row_f64())).collect();
                near("input", &work.input_rows, &inputs);
                let data = MechanismData::new(reduced);
                let mut storage = vec![0.0; data.block().memory()];
                let now = data.block().evaluate(&position, &speed, &mut storage).unwrap();
                near("inertia", &work.inertia, now.inertia);
                near("passive", &work.passive, now.passive);
                compared += 1;
            }
        }
    }
    assert!(compared > 60, "{compared}");
}

/// The exact linear model is the derivative of the equations of motion, with damping −∂f/∂q̇ and, where no spring is twisted, stiffness −∂f/∂q:
/// over the rationals where all is rational, else to rounding.
#[test]
fn the_linear_model_is_the_derivative_of_the_motion() {
    use kardan::expr::{Floating, Rationals, lower};
    use kardan::num::rational_from_f64;
    use kardan::reduce::{Motion, linearise};
    let (mut exact, mut rounded) = (0, 0);
    for builtin in kardan::model::BUILTIN {
        let (prepared, _) = kardan::study::prepare(builtin.source);
        for variant in &prepared.variants {
            let reduced = &variant.reduced;
            let r = reduced.degrees_of_freedom();
            for angle in [0.0, 0.375] {
                let position = vec![angle; r];
                let linear = linearise(reduced, &position);
                let mut motion = Motion::new(reduced);
                let mut expected = Vec::new();
                for (&(i, j), entry) in &motion.inertia.clone() {
                    expected.push(("inertia", linear.inertia[(i, j)].clone(), *entry));
                }
                for (k, row) in motion.inputs.clone().iter().enumerate() {
                    expected.extend(row.iter().map(|(i, entry)| ("input", linear.input[(*i, k)].clone(), *entry)));
                }
                for (j, what) in (0..2 * r).map(|j| (j, if j < r { "stiffness" } else { "damping" })) {
                    let slopes = motion.graph.derivatives(&motion.passive.clone(), motion.symbols[j]);
                    for (i, slope) in slopes.into_iter().enumerate() {
                        let slope = motion.graph.negate(slope);
                        match what {
                            // Springs count as relaxed; those that are twisted at a turned joint pull by its curve too.
                            "stiffness" if angle != 0.0 => {}
                            "stiffness" => expected.push((what, linear.stiffness[(i, j)].clone(), slope)),
                            _ => expected.push((what, linear.damping[(i, j - r)].clone(), slope)),
                        }
                    }
                }
                let exprs: Vec<_> = expected.iter().map(|(.., expr)| *expr).collect();
                let place = |symbol| motion.symbols.iter().position(|other| *other == symbol);
                let number = |symbol| place(symbol).filter(|k| *k < r).map_or(0.0, |_| angle);
                let fractions =
                    lower(&motion.graph, &exprs, &mut Rationals, |symbol| rational_from_f64(number(symbol)));
                let numbers = lower(&motion.graph, &exprs, &mut Floating::<f64>::default(), number);
                let size = |what: &str| {
                    let of = expected.iter().filter(|(other, ..)| *other == what);
                    of.fold(0.0f64, |size, (_, value, _)| size.max(value.to_f64().value().abs()))
                };
                for ((what, value, _), (fraction, number)) in expected.iter().zip(fractions.iter().zip(&numbers)) {
                    let place = || format!("{} {} at {angle}: {what}", builtin.name, variant.name);
                    match fraction {
                        Some(fraction) => {
                            exact += 1;
                            assert_eq!(fraction, value, "{}", place());
                        }
                        None => {
                            rounded += 1;
                            let off = (number - value.to_f64().value()).abs();
                            assert!(off <= 1e-13 * size(what), "{}: {off:e}", place());
                        }
                    }
                }
            }
        }
    }
    assert!(exact > 500 && rounded > 20, "{exact} exact, {rounded} rounded");
}

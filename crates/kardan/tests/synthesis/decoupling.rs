//! Gilbert's theory of decoupling against exact golden values, random systems whose structure is known because they are
//! built from it, and the misprints of the source.
//!
//! Origin of the golden numbers: an independent reference in Python (SymPy exact arithmetic), see `tests/runs/golden.rs`.

use std::collections::BTreeSet;

use crate::canonical_check::check_canonical;
use crate::common::{self, golden, list, rows};
use kardan::analysis::LinearSystem;
use kardan::num::{Matrix, Polynomial, Random, Rational, Scalar, characteristic_polynomial, rational_to_f64};
use kardan::results::Definition;
use kardan::synthesis::decoupling::*;

type M = Matrix<Rational>;

fn int(x: i64) -> Rational {
    Rational::from(x)
}

fn frac(n: i64, d: u64) -> Rational {
    Rational::from_parts(n.into(), d.into())
}

fn integers(rows: &[&[i64]]) -> M {
    M::from_fn(rows.len(), rows.first().map_or(0, |row| row.len()), |i, j| int(rows[i][j]))
}

fn polynomial(coefficients: &[i64]) -> Polynomial {
    Polynomial::new(coefficients.iter().map(|&c| int(c)).collect())
}

fn minus(a: &M, b: &M) -> M {
    a.plus(&b.scale(&int(-1)))
}

/// Every entry within 1e-9 of its golden value, relative to that entry; golden zeros are zeros.
#[track_caller]
fn is_golden(code: &M, expected: &[Vec<f64>], what: &str) {
    assert_eq!((code.rows(), code.columns()), (expected.len(), expected[0].len()), "{what}: shape");
    let mut worst = 0.0f64;
    for (i, row) in expected.iter().enumerate() {
        for (j, &value) in row.iter().enumerate() {
            let entry = &code[(i, j)];
            assert_eq!(entry.is_zero(), value == 0.0, "{what} ({i}, {j}): {entry} against {value}");
            if value != 0.0 {
                worst = worst.max((rational_to_f64(entry) - value).abs() / value.abs());
            }
        }
    }
    assert!(worst < 1e-9, "{what}: {worst:e}");
    println!("{what}: largest relative difference {worst:.1e}");
}

/// Every root of a polynomial beside its golden value.
#[track_caller]
fn has_roots(p: &Polynomial, expected: &[Vec<f64>]) {
    let mut roots: Vec<(f64, f64)> = Vec::new();
    for (part, exponent) in p.square_free() {
        part.roots().into_iter().for_each(|root| roots.extend(vec![root; exponent]));
    }
    assert_eq!(roots.len(), expected.len());
    for value in expected {
        let distance = |root: &(f64, f64)| (root.0 - value[0]).hypot(root.1 - value[1]);
        let nearest = (0..roots.len()).min_by(|&i, &j| distance(&roots[i]).total_cmp(&distance(&roots[j]))).unwrap();
        let root = roots.swap_remove(nearest);
        assert!(distance(&root) <= 1e-9 * value[0].hypot(value[1]).max(1.0), "{root:?} against {value:?}");
    }
}

/// A built-in model as an explicit system with the angles of shafts as outputs.
fn built_in(name: &str, inputs: &[&str], outputs: &[&str]) -> LinearSystem {
    common::built_in(name, inputs, outputs).explicit().unwrap()
}

/// ω = 20 rad/s, ξ = 0.7 for every output.
fn standard(degrees: &[usize]) -> Vec<Polynomial> {
    let compensation = Compensation::SecondOrder { natural_frequency: int(20), damping_ratio: frac(7, 10) };
    degrees.iter().map(|&r| compensation.polynomial(r).unwrap()).collect()
}

fn none(system: &LinearSystem) -> M {
    M::zeros(system.states.len(), 0)
}

// ---- the harmonic drive with a spring -----------------------------------------------------------------------------

/// Outputs rk.phi and `T_fs = J_fs φ̈_fs` (6.62), states wg, rk, fs and their speeds.
fn harmonic_drive_spring() -> LinearSystem {
    let one = built_in("harmonic-drive-spring", &["wg_motor", "rk_motor"], &["rk"]);
    assert_eq!(one.states, ["wg.phi", "rk.phi", "fs.phi", "wg.w", "rk.w", "fs.w"]);
    let inertia = frac(5, 100);
    LinearSystem {
        outputs: vec!["rk.phi".into(), "T_fs".into()],
        c: M::from_fn(2, 6, |i, j| if i == 0 { one.c[(0, j)].clone() } else { one.a[(5, j)].times(&inertia) }),
        d: M::from_fn(2, 2, |i, j| if i == 0 { int(0) } else { one.b[(5, j)].times(&inertia) }),
        ..one
    }
}

/// The twist of the torsion bar, `cs − rk`.
fn twist() -> Vec<Rational> {
    vec![frac(1, 51), int(-1), frac(50, 51), int(0), int(0), int(0)]
}

#[test]
fn harmonic_drive_spring_as_in_the_source() {
    let golden = &golden()["hds"];
    let full = harmonic_drive_spring();
    let quotient = observable_quotient(&full, &[twist()]);
    let system = &quotient.system;
    let z = "wg.phi - 51 rk.phi + 50 fs.phi".to_string();
    assert_eq!(system.states, ["rk.phi", &z, "wg.w", "rk.w", "fs.w"]);
    assert_eq!(quotient.definitions, [Definition { state: z.clone(), expression: z }]);
    assert_eq!(quotient.hidden, polynomial(&[0, 1]));
    is_golden(&system.a, &rows(&golden["A5"]), "A5");
    is_golden(&system.b, &rows(&golden["B5"]), "B5");
    is_golden(&system.c, &rows(&golden["C5"]), "C5");
    has_roots(&characteristic_polynomial(&system.a), &rows(&golden["open_loop_eigs_state5"]));
    has_roots(&characteristic_polynomial(&full.a), &rows(&golden["open_loop_eigs_state6"]));

    let degrees = relative_degrees(system);
    assert_eq!(degrees.degrees, [Some(2), Some(1)]);
    is_golden(&degrees.matrix, &rows(&golden["G"]), "G");
    is_golden(&degrees.free, &rows(&golden["Astar"]), "A*");
    is_golden(&inverse_decoupling_matrix(system, &degrees).unwrap(), &rows(&golden["G_inverse"]), "G^-1");

    let form = canonical_form(&integrator_decoupled(system).unwrap()).unwrap();
    assert_eq!(form.sizes, [2, 3, 0, 0]);
    assert_eq!(form.ranks, [3, 2]);
    is_golden(&form.q, &rows(&golden["Q"]), "Q");
    is_golden(&form.q_inverse, &rows(&golden["Q_inverse"]), "Q^-1");
    is_golden(&form.a, &rows(&golden["A_cd"]), "A_cd");
    is_golden(&form.b, &rows(&golden["B_cd"]), "B_cd");
    is_golden(&form.c, &rows(&golden["C_cd"]), "C_cd");
    check_canonical(&form, &degrees.degrees).unwrap();

    let gains = decouple(system, &none(system), None, &standard(&[2, 1])).unwrap();
    is_golden(&gains.k, &rows(&golden["K"]), "K");
    is_golden(&gains.l, &rows(&golden["L"]), "L");
    let closed = gains.closed_loop(system);
    assert_eq!(closed.inputs, ["ref_rk.phi", "ref_T_fs"]);
    assert_eq!(coupled_entries(&closed), []);
    let transfer: Vec<Vec<String>> =
        transfer_matrix(&closed).iter().map(|row| row.iter().map(ToString::to_string).collect()).collect();
    assert_eq!(transfer, [["400/(s^2 + 28 s + 400)", "0"], ["0", "20/(s + 20)"]]);
    has_roots(&characteristic_polynomial(&closed.a), &rows(&golden["closed_loop_eigs_state5"]));
    let zeros = zero_dynamics(system).unwrap();
    assert_eq!(zeros.polynomial, polynomial(&[0, 10_000, 1]));
    let zeros: Vec<Vec<f64>> = list(&golden["zeros_state5"]).iter().map(|x| vec![*x, 0.0]).collect();
    has_roots(&zero_dynamics(system).unwrap().polynomial, &zeros);

    // The same gains on the six states of the plant.
    let on_plant = gains.k.multiply(&quotient.projection);
    let closed_plant = minus(&full.a, &full.b.multiply(&on_plant));
    assert_eq!(characteristic_polynomial(&closed_plant), characteristic_polynomial(&closed.a).times(&quotient.hidden));
    assert_eq!(on_plant, decouple(&full, &none(&full), None, &standard(&[2, 1])).unwrap().k);
}

/// Without the twist of the spring the combination comes from the echelon form; rk.phi is a coordinate already.
#[test]
fn coordinates_of_the_quotient() {
    let quotient = observable_quotient(&harmonic_drive_spring(), &[]);
    assert_eq!(quotient.system.states, ["rk.phi", "wg.w", "rk.w", "fs.w", "wg.phi + 50 fs.phi"]);
    let torque = M::from_fn(6, 1, |i, _| int(i64::from(i == 5)));
    assert_eq!(quotient.project(&torque), integers(&[&[0], &[0], &[0], &[1], &[0]]));
    // Everything is seen: nothing changes.
    let whole = built_in("harmonic-drive-spring", &["wg_motor", "rk_motor"], &["rk", "fs"]);
    let quotient = observable_quotient(&whole, &[twist()]);
    assert_eq!((&quotient.system, &quotient.projection), (&whole, &M::identity(6)));
    assert_eq!(quotient.hidden, polynomial(&[1]));
    assert!(quotient.definitions.is_empty());
}

/// `B` of (6.60) as printed has the wrong sign: the loop it gives is positive feedback on the real plant.
#[test]
fn the_printed_sign_of_the_input_matrix_is_fatal() {
    let system = observable_quotient(&harmonic_drive_spring(), &[twist()]).system;
    let printed = LinearSystem { b: system.b.scale(&int(-1)), ..system.clone() };
    let gains = decouple(&printed, &none(&printed), None, &standard(&[2, 1])).unwrap();
    let closed = characteristic_polynomial(&minus(&system.a, &system.b.multiply(&gains.k)));
    let positive: Vec<f64> = closed.roots().iter().map(|root| root.0).filter(|x| *x > 1e-6).collect();
    assert_eq!(positive.len(), 3);
    for (value, expected) in positive.iter().zip([0.105, 38.2, 10_028.0]) {
        assert!((value - expected).abs() < 5e-3 * expected, "{value}");
    }
}

/// Q of (6.85) as printed: K = G⁻¹ (A* + K_cd Q) has an eigenvalue at +11.9 1/s.
#[test]
fn the_printed_transformation_is_fatal() {
    let system = observable_quotient(&harmonic_drive_spring(), &[twist()]).system;
    let degrees = relative_degrees(&system);
    let inverse = inverse_decoupling_matrix(&system, &degrees).unwrap();
    let form = canonical_form(&integrator_decoupled(&system).unwrap()).unwrap();
    let compensation = integers(&[&[400, 28, 0, 0, 0], &[0, 0, 20, 0, 0]]);
    let eigenvalues = |q: &M| {
        let k = inverse.multiply(&degrees.free.plus(&compensation.multiply(q)));
        characteristic_polynomial(&minus(&system.a, &system.b.multiply(&k))).roots()
    };
    // b_fs = 0.01, i/(i+1) = 50/51
    let mut printed = form.q.clone();
    printed[(2, 4)] = frac(-1, 100).minus(&frac(2500, 2601));
    let largest = |roots: Vec<(f64, f64)>| roots.iter().fold(f64::MIN, |max, root| max.max(root.0));
    let wrong = largest(eigenvalues(&printed));
    assert!((wrong - 11.9).abs() < 0.05, "{wrong}");
    assert_eq!(largest(eigenvalues(&form.q)), 0.0);
}

// ---- the steering system ------------------------------------------------------------------------------------------

#[test]
fn steering_system_as_in_the_source() {
    let golden = &golden()["sia"];
    let system = built_in("sia-steering", &["wg_motor", "rk_motor"], &["rk", "fs"]);
    // Open chains, p = s²: u = −K x + G⁻¹ v.
    let open = decouple(&system, &none(&system), None, &[polynomial(&[0, 0, 1]), polynomial(&[0, 0, 1])]).unwrap();
    is_golden(&open.k.scale(&int(-1)), &rows(&golden["Kx"]), "Kx");
    // There u2 is a torque along the flexspline; here v2 is its acceleration, u2 = J~_fs v2 (6.129).
    let inertia = golden["coefficients"]["Jfs_t"].as_f64().unwrap();
    let per_acceleration: Vec<Vec<f64>> =
        rows(&golden["Ku"]).iter().map(|row| vec![row[0], row[1] * inertia]).collect();
    is_golden(&open.inverse, &per_acceleration, "Ku");
    let gains = decouple(&system, &none(&system), None, &standard(&[2, 2])).unwrap();
    let closed = gains.closed_loop(&system);
    has_roots(&characteristic_polynomial(&closed.a), &rows(&golden["closed_loop_eigs"]));
    has_roots(&characteristic_polynomial(&system.a), &rows(&golden["open_loop_eigs"]));
    let zeros = zero_dynamics(&system).unwrap().polynomial;
    assert_eq!(zeros.primitive(), polynomial(&[10_000_000, 2060, 11]));
    assert_eq!(zeros.primitive().to_string(), "11 s^2 + 2060 s + 10000000");
    has_roots(&zeros, &rows(&golden["zero_dynamics_roots"]));
    assert_eq!(coupled_entries(&closed), []);
    for (i, row) in transfer_matrix(&closed).iter().enumerate() {
        for (j, entry) in row.iter().enumerate() {
            assert_eq!(entry.to_string(), if i == j { "400/(s^2 + 28 s + 400)" } else { "0" });
        }
    }
    // The outputs of Theorem 6.4 cannot be decoupled statically: both feel the drive first through one combination.
    let flat = built_in("sia-steering", &["wg_motor", "rk_motor"], &["fs", "cj"]);
    let refused = decouple(&flat, &none(&flat), None, &standard(&[2, 2])).unwrap_err();
    assert!(refused.to_string().ends_with("the inputs do not act on 5100·`fs.phi''` + 11·`cj.phi''`"), "{refused}");
    assert_eq!(refused.rank(), 1);
    // Three motors, two outputs: one too many is no harm.
    let wide = built_in("sia-steering", &["wg_motor", "rk_motor", "driver"], &["rk", "fs"]);
    let gains = decouple(&wide, &none(&wide), None, &standard(&[2, 2])).unwrap();
    assert_eq!(coupled_entries(&gains.closed_loop(&wide)), []);
    // One motor for two outputs is not enough.
    let narrow = built_in("sia-steering", &["wg_motor"], &["rk", "fs"]);
    let refused = decouple(&narrow, &none(&narrow), None, &standard(&[2, 2])).unwrap_err();
    assert!(matches!(&refused, NotDecouplable::TooManyOutputs { rank: 1, .. }), "{refused:?}");
}

// ---- random systems of known structure ----------------------------------------------------------------------------

fn below(random: &mut Random, bound: usize) -> usize {
    random.below(bound as u64) as usize
}

/// From −size to size.
fn small(random: &mut Random, size: u64) -> Rational {
    int(random.below(2 * size + 1) as i64 - size as i64)
}

fn some(random: &mut Random, rows: usize, columns: usize) -> M {
    M::from_fn(rows, columns, |_, _| small(random, 2))
}

/// Lower times upper triangle with ones on the diagonal.
fn unimodular(random: &mut Random, n: usize) -> M {
    let mut lower = |below: bool| {
        M::from_fn(n, n, |i, j| match i == j {
            true => int(1),
            false if (i > j) == below => small(random, 1),
            false => int(0),
        })
    };
    lower(true).multiply(&lower(false))
}

/// A regular matrix whose determinant is not one.
fn regular(random: &mut Random, n: usize) -> M {
    let scale: Vec<i64> = (0..n).map(|_| random.small(3)).collect();
    let m = unimodular(random, n);
    M::from_fn(n, n, |i, j| m[(i, j)].times(&int(scale[j])))
}

fn inverse(m: &M) -> M {
    m.solve(&M::identity(m.rows())).expect("regular")
}

/// The system in the states `T x`, under `u = F x + R w`.
fn hidden(system: &LinearSystem, t: &M, feedback: &M, r: &M) -> LinearSystem {
    let back = inverse(t);
    LinearSystem {
        d: system.d.multiply(r),
        ..LinearSystem::state_space(
            t.multiply(&system.a.plus(&system.b.multiply(feedback))).multiply(&back),
            t.multiply(&system.b).multiply(r),
            system.c.plus(&system.d.multiply(feedback)).multiply(&back),
        )
    }
}

fn hide(random: &mut Random, system: &LinearSystem) -> LinearSystem {
    let (n, m) = (system.states.len(), system.inputs.len());
    let (t, feedback, r) = (unimodular(random, n), some(random, m, n), regular(random, m));
    hidden(system, &t, &feedback, &r)
}

/// A canonically decoupled system with whole numbers (6.73)-(6.78), and the polynomial of its invariant zeros.
struct Built {
    form: CanonicalForm,
    degrees: Vec<usize>,
    zeros: Polynomial,
}

impl Built {
    fn new(random: &mut Random) -> Self {
        let m = 1 + below(random, 3);
        let degrees: Vec<usize> = (0..m).map(|_| below(random, 4)).collect();
        let mut sizes: Vec<usize> = degrees.iter().map(|r| r + below(random, 3)).collect();
        sizes.push(if m > 1 { below(random, 3) } else { 0 });
        sizes.push(below(random, 3));
        let n: usize = sizes.iter().sum();
        let start = |block: usize| sizes[..block].iter().sum::<usize>();
        let (mut a, mut b, mut c) = (M::zeros(n, n), M::zeros(n, m), M::zeros(m, n));
        let mut d = M::zeros(m, m);
        let mut roots = Vec::new();
        // A triangular block with known eigenvalues.
        let mut free = |random: &mut Random, a: &mut M, from: usize, to: usize| {
            for i in from..to {
                (from..i).for_each(|j| a[(i, j)] = int(0));
                a[(i, i)] = small(random, 4);
                roots.push(a[(i, i)].clone());
            }
        };
        let (shared, unreached) = (start(m), start(m + 1));
        for i in 0..m {
            let (from, to, r) = (start(i), start(i + 1), degrees[i]);
            for k in from..to {
                (from..to).chain(unreached..n).for_each(|j| a[(k, j)] = small(random, 2));
                b[(k, i)] = small(random, 2);
            }
            for k in 0..r {
                (from..to).for_each(|j| a[(from + k, j)] = int(i64::from(j == from + k + 1 && k + 1 < r)));
                b[(from + k, i)] = if k + 1 == r { int(random.small(3)) } else { int(0) };
            }
            free(random, &mut a, from + r, to);
            if r > 0 {
                c[(i, from)] = int(1);
            } else {
                d[(i, i)] = int(random.small(3));
            }
            (unreached..n).for_each(|j| c[(i, j)] = small(random, 2));
        }
        for k in shared..n {
            for j in if k < unreached { 0..n } else { unreached..n } {
                a[(k, j)] = small(random, 2);
            }
            (0..m).for_each(|j| b[(k, j)] = if k < unreached { small(random, 2) } else { int(0) });
        }
        free(random, &mut a, shared, unreached);
        free(random, &mut a, unreached, n);
        let identity = M::identity(n);
        Self {
            form: CanonicalForm { sizes, ranks: Vec::new(), q: identity.clone(), q_inverse: identity, a, b, c, d },
            degrees,
            zeros: Polynomial::from_roots(&roots),
        }
    }

    fn system(&self) -> LinearSystem {
        let CanonicalForm { a, b, c, d, .. } = &self.form;
        LinearSystem { d: d.clone(), ..LinearSystem::state_space(a.clone(), b.clone(), c.clone()) }
    }

    fn relative_degrees(&self) -> Vec<Option<usize>> {
        self.degrees.iter().map(|&r| Some(r)).collect()
    }
}

/// Stable whole poles, some of them complex.
fn random_polynomials(random: &mut Random, degrees: &[usize]) -> Vec<Polynomial> {
    let mut poles = |r: usize| {
        let mut out = Vec::new();
        while out.len() < r {
            let (re, im) = (int(-1 - below(random, 5) as i64), int(1 + below(random, 3) as i64));
            if r - out.len() > 1 && below(random, 2) == 0 {
                out.push((re.clone(), im.clone()));
                out.insert(0, (re, int(0).minus(&im)));
            } else {
                out.push((re, int(0)));
            }
        }
        out
    };
    degrees.iter().map(|&r| Compensation::Poles(poles(r)).polynomial(r).unwrap()).collect()
}

/// `C (sI − A)⁻¹ B + D` at a number that is no eigenvalue.
fn transfer_at(system: &LinearSystem, s: &Rational) -> Option<M> {
    let n = system.states.len();
    let resolvent = minus(&M::identity(n).scale(s), &system.a);
    Some(system.c.multiply(&resolvent.solve(&system.b)?).plus(&system.d))
}

fn determinant(m: &M) -> Rational {
    let (mut m, n, mut out) = (m.clone(), m.rows(), int(1));
    for k in 0..n {
        let Some(pivot) = (k..n).find(|&i| !m[(i, k)].is_zero()) else { return int(0) };
        if pivot != k {
            m.swap_rows(pivot, k);
            out = int(0).minus(&out);
        }
        out = out.times(&m[(k, k)]);
        for i in k + 1..n {
            let factor = m[(i, k)].over(&m[(k, k)]);
            for j in k..n {
                m[(i, j)] = m[(i, j)].minus(&factor.times(&m[(k, j)]));
            }
        }
    }
    out
}

/// `det [sI − A, −B; C, D]`.
fn system_determinant(system: &LinearSystem, s: &Rational) -> Rational {
    let (n, m) = (system.states.len(), system.inputs.len());
    let zero = int(0);
    determinant(&M::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
        (true, true) => (if i == j { s.clone() } else { int(0) }).minus(&system.a[(i, j)]),
        (true, false) => zero.minus(&system.b[(i, j - n)]),
        (false, true) => system.c[(i - n, j)].clone(),
        (false, false) => system.d[(i - n, j - n)].clone(),
    }))
}

#[test]
fn hidden_canonical_systems_are_decoupled_again() {
    let mut random = Random::new(6);
    let mut canonical = 0;
    for round in 0..150 {
        let built = Built::new(&mut random);
        let system = hide(&mut random, &built.system());
        let degrees = relative_degrees(&system);
        assert_eq!(degrees.degrees, built.relative_degrees(), "round {round}");
        // Zeros: as built, as the determinant of the system matrix, and of the hidden system alike.
        let zeros = zero_dynamics(&system).unwrap();
        assert_eq!(zeros.polynomial, built.zeros, "round {round}");
        let ratio = |s: i64| {
            let value = built.zeros.evaluate(&int(s));
            (!value.is_zero()).then(|| system_determinant(&system, &int(s)).over(&value))
        };
        let ratios: Vec<Rational> = [-9, 7, 11].into_iter().filter_map(ratio).collect();
        assert!(ratios.len() == 3 && ratios.iter().all(|x| *x == ratios[0] && !x.is_zero()), "round {round}");

        let requested = random_polynomials(&mut random, &built.degrees);
        let gains = decouple(&system, &none(&system), None, &requested).unwrap();
        let closed = gains.closed_loop(&system);
        assert_eq!(coupled_entries(&closed), [], "round {round}");
        for (i, row) in transfer_matrix(&closed).iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                let constant = Polynomial::constant(requested[i].coefficient(0));
                let expected = if i == j { RationalFunction::new(&constant, &requested[i]) } else { expected_zero() };
                assert_eq!(*entry, expected, "round {round}: ({i}, {j})");
                assert!(i != j || entry.denominator == requested[i]);
            }
        }
        let channels = requested.iter().fold(zeros.polynomial.clone(), |all, p| all.times(p));
        assert_eq!(characteristic_polynomial(&closed.a), channels, "round {round}");

        let integrators = integrator_decoupled(&system).unwrap();
        let form = canonical_form(&integrators).unwrap();
        check_canonical(&form, &degrees.degrees).unwrap_or_else(|wrong| panic!("round {round}: {wrong:?}"));
        assert_eq!(form.q.multiply(&integrators.a), form.a.multiply(&form.q));
        assert_eq!(
            (form.q.multiply(&integrators.b), form.c.multiply(&form.q)),
            (form.b.clone(), integrators.c.clone())
        );
        assert_eq!(form.q.multiply(&form.q_inverse), M::identity(form.q.rows()));
        // The sizes belong to the system, not to the way it is written: compare if what was built is canonical itself.
        if check_canonical(&built.form, &built.relative_degrees()).is_ok() {
            assert_eq!(form.sizes, built.form.sizes, "round {round}");
            canonical += 1;
        }
    }
    assert!(canonical > 40, "{canonical}");
}

fn expected_zero() -> RationalFunction {
    RationalFunction { numerator: Polynomial::default(), denominator: polynomial(&[1]) }
}

/// Ranks of L_i, controllability and condition 4 by matrices `[B AB …]` of this file's own.
#[test]
fn sizes_follow_from_ranks() {
    fn rank(m: &M) -> usize {
        let mut m = m.clone();
        let mut rank = 0;
        for column in 0..m.columns() {
            let Some(pivot) = (rank..m.rows()).find(|&i| !m[(i, column)].is_zero()) else { continue };
            m.swap_rows(rank, pivot);
            for i in rank + 1..m.rows() {
                let factor = m[(i, column)].over(&m[(rank, column)]);
                for j in column..m.columns() {
                    m[(i, j)] = m[(i, j)].minus(&factor.times(&m[(rank, j)]));
                }
            }
            rank += 1;
        }
        rank
    }
    fn controllability(a: &M, b: &M) -> M {
        let n = a.rows();
        let powers: Vec<M> = std::iter::successors(Some(b.clone()), |x| Some(a.multiply(x))).take(n).collect();
        M::from_fn(n, n * b.columns(), |i, j| powers[j / b.columns()][(i, j % b.columns())].clone())
    }
    let mut random = Random::new(17);
    for round in 0..60 {
        let built = Built::new(&mut random);
        let system = integrator_decoupled(&hide(&mut random, &built.system())).unwrap();
        let form = canonical_form(&system).unwrap();
        let (n, m) = (system.states.len(), system.inputs.len());
        if n == 0 {
            continue;
        }
        let reached = rank(&controllability(&system.a, &system.b));
        assert_eq!(form.sizes[m + 1], n - reached, "round {round}");
        for i in 0..m {
            let other_inputs = M::from_fn(n, m - 1, |k, j| system.b[(k, if j < i { j } else { j + 1 })].clone());
            let other_rank = if m == 1 { 0 } else { rank(&controllability(&system.a, &other_inputs)) };
            assert_eq!(form.ranks[i], other_rank, "round {round}");
            assert_eq!(form.sizes[i], reached - other_rank, "round {round}");
        }
        assert_eq!(form.sizes.iter().sum::<usize>(), n);
    }
}

#[test]
fn broken_forms_are_refused() {
    let system = integrator_decoupled(&observable_quotient(&harmonic_drive_spring(), &[]).system).unwrap();
    let form = canonical_form(&system).unwrap();
    let degrees = [Some(2), Some(1)];
    let with = |change: &dyn Fn(&mut CanonicalForm)| {
        let mut form = form.clone();
        change(&mut form);
        check_canonical(&form, &degrees).map_err(|(condition, _)| condition)
    };
    assert_eq!(with(&|_| ()), Ok(()));
    assert_eq!(with(&|f| f.a[(0, 3)] = int(1)), Err(1));
    assert_eq!(with(&|f| f.b[(2, 0)] = int(1)), Err(1));
    assert_eq!(with(&|f| f.c[(0, 2)] = int(1)), Err(1));
    assert_eq!(with(&|f| f.d[(0, 0)] = int(1)), Err(1));
    assert_eq!(with(&|f| f.a[(1, 0)] = int(1)), Err(2));
    assert_eq!(with(&|f| f.b[(1, 0)] = int(0)), Err(2));
    assert_eq!(with(&|f| f.c[(0, 1)] = int(1)), Err(2));
    assert_eq!(with(&|f| (2..5).for_each(|k| f.a[(4, k)] = int(0))), Err(3));
    // A state that channel 2 alone drives does not belong to the shared part.
    assert_eq!(with(&|f| f.sizes = vec![2, 2, 1, 0]), Err(4));
    // Not integrator decoupled at all.
    let plain = observable_quotient(&harmonic_drive_spring(), &[]).system;
    assert_eq!(canonical_form(&plain).unwrap_err().output, "rk.phi");
}

/// Chains of integrators driven through a matrix of given rank, hidden: the rank comes out, and what depends on what.
#[test]
fn singular_decoupling_matrices_are_refused_with_their_rank() {
    let mut random = Random::new(99);
    for round in 0..80 {
        let m = 2 + below(&mut random, 3);
        let rank = 1 + below(&mut random, m - 1);
        let degrees: Vec<usize> = (0..m).map(|_| 1 + below(&mut random, 3)).collect();
        // Independent rows first; each of the others is a combination, never zero.
        let base = regular(&mut random, m);
        let mut g = M::zeros(m, m);
        for i in 0..m {
            let from = if i < rank { i } else { below(&mut random, rank) };
            let factor = int(random.small(3));
            (0..m).for_each(|j| g[(i, j)] = base[(from, j)].times(&factor));
        }
        let n: usize = degrees.iter().sum();
        let (mut a, mut b, mut c) = (M::zeros(n, n), M::zeros(n, m), M::zeros(m, n));
        let mut at = 0;
        for (i, &r) in degrees.iter().enumerate() {
            c[(i, at)] = int(1);
            (at..at + r - 1).for_each(|k| a[(k, k + 1)] = int(1));
            at += r;
            (0..n).for_each(|j| a[(at - 1, j)] = small(&mut random, 2));
            (0..m).for_each(|j| b[(at - 1, j)] = g[(i, j)].clone());
        }
        let system = hide(&mut random, &LinearSystem::state_space(a, b, c));
        let requested = random_polynomials(&mut random, &degrees);
        let refused = decouple(&system, &none(&system), None, &requested).unwrap_err();
        assert_eq!(refused.rank(), rank, "round {round}");
        let NotDecouplable::Singular { degrees: found, not_reached, dependencies, .. } = &refused else {
            panic!("{refused:?}")
        };
        assert!(not_reached.is_empty() && dependencies.len() == m - rank);
        assert_eq!(*found, degrees.iter().map(|&r| Some(r)).collect::<Vec<_>>());
        let g = relative_degrees(&system).matrix;
        for row in dependencies {
            let row = M::from_fn(1, m, |_, j| row[j].clone());
            assert!(row.multiply(&g).as_slice().iter().all(|x| x.is_zero()), "round {round}");
        }
        assert!(refused.to_string().contains(&format!("rank {rank} instead of {m}")), "{refused}");
        assert_eq!(zero_dynamics(&system).unwrap_err(), refused);
        assert_eq!(integrator_decoupled(&system).unwrap_err(), refused);
    }
}

#[test]
fn outputs_that_no_input_reaches_are_named() {
    let a = integers(&[&[0, 1, 0], &[0, 0, 0], &[0, 0, -2]]);
    let b = integers(&[&[0, 0], &[1, 2], &[0, 0]]);
    let system = LinearSystem::state_space(a, b, integers(&[&[1, 0, 0], &[0, 0, 1]]));
    let degrees = relative_degrees(&system);
    assert_eq!(degrees.degrees, [Some(2), None]);
    let refused = inverse_decoupling_matrix(&system, &degrees).unwrap_err();
    let expected = "the outputs cannot be decoupled by static state feedback: the decoupling matrix has rank 1 instead of \
                    2; no input ever reaches `y2`";
    assert_eq!(refused.to_string(), expected);
    assert!(matches!(&refused, NotDecouplable::Singular { not_reached, dependencies, .. }
        if *not_reached == [1] && dependencies.is_empty()));
    // Two angles of one body.
    let dependent = LinearSystem::state_space(
        integers(&[&[0, 1], &[0, 0]]),
        integers(&[&[0, 0], &[1, 1]]),
        integers(&[&[1, 0], &[0, 3]]),
    );
    let refused = inverse_decoupling_matrix(&dependent, &relative_degrees(&dependent)).unwrap_err();
    assert!(refused.to_string().ends_with("the inputs do not act on 3·`y1''` − `y2'`"), "{refused}");
}

/// More inputs than outputs: the rows of a decouplable system, inputs mixed with one more.
#[test]
fn spare_inputs_are_no_harm() {
    let mut random = Random::new(3);
    for round in 0..40 {
        let built = Built::new(&mut random);
        let square = built.system();
        let (n, m) = (square.states.len(), square.inputs.len());
        let mut mixed = LinearSystem::state_space(square.a.clone(), M::zeros(n, m + 1), square.c.clone());
        let mix = regular(&mut random, m + 1);
        let wide = |part: &M| M::from_fn(part.rows(), m + 1, |i, j| if j < m { part[(i, j)].clone() } else { int(0) });
        (mixed.b, mixed.d) = (wide(&square.b).multiply(&mix), wide(&square.d).multiply(&mix));
        let requested = random_polynomials(&mut random, &built.degrees);
        let gains = decouple(&mixed, &none(&mixed), None, &requested).unwrap();
        assert_eq!(gains.matrix.multiply(&gains.inverse), M::identity(m));
        assert_eq!(coupled_entries(&gains.closed_loop(&mixed)), [], "round {round}");
        let form = canonical_form(&integrator_decoupled(&mixed).unwrap()).unwrap();
        check_canonical(&form, &built.relative_degrees()).unwrap();
    }
}

/// With the disturbance known, an output that is told to hold still does: `T_d(0) = 0`, and `T_d = 0` where that is promised.
#[test]
fn constant_compensated_disturbances_do_nothing() {
    let mut random = Random::new(41);
    let (mut promised, mut only_constant) = (0, 0);
    for round in 0..80 {
        let built = Built::new(&mut random);
        let system = hide(&mut random, &built.system());
        let (n, m, k) = (system.states.len(), system.inputs.len(), 1 + below(&mut random, 2));
        let w = M::from_fn(n, k, |_, _| small(&mut random, if round % 3 == 0 { 1 } else { 3 }));
        let w = if round % 4 == 0 { system.b.multiply(&some(&mut random, m, k)) } else { w };
        let direct = some(&mut random, m, k);
        let direct = (round % 2 == 0).then_some(&direct);
        let gains = decouple(&system, &w, direct, &random_polynomials(&mut random, &built.degrees)).unwrap();
        let closed = gains.closed_loop(&system);
        let through = minus(direct.unwrap_or(&M::zeros(m, k)), &system.d.multiply(&gains.m));
        let disturbed = LinearSystem {
            d: through,
            ..LinearSystem::state_space(closed.a.clone(), minus(&w, &system.b.multiply(&gains.m)), closed.c.clone())
        };
        for (i, row) in transfer_matrix(&disturbed).iter().enumerate() {
            for entry in row {
                // Nothing but the poles of the channel, and nothing in the end.
                assert!(gains.polynomials[i].divide(&entry.denominator).1.is_zero(), "round {round}");
                assert!(entry.evaluate(&int(0)).unwrap().is_zero(), "round {round}");
                assert!(!gains.rejects_any_signal[i] || entry.is_zero(), "round {round}");
            }
            assert_eq!(gains.rejects_any_signal[i], row.iter().all(RationalFunction::is_zero), "round {round}");
            *(if gains.rejects_any_signal[i] { &mut promised } else { &mut only_constant }) += 1;
        }
    }
    assert!(promised > 20 && only_constant > 20, "{promised} {only_constant}");
}

// ---- transfer matrices and quotients ------------------------------------------------------------------------------

/// Random fractions, not whole numbers.
fn fractions(random: &mut Random, rows: usize, columns: usize) -> M {
    M::from_fn(rows, columns, |_, _| match below(random, 3) {
        0 => int(0),
        _ => frac(random.small(50), 1 + random.below(12)),
    })
}

#[test]
fn transfer_matrices_have_the_right_values() {
    let mut random = Random::new(12);
    for round in 0..60 {
        let (n, m, p) = (below(&mut random, 7), 1 + below(&mut random, 3), 1 + below(&mut random, 3));
        let a = fractions(&mut random, n, n);
        let system = LinearSystem {
            d: fractions(&mut random, p, m),
            ..LinearSystem::state_space(a, fractions(&mut random, n, m), fractions(&mut random, p, n))
        };
        let transfer = transfer_matrix(&system);
        let mut compared = 0;
        for s in [frac(1, 3), int(-7), frac(22, 7), int(1000)] {
            let Some(expected) = transfer_at(&system, &s) else { continue };
            compared += 1;
            for i in 0..p {
                for j in 0..m {
                    assert_eq!(transfer[i][j].evaluate(&s).unwrap(), expected[(i, j)], "round {round}");
                }
            }
        }
        assert!(compared >= 3);
        let characteristic = characteristic_polynomial(&system.a);
        for entry in transfer.iter().flatten() {
            assert!(characteristic.divide(&entry.denominator).1.is_zero(), "round {round}");
            assert_eq!(entry.numerator.gcd(&entry.denominator).degree(), 0);
            assert_eq!(entry.denominator.monic(), entry.denominator);
        }
        let coupled: Vec<(usize, usize)> = (0..p)
            .flat_map(|i| (0..m).map(move |j| (i, j)))
            .filter(|&(i, j)| i != j && !transfer[i][j].is_zero())
            .collect();
        assert_eq!(coupled_entries(&system), coupled, "round {round}");
        // Cayley and Hamilton.
        let zero = characteristic
            .coefficients()
            .iter()
            .rev()
            .fold(M::zeros(n, n), |sum, c| sum.multiply(&system.a).plus(&M::identity(n).scale(c)));
        assert!(zero.as_slice().iter().all(|x| x.is_zero()), "round {round}");
    }
}

#[test]
fn unobservable_states_are_removed() {
    let mut random = Random::new(8);
    for round in 0..60 {
        let (observable, unobservable) = (1 + below(&mut random, 4), below(&mut random, 4));
        let n = observable + unobservable;
        // The unseen states drive nothing that is seen; companion chain observed from its first state.
        let roots: Vec<Rational> = (0..unobservable).map(|_| small(&mut random, 3)).collect();
        let a = M::from_fn(n, n, |i, j| match (i < observable, j < observable) {
            (true, true) if i + 1 < observable => int(i64::from(j == i + 1)),
            (true, false) => int(0),
            (false, false) if i == j => roots[i - observable].clone(),
            (false, false) if i < j => int(0),
            _ => small(&mut random, 3),
        });
        let mut c = M::zeros(2, n);
        c[(0, 0)] = int(1);
        (0..observable).for_each(|j| c[(1, j)] = small(&mut random, 2));
        let plain = LinearSystem::state_space(a, some(&mut random, n, 2), c);
        let mut system = hidden(&plain, &unimodular(&mut random, n), &M::zeros(2, n), &M::identity(2));
        system.d = some(&mut random, 2, 2);
        let preferred = fractions(&mut random, 2, n);
        let preferred: Vec<Vec<Rational>> = (0..2).map(|i| preferred.row(i).to_vec()).collect();
        let quotient = observable_quotient(&system, &preferred);
        assert_eq!(quotient.hidden, Polynomial::from_roots(&roots), "round {round}");
        assert_eq!(quotient.system.states.len(), observable);
        let (p, z) = (&quotient.projection, &quotient.system);
        assert_eq!(p.multiply(&system.a), z.a.multiply(p));
        assert_eq!((p.multiply(&system.b), z.c.multiply(p)), (z.b.clone(), system.c.clone()));
        assert_eq!(transfer_matrix(&system), transfer_matrix(z), "round {round}");
        assert_eq!(observable_quotient(z, &[]).system.states.len(), observable, "nothing more to leave out");
        assert_eq!(z.states.iter().collect::<BTreeSet<_>>().len(), observable, "names differ: {:?}", z.states);
    }
}

#[test]
fn long_combinations_get_short_names() {
    let n = 6;
    let mut system =
        LinearSystem::state_space(M::zeros(n, n), M::identity(n), M::from_fn(1, n, |_, j| int(10 + j as i64)));
    system.states = (0..n).map(|k| format!("shaft_{k}.phi")).collect();
    system.states[5] = "z1".into();
    let quotient = observable_quotient(&system, &[]);
    assert_eq!(quotient.system.states, ["z2"]);
    let expression = "10 shaft_0.phi + 11 shaft_1.phi + 12 shaft_2.phi + 13 shaft_3.phi + 14 shaft_4.phi + 15 z1";
    assert_eq!(quotient.definitions, [Definition { state: "z2".into(), expression: expression.into() }]);
    assert_eq!(quotient.hidden, polynomial(&[0, 0, 0, 0, 0, 1]));
    // A preferred row is taken as it points, in smallest whole numbers.
    let row: Vec<Rational> = (0..n).map(|j| frac(-10 - j as i64, 7)).collect();
    assert_eq!(observable_quotient(&system, &[row]).definitions, quotient.definitions);
    // No output: no state.
    let blind = LinearSystem { c: M::zeros(0, n), d: M::zeros(0, n), outputs: Vec::new(), ..system };
    assert_eq!(observable_quotient(&blind, &[]).system.states.len(), 0);
}

// ---- compensation -------------------------------------------------------------------------------------------------

#[test]
fn polynomials_of_channels() {
    let second = Compensation::SecondOrder { natural_frequency: int(20), damping_ratio: frac(7, 10) };
    let text = |degree: usize| second.polynomial(degree).unwrap().to_string();
    assert_eq!([0, 1, 2, 3].map(text), ["1", "s + 20", "s^2 + 28 s + 400", "s^3 + 48 s^2 + 960 s + 8000"]);
    let first = Compensation::FirstOrder { frequency: frac(1, 2) };
    assert_eq!(first.polynomial(2).unwrap().to_string(), "s^2 + s + 1/4");
    assert_eq!(first.polynomial(0).unwrap(), polynomial(&[1]));
    let poles = |list: &[(i64, i64)], degree| {
        Compensation::Poles(list.iter().map(|&(re, im)| (int(re), int(im))).collect()).polynomial(degree)
    };
    assert_eq!(poles(&[(-1, 2), (-3, 0), (-1, -2)], 3).unwrap(), polynomial(&[5, 2, 1]).times(&polynomial(&[3, 1])));
    assert_eq!(poles(&[], 0).unwrap(), polynomial(&[1]));
    assert_eq!(poles(&[(-1, 0)], 2).unwrap_err(), CompensationError::Count { degree: 2, poles: 1 });
    let unpaired = poles(&[(-1, 2), (-1, 2)], 2).unwrap_err();
    assert_eq!(unpaired.to_string(), "the conjugate of the pole -1 + 2 j is missing");
    assert!(matches!(poles(&[(0, 0)], 1), Err(CompensationError::NotStable { .. })));
    let wrong =
        Compensation::SecondOrder { natural_frequency: int(20), damping_ratio: int(0) }.polynomial(2).unwrap_err();
    assert_eq!(wrong.to_string(), "the damping ratio must be positive, it is 0");
}

// ---- size ---------------------------------------------------------------------------------------------------------

/// A chain of 20 bodies (40 states) with springs, dampers and decimals as parameters, two motors and two outputs.
#[test]
fn forty_states_are_designed() {
    let (bodies, mut random) = (20, Random::new(5));
    let mut decimal = |size: u64| frac(1 + random.below(size) as i64, 1000);
    let (mut stiffness, mut damping) = (M::zeros(bodies, bodies), M::zeros(bodies, bodies));
    for k in 0..bodies - 1 {
        let row: Vec<Rational> = (0..bodies).map(|j| int(i64::from(j == k) - i64::from(j == k + 1))).collect();
        stiffness.add_outer(&decimal(90_000), &row);
        damping.add_outer(&decimal(900), &row);
    }
    let inverse_inertia: Vec<Rational> = (0..bodies).map(|_| int(1).over(&decimal(900))).collect();
    let n = 2 * bodies;
    let a = M::from_fn(n, n, |i, j| match (i < bodies, j < bodies) {
        (true, true) => int(0),
        (true, false) => int(i64::from(j - bodies == i)),
        (false, true) => int(0).minus(&stiffness[(i - bodies, j)].times(&inverse_inertia[i - bodies])),
        (false, false) => int(0).minus(&damping[(i - bodies, j - bodies)].times(&inverse_inertia[i - bodies])),
    });
    let place = [3, 15];
    let b = M::from_fn(n, 2, |i, j| if i == bodies + place[j] { inverse_inertia[place[j]].clone() } else { int(0) });
    let c = M::from_fn(2, n, |i, j| int(i64::from(j == place[i] + 1)));
    let system = LinearSystem::state_space(a, b, c);
    designed(&system, &[3, 3]);
}

/// Every step of a design.
fn designed(system: &LinearSystem, degrees: &[usize]) {
    let n = system.states.len();
    assert_eq!(observable_quotient(system, &[]).system.states.len(), n);
    let gains = decouple(system, &none(system), None, &standard(degrees)).expect("decouplable");
    let closed = gains.closed_loop(system);
    assert_eq!(coupled_entries(&closed), []);
    assert_eq!(zero_dynamics(system).unwrap().polynomial.degree(), n - degrees.iter().sum::<usize>());
    assert_eq!(transfer_matrix(system)[0][0].denominator.degree(), n);
    assert!(transfer_matrix(&closed)[0][1].is_zero());
    let form = canonical_form(&integrator_decoupled(system).unwrap()).unwrap();
    check_canonical(&form, &degrees.iter().map(|&r| Some(r)).collect::<Vec<_>>()).unwrap();
}

/// 15 bodies that all move each other (30 states): a dense inertia matrix makes fractions with a large denominator.
#[test]
fn dense_inertia_is_designed() {
    let (bodies, mut random) = (15, Random::new(77));
    let mut sum = |terms: usize, size: u64| {
        let mut out = M::zeros(bodies, bodies);
        for _ in 0..terms {
            let row: Vec<Rational> = (0..bodies).map(|_| small(&mut random, 3)).collect();
            out.add_outer(&frac(1 + random.below(size) as i64, 1000), &row);
        }
        out
    };
    let (inertia, damping, stiffness) = (sum(2 * bodies, 900), sum(bodies, 900), sum(bodies, 90_000));
    let n = 2 * bodies;
    let block = |i: usize, j: usize, m: &M| int(0).minus(&m[(i - bodies, j % bodies)]);
    let system = LinearSystem {
        e: M::from_fn(n, n, |i, j| match (i < bodies, j < bodies) {
            (false, false) => inertia[(i - bodies, j - bodies)].clone(),
            _ => int(i64::from(i == j)),
        }),
        ..LinearSystem::state_space(
            M::from_fn(n, n, |i, j| match (i < bodies, j < bodies) {
                (true, _) => int(i64::from(j == i + bodies)),
                (false, true) => block(i, j, &stiffness),
                (false, false) => block(i, j, &damping),
            }),
            M::from_fn(n, 2, |i, j| int(i64::from(i == bodies + 3 * j))),
            M::from_fn(2, n, |i, j| int(i64::from(j == 1 + 4 * i))),
        )
    };
    designed(&system.explicit().unwrap(), &[2, 2]);
}

//! The rank tests of textbooks in floating point against the exact answer, on systems of an engineer's life.
//!
//! Both float tests count singular values above `max(size) · ε · σ₁`: the controllability matrix `[B, AB, A²B, …]`, and
//! `[λI − A, B]` at each computed eigenvalue. The exact answer is confirmed by a fraction-free elimination of
//! this file, and by what mechanics says of each system.

use dashu_int::{IBig, UBig};
use faer::{Mat, c64};
use kardan::analysis::{LinearSystem, structure};
use kardan::num::{Matrix, Rational};

type M = Matrix<Rational>;

/// A decimal, exact.
fn decimal(text: &str) -> Rational {
    let (mantissa, exponent) = text.split_once('e').unwrap_or((text, "0"));
    let (whole, digits) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let number: IBig = format!("{whole}{digits}").parse().expect("digits");
    let shift = exponent.parse::<i32>().expect("an exponent") - digits.len() as i32;
    let power = UBig::from(10u8).pow(shift.unsigned_abs() as usize);
    if shift < 0 { Rational::from_parts(number, power) } else { Rational::from(number * IBig::from(power)) }
}

fn negative(x: &Rational) -> Rational {
    Rational::ZERO - x
}

/// `H q̈ + D q̇ + S q = F u`.
fn mechanism(h: &M, d: &M, s: &M, f: &M) -> LinearSystem {
    let (r, m) = (h.rows(), f.columns());
    let unit = |on: bool| if on { Rational::ONE } else { Rational::ZERO };
    LinearSystem {
        states: (0..2 * r).map(|k| format!("x{k}")).collect(),
        inputs: (0..m).map(|k| format!("u{k}")).collect(),
        outputs: vec![],
        e: M::from_fn(2 * r, 2 * r, |i, j| if i >= r && j >= r { h[(i - r, j - r)].clone() } else { unit(i == j) }),
        a: M::from_fn(2 * r, 2 * r, |i, j| match (i < r, j < r) {
            (true, _) => unit(j == i + r),
            (false, true) => negative(&s[(i - r, j)]),
            (false, false) => negative(&d[(i - r, j - r)]),
        }),
        b: M::from_fn(2 * r, m, |i, j| if i < r { Rational::ZERO } else { f[(i - r, j)].clone() }),
        c: M::zeros(0, 2 * r),
        d: M::zeros(0, m),
        degrees_of_freedom: Some(r),
    }
}

/// Bodies in a row; `links` join neighbours.
fn chain(inertias: &[&str], stiffness: &[&str], damping: &[&str], forces: &[usize]) -> LinearSystem {
    let r = inertias.len();
    let links = |values: &[&str]| {
        let mut out = M::zeros(r, r);
        for (k, value) in values.iter().enumerate() {
            let value = decimal(value);
            for (i, j, sign) in [(k, k, 1), (k + 1, k + 1, 1), (k, k + 1, -1), (k + 1, k, -1)] {
                out[(i, j)] = &out[(i, j)] + &value * Rational::from(sign);
            }
        }
        out
    };
    let h = M::from_fn(r, r, |i, j| if i == j { decimal(inertias[i]) } else { Rational::ZERO });
    let f = M::from_fn(r, forces.len(), |i, j| Rational::from(i64::from(i == forces[j])));
    mechanism(&h, &links(damping), &links(stiffness), &f)
}

// ---- floating point -----------------------------------------------------------------------------------------------

fn float(m: &M) -> Mat<f64> {
    let m = m.to_f64();
    Mat::from_fn(m.rows(), m.columns(), |i, j| m[(i, j)])
}

fn count_large(singular: &[f64], rows: usize, columns: usize) -> usize {
    let largest = singular.iter().copied().fold(0.0, f64::max);
    let tolerance = rows.max(columns) as f64 * f64::EPSILON * largest;
    singular.iter().filter(|s| **s > tolerance).count()
}

/// Rank of `[B, AB, …]`.
fn kalman(a: &Mat<f64>, b: &Mat<f64>) -> usize {
    let (n, m) = (a.nrows(), b.ncols());
    let mut all = Mat::<f64>::zeros(n, n * m);
    let mut next = b.clone();
    for k in 0..n {
        all.submatrix_mut(0, k * m, n, m).copy_from(&next);
        next = a * &next;
    }
    count_large(&all.singular_values().expect("finite"), n, n * m)
}

/// The rank of `[λI − A, B]` at each computed eigenvalue.
fn ranks(a: &Mat<f64>, b: &Mat<f64>) -> Vec<usize> {
    let (n, m) = (a.nrows(), b.ncols());
    let eigenvalues = a.eigenvalues().expect("finite");
    let rank = |lambda: &c64| {
        let pencil = Mat::from_fn(n, n + m, |i, j| match j < n {
            true => (if i == j { *lambda } else { c64::ZERO }) - c64::new(a[(i, j)], 0.0),
            false => c64::new(b[(i, j - n)], 0.0),
        });
        count_large(&pencil.singular_values().expect("finite"), n, n + m)
    };
    eigenvalues.iter().map(rank).collect()
}

/// `E⁻¹A`, `E⁻¹B` computed in floating point, as one would.
fn float_system(system: &LinearSystem) -> (Mat<f64>, Mat<f64>) {
    use faer::linalg::solvers::Solve;
    let e = float(&system.e).partial_piv_lu();
    (e.solve(float(&system.a)), e.solve(float(&system.b)))
}

/// Kalman's rank, and the least of Hautus' ranks: n where the test says that every state is reached.
fn in_floats(system: &LinearSystem) -> (usize, usize) {
    let (a, b) = float_system(system);
    (kalman(&a, &b), ranks(&a, &b).into_iter().min().expect("states"))
}

// ---- exact --------------------------------------------------------------------------------------------------------

/// The rank of `[b, Gb, G²b, …]`, `G = E⁻¹A`, of a single input, by Bareiss' fraction-free elimination on whole numbers.
/// Columns are scaled to whole numbers, which changes no rank.
fn fraction_free_rank(system: &LinearSystem) -> usize {
    let n = system.states.len();
    assert_eq!(system.inputs.len(), 1);
    let whole = |column: &M| -> Vec<IBig> {
        let common = column.as_slice().iter().fold(UBig::ONE, |all, x| {
            let shared = dashu_int::ops::Gcd::gcd(&all, x.denominator());
            all / shared * x.denominator()
        });
        column.as_slice().iter().map(|x| x.numerator() * IBig::from(&common / x.denominator())).collect()
    };
    let solve = |right: &M| {
        let x = system.e.solve(right).expect("E is regular");
        assert_eq!(system.e.multiply(&x), *right);
        x
    };
    let mut rows: Vec<Vec<IBig>> = Vec::new();
    let mut next = solve(&system.b);
    while rows.len() < n {
        rows.push(whole(&next));
        next = solve(&system.a.multiply(&next));
    }
    let mut last = IBig::ONE;
    for k in 0..n {
        let pivot = (k..n).flat_map(|i| (k..n).map(move |j| (i, j))).find(|&(i, j)| rows[i][j] != IBig::ZERO);
        let Some((pivot, column)) = pivot else { return k };
        rows.swap(k, pivot);
        rows.iter_mut().for_each(|row| row.swap(k, column));
        for i in k + 1..n {
            for j in k + 1..n {
                rows[i][j] = (&rows[i][j] * &rows[k][k] - &rows[i][k] * &rows[k][j]) / &last;
            }
        }
        last = rows[k][k].clone();
    }
    n
}

fn exact(system: &LinearSystem) -> usize {
    structure(system).expect("E is regular").controllable_rank
}

/// The library and the elimination of this file agree that every state is reached.
#[track_caller]
fn assert_controllable(system: &LinearSystem) {
    assert_eq!((exact(system), fraction_free_rank(system)), (system.states.len(), system.states.len()));
}

/// The float tests are right where nothing is ill-scaled; otherwise the comparison would say nothing.
#[test]
fn the_float_tests_work_on_tame_systems() {
    let two = chain(&["1", "2"], &["3"], &["0.5"], &[0]);
    assert_eq!(in_floats(&two), (4, 4));
    assert_controllable(&two);
    // Equal bodies held by equal springs, not coupled: the second is not reached.
    let unit = M::identity(2);
    let f = M::from_fn(2, 1, |i, _| Rational::from(i64::from(i == 0)));
    let apart = mechanism(&unit, &unit, &unit, &f);
    assert_eq!((in_floats(&apart), exact(&apart)), ((2, 3), 2));
    assert_eq!(fraction_free_rank(&apart), 2);
}

/// A robot joint: rotor, gear and arm with stiff shafts between them; SI units. Every state is reached by the rotor.
#[test]
fn robot_joint() {
    let joint = chain(&["0.000002", "0.00001", "2.5"], &["50000", "8000"], &["0.001", "0.02"], &[0]);
    assert_controllable(&joint);
    let (kalman, _) = in_floats(&joint);
    assert!(kalman < 4, "the float test finds {kalman} of 6");
}

/// A train of equal bodies, pulled at one end: by the theorem on Jacobi matrices controllable for any length.
#[test]
fn trains_of_bodies() {
    for n in [6, 10, 12, 20] {
        let train = chain(&vec!["0.01"; n], &vec!["100"; n - 1], &vec!["0.02"; n - 1], &[0]);
        assert_controllable(&train);
        let (kalman, hautus) = in_floats(&train);
        assert!(kalman <= 6, "{n} bodies: {kalman}");
        assert_eq!(hautus, 2 * n, "this one is not lost");
    }
}

/// Two equal oscillators (1 kg, 10⁶ N/m) with a thread of 10⁻⁸ N/m or less between them. The determinant of the
/// controllability matrix is the square of the thread's stiffness: not zero. Both float tests lose it.
#[test]
fn weak_coupling() {
    for thread in ["1e-8", "1e-10", "1e-12"] {
        let (k, thread) = (decimal("1e6"), decimal(thread));
        let s = M::from_fn(2, 2, |i, j| if i == j { &k + &thread } else { negative(&thread) });
        let f = M::from_fn(2, 1, |i, _| Rational::from(i64::from(i == 0)));
        let oscillators = mechanism(&M::identity(2), &M::zeros(2, 2), &s, &f);
        assert_controllable(&oscillators);
        assert_eq!(in_floats(&oscillators), (2, 3));
    }
}

/// A free elastic rod in monomials 1, x, x², … (Ritz): `H = [1/(i+j+1)]` is Hilbert's matrix, `S = [ij/(i+j−1)]`.
fn rod(n: usize, force: impl Fn(usize) -> i64) -> LinearSystem {
    let frac = |a: usize, b: usize| Rational::from_parts(a.into(), b.into());
    let h = M::from_fn(n, n, |i, j| frac(1, i + j + 1));
    let s = M::from_fn(n, n, |i, j| if i * j == 0 { Rational::ZERO } else { frac(i * j, i + j - 1) });
    let f = M::from_fn(n, 1, |i, _| Rational::from(force(i)));
    mechanism(&h, &M::zeros(n, n), &s, &f)
}

/// Pushed at its end x = 1, where no mode of a free rod has a node.
#[test]
fn rod_pushed_at_its_end() {
    for n in [8, 12] {
        let rod = rod(n, |_| 1);
        assert_controllable(&rod);
        let (kalman, _) = in_floats(&rod);
        assert!(kalman <= n, "{kalman} of {}", 2 * n);
    }
}

/// Stretched by opposite forces at both ends: motions with u(1 − x) = u(x) are not reached, by symmetry; the others are
/// half of the states. The float tests lose most of these.
#[test]
fn rod_stretched_at_both_ends() {
    let n = 12;
    let rod = rod(n, |i| i64::from(i > 0));
    assert_eq!((exact(&rod), fraction_free_rank(&rod)), (n, n));
    let (a, b) = float_system(&rod);
    assert!(kalman(&a, &b) <= n / 2);
    let reached = ranks(&a, &b).iter().filter(|rank| **rank == 2 * n).count();
    assert!(reached < n, "{reached} of the {n} eigenvalues that are reached");
}

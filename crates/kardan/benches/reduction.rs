//! Speed of reduction, modes and Gramian beside `faer`'s own eigenvalue solver: `cargo bench -p kardan --bench reduction`.
//!
//! A chain of n bodies with springs and dampers between neighbours, a motor at each end, and one gear constraint
//! `q_a = 51 q_b − 50 q_c` in every ten bodies.

use divan::Bencher;
use faer::Mat;
use kardan::analysis::{ConstrainedSystem, Reduction, gramian, modes, reduction};
use kardan::assemble::DirectionalTerm;
use kardan::num::{Matrix, Rational, balance, eigenvalues};

fn main() {
    divan::main();
}

const SIZES: [usize; 2] = [100, 1000];

fn directional_term<T>(element: String, row: &[(usize, i64)], value: T) -> DirectionalTerm<T> {
    DirectionalTerm { element, row: row.iter().map(|(j, x)| (*j, Rational::from(*x))).collect(), value }
}

fn chain(n: usize) -> ConstrainedSystem {
    let fraction = |a: i64, b: i64| Rational::from(a) / Rational::from(b);
    let between = |i: usize| [(i, 1), (i + 1, -1)];
    ConstrainedSystem {
        coordinates: (0..n).map(|i| format!("body_{i}")).collect(),
        inertias: (0..n)
            .map(|i| directional_term(format!("body_{i}"), &[(i, 1)], fraction(1 + i as i64 % 7, 100)))
            .collect(),
        dampers: (0..n - 1)
            .map(|i| directional_term(format!("shaft_{i}"), &between(i), fraction(1 + i as i64 % 5, 50)))
            .collect(),
        springs: (0..n - 1)
            .map(|i| directional_term(format!("shaft_{i}"), &between(i), fraction(90 + i as i64 % 11, 1)))
            .collect(),
        loads: Vec::new(),
        constraints: (0..n / 10)
            .map(|k| directional_term(format!("gear_{k}"), &[(10 * k + 2, 1), (10 * k + 5, -51), (10 * k + 8, 50)], ()))
            .collect(),
        inputs: vec![
            directional_term("first".into(), &[(0, 1)], ()),
            directional_term("last".into(), &[(n - 1, 1)], ()),
        ],
    }
}

fn reduced(n: usize) -> Reduction {
    reduction(&chain(n), &[])
}

/// The state matrix as the eigenvalue solver likes it best.
fn balanced(n: usize) -> Mat<f64> {
    let (a, _) = reduced(n).state_space().expect("every body has inertia");
    let scales = balance(&a);
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] * scales[j] / scales[i])
}

/// C to K, exact, and the four reduced matrices.
#[divan::bench(args = SIZES, max_time = 60)]
fn reduce(bencher: Bencher, n: usize) {
    let system = chain(n);
    bencher.bench(|| {
        let reduced = reduction(&system, &[]);
        (reduced.inertia(), reduced.damping(), reduced.stiffness(), reduced.input())
    });
}

/// faer alone: eigenvalues of the state matrix.
#[divan::bench(args = SIZES, sample_count = 3, sample_size = 1)]
fn faer_eigenvalues(bencher: Bencher, n: usize) {
    let a = balanced(n);
    bencher.bench(|| a.eigenvalues().expect("converges"));
}

/// faer alone: eigenvalues and eigenvectors of the state matrix.
#[divan::bench(args = SIZES, sample_count = 3, sample_size = 1)]
fn faer_eigenvectors(bencher: Bencher, n: usize) {
    let a = balanced(n);
    bencher.bench(|| a.eigen().expect("converges"));
}

/// The library's poles.
#[divan::bench(args = SIZES, sample_count = 3, sample_size = 1)]
fn poles(bencher: Bencher, n: usize) {
    let a = balanced(n);
    let a = Matrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)]);
    bencher.bench(|| eigenvalues(&a).expect("converges"));
}

/// All modes with shapes and energies, from the reduction on.
#[divan::bench(args = SIZES, sample_count = 3, sample_size = 1)]
fn all_modes(bencher: Bencher, n: usize) {
    let (system, reduced) = (chain(n), reduced(n));
    bencher.bench(|| modes(&system, &reduced).expect("converges"));
}

/// The controllability Gramian of both motors over 1 s.
#[divan::bench(args = SIZES, sample_count = 3, sample_size = 1)]
fn gramian_of_one_second(bencher: Bencher, n: usize) {
    let (a, b) = reduced(n).state_space().expect("every body has inertia");
    bencher.bench(|| gramian(&a, &b, 1.0).expect("finite"));
}

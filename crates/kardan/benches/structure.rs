//! Speed of the exact answers on chains of bodies: `cargo bench -p kardan --bench structure`.

use divan::Bencher;
use kardan::analysis::{LinearSystem, certified_structure, structure};
use kardan::num::{Matrix, Rational};

fn main() {
    divan::main();
}

/// A chain of `states / 2` bodies with a spring and a damper between neighbours, a motor at one end and the angle of the
/// other end as output; parameters of three digits that differ from body to body.
fn chain(states: usize) -> LinearSystem {
    let r = states / 2;
    let decimal = |k: usize, step: usize, places: u32| {
        Rational::from_parts((101 + (k * step) % 887).into(), 10u32.pow(places).into())
    };
    let (mut stiffness, mut damping) = (Matrix::<Rational>::zeros(r, r), Matrix::<Rational>::zeros(r, r));
    for k in 1..r {
        for (matrix, value) in [(&mut stiffness, decimal(k, 353, 0)), (&mut damping, decimal(k, 211, 3))] {
            for (i, j, sign) in [(k - 1, k - 1, 1), (k, k, 1), (k - 1, k, -1), (k, k - 1, -1)] {
                matrix[(i, j)] = &matrix[(i, j)] + &value * Rational::from(sign);
            }
        }
    }
    let minus = |x: &Rational| Rational::ZERO - x;
    let one = |yes: bool| if yes { Rational::ONE } else { Rational::ZERO };
    let a = Matrix::from_fn(states, states, |i, j| match (i < r, j < r) {
        (true, _) => one(j == r + i),
        (false, true) => minus(&stiffness[(i - r, j)]),
        (false, false) => minus(&damping[(i - r, j - r)]),
    });
    LinearSystem {
        e: Matrix::from_fn(states, states, |i, j| match (i == j, i < r) {
            (true, true) => Rational::ONE,
            (true, false) => decimal(i, 97, 2),
            _ => Rational::ZERO,
        }),
        freedoms: Some(r),
        ..LinearSystem::state_space(
            a,
            Matrix::from_fn(states, 1, |i, _| one(i == r)),
            Matrix::from_fn(1, states, |_, j| one(j == r - 1)),
        )
    }
}

/// Exact answers, failure probability stated.
#[divan::bench(args = [10, 20, 50, 100, 200, 400, 500], sample_count = 3, sample_size = 1)]
fn exact(bencher: Bencher, states: usize) {
    let system = chain(states);
    bencher.bench(|| structure(&system));
}

/// Every answer proven.
#[divan::bench(args = [10, 20, 50, 64, 100, 200, 400, 500], sample_count = 3, sample_size = 1)]
fn proven(bencher: Bencher, states: usize) {
    let system = chain(states);
    bencher.bench(|| {
        let found = certified_structure(&system, &|_| ()).expect("E is regular");
        assert!(found.certificate.proven);
        found
    });
}

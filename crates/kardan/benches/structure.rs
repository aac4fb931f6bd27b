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
        degrees_of_freedom: Some(r),
        ..LinearSystem::state_space(
            a,
            Matrix::from_fn(states, 1, |i, _| one(i == r)),
            Matrix::from_fn(1, states, |_, j| one(j == r - 1)),
        )
    }
}

/// The chain and its mirror image joined by a body in the middle, which the motor turns and the sensor measures: the
/// motions that leave the middle at rest are neither reached nor seen.
fn mirrored(states: usize) -> LinearSystem {
    let half = chain(2 * (states / 4));
    let (h, r) = (states / 4, 2 * (states / 4) + 1);
    // Bodies 0 … h − 1, the middle h, and the mirror image; the last body of each half is coupled to the middle.
    let part = |matrix: &Matrix<Rational>, row: usize, column: usize, joint: i64| {
        let mut out = Matrix::<Rational>::zeros(r, r);
        for i in 0..h {
            for j in 0..h {
                out[(i, j)] = matrix[(row + i, column + j)].clone();
                out[(r - 1 - i, r - 1 - j)] = matrix[(row + i, column + j)].clone();
            }
        }
        for end in [h - 1, h + 1] {
            for (i, j, sign) in [(end, end, 1), (h, h, 1), (end, h, -1), (h, end, -1)] {
                out[(i, j)] = &out[(i, j)] + Rational::from(-sign * joint);
            }
        }
        out
    };
    let (stiffness, damping) = (part(&half.a, h, 0, 300), part(&half.a, h, h, 1));
    let mut inertia = part(&half.e, h, h, 0);
    inertia[(h, h)] = Rational::from(2);
    let one = |yes: bool| if yes { Rational::ONE } else { Rational::ZERO };
    LinearSystem {
        e: Matrix::from_fn(2 * r, 2 * r, |i, j| match (i < r, j < r) {
            (true, _) => one(i == j),
            (false, true) => Rational::ZERO,
            (false, false) => inertia[(i - r, j - r)].clone(),
        }),
        degrees_of_freedom: Some(r),
        ..LinearSystem::state_space(
            Matrix::from_fn(2 * r, 2 * r, |i, j| match (i < r, j < r) {
                (true, _) => one(j == r + i),
                (false, true) => stiffness[(i - r, j)].clone(),
                (false, false) => damping[(i - r, j - r)].clone(),
            }),
            Matrix::from_fn(2 * r, 1, |i, _| one(i == r + h)),
            Matrix::from_fn(1, 2 * r, |_, j| one(j == h)),
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

/// Every answer proven, half of the motions neither reached nor seen.
#[divan::bench(args = [20, 50, 64, 100, 200, 400], sample_count = 3, sample_size = 1)]
fn proven_mirrored(bencher: Bencher, states: usize) {
    let system = mirrored(states);
    bencher.bench(|| {
        let found = certified_structure(&system, &|_| ()).expect("E is regular");
        assert!(found.certificate.proven && found.controllable_rank == states / 4 * 2 + 2);
        found
    });
}

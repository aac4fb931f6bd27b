//! Proofs over boxes of parameters against known losses, random losses and a scan.

use std::time::Instant;

use kardan::analysis::{BoxProof, Family, prove_box};
use kardan::num::{Matrix, Random, Rational, Scalar};

fn ratio(a: i64, b: i64) -> Rational {
    Rational::from_parts_signed(a.into(), b.into())
}

/// A mechanical system term by term: `power` 0 spring, 1 damper, 2 inertia.
struct Builder {
    shafts: usize,
    multipliers: usize,
    rows: usize,
    family: Family,
}

impl Builder {
    fn new(shafts: usize, multipliers: usize, inputs: usize) -> Self {
        let (rows, columns) = (shafts + multipliers + inputs, shafts + multipliers);
        let zeros = || [0; 3].map(|_| Matrix::zeros(rows, columns));
        Self { shafts, multipliers, rows, family: Family { coefficients: zeros(), slopes: Vec::new() } }
    }

    fn parameter(&mut self) -> usize {
        let (rows, columns) = (self.rows, self.shafts + self.multipliers);
        self.family.slopes.push([0; 3].map(|_| Matrix::zeros(rows, columns)));
        self.family.slopes.len() - 1
    }

    fn outer(&self, value: &Rational, along: &[(usize, i64)]) -> Matrix<Rational> {
        let mut row = vec![Rational::zero(); self.shafts + self.multipliers];
        for &(i, a) in along {
            row[i] = Rational::from(a);
        }
        let mut out = Matrix::zeros(self.rows, self.shafts + self.multipliers);
        for i in 0..row.len() {
            for j in 0..row.len() {
                out[(i, j)] = value.times(&row[i]).times(&row[j]);
            }
        }
        out
    }

    /// A term `value (1 + tolerance x)` along a direction; no parameter if the tolerance is zero.
    fn term(&mut self, power: usize, value: Rational, tolerance: Rational, along: &[(usize, i64)]) {
        let matrix = self.outer(&value, along);
        self.family.coefficients[power] = self.family.coefficients[power].plus(&matrix);
        if !tolerance.is_zero() {
            let i = self.parameter();
            self.family.slopes[i][power] = matrix.scale(&tolerance);
        }
    }

    fn input(&mut self, index: usize, shaft: usize) {
        let row = self.shafts + self.multipliers + index;
        self.family.coefficients[0][(row, shaft)] = Rational::one();
    }
}

fn prove(family: &Family, budget: usize) -> BoxProof {
    prove_box(family, budget, &mut |_| {})
}

fn timed(name: &str, family: &Family, budget: usize) -> BoxProof {
    let start = Instant::now();
    let proof = prove(family, budget);
    println!("{name}: {proof:?} in {:?}", start.elapsed());
    proof
}

/// Bodies in a row with springs and dampers between them, the first and last also to ground.
fn chain(n: usize, inputs: &[usize], tolerated: usize, tolerance: Rational, random: &mut Random) -> Family {
    let mut b = Builder::new(n, 0, inputs.len());
    let mut left = tolerated;
    let mut tol = || {
        if left > 0 {
            left -= 1;
            tolerance.clone()
        } else {
            Rational::zero()
        }
    };
    for i in 0..n {
        b.term(2, ratio(10 + random.below(20) as i64, 10), tol(), &[(i, 1)]);
        if i + 1 < n {
            b.term(0, ratio(10 + random.below(40) as i64, 1), tol(), &[(i, 1), (i + 1, -1)]);
            b.term(1, ratio(1 + random.below(10) as i64, 10), Rational::zero(), &[(i, 1), (i + 1, -1)]);
        }
    }
    b.term(1, ratio(1, 5), tol(), &[(0, 1)]);
    for (k, &shaft) in inputs.iter().enumerate() {
        b.input(k, shaft);
    }
    b.family
}

#[test]
fn experiment() {
    for seed in 0..3 {
        for (n, inputs, q, tol) in [
            (2, vec![0], 2, (1, 10)),
            (3, vec![0], 3, (1, 10)),
            (5, vec![0], 0, (1, 10)),
            (5, vec![0], 1, (1, 10)),
            (5, vec![0], 3, (1, 10)),
            (5, vec![0], 6, (1, 10)),
            (5, vec![0, 2], 6, (1, 10)),
            (5, vec![0, 4], 6, (1, 10)),
            (5, vec![0, 2, 4], 6, (1, 10)),
            (5, vec![0, 2, 4], 9, (1, 10)),
            (8, vec![0, 4], 6, (1, 10)),
            (12, vec![0, 4, 8], 6, (1, 20)),
            (30, vec![0, 6, 12, 18, 24], 6, (1, 20)),
        ] {
            let family = chain(n, &inputs, q, ratio(tol.0, tol.1), &mut Random::new(seed));
            timed(&format!("chain {n} inputs {inputs:?} q {q} tol {tol:?}"), &family, 300_000);
        }
    }
}

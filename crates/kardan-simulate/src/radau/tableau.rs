//! Coefficients of Radau IIA, computed for any odd number of stages.

use std::sync::LazyLock;

use faer::Mat;

use crate::halving::halved;
use kardan_math::num::{Lu, Rational, rational_from_f64, rational_to_f64};

/// Collocation at the s zeros of `P_s − P_(s−1)` on the unit interval, the last of which is 1: order 2s − 1, L-stable.
#[derive(Debug)]
pub(super) struct Tableau {
    /// Stages.
    pub stages: usize,
    /// The nodes, as parts of the step.
    pub nodes: Vec<f64>,
    /// `∫₀^(c_i) ℓ_j`, row by row.
    pub integrals: Vec<f64>,
    /// The real eigenvalue of the inverse of that matrix.
    pub real: f64,
    /// Its pairs of eigenvalues, `α ± iβ`.
    pub pairs: Vec<(f64, f64)>,
    /// Its eigenvectors, that of the real one first, then real and imaginary part of each pair; row by row. And the inverse.
    pub vectors: Vec<f64>,
    pub inverse: Vec<f64>,
    /// Difference of the solution to one of order s, over the increments, without the part `h f(x₀)/real`.
    pub error: Vec<f64>,
    /// Its largest amplification of the rounding errors of its terms.
    pub amplification: f64,
    /// `c_i Π (c_i − c_j)` over the other nodes.
    denominators: Vec<f64>,
}

/// Those that are used.
static TABLEAUS: [LazyLock<Tableau>; 3] =
    [LazyLock::new(|| Tableau::new(3)), LazyLock::new(|| Tableau::new(5)), LazyLock::new(|| Tableau::new(7))];

/// Fewer stages for larger tolerances.
pub(super) fn tableau(relative: f64) -> &'static Tableau {
    let index = match relative {
        x if x >= 1e-4 => 0,
        x if x >= 1e-7 => 1,
        _ => 2,
    };
    &TABLEAUS[index]
}

/// `P_s(x) − P_(s−1)(x)` of Legendre's polynomials.
fn radau_polynomial(s: usize, x: f64) -> f64 {
    let (mut before, mut last) = (1.0, x);
    for k in 2..=s {
        let k = k as f64;
        (before, last) = (last, ((2.0 * k - 1.0) * x * last - (k - 1.0) * before) / k);
    }
    last - before
}

/// The zeros, as parts of the step.
fn nodes(s: usize) -> Vec<f64> {
    // Zeros lie apart by more than 1/s² of the interval.
    let grid = 8 * s * s;
    let at = |k: usize| -1.0 + 2.0 * k as f64 / grid as f64;
    let mut found = Vec::new();
    for k in 0..grid - 1 {
        let rises = radau_polynomial(s, at(k)) < 0.0;
        let changes = |x: f64| (radau_polynomial(s, x) < 0.0) != rises;
        if changes(at(k + 1)) {
            let (zero, _) = halved(at(k), at(k + 1), 0.0, changes);
            found.push(0.5 * (1.0 + zero));
        }
    }
    found.push(1.0);
    found
}

/// `∫₀^(c_i) ℓ_j` over Lagrange's polynomials of the nodes, exact for the nodes as they are rounded.
fn integrals(nodes: &[f64]) -> Vec<f64> {
    let nodes: Vec<Rational> = nodes.iter().filter_map(|c| rational_from_f64(*c)).collect();
    let s = nodes.len();
    let mut out = vec![0.0; s * s];
    for j in 0..s {
        // Coefficients of ℓ_j, constant first.
        let mut polynomial = vec![Rational::ONE];
        for (k, node) in nodes.iter().enumerate().filter(|(k, _)| *k != j) {
            let apart = &nodes[j] - &nodes[k];
            let mut next = vec![Rational::ZERO; polynomial.len() + 1];
            for (power, coefficient) in polynomial.iter().enumerate() {
                let coefficient = coefficient / &apart;
                next[power] = &next[power] - &coefficient * node;
                next[power + 1] = &next[power + 1] + &coefficient;
            }
            polynomial = next;
        }
        for (i, end) in nodes.iter().enumerate() {
            let horner =
                |sum: Rational, (power, c): (usize, &Rational)| (sum + c / Rational::from(power as i64 + 1)) * end;
            out[i * s + j] = rational_to_f64(&polynomial.iter().enumerate().rev().fold(Rational::ZERO, horner));
        }
    }
    out
}

/// The inverse of a regular matrix given row by row.
fn inverse(matrix: &[f64], n: usize) -> Vec<f64> {
    let mut lu = Lu::new(n);
    lu.factor(matrix);
    let mut out = vec![0.0; n * n];
    for column in 0..n {
        let mut unit = vec![0.0; n];
        unit[column] = 1.0;
        lu.solve(&mut unit);
        (0..n).for_each(|row| out[row * n + column] = unit[row]);
    }
    out
}

impl Tableau {
    fn new(s: usize) -> Self {
        let nodes = nodes(s);
        let integrals = integrals(&nodes);
        let inverted = inverse(&integrals, s);
        let eigen = Mat::from_fn(s, s, |i, j| inverted[i * s + j]).eigen().expect("a matrix of finite numbers");
        let (values, columns) = (eigen.S(), eigen.U());
        let mut vectors = vec![0.0; s * s];
        let (mut real, mut pairs) = (f64::NAN, Vec::new());
        for k in 0..s {
            let value = values[k];
            if value.im < 0.0 {
                continue;
            }
            if value.im == 0.0 {
                real = value.re;
                (0..s).for_each(|i| vectors[i * s] = columns[(i, k)].re);
            } else {
                pairs.push((value.re, value.im));
                let first = 2 * pairs.len() - 1;
                for i in 0..s {
                    (vectors[i * s + first], vectors[i * s + first + 1]) = (columns[(i, k)].re, columns[(i, k)].im);
                }
            }
        }
        let other_nodes = |i: usize| (0..s).filter(move |j| *j != i);
        let denominators =
            (0..s).map(|i| other_nodes(i).map(|j| nodes[i] - nodes[j]).product::<f64>() * nodes[i]).collect();
        // A quadrature of order s that has the weight 1/real at 0 differs from the solution's by −ℓ_i(0)/real at the nodes.
        let at_zero = |i: usize| other_nodes(i).map(|j| nodes[j] / (nodes[j] - nodes[i])).product::<f64>();
        let weights: Vec<f64> = (0..s).map(|i| -at_zero(i) / real).collect();
        let error: Vec<f64> = (0..s).map(|j| (0..s).map(|i| weights[i] * inverted[i * s + j]).sum()).collect();
        let amplification = error.iter().fold(1.0, |sum, e| sum + e.abs());
        let inverse = inverse(&vectors, s);
        Self { stages: s, nodes, integrals, real, pairs, vectors, inverse, error, amplification, denominators }
    }

    /// Weights of the increments at a part of the step: Lagrange's polynomials of 0 and the nodes. Returns the polynomial that vanishes
    /// there and has the slope 1 at 0.
    pub fn weights(&self, part: f64, out: &mut [f64]) -> f64 {
        for (i, out) in out.iter_mut().enumerate() {
            let other_nodes = self.nodes.iter().enumerate().filter(|(j, _)| *j != i);
            *out = other_nodes.fold(part, |product, (_, node)| product * (part - node)) / self.denominators[i];
        }
        self.nodes.iter().fold(part, |product, node| product * (node - part) / node)
    }
}

#[cfg(test)]
#[path = "../../tests/unit/radau/tableau.rs"]
mod tests;

//! Accelerations and constraint torques of few coordinates as one matrix times forces and biases: for many right sides
//! at one position.

use kardan_math::num::{Cholesky, dot};

/// Up to this many coordinates a product takes less time than factors.
const MAX_COORDINATES: usize = 6;

/// `[a; λ] = M [f; b]` with `H a = f − Gᵀλ` and `G a + b = 0`.
pub(super) struct Response {
    matrix: Vec<f64>,
    /// Coordinates, and active directions.
    counts: [usize; 2],
    /// Whether it is that of the present modes, at every position.
    pub(super) valid: bool,
    right_side: Vec<f64>,
    found: Vec<f64>,
}

impl Response {
    /// Memory for this many coordinates; `None` where there are more than few.
    pub(super) fn new(r: usize) -> Option<Self> {
        let most = 2 * r;
        let (matrix, right_side, found) = (vec![0.0; most * most], vec![0.0; most], vec![0.0; most]);
        (r <= MAX_COORDINATES).then_some(Self { matrix, counts: [r, 0], valid: false, right_side, found })
    }

    /// Computes M from the factors of H and of `S = G H⁻¹ Gᵀ` and from `W = H⁻¹ Gᵀ` (a row for each direction);
    /// coordinates at rest have no acceleration: `a = (H⁻¹ − W S⁻¹ Wᵀ) f − W S⁻¹ b`, `λ = S⁻¹ (Wᵀ f + b)`.
    pub(super) fn find(&mut self, inertia: &Cholesky, weighted: &[f64], active: &Cholesky, still: &[usize]) {
        let r = self.counts[0];
        let count = weighted.len() / r.max(1);
        let n = r + count;
        self.counts[1] = count;
        let row = |a: usize| &weighted[a * r..(a + 1) * r];
        for j in 0..n {
            let (above, below) = self.found[..n].split_at_mut(r);
            // The torques of a unit force, or of a unit bias.
            (0..count).for_each(|a| below[a] = if j < r { row(a)[j] } else { f64::from(a == j - r) });
            active.solve(below);
            above.fill(0.0);
            if j < r {
                above[j] = 1.0;
                inertia.solve(above);
            }
            for (a, torque) in below.iter().enumerate() {
                above.iter_mut().zip(row(a)).for_each(|(x, weight)| *x -= weight * torque);
            }
            still.iter().for_each(|&i| above[i] = 0.0);
            self.found[..n].iter().enumerate().for_each(|(i, x)| self.matrix[i * n + j] = *x);
        }
    }

    /// Accelerations and torques for forces and biases in the active directions.
    pub(super) fn apply(&mut self, force: &[f64], bias: impl Iterator<Item = f64>) -> [&[f64]; 2] {
        let [r, count] = self.counts;
        let n = r + count;
        self.right_side[..r].copy_from_slice(force);
        self.right_side[r..n].iter_mut().zip(bias).for_each(|(right_side, bias)| *right_side = bias);
        let right_side = &self.right_side[..n];
        for (found, row) in self.found.iter_mut().zip(self.matrix.chunks_exact(n.max(1))) {
            *found = dot(row, right_side);
        }
        let (accelerations, torques) = self.found[..n].split_at(r);
        [accelerations, torques]
    }
}

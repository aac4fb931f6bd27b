//! A linear system in chosen coordinates.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use super::system::minus_loads;
use super::{ConstrainedSystem, LoadSlopes};
use kardan_math::num::{Rational, SparseRow, project, rational_to_f64};
use kardan_mechanics::assemble::DirectionalTerm;

/// A system in chosen coordinates, exact and sparse: `H_r q̈_r + D_r q̇_r + S_r q_r = F_r τ` \[diss. (4.37)\].
#[derive(Debug, Clone)]
pub struct Reduction {
    /// Numbers of the shafts chosen as coordinates q_r, in the order chosen.
    pub coordinates: Vec<usize>,
    /// K, one sparse row per shaft: `q = K q_r` (4.35).
    pub basis: Vec<SparseRow>,
    /// The terms along the directions `Kᵀa` over the coordinates, in the order of the original ones; no constraints.
    pub system: ConstrainedSystem,
}

impl Reduction {
    /// Degrees of freedom.
    pub fn degrees_of_freedom(&self) -> usize {
        self.coordinates.len()
    }

    /// K, shafts × coordinates.
    pub fn basis_matrix(&self) -> Mat<f64> {
        let mut out = Mat::zeros(self.basis.len(), self.degrees_of_freedom());
        for (i, row) in self.basis.iter().enumerate() {
            for (j, x) in row {
                out[(i, *j)] = rational_to_f64(x);
            }
        }
        out
    }

    /// `H_r = KᵀHK` (4.39a).
    pub fn inertia(&self) -> Mat<f64> {
        sum_of_terms(&self.system.inertias, self.degrees_of_freedom())
    }

    /// `D_r = KᵀDK` (4.39b).
    pub fn damping(&self) -> Mat<f64> {
        let sum = sum_of_terms(&self.system.dampers, self.degrees_of_freedom());
        minus_loads(sum, &self.system.loads, |slopes| &slopes.on_rates)
    }

    /// `S_r = KᵀSK` (4.39c).
    pub fn stiffness(&self) -> Mat<f64> {
        let sum = sum_of_terms(&self.system.springs, self.degrees_of_freedom());
        minus_loads(sum, &self.system.loads, |slopes| &slopes.on_positions)
    }

    /// `F_r = KᵀF` (4.38).
    pub fn input(&self) -> Mat<f64> {
        columns(&self.system.inputs, self.degrees_of_freedom())
    }

    /// `A = [0 I; −H_r⁻¹S_r −H_r⁻¹D_r]` and `B = [0; H_r⁻¹F_r]` for the states `[q_r; q̇_r]`; `None` if `H_r` is not
    /// numerically positive definite.
    pub fn state_space(&self) -> Option<(Mat<f64>, Mat<f64>)> {
        let r = self.degrees_of_freedom();
        let factor = self.inertia().llt(Side::Lower).ok()?;
        let [s, d, f] = [self.stiffness(), self.damping(), self.input()].map(|m| factor.solve(&m));
        let a = Mat::from_fn(2 * r, 2 * r, |i, j| match (i < r, j < r) {
            (true, true) => 0.0,
            (true, false) => f64::from(u8::from(j - r == i)),
            (false, true) => 0.0 - s[(i - r, j)],
            (false, false) => 0.0 - d[(i - r, j - r)],
        });
        let b = Mat::from_fn(2 * r, f.ncols(), |i, j| if i < r { 0.0 } else { f[(i - r, j)] });
        Some((a, b))
    }
}

/// Eliminates the constraints (Theorem 4.1): every term `c a aᵀ` becomes `c (Kᵀa)(Kᵀa)ᵀ`.
///
/// The coordinates are those of [`ConstrainedSystem::explicit_basis`]: as many of `preferred` as are independent, then others
/// by number. Exact; the work grows with the number of entries, not with the square of the number of shafts.
///
/// # Panics
/// If `preferred` or a term names a shaft that does not exist, or `preferred` has a duplicate.
pub fn reduction(system: &ConstrainedSystem, preferred: &[usize]) -> Reduction {
    let (coordinates, basis) = system.sparse_basis(preferred);
    let system = reduced_system(system, &coordinates, &basis);
    Reduction { coordinates, basis, system }
}

/// The terms of a system along the directions `Kᵀa` over the coordinates chosen.
pub(super) fn reduced_system(
    system: &ConstrainedSystem,
    coordinates: &[usize],
    basis: &[SparseRow],
) -> ConstrainedSystem {
    let terms = |terms: &[DirectionalTerm<Rational>]| terms.iter().map(|term| reduced(term, basis)).collect();
    ConstrainedSystem {
        coordinates: coordinates.iter().map(|&shaft| system.coordinates[shaft].clone()).collect(),
        inertias: terms(&system.inertias),
        dampers: terms(&system.dampers),
        springs: terms(&system.springs),
        loads: system.loads.iter().map(|load| reduced_load(load, basis)).collect(),
        constraints: Vec::new(),
        inputs: system.inputs.iter().map(|input| reduced(input, basis)).collect(),
    }
}

fn reduced<T: Clone>(term: &DirectionalTerm<T>, basis: &[SparseRow]) -> DirectionalTerm<T> {
    DirectionalTerm { element: term.element.clone(), row: project(&term.row, basis), value: term.value.clone() }
}

fn reduced_load(load: &DirectionalTerm<LoadSlopes>, basis: &[SparseRow]) -> DirectionalTerm<LoadSlopes> {
    let LoadSlopes { on_positions, on_rates, rounded } = &load.value;
    let [on_positions, on_rates] = [on_positions, on_rates].map(|row| project(row, basis));
    let value = LoadSlopes { on_positions, on_rates, rounded: *rounded };
    DirectionalTerm { element: load.element.clone(), row: project(&load.row, basis), value }
}

/// `Σ c a aᵀ` in floating point, symmetric to the last bit.
pub fn sum_of_terms(terms: &[DirectionalTerm<Rational>], n: usize) -> Mat<f64> {
    let mut out = Mat::zeros(n, n);
    for term in terms {
        let (row, value) = (term.row_f64(), rational_to_f64(&term.value));
        for &(i, x) in &row {
            for &(j, y) in &row {
                out[(i, j)] += value * (x * y);
            }
        }
    }
    out
}

/// The directions as columns, n × directions.
pub(super) fn columns(directions: &[DirectionalTerm<()>], n: usize) -> Mat<f64> {
    let mut out = Mat::zeros(n, directions.len());
    for (k, direction) in directions.iter().enumerate() {
        for (i, x) in direction.row_f64() {
            out[(i, k)] = x;
        }
    }
    out
}

//! The projector of the constraint forces.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use super::bases::named;
use super::family::to_mat;
use super::reduction::columns;
use super::{BasisError, ConstrainedSystem, reduction, sum_of_terms};
use kardan_math::num::{Definiteness, Matrix, Scalar, definiteness};
use kardan_results::{ConstraintForces, NamedMatrix};

/// Up to this number of shafts all is computed over the rationals.
const EXACT_UP_TO: usize = 24;

/// The projector of the constraint forces \[diss. Theorem 4.5\]: `τ_c = −P (Fτ − Dq̇ − Sq)`.
///
/// Computed as `P = I − H K (KᵀHK)⁻¹ Kᵀ`, which needs `KᵀHK` definite only, so that shafts may be massless. Where H is
/// regular this is (4.56), `P = Cᵀ(CH⁻¹Cᵀ)⁻¹CH⁻¹`: both are projectors with range `range Cᵀ` and kernel `H ker C`. In
/// both cases `P² = P`, `PᵀK = 0`, `P Cᵀ = Cᵀ`. Multipliers follow from `Cᵀλ = τ_c`: `λ = −(CCᵀ)⁻¹ C P (Fτ − Dq̇ − Sq)`
/// (erratum to (4.54): with the minus sign). A multiplier has the unit N m divided by the unit of its constraint.
///
/// Exact up to 24 shafts, then rounded once; above in floating point (Cholesky factors of `KᵀHK` and `CCᵀ`).
/// Cost O(shafts³).
///
/// # Errors
/// [`BasisError::InertiaNotDefinite`] if a motion that the constraints allow has no kinetic energy.
pub fn constraint_forces(system: &ConstrainedSystem) -> Result<ConstraintForces, BasisError> {
    let (p, multipliers) = if system.coordinates.len() <= EXACT_UP_TO { exact(system)? } else { rounded(system)? };
    let input = columns(&system.inputs, system.coordinates.len());
    let residual = &p * &p - &p;
    let shafts = &system.coordinates;
    let inputs: Vec<String> = system.inputs.iter().map(|input| input.element.clone()).collect();
    let constraints: Vec<String> = system.constraints.iter().map(|c| c.element.clone()).collect();
    let negative = |title: &str, rows: &[String], m: Mat<f64>| -> NamedMatrix {
        named(title, "", rows, &inputs, &Mat::from_fn(m.nrows(), m.ncols(), |i, j| 0.0 - m[(i, j)]))
    };
    Ok(ConstraintForces {
        projector: named("projector of the constraint forces", "", shafts, shafts, &p),
        rank: system.constraints.len(),
        idempotence_residual: residual.norm_max(),
        input_to_torque: negative("constraint torque per input", shafts, &p * &input),
        input_to_multiplier: negative("multiplier per input", &constraints, &multipliers * &input),
    })
}

/// P and `(CCᵀ)⁻¹ C P` over the rationals, rounded at the end.
fn exact(system: &ConstrainedSystem) -> Result<(Mat<f64>, Mat<f64>), BasisError> {
    let (_, k) = system.explicit_basis(&[]);
    let (c, h) = (system.constraint_matrix(), system.inertia_matrix());
    let hk = h.multiply(&k);
    let reduced = k.transpose().multiply(&hk);
    if let Definiteness::PositiveSemi { direction: x } | Definiteness::Indefinite { witness: x } =
        definiteness(&reduced)
    {
        let x = Matrix::from_fn(x.len(), 1, |i, _| x[i].clone());
        let energy = x.transpose().multiply(&reduced).multiply(&x).to_f64()[(0, 0)];
        let direction = k.multiply(&x).as_slice().iter().map(Scalar::to_f64).collect();
        return Err(BasisError::InertiaNotDefinite { direction, energy });
    }
    let regular = "a definite matrix is regular";
    let moving = hk.multiply(&reduced.solve(&k.transpose()).expect(regular));
    let p = Matrix::identity(system.coordinates.len()).minus(&moving);
    let multipliers = c.multiply(&c.transpose()).solve(&c.multiply(&p)).expect("the rows of C are independent");
    Ok((to_mat(&p), to_mat(&multipliers)))
}

fn rounded(system: &ConstrainedSystem) -> Result<(Mat<f64>, Mat<f64>), BasisError> {
    let n = system.coordinates.len();
    let reduced = reduction(system, &[]);
    let k = reduced.basis_matrix();
    let Ok(factor) = reduced.inertia().llt(Side::Lower) else { return Err(not_definite(&reduced.inertia(), &k)) };
    let hk = sum_of_terms(&system.inertias, n) * &k;
    let p = Mat::<f64>::identity(n, n) - hk * factor.solve(k.transpose());
    let c = columns(&system.constraints, n);
    let gram = c.transpose() * &c;
    let factor = gram.llt(Side::Lower).map_err(|_| BasisError::NotFinite { matrix: "constraints" })?;
    let multipliers = factor.solve(c.transpose() * &p);
    Ok((p, multipliers))
}

/// The eigenvector of the smallest eigenvalue of the reduced inertia proves it.
fn not_definite(inertia: &Mat<f64>, k: &Mat<f64>) -> BasisError {
    match inertia.self_adjoint_eigen(Side::Lower) {
        Ok(eigen) if inertia.is_all_finite() => {
            let direction = k * eigen.U().col(0);
            BasisError::InertiaNotDefinite { direction: direction.iter().copied().collect(), energy: eigen.S()[0] }
        }
        _ => BasisError::NotFinite { matrix: "inertia" },
    }
}

//! Analysis of linear models.

mod bases;
mod box_proof;
mod certified;
mod class;
mod constraint_forces;
mod construction;
mod failing;
mod family;
mod gramian;
mod images;
mod loss;
mod massless;
mod modes;
mod pencil;
mod placement;
mod reduction;
mod sampling;
mod spectrum;
mod structure;
mod system;
mod zeros;

pub use bases::{BasisError, bases, eigenvalue_bounds, gram_schmidt};
pub use box_proof::{BoxProof, PencilBox, prove_box};
pub use class::class;
pub use constraint_forces::constraint_forces;
pub use construction::construction;
pub use failing::{Mechanics, failing_modes};
pub use family::{Family, Parameter, Pencil, SystemAt, loss_pencil};
pub use gramian::{Gramian, gramian, smallest_eigenvalue, transfer_energy};
pub use loss::{FARTHEST, nearest_loss};
pub use massless::{Eliminated, MasslessError, combination, eliminate_massless, massless_direction};
pub use modes::{modes, modes_of_pencil};
pub use pencil::{OutputSignal, linear_system};
pub use placement::{Candidate, Measure, Side, place, with_candidates};
pub use reduction::{Reduction, reduction, sum_of_terms};
pub use sampling::{SamplingPlan, sample, wilson};
pub use structure::{StructureError, certified_structure, controllable_rank, structure};
pub use system::{ConstrainedSystem, LinearSystem};

use crate::num::{Matrix, eigenvalues};
use crate::reduce::LinearModel;
use crate::results::Pole;
use crate::synthesis::Law;

/// Poles of a linear model under the linear parts of its laws, 1/s, sorted by size.
///
/// State matrix `[0 I; −H⁻¹(S − F Kq) −H⁻¹(D − F Kv)]` with the laws' gains on shaft angles brought to reduced
/// coordinates by the basis. `None` if a matrix is not finite or the eigenvalue iteration fails.
///
/// # Panics
/// If the inertia matrix is singular.
pub fn closed_loop_poles(model: &LinearModel, laws: &[Box<dyn Law>]) -> Option<Vec<Pole>> {
    let r = model.inertia.rows();
    let basis = model.basis.to_f64();
    let input = model.input.to_f64();
    let (mut stiffness, mut damping) = (model.stiffness.to_f64(), model.damping.to_f64());
    for law in laws {
        let (on_angles, on_speeds) = law.gains();
        let (on_angles, on_speeds) = (on_angles.multiply(&basis), on_speeds.multiply(&basis));
        for (row, name) in law.inputs().iter().enumerate() {
            let column = model.inputs.iter().position(|input| input == name)?;
            for i in 0..r {
                for j in 0..r {
                    stiffness[(i, j)] -= input[(i, column)] * on_angles[(row, j)];
                    damping[(i, j)] -= input[(i, column)] * on_speeds[(row, j)];
                }
            }
        }
    }
    let inertia = model.inertia.to_f64();
    let (a, b) = (inertia.solve(&stiffness)?, inertia.solve(&damping)?);
    let state = Matrix::from_fn(2 * r, 2 * r, |i, j| match (i < r, j < r) {
        (true, true) => 0.0,
        (true, false) => f64::from(u8::from(j - r == i)),
        (false, true) => -a[(i - r, j)],
        (false, false) => -b[(i - r, j - r)],
    });
    eigenvalues(&state)
}

use super::Law;
use crate::num::{Matrix, eigenvalues};
use crate::reduce::LinearModel;
use crate::results::Pole;

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

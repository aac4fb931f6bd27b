//! The pencil of a linear system with named outputs.

use super::parts::{joined, reduced_form, side_by_side, stacked};
use super::reduction::reduced_system;
use super::{ConstrainedSystem, LinearSystem};
use kardan_math::num::{Matrix, Rational, Scalar, SparseRow, dense_rows, project, sparse_rows};
use kardan_mechanics::equations::Measured;
use kardan_results::signal_name::Quantity;

/// An output of a linear system: a signal with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputSignal {
    /// `rk.phi`, or the name of a sensor.
    pub name: String,
    /// What it is.
    pub measured: Measured,
}

/// The reduced system as `E ẋ = A x + B u`, `y = C x + D u` with `x = [q_r; q̇_r]`, `E = diag(I, H_r)`,
/// `A = [0 I; −S_r −D_r]`, `B = [0; F_r]` \[diss. (4.37), (5.5)\], exact.
///
/// `coordinates` and `basis` are those of [`ConstrainedSystem::explicit_basis`]. A spring torque is `s` times the twist; a
/// constraint torque follows from the balance `Cᵀλ = Hq̈ + Dq̇ + Sq − Fτ` and may respond to inputs at once.
///
/// With a singular H_r (positive semidefinite, as sums of inertias are) E is singular too; see
/// [`eliminate_massless`](super::eliminate_massless).
///
/// # Panics
/// If an output names a shaft or an element that is not there.
pub fn linear_system(
    system: &ConstrainedSystem,
    coordinates: &[usize],
    basis: &Matrix<Rational>,
    outputs: &[OutputSignal],
) -> LinearSystem {
    let r = coordinates.len();
    let rows = sparse_rows(basis);
    let reduced = reduced_system(system, coordinates, &rows);
    let [inertia, input] = [reduced.inertia_matrix(), reduced.input_matrix()];
    let [damping, stiffness] = [reduced.damping_matrix(), reduced.stiffness_matrix()];
    let (zero, one, m) = (Matrix::zeros(r, r), Matrix::identity(r), system.inputs.len());
    let minus = |matrix: &Matrix<Rational>| matrix.scale(&Rational::NEG_ONE);
    let e = joined([&one, &zero], [&zero, &inertia]);
    let a = joined([&zero, &one], [&minus(&stiffness), &minus(&damping)]);
    let b = stacked(&[&Matrix::zeros(r, m), &input]);
    let mut c = Matrix::<Rational>::zeros(outputs.len(), 2 * r);
    let mut d = Matrix::<Rational>::zeros(outputs.len(), m);
    for (i, output) in outputs.iter().enumerate() {
        let row = OutputRow::of(system, &output.measured);
        let [on_positions, on_speeds, on_inputs] =
            row.over_states(system, &rows, [&stiffness, &damping, &inertia, &input]);
        c.row_mut(i).clone_from_slice(side_by_side(&[&on_positions, &on_speeds]).as_slice());
        d.row_mut(i).clone_from_slice(on_inputs.as_slice());
    }
    let names = reduced.coordinates.iter();
    LinearSystem {
        states: names.clone().map(|n| Quantity::Angle.of(n)).chain(names.map(|n| Quantity::Speed.of(n))).collect(),
        inputs: system.inputs.iter().map(|input| input.element.clone()).collect(),
        outputs: outputs.iter().map(|output| output.name.clone()).collect(),
        e,
        a,
        b,
        c,
        d,
        degrees_of_freedom: Some(r),
    }
}

/// An output of a system before reduction, as rows.
pub(super) struct OutputRow {
    /// Over positions, speeds and accelerations of the coordinates.
    pub motion: [Matrix<Rational>; 3],
    /// Over the multipliers of the constraints.
    pub multipliers: Matrix<Rational>,
}

impl OutputRow {
    pub fn of(system: &ConstrainedSystem, measured: &Measured) -> Self {
        let mut motion = [0; 3].map(|_| Matrix::<Rational>::zeros(1, system.coordinates.len()));
        let mut multipliers = Matrix::<Rational>::zeros(1, system.constraints.len());
        let mut add = |order: usize, coordinate: usize, x: &Rational| {
            let entry = &mut motion[order][(0, coordinate)];
            *entry = entry.plus(x);
        };
        match measured {
            Measured::Angle(name) => add(0, system.shaft(name), &Rational::ONE),
            Measured::Speed(name) => add(1, system.shaft(name), &Rational::ONE),
            Measured::SpringTorque(element) => {
                for spring in system.springs.iter().filter(|spring| spring.element == *element) {
                    spring.row.iter().for_each(|(k, x)| add(0, *k, &spring.value.times(x)));
                }
            }
            Measured::NetTorque(name) => add(2, system.shaft(name), &system.own_inertia(system.shaft(name))),
            Measured::ComplianceTorque(element, name) => {
                // −(s aᵀq + d aᵀq̇) on the shaft's entry of a.
                for (order, laws) in [(0, &system.springs), (1, &system.dampers)] {
                    for law in laws.iter().filter(|law| law.element == *element) {
                        let Some((_, own)) = law.row.iter().find(|(k, _)| *k == system.shaft(name)) else { continue };
                        let factor = Rational::ZERO.minus(&law.value.times(own));
                        law.row.iter().for_each(|(k, x)| add(order, *k, &factor.times(x)));
                    }
                }
            }
            Measured::ConstraintTorque(element, name) => {
                let shaft = system.shaft(name);
                for (k, constraint) in system.constraints.iter().enumerate().filter(|(_, c)| c.element == *element) {
                    let own = constraint.row.iter().find(|(candidate, _)| *candidate == shaft);
                    own.into_iter().for_each(|(_, x)| multipliers[(0, k)] = x.clone());
                }
            }
            Measured::Signal(_) => {} // The mechanism does not determine it.
        }
        Self { motion, multipliers }
    }

    /// The rows over positions and speeds of the reduced coordinates, and over inputs; `basis` has a row for each coordinate, and the
    /// matrices are those of the reduced system.
    fn over_states(
        self,
        system: &ConstrainedSystem,
        basis: &[SparseRow],
        [stiffness, damping, inertia, input]: [&Matrix<Rational>; 4],
    ) -> [Matrix<Rational>; 3] {
        let is_zero = |row: &Matrix<Rational>| row.as_slice().iter().all(Scalar::is_zero);
        let Self { mut motion, multipliers } = self;
        let mut on_inputs = Matrix::<Rational>::zeros(1, input.columns());
        if !is_zero(&multipliers) {
            // λ = (CCᵀ)⁻¹ C (Hq̈ + Dq̇ + Sq − Fτ)
            let rows = system.constraint_matrix();
            let gram = rows.multiply(&rows.transpose());
            let direction = multipliers.multiply(&gram.solve(&rows).expect("the constraints are independent"));
            let matrices = [system.stiffness_matrix(), system.damping_matrix(), system.inertia_matrix()];
            for (row, matrix) in motion.iter_mut().zip(&matrices) {
                *row = row.plus(&direction.multiply(matrix));
            }
            on_inputs = on_inputs.minus(&direction.multiply(&system.input_matrix()));
        }
        let reduced = |row: Matrix<Rational>| dense_rows(&[project(&sparse_rows(&row)[0], basis)], inertia.rows());
        let [on_positions, on_speeds, on_accelerations] = motion.map(reduced);
        if is_zero(&on_accelerations) {
            return [on_positions, on_speeds, on_inputs];
        }
        // q̈_r = H⁻¹ (F u − D q̇ − S q)
        let per_torque = any_solution(&inertia.transpose(), &on_accelerations.transpose()).transpose();
        [
            on_positions.minus(&per_torque.multiply(stiffness)),
            on_speeds.minus(&per_torque.multiply(damping)),
            on_inputs.plus(&per_torque.multiply(input)),
        ]
    }
}

/// One solution of M x = y. There is one: a motion v without inertia (`H_r v = 0`) has `H K v = 0`, hence takes no torque,
/// and moves no inertia of a single shaft.
fn any_solution(matrix: &Matrix<Rational>, right: &Matrix<Rational>) -> Matrix<Rational> {
    let n = matrix.columns();
    let e = reduced_form(&side_by_side(&[matrix, right]));
    assert!(!e.pivots.contains(&n), "the inertia is positive semidefinite");
    let mut out = Matrix::<Rational>::zeros(n, 1);
    for (row, &pivot) in e.pivots.iter().enumerate() {
        out[(pivot, 0)] = e.form[(row, n)].clone();
    }
    out
}

//! The pencil of a linear system with named outputs.

use super::parts::{beside, reduced_form, stacked};
use super::reduction::reduced_load;
use super::system::minus_loads;
use super::{ConstrainedSystem, LinearSystem};
use kardan_math::num::{Matrix, Rational, Scalar, project, sparse_rows, sum_of_outer};
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
    let [inertia, damping, stiffness] = [&system.inertias, &system.dampers, &system.springs]
        .map(|terms| sum_of_outer(terms.iter().map(|term| (project(&term.row, &rows), term.value.clone())), r));
    let loads: Vec<_> = system.loads.iter().map(|load| reduced_load(load, &rows)).collect();
    let damping = minus_loads(damping, &loads, |slopes| &slopes.on_rates);
    let stiffness = minus_loads(stiffness, &loads, |slopes| &slopes.on_positions);
    let mut input = Matrix::<Rational>::zeros(r, system.inputs.len());
    for (k, input_term) in system.inputs.iter().enumerate() {
        project(&input_term.row, &rows).into_iter().for_each(|(j, x)| input[(j, k)] = x);
    }
    let (e, a) = first_order(&inertia, &damping, &stiffness);
    let m = system.inputs.len();
    let b = stacked(&Matrix::zeros(r, m), &input);
    let mut c = Matrix::<Rational>::zeros(outputs.len(), 2 * r);
    let mut d = Matrix::<Rational>::zeros(outputs.len(), m);
    let shaft = |name: &String| system.shaft(name);
    for (i, output) in outputs.iter().enumerate() {
        match &output.measured {
            Measured::Angle(name) => c.row_mut(i)[..r].clone_from_slice(basis.row(shaft(name))),
            Measured::Speed(name) => c.row_mut(i)[r..].clone_from_slice(basis.row(shaft(name))),
            Measured::SpringTorque(element) => {
                for spring in system.springs.iter().filter(|spring| spring.element == *element) {
                    for (shaft, x) in &spring.row {
                        let factor = spring.value.times(x);
                        (0..r).for_each(|j| c[(i, j)] = c[(i, j)].plus(&factor.times(&basis[(*shaft, j)])));
                    }
                }
            }
            Measured::NetTorque(name) => {
                // J aᵀ q̈_r with q̈_r = H⁻¹ (F u − D q̇ − S q).
                let (shaft, own) = (shaft(name), system.own_inertia(shaft(name)));
                let row = Matrix::from_fn(1, r, |_, j| basis[(shaft, j)].times(&own));
                let per_torque = any_solution(&inertia, &row.transpose()).transpose();
                let [on_angles, on_speeds, on_inputs] =
                    [&stiffness, &damping, &input].map(|matrix| per_torque.multiply(matrix));
                (0..r).for_each(|j| c[(i, j)] = minus(&on_angles[(0, j)]));
                (0..r).for_each(|j| c[(i, r + j)] = minus(&on_speeds[(0, j)]));
                (0..m).for_each(|j| d[(i, j)] = on_inputs[(0, j)].clone());
            }
            Measured::ComplianceTorque(element, name) => {
                // −(s aᵀq + d aᵀq̇) on the shaft's entry of a.
                let laws = system.springs.iter().map(|spring| (spring, 0));
                for (law, first) in laws.chain(system.dampers.iter().map(|damper| (damper, r))) {
                    let own = law.row.iter().find(|(k, _)| law.element == *element && *k == shaft(name));
                    let Some((_, own)) = own else { continue };
                    for (k, x) in &law.row {
                        let factor = minus(&law.value.times(x).times(own));
                        (0..r).for_each(|j| c[(i, first + j)] = c[(i, first + j)].plus(&factor.times(&basis[(*k, j)])));
                    }
                }
            }
            Measured::ConstraintTorque(element, name) => {
                let (on_states, on_inputs) =
                    constraint_torque(system, basis, [&inertia, &damping, &stiffness, &input], element, shaft(name));
                (0..2 * r).for_each(|j| c[(i, j)] = on_states[j].clone());
                (0..m).for_each(|j| d[(i, j)] = on_inputs[j].clone());
            }
            Measured::Signal(_) => {} // The mechanism does not determine it.
        }
    }
    let names = coordinates.iter().map(|&shaft| &system.coordinates[shaft]);
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

fn minus(x: &Rational) -> Rational {
    Rational::ZERO.minus(x)
}

/// E and A of the states `[q_r; q̇_r]`.
fn first_order(
    inertia: &Matrix<Rational>,
    damping: &Matrix<Rational>,
    stiffness: &Matrix<Rational>,
) -> (Matrix<Rational>, Matrix<Rational>) {
    let r = inertia.rows();
    let (mut e, mut a) = (Matrix::<Rational>::zeros(2 * r, 2 * r), Matrix::<Rational>::zeros(2 * r, 2 * r));
    for i in 0..r {
        (e[(i, i)], a[(i, r + i)]) = (Rational::ONE, Rational::ONE);
        let entries = |m: &Matrix<Rational>| (0..r).filter(|&j| !m[(i, j)].is_zero()).collect::<Vec<_>>();
        entries(inertia).into_iter().for_each(|j| e[(r + i, r + j)] = inertia[(i, j)].clone());
        entries(stiffness).into_iter().for_each(|j| a[(r + i, j)] = minus(&stiffness[(i, j)]));
        entries(damping).into_iter().for_each(|j| a[(r + i, r + j)] = minus(&damping[(i, j)]));
    }
    (e, a)
}

/// Torque of an element's constraints on a shaft, over the states and the inputs.
fn constraint_torque(
    system: &ConstrainedSystem,
    basis: &Matrix<Rational>,
    [inertia, damping, stiffness, input]: [&Matrix<Rational>; 4],
    element: &str,
    shaft: usize,
) -> (Vec<Rational>, Vec<Rational>) {
    let rows = system.constraint_matrix();
    let weights = Matrix::from_fn(1, rows.rows(), |_, k| {
        if system.constraints[k].element == element { rows[(k, shaft)].clone() } else { Rational::ZERO }
    });
    // weightsᵀ λ with λ = (CCᵀ)⁻¹ C (Hq̈ + Dq̇ + Sq − Fτ)
    let gram = rows.multiply(&rows.transpose());
    let multiplier = gram.solve(&rows).expect("the constraints are independent");
    let direction = weights.multiply(&multiplier);
    let on = |m: &Matrix<Rational>| direction.multiply(m).multiply(basis);
    let acceleration = on(&system.inertia_matrix());
    let per_inertia = any_solution(&inertia.transpose(), &acceleration.transpose());
    let through = |m: &Matrix<Rational>| per_inertia.transpose().multiply(m);
    let difference = |a: Matrix<Rational>, b: Matrix<Rational>| {
        (0..a.columns()).map(|j| a[(0, j)].minus(&b[(0, j)])).collect::<Vec<_>>()
    };
    let mut on_states = difference(on(&system.stiffness_matrix()), through(stiffness));
    on_states.extend(difference(on(&system.damping_matrix()), through(damping)));
    (on_states, difference(through(input), direction.multiply(&system.input_matrix())))
}

/// One solution of M x = y. There is one: a motion v without inertia (`H_r v = 0`) has `H K v = 0`, hence takes no torque,
/// and moves no inertia of a single shaft.
fn any_solution(matrix: &Matrix<Rational>, right: &Matrix<Rational>) -> Matrix<Rational> {
    let n = matrix.columns();
    let e = reduced_form(&beside(matrix, right));
    assert!(!e.pivots.contains(&n), "the inertia is positive semidefinite");
    let mut out = Matrix::<Rational>::zeros(n, 1);
    for (row, &pivot) in e.pivots.iter().enumerate() {
        out[(pivot, 0)] = e.form[(row, n)].clone();
    }
    out
}

//! Linear equations of motion as equations of first order.

use kardan_math::num::{Matrix, Scalar, selected};

/// `ż = A z + B τ` of `H q̈_r + D q̇_r + S q_r = F τ`, with the states `z = [q_r; q̇_m]` where m are the coordinates that have an inertia.
///
/// A coordinate without inertia has a damping of its own ([`massless_dynamics`](super::massless_dynamics())), so its rate follows from the states and the inputs.
#[derive(Debug, Clone, PartialEq)]
pub struct FirstOrder<S> {
    /// A, states × states.
    pub a: Matrix<S>,
    /// B, states × inputs.
    pub b: Matrix<S>,
    /// m: numbers of the coordinates whose rates are states.
    pub moving: Vec<usize>,
}

/// Numbers of the coordinates that have an inertia.
pub fn with_inertia<S: Scalar>(inertia: &Matrix<S>) -> Vec<usize> {
    (0..inertia.rows()).filter(|k| !inertia[(*k, *k)].is_zero()).collect()
}

impl<S: Scalar> FirstOrder<S> {
    /// From the coordinates that have an inertia ([`with_inertia`]) and the matrices H, D, S and F; `None` if a coordinate has neither inertia nor
    /// damping, or a matrix is not definite.
    pub fn new(moving: Vec<usize>, [inertia, damping, stiffness, input]: [&Matrix<S>; 4]) -> Option<Self> {
        let (r, m) = (inertia.rows(), input.columns());
        let relaxing: Vec<usize> = (0..r).filter(|k| !moving.contains(k)).collect();
        let minus = S::zero().minus(&S::one());
        let own = selected(inertia, &moving, &moving);
        // The entries of some rows on the coordinates: of positions, of rates with an inertia, of inputs.
        let acting = |rows: &[usize]| {
            let all: Vec<usize> = (0..r).collect();
            let inputs: Vec<usize> = (0..m).collect();
            [selected(stiffness, rows, &all), selected(damping, rows, &moving), selected(input, rows, &inputs)]
        };
        let mut on_moving = acting(&moving);
        // q̇ = −D⁻¹ (S q_r + D q̇_m − F τ) of those without.
        let mut rates = None;
        if !relaxing.is_empty() {
            let damped = selected(damping, &relaxing, &relaxing);
            let [on_positions, on_rates, on_inputs] = acting(&relaxing);
            let found = [damped.solve(&on_positions)?, damped.solve(&on_rates)?, damped.solve(&on_inputs)?];
            let across = selected(damping, &moving, &relaxing).scale(&minus);
            for (of, found) in on_moving.iter_mut().zip(&found) {
                *of = of.plus(&across.multiply(found));
            }
            rates = Some(found);
        }
        let [on_positions, on_rates, on_inputs] = on_moving;
        let accelerations = [own.solve(&on_positions)?, own.solve(&on_rates)?, own.solve(&on_inputs)?];
        let n = r + moving.len();
        let (mut a, mut b) = (Matrix::zeros(n, n), Matrix::zeros(n, m));
        moving.iter().enumerate().for_each(|(k, &place)| a[(place, r + k)] = S::one());
        let rows = (r..n).enumerate().map(|(k, row)| (&accelerations, k, row));
        let relaxing = relaxing.iter().enumerate();
        let rates = rates.iter().flat_map(|rates| relaxing.clone().map(move |(k, &row)| (rates, k, row)));
        for ([on_positions, on_rates, on_inputs], k, row) in rows.chain(rates) {
            (0..r).for_each(|j| a[(row, j)] = minus.times(&on_positions[(k, j)]));
            (r..n).for_each(|j| a[(row, j)] = minus.times(&on_rates[(k, j - r)]));
            (0..m).for_each(|j| b[(row, j)] = on_inputs[(k, j)].clone());
        }
        Some(Self { a, b, moving })
    }
}

/// Rows over angles and speeds of all shafts as rows over the states of [`FirstOrder`], with the basis K. They do not
/// depend on rates that are not states.
pub fn over_states<S: Scalar>(
    [on_angles, on_speeds]: [&Matrix<S>; 2],
    basis: &Matrix<S>,
    moving: &[usize],
) -> Matrix<S> {
    let r = basis.columns();
    let (over_q, over_w) = (on_angles.multiply(basis), on_speeds.multiply(basis));
    Matrix::from_fn(on_angles.rows(), r + moving.len(), |i, j| match j.checked_sub(r) {
        None => over_q[(i, j)].clone(),
        Some(k) => over_w[(i, moving[k])].clone(),
    })
}

/// Angles, and speeds, of all shafts over the states, rows for each; rates that are no states are left out.
pub fn motions_over_states<S: Scalar>(basis: &Matrix<S>, moving: &[usize]) -> [Matrix<S>; 2] {
    let (unit, none) = (Matrix::identity(basis.rows()), Matrix::zeros(basis.rows(), basis.rows()));
    [[&unit, &none], [&none, &unit]].map(|rows| over_states(rows, basis, moving))
}

//! The planner that inverts a model for its references, as a linear block.

use super::FlatParametrisation;
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Polynomial, Rational, Scalar, is_hurwitz};

/// Why there is no feed-forward from these references.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlannerError {
    /// Zeros that would have to be inverted are not stable.
    #[error("the inverse is not stable: zeros at the roots of {polynomial}")]
    UnstableInverse {
        /// z(s).
        polynomial: Polynomial,
        /// Its roots, 1/s.
        zeros: Vec<(f64, f64)>,
    },
    /// Not one filter for each output.
    #[error("{found} filters for {outputs} outputs")]
    Count {
        /// Number of filters.
        found: usize,
        /// Number of outputs.
        outputs: usize,
    },
    /// A filter is not monic and stable (roots in the open left half plane).
    #[error("the filter of {output} must be monic with all roots in the open left half plane")]
    Filter {
        /// The output.
        output: String,
    },
    /// A filter does not give enough derivatives.
    #[error("the filter of {output} must have degree {needed} or more")]
    Degree {
        /// The output.
        output: String,
        /// Derivatives that are needed.
        needed: usize,
    },
}

/// The feed-forward that lets outputs follow filtered references exactly: `ξ̇ = A_p ξ + B_p r`,
/// `[x_ref; u_ref] = C_p ξ + D_p r`.
///
/// Output i follows `f_i(0)/f_i(s) r_i`, and `x_ref = X(s)/z(s) y`, `u_ref = U(s)/z(s) y`. ξ contains for each output its value
/// and derivatives up to the degree of f_i less one, then, if there are zeros and they act on it, the states of the filter
/// `1/z(s)`. The result is a system with the references as inputs (named as the outputs they lead) and all states, then all
/// inputs of the plant as outputs.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Polynomial, Rational};
/// use kardan_synthesis::inversion::{flat_parametrisation, planner};
/// let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// let body = LinearSystem::state_space(
///     matrix(&[&[0, 1], &[0, 0]]), matrix(&[&[0], &[1]]), matrix(&[&[1, 0]]),
/// );
/// let flat = flat_parametrisation(&body).unwrap();
/// let filter = Polynomial::new([4, 4, 1].map(Rational::from).to_vec());
/// let plan = planner(&flat, &[filter]).unwrap();
/// assert_eq!(plan.outputs, ["x1", "x2", "u1"]);
/// assert_eq!(plan.c.row(2), [Rational::from(-4), Rational::from(-4)]);
/// ```
///
/// # Errors
/// [`PlannerError`]: z or a filter is not stable, or a filter has too low a degree
/// (see [`FlatParametrisation::derivatives`]).
pub fn planner(flat: &FlatParametrisation, filters: &[Polynomial]) -> Result<LinearSystem, PlannerError> {
    let m = flat.outputs.len();
    if filters.len() != m {
        return Err(PlannerError::Count { found: filters.len(), outputs: m });
    }
    if !is_hurwitz(&flat.z) {
        let zeros = flat.z.square_free().iter().flat_map(|(part, _)| part.roots()).collect();
        return Err(PlannerError::UnstableInverse { polynomial: flat.z.clone(), zeros });
    }
    for ((filter, output), needed) in filters.iter().zip(&flat.outputs).zip(flat.derivatives()) {
        if filter.coefficients().last() != Some(&Rational::ONE) || !is_hurwitz(filter) {
            return Err(PlannerError::Filter { output: output.clone() });
        }
        if filter.degree() < needed {
            return Err(PlannerError::Degree { output: output.clone(), needed });
        }
    }
    let rows = flat.states.len() + flat.inputs.len();
    let entry = |row: usize, i: usize| match row.checked_sub(flat.states.len()) {
        None => &flat.x[(row, i)],
        Some(input) => &flat.u[(input, i)],
    };
    let order = flat.z.degree();
    // Entry/z = quotient + remainder/z.
    let divided: Vec<Vec<(Polynomial, Polynomial)>> =
        (0..m).map(|i| (0..rows).map(|row| entry(row, i).divide(&flat.z)).collect()).collect();
    let filtered = |i: usize| divided[i].iter().any(|(_, rest)| !rest.is_zero());
    let mut states = Vec::new();
    // Where the states of each output and of its filter 1/z begin.
    let mut places = Vec::new();
    for (i, output) in flat.outputs.iter().enumerate() {
        let start = states.len();
        let chain =
            |name: &str, length: usize| (0..length).map(|k| name.to_string() + &"'".repeat(k)).collect::<Vec<_>>();
        states.extend(chain(output, filters[i].degree()));
        places.push((start, states.len()));
        states.extend(chain(&format!("{output}/z"), if filtered(i) { order } else { 0 }));
    }
    let total = states.len();
    let (mut a, mut b) = (Matrix::<Rational>::zeros(total, total), Matrix::<Rational>::zeros(total, m));
    let (mut c, mut d) = (Matrix::<Rational>::zeros(rows, total), Matrix::<Rational>::zeros(rows, m));
    for i in 0..m {
        let (start, filter_start) = places[i];
        let f = filters[i].coefficients();
        let derivative = Derivative { start, filter: f, output: i };
        for k in 0..filters[i].degree() {
            derivative.add(k + 1, &Rational::ONE, a.row_mut(start + k), b.row_mut(start + k));
        }
        if filtered(i) {
            for k in 0..order - 1 {
                a[(filter_start + k, filter_start + k + 1)] = Rational::ONE;
            }
            let last = filter_start + order - 1;
            derivative.add(0, &Rational::ONE, a.row_mut(last), b.row_mut(last));
            for (k, z) in flat.z.coefficients()[..order].iter().enumerate() {
                a[(last, filter_start + k)] = Rational::ZERO.minus(z);
            }
        }
        for (row, (quotient, rest)) in divided[i].iter().enumerate() {
            for (k, x) in quotient.coefficients().iter().enumerate() {
                derivative.add(k, x, c.row_mut(row), d.row_mut(row));
            }
            for (k, x) in rest.coefficients().iter().enumerate() {
                c[(row, filter_start + k)] = x.clone();
            }
        }
    }
    Ok(LinearSystem {
        states,
        inputs: flat.outputs.clone(),
        outputs: flat.states.iter().chain(&flat.inputs).cloned().collect(),
        e: Matrix::identity(total),
        a,
        b,
        c,
        d,
        degrees_of_freedom: None,
    })
}

/// How the derivatives of a filtered reference follow from the state of its filter and the reference.
struct Derivative<'a> {
    start: usize,
    filter: &'a [Rational],
    output: usize,
}

impl Derivative<'_> {
    /// Adds `factor` times the k-th derivative; k is at most the degree of the filter.
    fn add(&self, k: usize, factor: &Rational, on_states: &mut [Rational], on_references: &mut [Rational]) {
        let degree = self.filter.len() - 1;
        if k < degree {
            let place = &mut on_states[self.start + k];
            *place = place.plus(factor);
            return;
        }
        // y^(degree) = f₀ r − Σ f_l y^(l)
        for (l, f) in self.filter[..degree].iter().enumerate() {
            let place = &mut on_states[self.start + l];
            *place = place.minus(&factor.times(f));
        }
        let place = &mut on_references[self.output];
        *place = place.plus(&factor.times(&self.filter[0]));
    }
}

//! Flat outputs: states and inputs as functions of them and their derivatives.

use super::row_span::RowSpan;
use super::{Obstruction, PolynomialMatrix, obstruction, structure_algorithm};
use kardan_analysis::LinearSystem;
use kardan_math::num::{
    Matrix, ModularMatrix, Polynomial, PrimeField, Rational, Residue, Scalar, characteristic_polynomial, reduced_form,
    rows_of,
};

/// States and inputs as functions of the outputs and their derivatives: `x = X(s)/z(s) y`, `u = U(s)/z(s) y`.
#[derive(Debug, Clone, PartialEq)]
pub struct FlatParametrisation {
    /// Names of the states.
    pub states: Vec<String>,
    /// Names of the inputs.
    pub inputs: Vec<String>,
    /// Names of the outputs.
    pub outputs: Vec<String>,
    /// X(s), states × outputs.
    pub x: PolynomialMatrix,
    /// U(s), inputs × outputs.
    pub u: PolynomialMatrix,
    /// z(s), monic: the least common denominator of all entries of X/z; its roots are invariant zeros.
    pub z: Polynomial,
    /// All invariant zeros with their multiplicities, motions that inputs do not reach or outputs do not show included; a
    /// multiple of z.
    pub zeros: Polynomial,
}

impl FlatParametrisation {
    /// Whether the outputs are flat: every variable is a function of them and finitely many derivatives.
    ///
    /// True iff there are no invariant zeros; then all states are controllable and observable.
    pub fn is_flat(&self) -> bool {
        self.zeros.degree() == 0
    }

    /// The highest derivative of each output that x and u need. With zeros, the remainder passes the filter 1/z.
    pub fn derivatives(&self) -> Vec<usize> {
        let highest = |i| self.x.column_degree(i).max(self.u.column_degree(i));
        (0..self.outputs.len()).map(|i| highest(i).saturating_sub(self.z.degree())).collect()
    }
}

/// Why states and inputs do not follow from the outputs.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FlatnessError {
    /// More outputs than inputs, or fewer.
    #[error("{outputs} outputs and {inputs} inputs: there must be as many outputs as inputs")]
    NotSquare {
        /// Number of outputs.
        outputs: usize,
        /// Number of inputs.
        inputs: usize,
    },
    /// The outputs depend on each other.
    #[error("the system cannot be inverted: {0}")]
    Dependent(Obstruction),
}

/// The inverse of a square system with all its variables, exact and in lowest terms.
///
/// X, U and z solve `(sI − A) X = B U`, `C X + D U = z I`. The outputs are flat \[diss. Th. 6.4\] iff there are no invariant
/// zeros; the theorem itself holds only without damping of the torsion bar, otherwise z = s + s_sp/d_sp remains (erratum).
///
/// Method: the [structure algorithm](structure_algorithm) makes some combinations ζ of states and, with
/// `u = D̄⁻¹(P(s) y − C̄ x)`, the inputs functions of outputs and derivatives. The other states η obey
/// `η̇ = Q η + (polynomials) y`, where Q has the invariant zeros as eigenvalues; the polynomials are divided by sI − Q, and z
/// is the minimal polynomial of Q with respect to the remainder. About O(n³) rational operations.
///
/// `system` has E = I.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_synthesis::inversion::flat_parametrisation;
/// let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// let (a, b) = (matrix(&[&[0, 1], &[-2, -3]]), matrix(&[&[0], &[1]]));
/// let position = flat_parametrisation(&LinearSystem::state_space(a.clone(), b.clone(), matrix(&[&[1, 0]]))).unwrap();
/// assert!(position.is_flat());
/// assert_eq!(position.u[(0, 0)].to_string(), "s^2 + 3 s + 2");
/// // y = x₁′ + 5 x₁ leaves a differential equation.
/// let other = flat_parametrisation(&LinearSystem::state_space(a, b, matrix(&[&[5, 1]]))).unwrap();
/// assert_eq!(other.z.to_string(), "s + 5");
/// ```
///
/// # Errors
/// [`FlatnessError`] if the system is not square or its transfer matrix is singular.
pub fn flat_parametrisation(system: &LinearSystem) -> Result<FlatParametrisation, FlatnessError> {
    let (n, m, p) = (system.a.rows(), system.c.rows(), system.b.columns());
    if m != p {
        return Err(FlatnessError::NotSquare { outputs: m, inputs: p });
    }
    let found = structure_algorithm(system);
    let Some(inverse) = found.d.solve(&Matrix::identity(m)) else {
        let unexpected = || Obstruction {
            rank: found.rank(),
            inputs: system.inputs.clone(),
            outputs: system.outputs.clone(),
            relations: Vec::new(),
        };
        return Err(FlatnessError::Dependent(obstruction(system).unwrap_or_else(unexpected)));
    };
    // ẋ = (A − B D̄⁻¹ C̄) x + B D̄⁻¹ P(s) y
    let drive = system.b.multiply(&inverse);
    let a = system.a.minus(&drive.multiply(&found.c));
    // ζ = Z x; x = T_ζ ζ + T_η η with η the states that are no pivots of Z.
    let z = Matrix::from_fn(found.determined.len(), n, |i, j| found.determined[i].row[j].clone());
    let zeta =
        PolynomialMatrix::from_rows(found.determined.iter().map(|determined| determined.operator.clone()).collect(), m);
    let e = reduced_form(&z);
    let (free, from_rest) = (e.free(), e.kernel());
    let mut from_rows = Matrix::<Rational>::zeros(n, z.rows());
    for (row, &pivot) in e.pivots.iter().enumerate() {
        from_rows.row_mut(pivot).clone_from_slice(e.transform.row(row));
    }
    let of_free = |matrix: Matrix<Rational>| rows_of(&matrix, &free);
    let q = of_free(a.multiply(&from_rest));
    let excitation = PolynomialMatrix::constant(&of_free(a.multiply(&from_rows)))
        .multiply(&zeta)
        .plus(&PolynomialMatrix::constant(&of_free(drive)).multiply(&found.operator));
    let (quotient, remainder) = divide_by_pencil(&q, &excitation);
    let zeros = characteristic_polynomial(&q);
    let (z, numerator) = resolvent(&q, &remainder, &zeros);
    let x = PolynomialMatrix::constant(&from_rows)
        .multiply(&zeta)
        .plus(&PolynomialMatrix::constant(&from_rest).multiply(&quotient))
        .scale(&z)
        .plus(&PolynomialMatrix::constant(&from_rest).multiply(&numerator));
    let minus_c = PolynomialMatrix::constant(&found.c.scale(&Rational::NEG_ONE));
    let u = PolynomialMatrix::constant(&inverse).multiply(&found.operator.scale(&z).plus(&minus_c.multiply(&x)));
    Ok(FlatParametrisation {
        states: system.states.clone(),
        inputs: system.inputs.clone(),
        outputs: system.outputs.clone(),
        x,
        u,
        z,
        zeros,
    })
}

/// `W(s) = (sI − Q) W₁(s) + W₀`: W₁ and W₀.
fn divide_by_pencil(q: &Matrix<Rational>, w: &PolynomialMatrix) -> (PolynomialMatrix, Matrix<Rational>) {
    let degree = (0..w.columns()).map(|j| w.column_degree(j)).max().unwrap_or(0);
    let mut carried = w.coefficient(degree);
    let mut quotient = Vec::new();
    for k in (0..degree).rev() {
        let next = w.coefficient(k).plus(&q.multiply(&carried));
        quotient.push(std::mem::replace(&mut carried, next));
    }
    quotient.reverse();
    let entry = |i, j| Polynomial::new(quotient.iter().map(|v| v[(i, j)].clone()).collect());
    (PolynomialMatrix::from_fn(w.rows(), w.columns(), entry), carried)
}

/// `(sI − Q)⁻¹ W = N(s)/μ(s)` in lowest terms: μ, monic, and N, given the characteristic polynomial of Q.
///
/// μ is the monic polynomial of smallest degree with `μ(Q) W = 0`; N has the coefficients `N_k = μ_{k+1} W + Q N_{k+1}`.
fn resolvent(
    q: &Matrix<Rational>,
    w: &Matrix<Rational>,
    characteristic: &Polynomial,
) -> (Polynomial, PolynomialMatrix) {
    let mu = if excites_all(q, w) { characteristic.clone() } else { minimal_polynomial(q, w) };
    let mut carried = Matrix::<Rational>::zeros(w.rows(), w.columns());
    let mut numerator = Vec::new();
    for factor in mu.coefficients()[1..].iter().rev() {
        carried = w.scale(factor).plus(&q.multiply(&carried));
        numerator.push(carried.clone());
    }
    numerator.reverse();
    let entry = |i, j| Polynomial::new(numerator.iter().map(|n| n[(i, j)].clone()).collect());
    let numerator = PolynomialMatrix::from_fn(w.rows(), w.columns(), entry);
    (mu, numerator)
}

/// Whether W, QW, …, Qⁿ⁻¹W are found to be independent modulo a prime; then they are.
fn excites_all(q: &Matrix<Rational>, w: &Matrix<Rational>) -> bool {
    let field = PrimeField::new((1 << 61) - 1);
    let images = [q, w].map(|m| ModularMatrix::from_rational(&field, m));
    let [Some(q), Some(mut power)] = images else { return false };
    let n = w.rows();
    let mut rows: Vec<Vec<Residue>> = Vec::with_capacity(n);
    for _ in 0..n {
        rows.push((0..n).flat_map(|i| power.row(i).to_vec()).collect());
        power = q.multiply(&field, &power);
    }
    let krylov = ModularMatrix::from_fn(n, n * w.columns(), |i, j| rows[i][j]);
    krylov.echelon(&field).1.len() == n
}

/// The monic polynomial μ of smallest degree with `μ(Q) W = 0`.
fn minimal_polynomial(q: &Matrix<Rational>, w: &Matrix<Rational>) -> Polynomial {
    let mut span = RowSpan::default();
    let mut power = w.clone();
    loop {
        if let Some(weights) = span.insert(power.as_slice()) {
            let lower = weights.iter().map(|x| Rational::ZERO.minus(x));
            return Polynomial::new(lower.chain([Rational::ONE]).collect());
        }
        power = q.multiply(&power);
    }
}

//! The exact gains of a static decoupling.

use super::decouplable::{NotDecouplable, closed, inverse_decoupling_matrix};
use super::relative_degree::{chain, relative_degrees};
use super::rows::{add, row_times, stack};
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Polynomial, Rational, Scalar};

/// The exact gains of `u = −K x + L r − M d` \[diss. (6.98)\].
#[derive(Debug, Clone, PartialEq)]
pub struct StaticDecoupling {
    /// r_i.
    pub degrees: Vec<usize>,
    /// G, outputs × inputs (6.66).
    pub matrix: Matrix<Rational>,
    /// G⁻¹, inputs × outputs (6.68); Gᵀ(GGᵀ)⁻¹ with more inputs than outputs.
    pub inverse: Matrix<Rational>,
    /// A*, outputs × states (6.70).
    pub free: Matrix<Rational>,
    /// K, inputs × states.
    pub k: Matrix<Rational>,
    /// L, inputs × references, one reference per output.
    pub l: Matrix<Rational>,
    /// M, inputs × disturbances.
    pub m: Matrix<Rational>,
    /// p_i, monic of degree r_i.
    pub polynomials: Vec<Polynomial>,
    /// For each output, whether it is decoupled from disturbances of any time course: they reach none of its derivatives
    /// before the inputs do. If not, it is decoupled from constant ones only; a change excites a motion with the poles of p_i.
    pub rejects_any_signal: Vec<bool>,
}

impl StaticDecoupling {
    /// The loop `ẋ = (A − BK) x + BL r`, `y = (C − DK) x + DL r`; inputs `ref_<output>`.
    ///
    /// # Panics
    /// If the system has another shape than the one that the gains were made for.
    pub fn closed_loop(&self, system: &LinearSystem) -> LinearSystem {
        closed(system, &self.k, &self.l, system.outputs.iter().map(|output| format!("ref_{output}")).collect())
    }
}

/// Gains of the static state feedback that makes every output its own channel, `p_i(d/dt) y_i = p_i(0) r_i`, exactly
/// \[diss. (6.71), (6.96)-(6.98)\].
///
/// For `ẋ = A x + B u + W d`, `y = C x + D u + F d` with constant known d the derivatives before the inputs appear are
/// `y_i = C_i x + F_i d`, `y_i^(j) = C_i Aʲ x + C_i Aʲ⁻¹ W d`, and `y_i^(r_i) = A*_i x + C_i A^(r_i−1) W d + G_i u`. With
/// `p_i = s^r + a_{r−1} s^(r−1) + … + a_0` this gives
///
/// - `K = G⁻¹ (A*_i + Σ_j a_j C_i Aʲ)`, inputs × states,
/// - `L = G⁻¹ diag(a_0)`, inputs × references,
/// - `M = G⁻¹ (C_i A^(r_i−1) W + Σ_{j≥1} a_j C_i Aʲ⁻¹ W + a_0 F_i)`, inputs × disturbances.
///
/// An output of degree 0 takes the polynomial 1: `y_i = r_i`, with `C_i` for A*_i and F_i alone in M. `disturbance` is W,
/// states × disturbances (n × 0 if there are none), `direct` is F, outputs × disturbances, zero if left out. With more
/// inputs than outputs G⁻¹ is Gᵀ(GGᵀ)⁻¹.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Polynomial, Rational};
/// use kardan_synthesis::decoupling::decouple;
/// let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// // A body of 2 kg m² with the damping 3: u = 2 (400 (r − φ) − 28 ω) + 3 ω − load.
/// let half = |rows| Matrix::scale(&matrix(rows), &Rational::from_parts(1.into(), 2u8.into()));
/// let body = LinearSystem::state_space(half(&[&[0, 2], &[0, -3]]), half(&[&[0], &[1]]), matrix(&[&[1, 0]]));
/// let wanted = Polynomial::new([400, 28, 1].map(Rational::from).to_vec());
/// let gains = decouple(&body, &half(&[&[0], &[1]]), None, &[wanted]).unwrap();
/// assert_eq!(gains.k, matrix(&[&[800, 53]]));
/// assert_eq!((gains.l, gains.m), (matrix(&[&[800]]), matrix(&[&[1]])));
/// assert!(gains.rejects_any_signal[0]);
/// ```
///
/// # Errors
/// [`NotDecouplable`] with the exact rank of G and the reasons.
///
/// # Panics
/// If E is not the identity, a shape does not fit, or a polynomial is not monic of the degree of its output (those of
/// [`Compensation`](super::Compensation) are).
pub fn decouple(
    system: &LinearSystem,
    disturbance: &Matrix<Rational>,
    direct: Option<&Matrix<Rational>>,
    polynomials: &[Polynomial],
) -> Result<StaticDecoupling, NotDecouplable> {
    let (n, outputs, disturbances) = (system.states.len(), system.outputs.len(), disturbance.columns());
    assert_eq!(disturbance.rows(), n, "one row of the disturbance matrix per state");
    if let Some(direct) = direct {
        assert_eq!((direct.rows(), direct.columns()), (outputs, disturbances), "direct effect of another shape");
    }
    let relative = relative_degrees(system);
    let inverse = inverse_decoupling_matrix(system, &relative)?;
    let degrees: Vec<usize> =
        relative.degrees.iter().map(|r| r.expect("a regular decoupling matrix has no zero row")).collect();
    assert_eq!(polynomials.len(), outputs, "one polynomial per output");
    let (mut on_states, mut on_disturbances, mut rejects_any_signal) = (Vec::new(), Vec::new(), Vec::new());
    for (i, (p, &degree)) in polynomials.iter().zip(&degrees).enumerate() {
        assert!(
            p.degree() == degree && p.coefficient(degree) == Rational::ONE,
            "polynomial {i} is not monic of degree {degree}"
        );
        let mut row = relative.free.row(i).to_vec();
        let mut effect = vec![Rational::ZERO; disturbances];
        let mut untouched = true;
        for (j, derivative) in chain(system, i, degree).iter().enumerate() {
            add(&mut row, &p.coefficient(j), derivative);
            // C_i Aʲ W enters with the derivative j + 1.
            let entering = row_times(derivative, disturbance);
            untouched &= j + 1 == degree || entering.iter().all(Scalar::is_zero);
            add(&mut effect, &p.coefficient(j + 1), &entering);
        }
        if let Some(direct) = direct {
            add(&mut effect, &p.coefficient(0), direct.row(i));
            untouched &= degree == 0 || direct.row(i).iter().all(Scalar::is_zero);
        }
        on_states.push(row);
        on_disturbances.push(effect);
        rejects_any_signal.push(untouched);
    }
    let zero = Rational::ZERO;
    let stationary =
        Matrix::from_fn(outputs, outputs, |i, j| if i == j { polynomials[i].coefficient(0) } else { zero.clone() });
    Ok(StaticDecoupling {
        k: inverse.multiply(&stack(&on_states, n)),
        l: inverse.multiply(&stationary),
        m: inverse.multiply(&stack(&on_disturbances, disturbances)),
        degrees,
        matrix: relative.matrix,
        inverse,
        free: relative.free,
        polynomials: polynomials.to_vec(),
        rejects_any_signal,
    })
}

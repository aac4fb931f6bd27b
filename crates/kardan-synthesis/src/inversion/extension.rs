//! Dynamic extension: integrators before inputs that make outputs decouplable.

use std::collections::BTreeSet;

use super::notation::combination;
use super::{Obstruction, obstruction};
use crate::decoupling::relative_degrees;
use crate::matrix_parts::{selected, side_by_side, stacked};
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Rational, Scalar, columns_of, reduced_form, rows_of};

/// An integrator that a dynamic extension puts before an input.
#[derive(Debug, Clone, PartialEq)]
pub struct Integrator {
    /// Name of its state: `wg_motor.x1`.
    pub state: String,
    /// The input whose place the rate of the integrator takes.
    pub input: usize,
    /// The state as a combination of the inputs at its stage; 1 at `input`.
    pub combination: Vec<Rational>,
    /// The same as text: `wg_motor`, `wg_motor' - 50 rk_motor`. A prime is a derivative.
    pub before: String,
}

impl Integrator {
    /// Whether it is before a single input, not before a combination.
    pub fn is_plain(&self) -> bool {
        self.combination.iter().filter(|x| !Scalar::is_zero(*x)).count() == 1
    }
}

/// A system with integrators before some of its inputs, whose decoupling matrix has full row rank.
#[derive(Debug, Clone, PartialEq)]
pub struct Extension {
    /// The integrators, in the order in which they were added; their states follow those of the system.
    pub integrators: Vec<Integrator>,
    /// The extended system, E = I; its inputs v are named `wg_motor'` (the rate of an integrator) or as before.
    pub extended: LinearSystem,
    /// U_x of `u = U_x x_e + U_v v`, inputs × extended states.
    pub from_state: Matrix<Rational>,
    /// U_v, inputs × inputs.
    pub from_input: Matrix<Rational>,
    /// Relative degree of each output of the extended system: the smallest that any decoupling law can give.
    pub relative_degrees: Vec<usize>,
    /// Decoupling matrix of the extended system, full row rank.
    pub decoupling_matrix: Matrix<Rational>,
}

impl Extension {
    /// The inputs with integrators before them, and how many: `("wg_motor", 2)`. A chain before an input counts once.
    pub fn chains(&self) -> Vec<(String, usize)> {
        let mut out: Vec<(String, usize)> = Vec::new();
        for integrator in &self.integrators {
            // The chain before a plain input goes by the name of the input, however long it is.
            let mut same_input = self.integrators.iter().filter(|other| other.input == integrator.input);
            let name = if same_input.all(Integrator::is_plain) {
                integrator.before.trim_end_matches('\'').to_string()
            } else {
                integrator.before.clone()
            };
            match out.iter_mut().find(|(candidate, _)| *candidate == name) {
                Some((_, count)) => *count += 1,
                None => out.push((name, 1)),
            }
        }
        out
    }
}

/// Integrators before inputs, or combinations of them, with which static state feedback decouples the outputs; for as many
/// inputs as outputs the fewest.
///
/// Method (Descusse and Moog, Int. J. Control 42 (1985), 1387-1398, for linear systems): let G be the decoupling matrix,
/// one row `C_i A^(r_i − 1) B` per output. The combinations of inputs in rows of G that depend on each other get an
/// integrator each; repeat until G has full row rank m. It ends because every stage raises the sum of the relative degrees by
/// more than the number of integrators.
///
/// Every compensator C(s) that decouples makes each row of `G C(∞)` zero or independent of the others, so it annihilates all
/// rows that depend on others, hence factors through these integrators; by induction the relative degrees become the least
/// possible, the essential orders (Commault, Descusse, Dion, Lafay and Malabre 1986). Where the transfer matrix is square,
/// static feedback leaves its orders at infinity alone, so that no fewer integrators will do. With more inputs than outputs,
/// feedback that gives up inputs can sometimes do with fewer (Morgan's problem), which is not tried. An integrator is
/// before an input as it is wherever the space of combinations allows it.
///
/// `system` has E = I; there may be more inputs than outputs.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_synthesis::inversion::dynamic_extension;
/// let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// // y₁′ = u₁, y₂′ = x₃ + u₁, x₃′ = u₂: both outputs answer to u₁ first.
/// let system = LinearSystem::state_space(
///     matrix(&[&[0, 0, 0], &[0, 0, 1], &[0, 0, 0]]),
///     matrix(&[&[1, 0], &[1, 0], &[0, 1]]),
///     matrix(&[&[1, 0, 0], &[0, 1, 0]]),
/// );
/// let extension = dynamic_extension(&system).unwrap();
/// assert_eq!(extension.chains(), [("u1".to_string(), 1)]);
/// assert_eq!(extension.relative_degrees, [2, 2]);
/// ```
///
/// # Errors
/// The [`Obstruction`] if the transfer matrix has not full row rank; then no feedback at all decouples the outputs.
pub fn dynamic_extension(system: &LinearSystem) -> Result<Extension, Obstruction> {
    if let Some(obstruction) = obstruction(system) {
        return Err(obstruction);
    }
    let (n, p) = (system.a.rows(), system.b.columns());
    let mut extended = LinearSystem { e: Matrix::identity(n), degrees_of_freedom: None, ..system.clone() };
    let (mut from_state, mut from_input) = (Matrix::zeros(p, n), Matrix::identity(p));
    let mut integrators: Vec<Integrator> = Vec::new();
    loop {
        let found = relative_degrees(&extended);
        let g = found.matrix;
        let dependent: BTreeSet<usize> = reduced_form(&g).dependent_rows().into_iter().flatten().collect();
        if dependent.is_empty() {
            return Ok(Extension {
                integrators,
                extended,
                from_state,
                from_input,
                relative_degrees: found.degrees.into_iter().flatten().collect(),
                decoupling_matrix: g,
            });
        }
        let dependent: Vec<usize> = dependent.into_iter().collect();
        let g = rows_of(&g, &dependent);
        let e = reduced_form(&g);
        // v̄_j = (row of the echelon form) v for the pivots j, v̄_j = v_j for the others; v = V v̄.
        let mut v = Matrix::<Rational>::identity(p);
        for (row, &pivot) in e.pivots.iter().enumerate() {
            for j in e.free() {
                v[(pivot, j)] = Rational::ZERO.minus(&e.form[(row, j)]);
            }
        }
        for (row, &input) in e.pivots.iter().enumerate() {
            let combined = e.form.row(row).to_vec();
            let count = 1 + integrators.iter().filter(|i| i.input == input).count();
            integrators.push(Integrator {
                state: format!("{}.x{count}", system.inputs[input]),
                input,
                before: combination(&combined, &extended.inputs),
                combination: combined,
            });
        }
        let first = integrators.len() - e.pivots.len();
        let names = integrators[first..].iter().map(|i| i.state.clone());
        extended.states.extend(names);
        e.pivots.iter().for_each(|&input| extended.inputs[input].push('\''));
        let moved = |on_state: &Matrix<Rational>, on_input: &Matrix<Rational>| {
            moved_to_states(on_state, &on_input.multiply(&v), &e.pivots)
        };
        (from_state, from_input) = moved(&from_state, &from_input);
        let (c, d) = moved(&extended.c, &extended.d);
        let (a, b) = moved(&extended.a, &extended.b);
        let total = a.rows() + e.pivots.len();
        extended.a = stacked(&[&a, &Matrix::zeros(e.pivots.len(), total)]);
        extended.b = stacked(&[&b, &selected(&Matrix::identity(p), &e.pivots, &(0..p).collect::<Vec<_>>())]);
        (extended.c, extended.d, extended.e) = (c, d, Matrix::identity(total));
    }
}

/// `[X, Y_J]` and Y with zeros in the columns J: those inputs have become states.
fn moved_to_states(
    on_state: &Matrix<Rational>,
    on_input: &Matrix<Rational>,
    moved: &[usize],
) -> (Matrix<Rational>, Matrix<Rational>) {
    let states = side_by_side(&[on_state, &columns_of(on_input, moved)]);
    let inputs = Matrix::from_fn(on_input.rows(), on_input.columns(), |i, j| {
        if moved.contains(&j) { Rational::ZERO } else { on_input[(i, j)].clone() }
    });
    (states, inputs)
}

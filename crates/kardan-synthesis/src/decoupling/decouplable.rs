//! Decides whether static state feedback can decouple outputs.

use super::relative_degree::{RelativeDegrees, relative_degrees};
use super::rows::{primitive, stack};
use kardan_analysis::{LinearSystem, combination};
use kardan_math::num::{Matrix, Rational, reduced_form};

/// Why outputs cannot be decoupled by static state feedback; decided exactly.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotDecouplable {
    /// Fewer inputs than outputs.
    #[error("{} outputs need as many inputs, there are {} only", outputs.len(), inputs.len())]
    TooManyOutputs {
        /// Names of the outputs.
        outputs: Vec<String>,
        /// Names of the inputs.
        inputs: Vec<String>,
        /// Rank of the decoupling matrix.
        rank: usize,
    },
    /// The decoupling matrix has dependent rows.
    #[error("the outputs cannot be decoupled by static state feedback: {}", reasons(outputs, degrees, *rank, dependencies))]
    Singular {
        /// Names of the outputs.
        outputs: Vec<String>,
        /// Relative degree of each output.
        degrees: Vec<Option<usize>>,
        /// Rank of the decoupling matrix.
        rank: usize,
        /// Numbers of the outputs that no input ever reaches.
        not_reached: Vec<usize>,
        /// Combinations of rows of the decoupling matrix that vanish, one entry per output, in smallest whole numbers; only
        /// of outputs that are reached.
        dependencies: Vec<Vec<Rational>>,
    },
}

impl NotDecouplable {
    /// Rank of the decoupling matrix.
    pub fn rank(&self) -> usize {
        match self {
            Self::TooManyOutputs { rank, .. } | Self::Singular { rank, .. } => *rank,
        }
    }
}

fn reasons(outputs: &[String], degrees: &[Option<usize>], rank: usize, dependencies: &[Vec<Rational>]) -> String {
    let mut out = vec![format!("the decoupling matrix has rank {rank} instead of {}", outputs.len())];
    for (output, _) in outputs.iter().zip(degrees).filter(|(_, degree)| degree.is_none()) {
        out.push(format!("no input ever reaches `{output}`"));
    }
    let derivative = |output: &String, degree: usize| match degree {
        0..=3 => output.clone() + &"'".repeat(degree),
        _ => format!("{output}^({degree})"),
    };
    for row in dependencies {
        let terms = outputs.iter().zip(degrees).zip(row).filter(|(_, factor)| !factor.is_zero());
        let terms: Vec<(String, Rational)> =
            terms.map(|((o, degree), factor)| (derivative(o, degree.unwrap_or(0)), factor.clone())).collect();
        out.push(format!("the inputs do not act on {}", combination(&terms)));
    }
    out.join("; ")
}

/// G⁻¹, or G⁺ = Gᵀ(GGᵀ)⁻¹ if there are more inputs than outputs: inputs × outputs, exact \[diss. (6.66), (6.68)\].
///
/// Of all right inverses G⁺ gives the inputs with the smallest sum of squares.
///
/// # Errors
/// [`NotDecouplable`] with the exact rank and the dependent rows.
pub fn inverse_decoupling_matrix(
    system: &LinearSystem,
    degrees: &RelativeDegrees,
) -> Result<Matrix<Rational>, NotDecouplable> {
    let g = &degrees.matrix;
    let outputs = g.rows();
    if outputs == g.columns() {
        if let Some(inverse) = g.solve(&Matrix::identity(outputs)) {
            return Ok(inverse);
        }
    } else if outputs < g.columns() {
        let transposed = g.transpose();
        // G⁺ᵀ = (GGᵀ)⁻¹ G; the Gram matrix is regular if the rows are independent.
        if let Some(inverse) = g.multiply(&transposed).solve(g) {
            return Ok(inverse.transpose());
        }
    }
    Err(not_decouplable(system, degrees))
}

fn not_decouplable(system: &LinearSystem, degrees: &RelativeDegrees) -> NotDecouplable {
    let outputs = degrees.degrees.len();
    let reached: Vec<usize> = (0..outputs).filter(|&i| degrees.degrees[i].is_some()).collect();
    let rows: Vec<Vec<Rational>> = reached.iter().map(|&i| degrees.matrix.row(i).to_vec()).collect();
    let g = stack(&rows, degrees.matrix.columns());
    let e = reduced_form(&g);
    if outputs > degrees.matrix.columns() {
        let (outputs, inputs) = (system.outputs.clone(), system.inputs.clone());
        return NotDecouplable::TooManyOutputs { outputs, inputs, rank: e.rank() };
    }
    let spread = |i: usize| {
        let mut row = vec![Rational::ZERO; outputs];
        reached.iter().zip(e.transform.row(i)).for_each(|(&output, x)| row[output] = x.clone());
        primitive(&row)
    };
    NotDecouplable::Singular {
        outputs: system.outputs.clone(),
        degrees: degrees.degrees.clone(),
        rank: e.rank(),
        not_reached: (0..outputs).filter(|i| !reached.contains(i)).collect(),
        dependencies: (e.rank()..reached.len()).map(spread).collect(),
    }
}

/// The integrator-decoupled system `(A − BG⁻¹A*, BG⁻¹, C)` with `y_i^(r_i) = v_i` \[diss. (6.69)-(6.71)\].
///
/// Its inputs are `v1`, `v2`, …, one per output; feedthrough is kept, so an output of degree 0 is its input.
///
/// # Errors
/// [`NotDecouplable`].
///
/// # Panics
/// If E is not the identity.
pub fn integrator_decoupled(system: &LinearSystem) -> Result<LinearSystem, NotDecouplable> {
    let degrees = relative_degrees(system);
    let inverse = inverse_decoupling_matrix(system, &degrees)?;
    let feedback = inverse.multiply(&degrees.free);
    let names = (1..=inverse.columns()).map(|k| format!("v{k}")).collect();
    Ok(closed(system, &feedback, &inverse, names))
}

/// The system under `u = −K x + L v`.
pub(crate) fn closed(
    system: &LinearSystem,
    k: &Matrix<Rational>,
    l: &Matrix<Rational>,
    inputs: Vec<String>,
) -> LinearSystem {
    LinearSystem {
        states: system.states.clone(),
        inputs,
        outputs: system.outputs.clone(),
        e: system.e.clone(),
        a: system.a.minus(&system.b.multiply(k)),
        b: system.b.multiply(l),
        c: system.c.minus(&system.d.multiply(k)),
        d: system.d.multiply(l),
        degrees_of_freedom: None,
    }
}

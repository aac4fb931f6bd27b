//! The structure algorithm of Silverman: inversion by differentiating outputs.

use super::polynomial_matrix::{PolynomialMatrix, derivative};
use super::row_span::RowSpan;
use crate::decoupling::{row_times, subtract};
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Polynomial, Rational, Scalar};

/// A combination of outputs and their derivatives that the state alone determines, `operator(s) y = row x`.
#[derive(Debug, Clone, PartialEq)]
pub struct DecouplingRow {
    /// The output whose differentiation led to it.
    pub output: usize,
    /// One polynomial per output.
    pub operator: Vec<Polynomial>,
    /// One entry per state.
    pub row: Vec<Rational>,
}

/// The result of the [`structure_algorithm`]: `P(s) y = C̄ x + D̄ u`.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureAlgorithm {
    /// P(s), outputs × outputs, nonsingular.
    pub operator: PolynomialMatrix,
    /// C̄, outputs × states. A row without an order is zero.
    pub c: Matrix<Rational>,
    /// D̄, outputs × inputs: rows with an order are independent, the others zero.
    pub d: Matrix<Rational>,
    /// How often the row of each output was differentiated until inputs appeared. `None`: they never do, and
    /// `operator.row(i) y = 0` is a relation between the outputs.
    pub orders: Vec<Option<usize>>,
    /// The intermediate rows, in the order of the derivatives; they are linearly independent.
    pub determined: Vec<DecouplingRow>,
}

impl StructureAlgorithm {
    /// The rank of the transfer matrix over the rational functions.
    pub fn rank(&self) -> usize {
        self.orders.iter().flatten().count()
    }

    /// The chain that begins with an output, as far as computed, in the order of its derivatives.
    pub fn chain(&self, output: usize) -> impl Iterator<Item = &DecouplingRow> {
        self.determined.iter().filter(move |determined| determined.output == output)
    }
}

struct Row {
    operator: Vec<Polynomial>,
    c: Vec<Rational>,
    d: Vec<Rational>,
    order: Option<usize>,
    open: bool,
}

impl Row {
    fn subtract(&mut self, factor: &Rational, operator: &[Polynomial], c: &[Rational]) {
        let minus = Rational::ZERO.minus(factor);
        for (p, q) in self.operator.iter_mut().zip(operator) {
            *p = p.plus(&q.scale(&minus));
        }
        subtract(&mut self.c, factor, c);
    }
}

/// Differentiates outputs until inputs appear independently of each other: `P(s) y = C̄ x + D̄ u`.
///
/// Method (Silverman, IEEE Trans. Autom. Control 14 (1969), 270-276; Hirschorn 1979 for nonlinear systems): a row whose
/// feedthrough depends on that of earlier ones loses it by subtracting them and is differentiated; so `rank D̄` becomes the
/// rank of the transfer matrix, and the numbers of differentiations are its orders at infinity. A row that has become a
/// combination of known ones is a relation and ends its chain, hence at most n differentiations. With full row rank,
/// `det P(s) = ±s^(sum of the orders)`. Exact; about O(n³) rational operations.
///
/// `system` has E = I.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_synthesis::inversion::structure_algorithm;
/// // Two outputs, the second behind one more integrator, both driven by the first input first.
/// let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// let system = LinearSystem::state_space(
///     matrix(&[&[0, 0, 0], &[0, 0, 1], &[0, 0, 0]]),
///     matrix(&[&[1, 0], &[1, 0], &[0, 1]]),
///     matrix(&[&[1, 0, 0], &[0, 1, 0]]),
/// );
/// let found = structure_algorithm(&system);
/// assert_eq!((found.rank(), found.orders), (2, vec![Some(1), Some(2)]));
/// // s (s y₂ − s y₁) = u₂
/// assert_eq!(found.operator[(1, 0)].to_string(), "-s^2");
/// ```
pub fn structure_algorithm(system: &LinearSystem) -> StructureAlgorithm {
    structure_of_rows(system, &(0..system.c.rows()).collect::<Vec<_>>())
}

/// The same for some of the outputs; they are numbered by their place in `outputs`.
pub(super) fn structure_of_rows(system: &LinearSystem, outputs: &[usize]) -> StructureAlgorithm {
    let m = outputs.len();
    let unit = |i: usize, j: usize| Polynomial::constant(if i == j { Rational::ONE } else { Rational::ZERO });
    let mut rows: Vec<Row> = (0..m)
        .map(|i| Row {
            operator: (0..m).map(|j| unit(i, j)).collect(),
            c: system.c.row(outputs[i]).to_vec(),
            d: system.d.row(outputs[i]).to_vec(),
            order: None,
            open: true,
        })
        .collect();
    let (mut acting, mut acting_rows) = (RowSpan::default(), Vec::new());
    let (mut span, mut determined) = (RowSpan::default(), Vec::<DecouplingRow>::new());
    for order in 0.. {
        for i in 0..m {
            if !rows[i].open {
                continue;
            }
            let Some(weights) = acting.insert(&rows[i].d) else {
                (rows[i].order, rows[i].open) = (Some(order), false);
                acting_rows.push(i);
                continue;
            };
            for (weight, &source_row) in weights.iter().zip(&acting_rows).filter(|(w, _)| !Scalar::is_zero(*w)) {
                let (operator, c) = (rows[source_row].operator.clone(), rows[source_row].c.clone());
                rows[i].subtract(weight, &operator, &c);
            }
            rows[i].d.fill(Rational::ZERO);
            let Some(weights) = span.insert(&rows[i].c) else {
                determined.push(DecouplingRow {
                    output: i,
                    operator: rows[i].operator.clone(),
                    row: rows[i].c.clone(),
                });
                continue;
            };
            for (weight, source_row) in weights.iter().zip(&determined).filter(|(w, _)| !Scalar::is_zero(*w)) {
                rows[i].subtract(weight, &source_row.operator, &source_row.row);
            }
            rows[i].open = false;
        }
        if rows.iter().all(|row| !row.open) {
            break;
        }
        for row in rows.iter_mut().filter(|row| row.open) {
            row.operator = row.operator.iter().map(derivative).collect();
            row.d = row_times(&row.c, &system.b);
            row.c = row_times(&row.c, &system.a);
        }
    }
    StructureAlgorithm {
        c: Matrix::from_fn(m, system.c.columns(), |i, j| rows[i].c[j].clone()),
        d: Matrix::from_fn(m, system.d.columns(), |i, j| rows[i].d[j].clone()),
        orders: rows.iter().map(|row| row.order).collect(),
        operator: PolynomialMatrix::from_rows(rows.into_iter().map(|row| row.operator).collect(), m),
        determined,
    }
}

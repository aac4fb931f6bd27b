//! Tables over one or two quantities, which expressions call by name.

use super::{Expr, Graph, PiecewisePolynomial};
use kardan_math::num::{Rational, rational_from_f64, rational_to_f64, steffen};
use kardan_math::units::Dimension;

/// The continuation outside the first and the last point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extrapolation {
    /// The value of that point.
    Level,
    /// The straight line of the outermost slope.
    Straight,
}

/// A table: over one quantity a curve through points, over two a surface through a grid of them.
///
/// The surface is `f(x, y) = Σ_j h_j(y) f_j(x)`: along x a curve for each y of the grid, between two of these a straight line along y.
///
/// ```
/// use kardan_expr::expr::{Extrapolation, Lookup};
/// use kardan_math::num::Rational;
/// use kardan_math::units::Dimension;
/// let whole = |list: &[i64]| list.iter().map(|x| Rational::from(*x)).collect::<Vec<_>>();
/// let dimensions = [Dimension::ANGULAR_VELOCITY, Dimension::NONE];
/// let grid = [whole(&[0, 100, 200]), whole(&[0, 1])];
/// // At 0, 100 and 200 rad/s without throttle, then at full throttle.
/// let map = Lookup::surface(dimensions, Dimension::TORQUE, grid, &whole(&[0, -4, -8, 20, 40, 30]), false, Extrapolation::Level).unwrap();
/// assert_eq!(map.value(&[50.0, 0.5]), 14.0);
/// assert_eq!(map.value(&[1e6, 2.0]), 30.0);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Lookup {
    arguments: Vec<Dimension>,
    dimension: Dimension,
    /// Over the first argument, one for each grid point of the second.
    rows: Vec<PiecewisePolynomial>,
    /// The share of each row, over the second argument.
    shares: Vec<PiecewisePolynomial>,
    beyond: Extrapolation,
}

/// A curve through points.
fn curve(points: &[(Rational, Rational)], cubic: bool, beyond: Extrapolation) -> Option<PiecewisePolynomial> {
    let straight = beyond == Extrapolation::Straight;
    if cubic && points.len() > 2 {
        let list = |of: &dyn Fn(&(Rational, Rational)) -> f64| points.iter().map(of).collect::<Vec<f64>>();
        let (x, y) = (list(&|point| rational_to_f64(&point.0)), list(&|point| rational_to_f64(&point.1)));
        let slopes: Vec<Rational> = steffen(&x, &y).into_iter().map(rational_from_f64).collect::<Option<_>>()?;
        return PiecewisePolynomial::smooth(points, &slopes, straight);
    }
    let mut lines = PiecewisePolynomial::through(points)?;
    let count = lines.pieces.len();
    if straight && count > 2 {
        lines.pieces[0] = lines.pieces[1].clone();
        lines.pieces[count - 1] = lines.pieces[count - 2].clone();
    }
    Some(lines)
}

impl Lookup {
    /// A curve through points over one quantity: straight lines, or monotone cubics. None if the points do not rise, or there are none.
    pub fn curve(
        argument: Dimension,
        dimension: Dimension,
        points: &[(Rational, Rational)],
        cubic: bool,
        beyond: Extrapolation,
    ) -> Option<Self> {
        let rows = vec![curve(points, cubic, beyond)?];
        Some(Self { arguments: vec![argument], dimension, rows, shares: Vec::new(), beyond })
    }

    /// A surface over two quantities: the values for all x at the first y, then at the second, and so on. None if either side of the grid does
    /// not rise or is empty, or the number of values is another.
    pub fn surface(
        arguments: [Dimension; 2],
        dimension: Dimension,
        [x, y]: [Vec<Rational>; 2],
        values: &[Rational],
        cubic: bool,
        beyond: Extrapolation,
    ) -> Option<Self> {
        if values.len() != x.len() * y.len() || values.is_empty() {
            return None;
        }
        let row = |values: &[Rational]| {
            let points: Vec<_> = x.iter().cloned().zip(values.iter().cloned()).collect();
            curve(&points, cubic, beyond)
        };
        let rows = values.chunks_exact(x.len()).map(row).collect::<Option<_>>()?;
        let share = |own: usize| {
            let hat = |(k, y): (usize, &Rational)| (y.clone(), Rational::from(u8::from(k == own)));
            curve(&y.iter().enumerate().map(hat).collect::<Vec<_>>(), false, beyond)
        };
        let shares = (0..y.len()).map(share).collect::<Option<_>>()?;
        Some(Self { arguments: arguments.to_vec(), dimension, rows, shares, beyond })
    }

    /// Dimensions of its arguments.
    pub fn arguments(&self) -> &[Dimension] {
        &self.arguments
    }

    /// The range of its points in each argument.
    pub fn ranges(&self) -> Vec<(f64, f64)> {
        let ends = |table: &PiecewisePolynomial| {
            let [first, last] = [table.knots.first(), table.knots.last()].map(|knot| knot.map_or(0.0, rational_to_f64));
            (first, last)
        };
        self.rows.first().into_iter().chain(self.shares.first()).map(ends).collect()
    }

    /// The continuation outside its points.
    pub fn beyond(&self) -> Extrapolation {
        self.beyond
    }

    /// Dimension of its value.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// Its value where its arguments are these expressions.
    ///
    /// # Panics
    /// With fewer arguments than it has.
    pub fn write_into(&self, graph: &mut Graph, at: &[Expr]) -> Expr {
        if self.shares.is_empty() {
            return graph.table(self.rows[0].clone(), at[0]);
        }
        let mut terms = Vec::new();
        for (row, share) in self.rows.iter().zip(&self.shares) {
            let (row, share) = (graph.table(row.clone(), at[0]), graph.table(share.clone(), at[1]));
            terms.push((graph.multiply(row, share), Rational::ONE));
        }
        graph.sum(Rational::ZERO, &terms)
    }

    /// Its value at a place, SI.
    ///
    /// # Panics
    /// With fewer arguments than it has.
    pub fn value(&self, at: &[f64]) -> f64 {
        let mut graph = Graph::default();
        let symbols: Vec<Expr> = (0..at.len()).map(|k| graph.symbol(&k.to_string(), Dimension::NONE)).collect();
        let value = self.write_into(&mut graph, &symbols);
        let place =
            |symbol| symbols.iter().position(|own| graph.symbol_of(*own) == Some(symbol)).map_or(0.0, |k| at[k]);
        super::lower(&graph, &[value], &mut super::Floating::<f64>::default(), place)[0]
    }
}

#[cfg(test)]
#[path = "../../tests/unit/expr/lookup.rs"]
mod tests;

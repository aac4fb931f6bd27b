//! Smooth curves through points.

use super::kind::KeyError;
use kardan_expr::expr::{Domain, Expr, Floating, Graph, PiecewisePolynomial};
use kardan_math::num::{Rational, rational_from_f64};
use kardan_mechanics::equations::Curve;

/// A natural cubic spline with linear extrapolation: the curve and its slope are continuous exactly, its curvature to rounding.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::element) struct Spline {
    /// The curve, its slope and its curvature.
    tables: [PiecewisePolynomial; 3],
}

impl Spline {
    /// Through two or more points with increasing abscissas.
    pub fn new(points: &[(f64, f64)]) -> Option<Self> {
        let slopes = slopes(points);
        let point = |(x, y): &(f64, f64)| Some((rational_from_f64(*x)?, rational_from_f64(*y)?));
        let points: Vec<_> = points.iter().map(point).collect::<Option<_>>()?;
        let slopes: Vec<Rational> = slopes.iter().map(|slope| rational_from_f64(*slope)).collect::<Option<_>>()?;
        let curve = PiecewisePolynomial::smooth(&points, &slopes, true)?;
        let slope = curve.derivative();
        let curvature = slope.derivative();
        Some(Self { tables: [curve, slope, curvature] })
    }

    /// Where the curve reverses: the ends of the first piece in which the slope vanishes or changes its sign.
    pub fn turns(&self) -> Option<(f64, f64)> {
        let [_, slope, _] = &self.tables;
        let rises = slope.value(&slope.knots[0]) > Rational::ZERO;
        let falls_short = |value: Rational| if rises { value <= Rational::ZERO } else { value >= Rational::ZERO };
        slope.knots.windows(2).enumerate().find_map(|(k, ends)| {
            let (origin, coefficients) = &slope.pieces[k + 1];
            let mut places = vec![ends[0].clone(), ends[1].clone()];
            // The vertex of the parabola.
            if let [_, first, second] = coefficients.as_slice()
                && *second != Rational::ZERO
            {
                let vertex = origin - first / (second * Rational::from(2));
                places.extend(Some(vertex).filter(|x| *x > ends[0] && *x < ends[1]));
            }
            let bad = places.iter().any(|x| falls_short(slope.value(x)));
            bad.then(|| (ends[0].to_f64().value(), ends[1].to_f64().value()))
        })
    }

    fn at(&self, order: usize, x: f64) -> f64 {
        Floating::<f64>::default().table(&self.tables[order], &x)
    }
}

impl Curve for Spline {
    fn value(&self, x: f64) -> f64 {
        self.at(0, x)
    }

    fn derivatives(&self, x: f64) -> (f64, f64) {
        (self.at(1, x), self.at(2, x))
    }

    fn expressions(&self, graph: &mut Graph, x: Expr) -> [Expr; 3] {
        self.tables.clone().map(|table| graph.table(table, x))
    }
}

/// Slopes of the natural spline at its points: the curvature is continuous, and zero at both ends.
fn slopes(points: &[(f64, f64)]) -> Vec<f64> {
    let n = points.len();
    if n < 2 {
        return Vec::new();
    }
    let h: Vec<f64> = points.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
    let chord: Vec<f64> = points.windows(2).zip(&h).map(|(pair, h)| (pair[1].1 - pair[0].1) / h).collect();
    // Rows: lower, diagonal, upper, right-hand side.
    let row = |k: usize| match k {
        0 => [0.0, 2.0, 1.0, 3.0 * chord[0]],
        _ if k == n - 1 => [1.0, 2.0, 0.0, 3.0 * chord[k - 1]],
        _ => {
            let (before, behind) = (h[k - 1].recip(), h[k].recip());
            [before, 2.0 * (before + behind), behind, 3.0 * (chord[k - 1] * before + chord[k] * behind)]
        }
    };
    let mut rows: Vec<[f64; 4]> = (0..n).map(row).collect();
    for k in 1..n {
        let factor = rows[k][0] / rows[k - 1][1];
        rows[k][1] -= factor * rows[k - 1][2];
        rows[k][3] -= factor * rows[k - 1][3];
    }
    let mut out = vec![0.0; n];
    for k in (0..n).rev() {
        let behind = out.get(k + 1).map_or(0.0, |slope| rows[k][2] * slope);
        out[k] = (rows[k][3] - behind) / rows[k][1];
    }
    out
}

/// Errors of the points of a curve.
pub(in crate::element) fn check_points(key: &'static str, points: &[(f64, f64)]) -> Vec<KeyError> {
    if points.len() < 2 {
        return vec![KeyError::new(key, "a curve needs two points at least", "add more points")];
    }
    if let Some(pair) = points.windows(2).find(|pair| pair[0].0 >= pair[1].0) {
        let message = format!("its points do not rise: after {} comes {} (SI)", pair[0].0, pair[1].0);
        return vec![KeyError::new(key, message, "list the points in order, each abscissa once")];
    }
    match Spline::new(points).and_then(|spline| spline.turns()) {
        Some((from, to)) => {
            let message = format!("the smooth curve through its points reverses between {from} and {to} (SI)");
            vec![KeyError::new(key, message, "let the values only rise or only fall, or add points there")]
        }
        None => Vec::new(),
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/element/shared/spline.rs"]
mod tests;

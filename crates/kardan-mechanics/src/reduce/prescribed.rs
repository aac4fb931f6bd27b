//! Constraints whose right-hand sides are functions of time (rheonomic), in the equations of motion.

use std::collections::BTreeMap;

use super::{Motion, Reduced};
use kardan_expr::expr::Expr;
use kardan_math::num::{Rational, rational_from_f64};

/// A right-hand side: its change since time zero, its first and its second derivative by the time.
pub(super) type Moving = BTreeMap<usize, [Expr; 3]>;

impl Motion {
    /// For each friction direction and each multiplier constraint whether a speed in its direction is prescribed.
    pub fn prescribed_directions(&mut self, reduced: &Reduced) -> Vec<bool> {
        let frictions =
            reduced.equations.set_valued().map(|(_, row)| self.sum(row, |motion, shaft| motion.carried[shaft]));
        let mut speeds: Vec<Expr> = frictions.collect();
        for k in 0..self.multiplier_constraints.len() {
            let (speed, rate) = (
                self.sum_over_multiplier(k, |motion, shaft| motion.carried[shaft]),
                self.multiplier_constraints[k].rate,
            );
            speeds.push(self.graph.subtract(speed, rate));
        }
        speeds.into_iter().map(|speed| !self.graph.is_zero(speed)).collect()
    }

    /// The right-hand sides that vary, by the number of their constraint; none where the time is fixed.
    pub(super) fn moving(&mut self, reduced: &Reduced) -> Moving {
        let mut out = Moving::new();
        if self.timed.begin {
            return out;
        }
        for (k, constraint) in reduced.equations.constraints.iter().enumerate() {
            let Some(function) = reduced.equations.moving.get(&constraint.element) else { continue };
            let value = self.of_time(function);
            let begin = rational_from_f64(constraint.value.to_f64()).unwrap_or(Rational::ZERO);
            let changed = self.graph.sum(-begin, &[(value, Rational::ONE)]);
            let rate = function.rate();
            let [first, second] = [&rate, &rate.rate()].map(|rate| self.of_time(rate));
            out.insert(k, [changed, first, second]);
        }
        out
    }

    /// Angle, speed, bias and prescribed speed with the contributions of varying right-hand sides.
    pub(super) fn moved(&mut self, found: [Expr; 4], shares: &[(usize, Rational)], moving: &Moving) -> [Expr; 4] {
        let [mut angle, mut speed, mut bias, mut carried] = found;
        for (row, share) in shares {
            let Some([changed, rate, second]) = moving.get(row) else { continue };
            let of = [(&mut angle, changed), (&mut speed, rate), (&mut bias, second), (&mut carried, rate)];
            for (whole, part) in of {
                let terms = [(*whole, Rational::ONE), (*part, share.clone())];
                *whole = self.graph.sum(Rational::ZERO, &terms);
            }
        }
        [angle, speed, bias, carried]
    }
}

//! Constraints that are not solved for a coordinate.

use std::sync::Arc;

use super::formula::Formula;
use kardan_expr::expr::OfTime;
use kardan_math::units::Exact;

/// A constraint that is not solved for a coordinate: a run enforces it by its multiplier.
#[derive(Debug, Clone, PartialEq)]
pub enum MultiplierLaw<Row> {
    /// `Σ a_i(q) q̇_i = 0`, coefficients as expressions of coordinates.
    Rates(Vec<(Row, Arc<Formula>)>),
    /// `φ(q) = 0`.
    Surface(Arc<Formula>),
    /// `Σ a_i q_i` or one of its rates is a function of time.
    Prescribed {
        /// a
        row: Vec<(Row, Exact)>,
        /// Whether it is the sum of positions (0), speeds (1) or accelerations (2).
        order: usize,
        /// The function.
        function: Arc<OfTime>,
    },
}

impl<Row> MultiplierLaw<Row> {
    /// The same over other names of coordinates.
    pub fn renamed<Other>(&self, name: impl Fn(&Row) -> Other) -> MultiplierLaw<Other> {
        match self {
            Self::Rates(row) => MultiplierLaw::Rates(row.iter().map(|(own, a)| (name(own), Arc::clone(a))).collect()),
            Self::Surface(formula) => MultiplierLaw::Surface(Arc::clone(formula)),
            Self::Prescribed { row, order, function } => {
                let row = row.iter().map(|(own, x)| (name(own), x.clone())).collect();
                MultiplierLaw::Prescribed { row, order: *order, function: Arc::clone(function) }
            }
        }
    }

    /// The coordinates of its sum; a surface is none.
    pub fn summed(&self) -> Vec<&Row> {
        match self {
            Self::Rates(row) => row.iter().map(|(own, _)| own).collect(),
            Self::Surface(_) => Vec::new(),
            Self::Prescribed { row, .. } => row.iter().map(|(own, _)| own).collect(),
        }
    }

    /// The formulas in it.
    pub fn formulas(&self) -> Vec<&Arc<Formula>> {
        match self {
            Self::Rates(row) => row.iter().map(|(_, formula)| formula).collect(),
            Self::Surface(formula) => vec![formula],
            Self::Prescribed { .. } => Vec::new(),
        }
    }

    /// Whether a number in it is rounded.
    pub fn is_rounded(&self) -> bool {
        let numbers = match self {
            Self::Rates(_) | Self::Surface(_) => &[][..],
            Self::Prescribed { row, .. } => row,
        };
        numbers.iter().any(|(_, x)| x.is_rounded()) || self.formulas().into_iter().any(|formula| formula.is_rounded())
    }

    /// Whether it prescribes a function of time.
    pub fn prescribes(&self) -> bool {
        matches!(self, Self::Prescribed { .. })
    }
}

impl MultiplierLaw<String> {
    /// The coordinates in it.
    pub fn coordinates(&self) -> Vec<&str> {
        let in_formulas = self.formulas().into_iter().flat_map(|formula| formula.coordinates());
        self.summed().into_iter().map(String::as_str).chain(in_formulas).collect()
    }
}

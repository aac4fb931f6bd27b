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
    /// `Σ a_i q_i` is a function of time.
    Position(Vec<(Row, Exact)>, Arc<OfTime>),
    /// `Σ a_i q̇_i` is a function of time.
    Speed(Vec<(Row, Exact)>, Arc<OfTime>),
    /// `Σ a_i q̈_i` is a function of time.
    Acceleration(Vec<(Row, Exact)>, Arc<OfTime>),
}

impl<Row> MultiplierLaw<Row> {
    /// The same over other names of coordinates.
    pub fn renamed<Other>(&self, name: impl Fn(&Row) -> Other) -> MultiplierLaw<Other> {
        let numbers = |row: &[(Row, Exact)]| row.iter().map(|(own, x)| (name(own), x.clone())).collect();
        match self {
            Self::Rates(row) => MultiplierLaw::Rates(row.iter().map(|(own, a)| (name(own), Arc::clone(a))).collect()),
            Self::Surface(formula) => MultiplierLaw::Surface(Arc::clone(formula)),
            Self::Position(row, place) => MultiplierLaw::Position(numbers(row), Arc::clone(place)),
            Self::Speed(row, rate) => MultiplierLaw::Speed(numbers(row), Arc::clone(rate)),
            Self::Acceleration(row, rate) => MultiplierLaw::Acceleration(numbers(row), Arc::clone(rate)),
        }
    }

    /// The coordinates of its sum; a surface is none.
    pub fn summed(&self) -> Vec<&Row> {
        match self {
            Self::Rates(row) => row.iter().map(|(own, _)| own).collect(),
            Self::Surface(_) => Vec::new(),
            Self::Position(row, _) | Self::Speed(row, _) | Self::Acceleration(row, _) => {
                row.iter().map(|(own, _)| own).collect()
            }
        }
    }

    /// The formulas in it.
    pub fn formulas(&self) -> Vec<&Arc<Formula>> {
        match self {
            Self::Rates(row) => row.iter().map(|(_, formula)| formula).collect(),
            Self::Surface(formula) => vec![formula],
            Self::Position(..) | Self::Speed(..) | Self::Acceleration(..) => Vec::new(),
        }
    }

    /// Whether a number in it is rounded.
    pub fn is_rounded(&self) -> bool {
        let numbers = match self {
            Self::Rates(_) | Self::Surface(_) => &[][..],
            Self::Position(row, _) | Self::Speed(row, _) | Self::Acceleration(row, _) => row,
        };
        numbers.iter().any(|(_, x)| x.is_rounded()) || self.formulas().into_iter().any(|formula| formula.is_rounded())
    }

    /// Whether it prescribes a function of time.
    pub fn prescribes(&self) -> bool {
        matches!(self, Self::Position(..) | Self::Speed(..) | Self::Acceleration(..))
    }
}

impl MultiplierLaw<String> {
    /// The coordinates in it.
    pub fn coordinates(&self) -> Vec<&str> {
        let in_formulas = self.formulas().into_iter().flat_map(|formula| formula.coordinates());
        self.summed().into_iter().map(String::as_str).chain(in_formulas).collect()
    }
}

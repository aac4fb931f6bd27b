//! The content of a file of matrices.

use kardan_analysis::LinearSystem;
use kardan_math::num::Rational;

/// A linear system as a file gives it.
#[derive(Debug, Clone, PartialEq)]
pub struct StateSpace {
    /// The matrices, exact; E may be singular.
    pub system: LinearSystem,
    /// In discrete time the sample time, s; `Some(None)` if it is not known. In continuous time `None`.
    pub sample_time: Option<Option<Rational>>,
    /// The uncertainty of the numbers.
    pub digits: DataDigits,
}

/// The uncertainty of the numbers of a file, as Frobenius norms: half a unit of the last digit of decimals
/// written by hand, 2⁻⁵³ of the size of binary numbers and of decimals with 15 digits or more. Whole numbers and fractions
/// are exact.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DataDigits {
    /// Whether they are those of binary numbers.
    pub binary: bool,
    /// Of `[A, B]`.
    pub inputs: f64,
    /// Of `[A; C]`.
    pub outputs: f64,
    /// Of `E`.
    pub descriptor: f64,
}

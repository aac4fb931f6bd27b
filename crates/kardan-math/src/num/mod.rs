//! Numbers and small dense matrices: the same code over `f64` (speed) and over exact rationals (certainty).
//!
//! Independent of mechanics. Structural decisions (rank, definiteness, which rows depend on which) are made here over
//! [`Rational`]; floating point decides magnitudes only.

mod at_zero;
mod balance;
mod block_triangular;
mod bracket;
mod characteristic;
mod contraction;
mod dense;
mod dyadic;
mod eigen;
mod elimination;
mod exact_zoh;
mod exponential;
mod float;
mod fourier;
mod golden;
mod hessenberg;
mod invariant_factors;
mod krylov;
mod last_digits;
mod matrix;
mod modular;
pub mod modular_polynomial;
mod null_vectors;
mod parts;
mod polynomial;
mod polynomial_roots;
mod positive_roots;
mod prime_field;
mod reachable;
mod reconstruct;
mod resolvent;
mod root_sides;
mod roots;
mod routh;
mod scalar;
mod size;
mod snapshot;
mod sparse;
mod sparse_lu;
mod steffen;
mod wide;

pub use at_zero::{AtZero, Rounding, at_zero};
pub use balance::balance;
pub use balance::{scaled, unscaled};
pub use block_triangular::isolated;
pub use bracket::bracket;
pub use characteristic::{characteristic_polynomial, is_hurwitz};
pub use contraction::contracts;
pub use dense::{Cholesky, Lu, dot, multiply};
pub use dense::{LANES, Panels, product};
pub use eigen::eigenvalues;
pub use elimination::{Definiteness, Echelon, definiteness, definiteness_of_rows, echelon, kernel, reduced_form};
pub use exact_zoh::{ExactZoh, exact_zoh};
pub use exponential::{Discretised, discretise, exponential};
pub use float::{Float, max_or_nan};
pub use fourier::fourier;
pub use golden::golden;
pub use hessenberg::hessenberg;
pub use invariant_factors::invariant_factors;
pub use krylov::{Operator, recurrence};
pub use last_digits::LastDigits;
pub use matrix::Matrix;
pub use modular::{ModularMatrix, exact_rank};
pub use null_vectors::{NullVectors, null_vectors};
pub use parts::{columns_of, joined, rows_of, selected, side_by_side, stacked, window};
pub use polynomial::{Polynomial, multiply_whole};
pub use prime_field::{PrimeField, Primes, Random, Residue, is_prime, prime_below, prime_fields, random_prime};
pub use reachable::{Reachable, Span, quotient_action, reachable};
pub use reconstruct::{Reconstruction, nearby_fraction};
pub use resolvent::{Resolvent, resolvent};
pub use root_sides::{RootSides, cayley, from_cayley, root_sides};
pub use routh::routh_column;
pub use scalar::{
    Rational, Scalar, common_denominator, rational_from_f64, rational_to_f64, shortest_decimal, whole_multiple,
};
pub use size::{above, below, exponent, length, power_of_two, root_above};
pub use snapshot::StateArchive;
pub use sparse::{
    SparseEchelon, SparseRow, dense_rows, project, sparse_echelon, sparse_rows, sparse_sum_of_outer, sum_of_outer,
};
pub use sparse_lu::{Field, SparseLu, SparseOrder};
pub use steffen::steffen;

//! Numbers of kardan: dense and sparse matrices over `f64` and over exact fractions, quantities with units, and names in sentences.
//!
//! It knows no mechanics. Begin with [`num::Matrix`], [`num::Rational`] and [`units::Exact`].
//!
//! ```
//! use kardan_math::num::{Matrix, Rational};
//! use kardan_math::units::{Dimension, parse_quantity};
//!
//! // The same elimination decides exactly over fractions and quickly over floating point.
//! let third = Rational::from(1) / Rational::from(3);
//! let a = Matrix::from_fn(2, 2, |i, j| if i == j { third.clone() } else { Rational::from(0) });
//! let x = a.solve(&Matrix::identity(2)).unwrap();
//! assert_eq!(x.row(0)[0], Rational::from(3));
//!
//! let (inertia, dimension) = parse_quantity("130 kg mm^2")?;
//! assert_eq!((inertia.to_f64(), dimension), (130e-6, Dimension::INERTIA));
//! # Ok::<(), kardan_math::units::UnitError>(())
//! ```
#![deny(clippy::disallowed_methods)]

pub mod names;
pub mod num;
pub mod units;

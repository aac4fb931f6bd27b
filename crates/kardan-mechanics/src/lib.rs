//! Equations of motion: terms along directions, their assembly, and the elimination of constraints.
//!
//! It knows no files, no elements and no control. Begin with [`equations::Term`], [`assemble::Equations`] and [`reduce::Reduced`].
//!
//! ```
//! use kardan_mechanics::{assemble::assemble, reduce::reduce};
//!
//! let (document, _) = kardan_model::read(kardan_model::builtin("harmonic-drive").unwrap().source);
//! let (drive, _) = document.model(&[]);
//! let reduced = reduce(assemble(&drive.all_coordinates, &drive.terms), None).unwrap();
//! // Three shafts, one constraint.
//! assert_eq!(reduced.coordinates.len(), 2);
//! ```
#![deny(clippy::disallowed_methods)]

pub mod assemble;
pub mod equations;
pub mod program;
pub mod reduce;
pub mod symbolic;

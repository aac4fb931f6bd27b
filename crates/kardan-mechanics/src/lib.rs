//! Equations of motion: terms along directions, their assembly, and the elimination of constraints.
//!
//! It knows no files, no elements and no control. Begin with [`equations::Term`], [`assemble::Equations`] and [`reduce::Reduced`].
//!
//! ```
//! use kardan_mechanics::assemble::assemble;
//! use kardan_mechanics::reduce::reduce;
//! use kardan_model::{builtin, read};
//!
//! let (document, _) = read(builtin("harmonic-drive").unwrap().source);
//! let (drive, _) = document.model(&[]);
//! let equations = assemble(&drive.all_coordinates, &drive.terms);
//! let reduced = reduce(&equations, &drive.coordinates).unwrap();
//! assert_eq!(reduced.coordinates.len(), 2);
//! ```
#![deny(clippy::disallowed_methods)]

pub mod assemble;
pub mod equations;
pub mod program;
pub mod reduce;
pub mod symbolic;

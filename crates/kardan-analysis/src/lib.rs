//! Analysis of linear models: structure, modes, zeros, stability, certificates and distances, decided over fractions.
//!
//! It knows no control laws and no runs. Begin with [`LinearSystem`], [`ConstrainedSystem`] and [`stability_of`].
//!
//! ```
//! use kardan_analysis::{Plane, stability_of};
//! use kardan_math::num::{Matrix, Rational};
//! use kardan_results::Stability;
//!
//! // ẍ + ẋ + x = 0
//! let a = Matrix::from_fn(2, 2, |i, j| Rational::from([[0, 1], [-1, -1]][i][j]));
//! assert_eq!(stability_of(&a, Plane::Continuous).word, Stability::Stable);
//! ```
#![deny(clippy::disallowed_methods)]

mod bases;
mod box_proof;
mod certified;
mod class;
mod constraint_forces;
mod construction;
mod dependent;
mod descriptor;
mod detect;
mod distance;
mod failing;
mod family;
mod generic_functions;
mod generic_motion;
mod generic_sizes;
mod gramian;
mod images;
mod indices;
mod integrable;
mod massless;
mod modes;
mod parity;
mod parts;
mod pencil;
mod placement;
mod properties;
mod realisation;
mod reduction;
mod sampling;
mod spectrum;
mod stability;
mod structure;
mod system;
mod uncontrollability;
mod zeros;

pub use bases::{BasisError, bases, eigenvalue_bounds, gram_schmidt};
pub use box_proof::{BoxProof, PencilBox, prove_box};
pub use class::{class, multiplier_constraint_classes};
pub use constraint_forces::constraint_forces;
pub use construction::{MOST_CONSTRUCTED, construction};
pub use dependent::{Dependent, dependent_row};
pub use descriptor::{DecomposedDescriptor, DescriptorError, MOST_VARIABLES, SingularPencil, descriptor};
pub use detect::{Goal, MOST_EXACT, SmallestSets, Transfer, constant_is_detectable, smallest_sets};
pub use distance::{MOST_FROM_BELOW, MOST_STATES, distance_of_matrices};
pub use failing::{Mechanics, failing_modes};
pub use family::{Family, Parameter, Pencil, SystemAt, uncontrollability_pencil};
pub use gramian::{Gramian, gramian, smallest_eigenvalue, transfer_energy};
pub use massless::{Eliminated, MasslessError, combination, eliminate_massless, massless_direction, plain_combination};
pub use modes::{exact_modes_beside, exact_modes_of_pencil, mode_of_motion, modes, modes_of_pencil, needs_modes};
pub use parity::{Broken, ParitySignal, Relation, StaticRelations, relation_is_satisfied, relations, static_relations};
pub use pencil::{OutputSignal, linear_system};
pub use placement::{Candidate, Measure, place, with_candidates};
pub use properties::{modular_properties, properties, stability_proofs};
pub use realisation::{MOST_TRANSFORMED, realisations};
pub use reduction::{Reduction, reduction, sum_of_terms};
pub use sampling::{SamplingPlan, sample};
pub use stability::{Plane, despite_rounding, stability_of, stability_of_roots};
pub use structure::{StructureError, certified_structure, controllable_rank, state_modular, structure};
pub use system::{ConstrainedSystem, LinearSystem, LoadSlopes, Side};
pub use uncontrollability::{FARTHEST, distance_to_uncontrollability};

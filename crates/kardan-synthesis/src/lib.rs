//! Control laws: from a model and a specification to gains that a block of `kardan-rt` runs, and to the margins of the loop.
//!
//! `law/` contains one file for each law and [`REGISTRY`], the only list of them; the parser of `[control.<name>]` tables, the manual
//! and the tests read it. The other folders contain the theory that the laws share. Begin with [`REGISTRY`], [`LawKind`] and [`Law`].
//!
//! ```
//! use kardan_math::num::Matrix;
//! use kardan_synthesis::regulator::lyapunov;
//!
//! // aᵀx + xa + q = 0 for a = −1, q = 2.
//! let number = |value| Matrix::from_fn(1, 1, |_, _| value);
//! assert_eq!(lyapunov(&number(-1.0), &number(2.0)).unwrap().solution.row(0)[0], 1.0);
//! ```
#![deny(clippy::disallowed_methods)]

#[macro_use]
mod forward;
#[macro_use]
mod keys;

mod at_operating_point;
mod blending;
mod channels;
mod clock;
mod closed_loop;
mod counters;
pub mod decoupling;
mod design;
mod designed;
mod error;
mod exact;
mod exact_motions;
mod exact_poles;
pub mod inversion;
mod kind;
mod law;
mod law_runtime;
mod linear_law;
mod linear_part;
pub mod margins;
mod matrix_parts;
mod nonlinear_law;
mod notation;
mod observed;
pub mod observer;
mod outputs;
mod plant;
mod reference;
pub mod regulator;
mod sample_time;
mod sampled;
mod stability;
mod state_feedback;
mod submodel_law;
mod task_law;
mod zeros;

pub use blending::blending_signal;
pub use clock::Clock;
use clock::is_single;
pub use closed_loop::{closed_loop_matrix, closed_loop_poles, poles_excluding};
pub use counters::{Counters, counting_charges, remove_counting_charges};
pub use design::design_law;
pub use designed::{ExportedSignal, Frozen, Kinks, Law};
pub use error::{Advice, SynthesisError};
pub use exact::{ExactLaw, ExactLoop, named, rounded};
pub use exact_motions::{ExactMotions, exact_motions, exact_motions_of};
pub use kardan_results::Stability;
pub use kind::{LawKind, Request};
pub use law::*;
pub use law_runtime::{Block, LawRuntime, Observation};
pub use linear_part::LinearLaw;
use linear_part::sizes;
pub use notation::linear_combination;
pub use observed::Observer;
pub use plant::{Plant, effective_inertia, input_inertia};
use plant::{angle_output, output_shaft};
pub use reference::Reference;
pub use sample_time::{LONGEST_DELAY, LONGEST_SAMPLE_TIME, SHORTEST_SAMPLE_TIME, clock, implemented};
pub use sampled::{
    BesideBlocks, Change, ControlLoop, ExactMap, GAINS, LIMIT_STEP, Lifted, Limit, LinearTask, LoopBlocks, LoopPlant,
    Readings, Reads, SampledLoop, SampledLoopError, SampledPart, SlowSensor, Slowest, Survey, Teller, VariedPlant,
    Wire, reading_variance, sampled,
};
pub use stability::stability;
pub use submodel_law::submodel_law;
pub use task_law::TaskLaw;
pub use zeros::roots;

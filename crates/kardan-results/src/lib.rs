//! What the studies of kardan return: plain data with names and units, without computations.
//!
//! Reports and exports read these types and nothing else of kardan. Begin with [`Study`] (a run), [`Analysis`] and [`Design`].
//!
//! ```
//! use kardan_results::Stability;
//!
//! // A verdict says how far it goes: `Undecided` is one of its cases.
//! assert_ne!(Stability::Stable, Stability::Undecided);
//! ```
#![deny(clippy::disallowed_methods)]

mod accuracy;
mod analysis;
mod bench;
mod certificate;
mod constrained_model;
mod descriptor;
mod design;
mod distances;
mod exploration;
mod extremes;
mod identification;
mod linearised;
mod loop_along_path;
mod margins;
mod mechanism;
mod modes;
mod motor_load;
mod numbers;
mod parity;
mod pencil;
mod physical;
mod placement;
mod realisation;
mod reference;
mod responses;
mod robustness;
mod run;
mod safety;
pub mod serial;
mod signal_graph;
pub mod signal_name;
mod stability;
mod structure;
mod study;
mod sweep;
mod verdict;

pub use accuracy::*;
pub use analysis::*;
pub use bench::*;
pub use certificate::*;
pub use constrained_model::*;
pub use descriptor::*;
pub use design::*;
pub use distances::*;
pub use exploration::*;
pub use extremes::*;
pub use identification::*;
pub use kardan_math::names::bidi_escaped;
pub use linearised::*;
pub use loop_along_path::*;
pub use margins::*;
pub use mechanism::*;
pub use modes::*;
pub use motor_load::*;
pub use numbers::*;
pub use parity::*;
pub use pencil::*;
pub use physical::*;
pub use placement::*;
pub use realisation::*;
pub use reference::*;
pub use responses::*;
pub use robustness::*;
pub use run::*;
pub use safety::*;
pub use signal_graph::*;
pub use stability::*;
pub use structure::*;
pub use study::*;
pub use sweep::*;
pub use verdict::*;

//! The control laws, one file or folder each, and the one list of them.

mod computed_torque;
mod decoupling;
mod flatness;
mod lqr;
mod noninteracting;
mod pole_placement;
mod position_loop;
mod program;
mod sampled_noninteracting;

pub use computed_torque::{ComputedTorque, ComputedTorqueChannel};
pub use decoupling::{Decoupling, DecouplingChannel};
pub use flatness::{Flatness, FlatnessChannel};
pub use lqr::{Lqr, LqrChannel};
pub use noninteracting::{
    ChannelDesign, Noninteracting, NoninteractingChannel, NoninteractingDesign, design_noninteracting,
};
pub use pole_placement::{PolePlacement, PolePlacementChannel};
pub use position_loop::PositionLoop;
pub use program::{Program, ProgramReference};
pub use sampled_noninteracting::{SampledNoninteracting, SampledNoninteractingChannel};

use super::LawKind;

/// All laws.
pub const REGISTRY: &[LawKind] = &[
    computed_torque::COMPUTED_TORQUE,
    decoupling::DECOUPLING,
    flatness::FLATNESS,
    lqr::LQR,
    noninteracting::NONINTERACTING,
    pole_placement::POLE_PLACEMENT,
    position_loop::POSITION_LOOP,
    program::PROGRAM,
    sampled_noninteracting::SAMPLED_NONINTERACTING,
];

/// The law with that keyword.
pub fn find(keyword: &str) -> Option<&'static LawKind> {
    REGISTRY.iter().find(|law| law.keyword == keyword)
}

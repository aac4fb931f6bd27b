//! The control laws, one file each, and the one list of them.

mod computed_torque;
mod decoupling;
mod noninteracting;
mod position_loop;

pub use noninteracting::{ChannelDesign, NoninteractingDesign, design_noninteracting};

use super::LawKind;

/// All laws.
pub const REGISTRY: &[LawKind] = &[
    computed_torque::COMPUTED_TORQUE,
    decoupling::DECOUPLING,
    noninteracting::NONINTERACTING,
    position_loop::POSITION_LOOP,
];

/// The law with that keyword.
pub fn find(keyword: &str) -> Option<&'static LawKind> {
    REGISTRY.iter().find(|law| law.keyword == keyword)
}

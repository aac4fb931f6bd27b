//! The designs of controllers: proofs about their loops, interaction, robustness, and what they need of their motors.

pub(super) mod actuator_usage;
pub(super) mod cross_coupling;
pub(super) mod designs;
pub(super) mod explore;
pub(super) mod proof;
pub(super) mod robustness;

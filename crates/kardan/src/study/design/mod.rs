//! The designs of controllers, and how far their loops are from instability.

pub(super) mod cross_coupling;
pub(super) mod design_in_motion;
pub(super) mod designs;
pub(super) mod explore;
pub(super) mod loop_along_path;
pub(super) mod margins;
pub(super) mod margins_over_positions;

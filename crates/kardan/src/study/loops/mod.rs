//! The loops of laws, blocks and a plant: which blocks they contain, their steps, stability and margins, also along a path of the joints.

pub(super) mod blocks;
pub(super) mod loop_along_path;
pub(super) mod loop_blocks;
pub(super) mod margins;
pub(super) mod margins_over_positions;
pub(super) mod stepped_loop;

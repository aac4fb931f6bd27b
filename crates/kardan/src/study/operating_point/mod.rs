//! Where a model is linearised: the points that controllers and an analysis name, at rest and in motion.

pub(super) mod design_in_motion;
pub(super) mod named_point;
pub(super) mod point_in_motion;
pub(super) mod working_point;

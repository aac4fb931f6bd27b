//! Structure, modes and distances of a model at an operating point.

pub(super) mod descriptor;
pub(super) mod linearise;
pub(super) mod parity;
pub(super) mod placement;
pub(super) mod sensitivity;
pub(super) mod stability_at_point;
pub(super) mod structure;
pub(super) mod thresholds;

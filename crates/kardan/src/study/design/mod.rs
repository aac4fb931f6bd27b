//! The designs of controllers, and how far their loops are from instability.

pub(super) mod cross_coupling;
pub(super) mod designs;
pub(super) mod explore;

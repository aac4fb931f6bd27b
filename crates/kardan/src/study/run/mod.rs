//! The runs of a study.

pub(super) mod accuracy;
pub(super) mod model_summary;
pub(super) mod runs;

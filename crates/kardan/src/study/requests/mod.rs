//! What the tables of a model file request of an analysis, a bench, the faults and a sweep, with their errors.

pub(super) mod analysis_spec;
pub(super) mod bench_spec;
pub(super) mod bench_truth;
pub(super) mod correlated;
pub(super) mod distribution;
pub(super) mod safety_spec;
pub(super) mod sample_space;
pub(super) mod sampling_method;
pub(super) mod sweep_spec;
pub(super) mod varied;

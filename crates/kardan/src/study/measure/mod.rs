//! What is measured in a run: computed signals, figures, requirements, spectra.

pub(super) mod computed_signals;
pub(super) mod figure;
pub(super) mod figure_spec;
pub(super) mod measures;
pub(super) mod measures_over_input;
pub(super) mod plot_spec;
pub(super) mod requirement_spec;
pub(super) mod requirement_verdict;
pub(super) mod selected_variants;
pub(super) mod spectrum;

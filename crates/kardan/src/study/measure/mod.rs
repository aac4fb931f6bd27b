//! What is measured in a run: signals, figures, requirements, spectra.

pub(super) mod computed_signals;
pub(super) mod figure;
pub(super) mod measures;
pub(super) mod measures_over_input;
pub(super) mod requirement;
pub(super) mod requirements;
pub(super) mod signals;
pub(super) mod spectrum;

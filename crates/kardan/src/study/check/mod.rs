//! What is wrong with a model, found before anything is computed: one file a rule.

pub(super) mod circuit;
pub(super) mod debounce;
pub(super) mod effort;
pub(super) mod equilibrium;
pub(super) mod extrapolation_warnings;
pub(super) mod kinks;
pub(super) mod massless_elimination;
pub(super) mod massless_motions;
pub(super) mod model_checks;
pub(super) mod multiplier_constraints;
pub(super) mod quantisation_ambiguity;
pub(super) mod redundant_torques;
pub(super) mod safety_rows;
pub(super) mod stop_checks;
pub(super) mod vehicle_validity;

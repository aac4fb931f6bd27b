//! The tables of a model file as typed values, and the places and names that messages about them need.

pub(super) mod events;
pub(super) mod faults;
pub(super) mod initial_state;
pub(super) mod locations;
pub(super) mod positions;
pub(super) mod read_values;
pub(super) mod scenario;
pub(super) mod signal_table;
pub(super) mod source_signals;
pub(super) mod state_names;
pub(super) mod tolerance;
pub(super) mod variant_diagnostics;

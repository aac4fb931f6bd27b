//! Errors of the analysis of structure.

/// Why the structure of a system cannot be decided.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StructureError {
    /// There are no states.
    #[error("the system has no states")]
    NoStates,
    /// E is singular, so the equations do not determine the rates of all states.
    #[error("E is singular: its rank is {rank}, the system has {states} states")]
    SingularDescriptor {
        /// Exact rank.
        rank: usize,
        /// Number of states.
        states: usize,
    },
}

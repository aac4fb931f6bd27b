//! Plain matrices with a singular E: decomposed, or the reason why this is impossible.

use kardan_analysis::{
    DecomposedDescriptor, DescriptorError, LinearSystem, MOST_VARIABLES, SingularPencil, descriptor,
};
use kardan_schema::diagnostics::Diagnostic;

/// Largest number of equations that are listed with their factors.
const MAX_LISTED: usize = 8;

/// The descriptor system and its equivalent state space.
///
/// # Errors
/// If the pencil is singular, or too large.
pub(in crate::study) fn decompose_descriptor(system: &LinearSystem) -> Result<DecomposedDescriptor, Diagnostic> {
    descriptor(system).map_err(|error| match error {
        DescriptorError::Singular(why) => singular(&why),
        DescriptorError::TooLong => {
            let message = "`E` is singular, and the pencil is too large for an exact decomposition: its numbers are \
                           long fractions";
            Diagnostic::error("state-space::too-large", message)
                .help("give the numbers with fewer digits, or solve the algebraic equations and give what remains")
        }
        DescriptorError::TooLarge => {
            let message = format!(
                "`E` is singular, and a descriptor system of {} variables is too large: kardan decomposes at most \
                 {MOST_VARIABLES}",
                system.states.len()
            );
            Diagnostic::error("state-space::too-large", message).help(
                "solve the algebraic equations for some of the variables and give what remains, with a regular `E`",
            )
        }
    })
}

fn singular(why: &SingularPencil) -> Diagnostic {
    let mut message = String::from(
        "the pencil sE - A is singular: det(sE - A) is zero for all s, so the equations E x' = A x + B u do not determine x",
    );
    let listed: Option<Vec<String>> =
        why.equations.iter().map(|(row, factor)| Some(format!("({}) · row {}", factor.as_ref()?, row + 1))).collect();
    match listed.filter(|all| all.len() <= MAX_LISTED) {
        Some(all) => message += &format!("; of sE - A {} is zero for all s", all.join(" + ")),
        None => {
            let rows: Vec<String> = why.equations.iter().map(|(row, _)| (row + 1).to_string()).collect();
            message += &format!("; the rows {} of sE - A depend on each other for all s", rows.join(", "));
        }
    }
    Diagnostic::error("state-space::singular", message)
        .help("one of these equations follows from the others, or contradicts them: replace it by the missing one")
}

//! The equations of motion as text.

pub(super) mod form;
pub(super) mod forms;
pub(super) mod latex_lines;
pub(super) mod multiplier_equations;
pub(super) mod symbolic;

//! Stability and margins of a controller's loop with sampling, delay, lag and limits.

mod channels;
mod check;
mod clocks;
mod contacts;
mod responses;
mod sides;
mod stability;
mod survey;
mod verdict;
mod warnings;

pub(super) use channels::motor_margins;
pub use check::overrule;
pub(super) use check::{UNSTABLE, check_margins, check_sampled};
pub(super) use contacts::{contact_warnings, contacts_verdict, margins_in_contact, replaced_plants};
pub(super) use responses::responses;
pub(super) use sides::LoopKinks;
pub(super) use survey::{decay, excluded, searches, survey};
pub(super) use verdict::verdict;
pub(super) use warnings::warnings;

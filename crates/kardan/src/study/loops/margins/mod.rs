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

pub(in crate::study) use channels::motor_margins;
pub use check::overrule;
pub(in crate::study) use check::{UNSTABLE, check_margins, check_sampled, check_size};
pub(in crate::study) use contacts::{contact_warnings, contacts_verdict, margins_in_contact, with_plants};
pub(in crate::study) use responses::responses;
pub(in crate::study) use sides::LoopKinks;
pub(in crate::study) use survey::{decay, excluded, searches, survey};
pub(in crate::study) use verdict::verdict;
pub(in crate::study) use warnings::warnings;

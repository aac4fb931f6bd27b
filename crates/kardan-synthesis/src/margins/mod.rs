//! Stability margins of a loop over all frequencies: gain, phase, delay and disk margins of one channel,
//! and of all channels at once.
//!
//! The loop is `ż = A z + B w`, `u = C z` (or a map over a sample time), stable, with w = 0 as designed. An error δ of channel i
//! adds `w_i = δ_i u_i`: its signal is `1 + δ_i` times what it should be. With `M(s) = C (sI − A)⁻¹ B` the loop loses its
//! stability where `det(I − diag(δ) M(jω)) = 0`; for one channel M = −T, and 1 + M = S.

mod channel;
mod channel_quotient;
mod frequencies;
mod multiloop;
mod response;

pub use channel::{channel_margins, within_disk};
pub use frequencies::{frequency_range, refined};
pub use multiloop::{MultiloopMargin, multiloop_margin, structured_singular_value};
pub use response::{FrequencyError, LargestGain, Response};

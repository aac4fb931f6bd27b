//! State feedback by pole placement and by quadratic cost, in floating point with certified residuals.
//!
//! What can be placed or stabilised at all is decided exactly ([`unreached`]); floating point ([`place_poles`], [`lqr`],
//! [`lyapunov`]) then works in balanced coordinates and reports the residual of the defining equation.

mod assignment;
mod discrete;
mod floating;
mod lyapunov;
mod pole_list;
mod pole_placement;
mod quadratic;
mod reach;
mod riccati;
mod schur;
mod single_input;
mod steady_state;

pub use super::exact_poles::ExactPole;
pub use discrete::{SampledCost, SampledRegulator, sampled_lqr, stein};
pub use lyapunov::{Lyapunov, LyapunovError, lyapunov};
pub use pole_placement::{Placement, PlacementError, place_poles};
pub use quadratic::{Regulator, RiccatiError, Weights, lqr};
pub use reach::{Chains, Unreached, chains, unreached};
pub use steady_state::{SteadyState, SteadyStateError, steady_state};

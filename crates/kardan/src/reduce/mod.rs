//! Constraints out of the equations: reduced coordinates, the explicit form `q = γ(q_r)` and its derivatives.
//!
//! Linear constraints are eliminated exactly over the rationals; nonlinear transmissions follow in an order in which
//! each can be evaluated in closed form. The result is a plan that floating point executes without decisions.

mod answered;
mod constraint_torques;
mod contacts;
mod dynamics;
mod equilibrium;
mod equilibrium_rows;
mod error;
mod explicit;
mod first_order;
mod initial;
mod instant;
mod kept;
mod kinematics;
mod law_slopes;
mod law_torques;
mod laws;
mod linear;
mod mechanism;
mod motion;
mod multipliers;
mod prescribed;
mod reduced;
mod redundant;
mod relaxation;
mod slipping;
mod steady;

pub use answered::{AnsweredTorque, answered_locks, answered_torques, is_answered};
pub use constraint_torques::Acting;
pub use contacts::{Contact, contacts, pressed_cushions};
pub use dynamics::{Dynamics, Extension, MotionPlan, Work};
pub use equilibrium::{Equilibria, Equilibrium, Held, STARTS, equilibria, held};
pub use equilibrium_rows::{NoEquilibrium, equilibrium_rows};
pub use error::{Dependency, ReduceError};
pub use explicit::reduce;
pub use first_order::{FirstOrder, motions_over_states, over_states, with_inertia};
pub use initial::{GivenStart, StartConflict, start_position, start_speed};
pub use instant::{Instant, closed_contacts, engaged_locks, slip_speeds, with_held, with_sliding};
pub use kept::{GivenRows, NoStart, StartOnRows, follows_everywhere, frozen, inertia_with_rows, start_on_rows};
pub use kinematics::{Kinematics, Slope, slopes};
pub use law_slopes::{
    GeometricStiffness, LawSlopes, OperatingPoint, geometric_stiffness, is_linear_law, law_slopes, law_slopes_at,
    law_slopes_with, laws_are_linear,
};
pub use law_torques::{LawTorques, NotLinear, Wave, law_waves};
pub use linear::{LinearModel, SparseModel, linearise, linearise_at, linearise_near, sparse_model};
pub use mechanism::{MechanismData, MechanismError};
pub use motion::{Forces, KeptRate, Motion, SparseRow, Timed};
pub use multipliers::Multipliers;
pub use reduced::{Affine, Reduced, Redundant, Relaxation, Slip, Step};
pub use relaxation::{NoRelaxation, relaxation};
pub use steady::{GivenMotion, NoSteadyMotion, SteadyMotion, accelerations, motion_of, steady_motion};

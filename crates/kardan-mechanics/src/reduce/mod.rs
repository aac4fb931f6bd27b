//! Elimination of constraints: reduced coordinates, the explicit form `q = γ(q_r)` and its derivatives.
//!
//! Linear constraints are eliminated exactly over the rationals; nonlinear transmissions follow in an order in which
//! each can be evaluated in closed form. The result is a plan that runs in floating point without decisions.

mod block_torque_slopes;
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
mod kinematics;
mod law_slopes;
mod law_torques;
mod laws;
mod linear;
mod massless;
mod mechanism;
mod motion;
mod multiplier_constraints;
mod prescribed;
mod reduced;
mod redundant;
mod slipping;
mod steady;

pub use block_torque_slopes::{BlockTorque, block_locks, block_torques, reads_blocks};
pub use constraint_torques::Acting;
pub use contacts::{Contact, contacts, pressed_cushions};
pub use dynamics::{Dynamics, Extension, MotionPlan, Work};
pub use equilibrium::{Equilibria, Equilibrium, STARTS, Trim, equilibria, trim};
pub use equilibrium_rows::{NoEquilibrium, equilibrium_rows};
pub use error::{Dependency, ReduceError};
pub use explicit::reduce;
pub use first_order::{FirstOrder, motions_over_states, over_states, with_inertia};
pub use initial::{StartConflict, StartValue, start_position, start_speed};
pub use instant::{Instant, closed_contacts, engaged_locks, slip_speeds, with_enforced, with_sliding};
pub use kinematics::{Kinematics, Slope, slopes};
pub use law_slopes::{
    LawSlopes, OperatingPoint, geometric_stiffness, is_linear_law, law_slopes, law_slopes_at, law_slopes_with,
    laws_are_linear,
};
pub use law_torques::{LawTorques, NotLinear, Wave, law_waves};
pub use linear::{LinearModel, SparseModel, linearise, linearise_at, linearise_near, sparse_model};
pub use massless::{NoMasslessDynamics, massless_dynamics};
pub use mechanism::{MechanismData, MechanismError};
pub use motion::{Forces, Motion, MultiplierTerms, SparseRow, Timed};
pub use multiplier_constraints::{
    NoStart, StartOnRows, StartValues, follows_everywhere, frozen, inertia_with_rows, start_on_rows,
};
pub use reduced::{Affine, MasslessDynamics, Reduced, Redundant, Slip, Step};
pub use steady::{MotionSpec, NoSteadyMotion, SteadyMotion, accelerations, motion_of, steady_motion};

//! The blocks and the small solvers under them.

mod blocks;
mod gains;
mod model_observer;
mod not_a_number;
mod signals;
mod solvers;
mod state_space;

use kardan_rt::{Arithmetic, Real}; // `solvers` compiles a private file of the crate, which imports these from its root

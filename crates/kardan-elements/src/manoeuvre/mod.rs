//! Manoeuvres: driving tests of steering engineers, one file for each kind.
//!
//! [`REGISTRY`] is the one list from which the parser, its checks, the manual and the tests are derived. A manoeuvre expands to tables that
//! exist: a signal or a path, figures, requirements, and values of variants.

mod double_lane_change;
mod free;
mod kind;
mod obstacle_avoidance;
mod parking;
mod path;
mod sine_steer;
mod sine_with_dwell;
mod split_braking;
mod steady_circle;
mod step_steer;
mod weave;

pub use crate::element::quoted;
pub use kind::{COMMON, Cones, Made, Manoeuvre, ManoeuvreKind, ManoeuvreSpec, Need};
pub use path::{Path, lanes};

/// All kinds of manoeuvres.
pub const REGISTRY: &[ManoeuvreKind] = &[
    steady_circle::STEADY_CIRCLE,
    step_steer::STEP_STEER,
    sine_steer::SINE_STEER,
    weave::WEAVE,
    double_lane_change::DOUBLE_LANE_CHANGE,
    obstacle_avoidance::OBSTACLE_AVOIDANCE,
    sine_with_dwell::SINE_WITH_DWELL,
    split_braking::SPLIT_BRAKING,
    parking::PARKING,
    free::FREE,
];

/// The kind with that keyword.
pub fn find(keyword: &str) -> Option<&'static ManoeuvreKind> {
    REGISTRY.iter().find(|kind| kind.keyword == keyword)
}

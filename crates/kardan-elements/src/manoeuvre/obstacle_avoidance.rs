//! The manoeuvre `obstacle_avoidance` of ISO 3888-2.

use super::kind::{Made, ManoeuvreKind, ManoeuvreSpec};
use super::path::{KEYS, lane_change};

pub(super) const OBSTACLE_AVOIDANCE: ManoeuvreKind = ManoeuvreKind {
    keyword: "obstacle_avoidance",
    summary: "The obstacle avoidance of ISO 3888-2 (moose test), driven by a driver with a path.",
    measures: "Those of `double_lane_change`.",
    keys: KEYS,
    write,
};

fn write(spec: &ManoeuvreSpec<'_>, made: &mut Made) {
    lane_change(spec, made, "iso_3888_2");
}

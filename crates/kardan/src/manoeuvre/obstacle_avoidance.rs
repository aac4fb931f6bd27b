use super::kind::{Given, Made, ManoeuvreKind};
use super::path::{KEYS, lane_change};

/// The obstacle avoidance of ISO 3888-2.
pub(super) const OBSTACLE_AVOIDANCE: ManoeuvreKind = ManoeuvreKind {
    keyword: "obstacle_avoidance",
    summary: "The obstacle avoidance of ISO 3888-2 (moose test), which a driver with a path drives.",
    measures: "Those of `double_lane_change`.",
    keys: KEYS,
    write,
};

fn write(given: &Given<'_>, made: &mut Made) {
    lane_change(given, made, "iso_3888_2");
}

//! The manoeuvre `double_lane_change` of ISO 3888-1.

use super::kind::{Made, ManoeuvreKind, ManoeuvreSpec};
use super::path::{KEYS, lane_change};

pub(super) const DOUBLE_LANE_CHANGE: ManoeuvreKind = ManoeuvreKind {
    keyword: "double_lane_change",
    summary: "The double lane change of ISO 3888-1, driven by a driver with a path.",
    measures: "`room`: least distance of the corners of the car, at its axles, from the limits of the lanes; `a_y`, `yaw_rate`, `angle` and `rate` \
               of the wheel, `torque`: largest magnitudes. Criterion: `room` above zero.",
    keys: KEYS,
    write,
};

fn write(spec: &ManoeuvreSpec<'_>, made: &mut Made) {
    lane_change(spec, made, "iso_3888_1");
}

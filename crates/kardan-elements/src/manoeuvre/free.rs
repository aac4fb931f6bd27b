//! The manoeuvre `free`, which the model defines itself.

use super::kind::{Made, ManoeuvreKind, ManoeuvreSpec, Need};

pub(super) const FREE: ManoeuvreKind = ManoeuvreKind {
    keyword: "free",
    summary: "A custom manoeuvre: the wheel angle as an expression, with a duration; figures and requirements are separate tables.",
    measures: "None.",
    keys: &[("duration", Need::Required), ("steering_angle", Need::Optional)],
    write,
};

fn write(spec: &ManoeuvreSpec<'_>, made: &mut Made) {
    made.duration = spec.value("duration");
    made.angle = spec.value("steering_angle");
}

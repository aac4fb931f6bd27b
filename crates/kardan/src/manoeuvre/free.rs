use super::kind::{Made, ManoeuvreKind, ManoeuvreSpec, Need};

/// A manoeuvre of one's own.
pub(super) const FREE: ManoeuvreKind = ManoeuvreKind {
    keyword: "free",
    summary: "One of your own: the angle of the wheel as an expression, with a duration; figures and requirements stand beside it.",
    measures: "None.",
    keys: &[("duration", Need::Required), ("course", Need::Optional)],
    write,
};

fn write(spec: &ManoeuvreSpec<'_>, made: &mut Made) {
    made.duration = spec.value("duration");
    made.angle = spec.value("course");
}

use super::kind::{Given, Made, ManoeuvreKind, Need};

/// A manoeuvre of one's own.
pub(super) const FREE: ManoeuvreKind = ManoeuvreKind {
    keyword: "free",
    summary: "One of your own: the angle of the wheel as an expression, with a duration; figures and requirements stand beside it.",
    measures: "None.",
    keys: &[("duration", Need::Required), ("course", Need::Optional)],
    write,
};

fn write(given: &Given<'_>, made: &mut Made) {
    made.duration = given.value("duration");
    made.angle = given.value("course");
}

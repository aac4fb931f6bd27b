//! The manoeuvre `steady_circle` of ISO 4138.

use super::kind::{Made, ManoeuvreKind, ManoeuvreSpec, Need};

pub(super) const STEADY_CIRCLE: ManoeuvreKind = ManoeuvreKind {
    keyword: "steady_circle",
    summary: "Steady circles of ISO 4138 at one speed: the wheel turns slowly to an angle.",
    measures: "`understeer`: understeer gradient, the slope of the front wheel angle minus the Ackermann angle over the lateral acceleration; \
               `a_y`: largest lateral acceleration; `sideslip`: slope of the sideslip angle; `torque`: largest steering torque. They are evaluated \
               from a quarter of `over` on. Criteria: none.",
    keys: &[
        ("amplitude", Need::Required),
        ("start", Need::Default("1 s")),
        ("over", Need::Default("30 s")),
        ("duration", Need::Optional),
    ],
    write,
};

fn write(spec: &ManoeuvreSpec<'_>, made: &mut Made) {
    let [amplitude, start, over] = ["amplitude", "start", "over"].map(|key| spec.text(key));
    made.steer(spec, &[("kind", "ramp"), ("to", &amplitude)], &["start", "over"]);
    made.duration = spec.value("duration").or(Some(format!("{start} + {over}")));
    let [a_y, r, u, v] = ["a_y", "yaw_rate", "v_x", "v_y"].map(|word| spec.of_car(word));
    let [front, rear] = ["front_axle", "rear_axle"].map(|key| spec.of_car(key));
    let wheels = super::quoted(&format!("{}_wheel.phi", spec.car.as_deref().unwrap_or("car")));
    let (from, until) = (format!("{start} + {over} / 4"), format!("{start} + {over}"));
    let window = [("from", from.as_str()), ("until", until.as_str())];
    let beyond = format!("{wheels} - ({front} + {rear}) * {r} / {u}");
    let slope = |signal: &str, made: &mut Made, name: &str, display: &str| {
        let keys = [("signal", signal), ("measure", "slope"), ("over", &a_y), ("display_unit", display)];
        made.figure(spec, name, &[&keys[..], &window[..]].concat());
    };
    slope(&beyond, made, "understeer", "deg s^2/m");
    slope(&format!("atan2({v}, {u})"), made, "sideslip", "deg s^2/m");
    made.figure(spec, "a_y", &[&[("signal", a_y.as_str()), ("measure", "max_abs")][..], &window].concat());
    if let Some(torque) = &spec.torque {
        made.figure(spec, "torque", &[&[("signal", torque.as_str()), ("measure", "max_abs")][..], &window].concat());
    }
}

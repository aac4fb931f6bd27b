//! The manoeuvre `step_steer` of ISO 7401.

use super::kind::{Made, ManoeuvreKind, ManoeuvreSpec, Need};

pub(super) const STEP_STEER: ManoeuvreKind = ManoeuvreKind {
    keyword: "step_steer",
    summary: "The step input of ISO 7401: the wheel turns to an angle at a rate, and stays there.",
    measures: "Times count from half of the wheel angle. `response_time`: until the yaw rate is at 90 % of its last value; `peak_time`: until its \
               largest value; `overshoot`; `yaw_gain`: last yaw rate over the commanded wheel angle; `sideslip`: last sideslip angle; `tb`: TB \
               factor, `peak_time` times the magnitude of `sideslip`; `a_y`: last lateral acceleration. Criteria: none.",
    keys: &[
        ("amplitude", Need::Required),
        ("start", Need::Default("1 s")),
        ("rate", Need::Default("200 deg/s")),
        ("duration", Need::Optional),
    ],
    write,
};

fn write(spec: &ManoeuvreSpec<'_>, made: &mut Made) {
    let [amplitude, start, rate] = ["amplitude", "start", "rate"].map(|key| spec.text(key));
    let over = format!("abs({amplitude}) / {rate}");
    made.steer(spec, &[("kind", "ramp"), ("to", &amplitude), ("start", &start), ("over", &over)], &[]);
    made.duration = spec.value("duration").or(Some(format!("{start} + {over} + 4 s")));
    let half = format!("{start} + {over} / 2");
    let [a_y, r, u, v] = ["a_y", "yaw_rate", "v_x", "v_y"].map(|word| spec.of_car(word));
    // To the left for both signs of the angle.
    let rise = format!("{r} / {amplitude}");
    let rising = [("signal", rise.as_str()), ("from", half.as_str())];
    made.figure(spec, "peak_time", &[&[("measure", "time_of_max"), ("display_unit", "ms")][..], &rising].concat());
    made.figure(spec, "overshoot", &[("signal", &r), ("measure", "overshoot"), ("display_unit", "%")]);
    made.figure(spec, "yaw_gain", &[("signal", &rise), ("measure", "final")]);
    let rises = [("signal", rise.as_str()), ("measure", "rise_time"), ("band", "0.1"), ("from", start.as_str())];
    made.figure(spec, "rise", &[&rises[..], &[("display_unit", "ms")]].concat());
    let rise = super::quoted(&spec.own("rise"));
    made.figure(spec, "response_time", &[("value", &format!("{rise} - {over} / 2")), ("display_unit", "ms")]);
    made.figure(
        spec,
        "sideslip",
        &[("signal", &format!("atan2({v}, {u})")), ("measure", "final"), ("display_unit", "deg")],
    );
    let [peak, slip] = ["peak_time", "sideslip"].map(|name| super::quoted(&spec.own(name)));
    made.figure(spec, "tb", &[("value", &format!("{peak} * abs({slip})")), ("display_unit", "deg s")]);
    made.figure(spec, "a_y", &[("signal", &a_y), ("measure", "final")]);
}

//! The manoeuvre `weave` of ISO 13674-1.

use super::kind::{Made, ManoeuvreKind, ManoeuvreSpec, Need};

pub(super) const WEAVE: ManoeuvreKind = ManoeuvreKind {
    keyword: "weave",
    summary: "The weave of ISO 13674-1: a sine about straight ahead.",
    measures: "Over the last `periods`: `torque_gradient`: steering torque over lateral acceleration at its rising zero crossing; \
               `torque_hysteresis`: distance of the branches of the torque there; `a_y_hysteresis`: that of the lateral acceleration at zero \
               torque; `angle_hysteresis`: that of the wheel angle over the lateral acceleration; `yaw_gain`, `yaw_lag`, `a_y_gain`, `a_y_lag`: \
               gain and delay over the wheel angle at the frequency; `a_y`: largest. Without a torque its figures are omitted. Criteria: none.",
    keys: &[
        ("amplitude", Need::Required),
        ("start", Need::Default("1 s")),
        ("frequency", Need::Default("0.2 Hz")),
        ("periods", Need::Default("2")),
        ("duration", Need::Optional),
    ],
    write,
};

fn write(spec: &ManoeuvreSpec<'_>, made: &mut Made) {
    let [start, frequency, periods] = ["start", "frequency", "periods"].map(|key| spec.text(key));
    made.steer(spec, &[("kind", "sine")], &["amplitude", "start", "frequency"]);
    let end = spec.value("duration").unwrap_or(format!("{start} + ({periods} + 1.5) / {frequency}"));
    made.duration = Some(end.clone());
    let from = format!("{end} - {periods} / {frequency}");
    let [a_y, r] = ["a_y", "yaw_rate"].map(|word| spec.of_car(word));
    let angle = spec.wheel.as_ref().map(|wheel| super::quoted(&format!("{wheel}.phi")));
    let mut over = |name: &str, signal: &str, measure: &str, other: &str, more: &[(&str, &str)]| {
        let keys = [("signal", signal), ("measure", measure), ("over", other), ("from", from.as_str())];
        made.figure(spec, name, &[&keys[..], more].concat());
    };
    if let Some(torque) = &spec.torque {
        over("torque_gradient", torque, "gradient", &a_y, &[("display_unit", "N m s^2/m")]);
        over("torque_hysteresis", torque, "hysteresis", &a_y, &[]);
        over("a_y_hysteresis", &a_y, "hysteresis", torque, &[]);
    }
    if let Some(angle) = &angle {
        over("angle_hysteresis", angle, "hysteresis", &a_y, &[("display_unit", "deg")]);
        let at = ("frequency", frequency.as_str());
        for (name, signal) in [("yaw", &r), ("a_y", &a_y)] {
            over(&format!("{name}_gain"), signal, "gain", angle, &[at]);
            over(&format!("{name}_lag"), signal, "lag", angle, &[at, ("display_unit", "ms")]);
        }
    }
    made.figure(spec, "a_y", &[("signal", &a_y), ("measure", "max_abs"), ("from", &from)]);
}

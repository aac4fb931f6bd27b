//! The manoeuvre `parking`: steering at standstill.

use super::kind::{Made, ManoeuvreKind, ManoeuvreSpec, Need};

pub(super) const PARKING: ManoeuvreKind = ManoeuvreKind {
    keyword: "parking",
    summary: "Parking: one period of the wheel from side to side, at standstill if `set` defines it.",
    measures: "`torque`: largest steering torque; `hysteresis`: distance of its branches over the wheel angle at the centre; `power`: largest power \
               of the hands. Criteria: none.",
    keys: &[
        ("amplitude", Need::Default("360 deg")),
        ("start", Need::Default("1 s")),
        ("frequency", Need::Default("0.1 Hz")),
        ("duration", Need::Optional),
    ],
    write,
};

fn write(spec: &ManoeuvreSpec<'_>, made: &mut Made) {
    let [start, frequency] = ["start", "frequency"].map(|key| spec.text(key));
    made.steer(spec, &[("kind", "sine")], &["amplitude", "start", "frequency"]);
    made.duration = spec.value("duration").or(Some(format!("{start} + 1.25 / {frequency}")));
    let Some(torque) = &spec.torque else { return };
    made.figure(spec, "torque", &[("signal", torque), ("measure", "max_abs")]);
    if let Some(wheel) = &spec.wheel {
        let [phi, w] = ["phi", "w"].map(|word| super::quoted(&format!("{wheel}.{word}")));
        let keys: [(&str, &str); 4] = [("signal", torque), ("measure", "hysteresis"), ("over", &phi), ("from", &start)];
        made.figure(spec, "hysteresis", &keys);
        made.figure(spec, "power", &[("signal", &format!("({torque}) * {w}")), ("measure", "max")]);
    }
}

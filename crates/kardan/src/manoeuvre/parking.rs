use super::kind::{Given, Made, ManoeuvreKind, Need};

/// Steering at standstill.
pub(super) const PARKING: ManoeuvreKind = ManoeuvreKind {
    keyword: "parking",
    summary: "Parking: one wave of the wheel from side to side, at standstill where `set` says so.",
    measures: "`torque`: largest steering torque; `hysteresis`: how far its branches over the angle of the wheel are apart at the middle; `power`: largest power of the \
               hands. Criteria: none.",
    keys: &[
        ("amplitude", Need::Default("360 deg")),
        ("start", Need::Default("1 s")),
        ("frequency", Need::Default("0.1 Hz")),
        ("duration", Need::Optional),
    ],
    write,
};

fn write(given: &Given<'_>, made: &mut Made) {
    let [amplitude, start, frequency] = ["amplitude", "start", "frequency"].map(|key| given.text(key));
    let wave = [("kind", "sine"), ("amplitude", amplitude.as_str())];
    made.steer(given, &[&wave[..], &[("start", start.as_str()), ("frequency", frequency.as_str())]].concat());
    made.duration = given.value("duration").or(Some(format!("{start} + 1.25 / {frequency}")));
    let Some(torque) = &given.torque else { return };
    made.figure(given, "torque", &[("signal", torque), ("measure", "max_abs")]);
    if let Some(wheel) = &given.wheel {
        let [phi, w] = ["phi", "w"].map(|word| super::quoted(&format!("{wheel}.{word}")));
        let over = [("measure", "hysteresis"), ("over", phi.as_str()), ("from", start.as_str())];
        made.figure(given, "hysteresis", &[&[("signal", torque.as_str())][..], &over].concat());
        made.figure(given, "power", &[("signal", &format!("({torque}) * {w}")), ("measure", "max")]);
    }
}

use super::kind::{Given, Made, ManoeuvreKind, Need};

/// Braking straight ahead on a road that sticks differently left and right.
pub(super) const SPLIT_BRAKING: ManoeuvreKind = ManoeuvreKind {
    keyword: "split_braking",
    summary: "Braking straight ahead to standstill; with `mu_left` and `mu_right` of the car on split friction.",
    measures: "`yaw_rate`, `heading`, `offset` (y): largest sizes; `correction`, `torque`: those of the angle of the wheel and of the steering torque; `lack`: \
               largest braking force that is asked for and not given; `speed`: the least one. Criteria: `lack` below 1 N, as the speed falls as if all were given; \
               `speed` at zero or more, but for rounding: the car had the speed from which it brakes.",
    keys: &[
        ("speed", Need::Required),
        ("deceleration", Need::Required),
        ("start", Need::Default("1 s")),
        ("corrects", Need::Optional),
        ("brakes", Need::Optional),
        ("slows", Need::Optional),
        ("duration", Need::Optional),
    ],
    write,
};

fn write(given: &Given<'_>, made: &mut Made) {
    let [speed, deceleration, start] = ["speed", "deceleration", "start"].map(|key| given.text(key));
    let over = format!("{speed} / {deceleration}");
    let force = format!("{} * {deceleration}", given.of_car("mass"));
    // One pulse: the next one is far behind the end.
    let period = format!("1000 * {over}");
    let pulse = [("kind", "pulses"), ("high", force.as_str()), ("width", &over), ("period", &period)];
    made.share(given, ("brakes", "braking"), &[&pulse[..], &[("start", start.as_str())]].concat());
    let ramp = [("kind", "ramp"), ("to", speed.as_str()), ("start", &start), ("over", &over)];
    made.share(given, ("slows", "slowed"), &ramp);
    let corrects = given.word("corrects") == Some("yes");
    let straight = if corrects { &mut made.path } else { &mut made.angle };
    *straight = Some(if corrects { "0 m" } else { "0 deg" }.into());
    made.duration = given.value("duration").or(Some(format!("{start} + {over}")));
    for (name, word, display) in [
        ("yaw_rate", "yaw_rate", "deg/s"),
        ("heading", "heading", "deg"),
        ("offset", "y", "m"),
        ("lack", "braking_lack", "N"),
    ] {
        let signal = given.of_car(word);
        made.figure(given, name, &[("signal", &signal), ("measure", "max_abs"), ("display", display)]);
    }
    if let Some(wheel) = &given.wheel {
        let angle = super::quoted(&format!("{wheel}.phi"));
        made.figure(given, "correction", &[("signal", &angle), ("measure", "max_abs"), ("display", "deg")]);
    }
    if let Some(torque) = &given.torque {
        made.figure(given, "torque", &[("signal", torque), ("measure", "max_abs")]);
    }
    let signal = given.of_car("v_x");
    made.figure(given, "speed", &[("signal", &signal), ("measure", "min")]);
    made.criterion(given, "lack", ("below", "1 N"));
    made.criterion(given, "speed", ("above", "-1e-6 m/s"));
}

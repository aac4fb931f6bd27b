//! The manoeuvre `split_braking`: braking straight ahead on split friction.

use super::kind::{Made, ManoeuvreKind, ManoeuvreSpec, Need};

pub(super) const SPLIT_BRAKING: ManoeuvreKind = ManoeuvreKind {
    keyword: "split_braking",
    summary: "Braking straight ahead to standstill; with `mu_left` and `mu_right` of the car on split friction.",
    measures: "`yaw_rate`, `heading`, `offset` (y): largest magnitudes; `correction`, `torque`: those of the steering wheel angle and of the \
               steering torque; `lack`: largest difference of requested and delivered braking force; `speed`: the least one. Criteria: `lack` below \
               1 N, because the speed falls as if all were delivered; `speed` at zero or more, to rounding: the car had the speed from which it \
               brakes.",
    keys: &[
        ("speed", Need::Required),
        ("deceleration", Need::Required),
        ("start", Need::Default("1 s")),
        ("closed_loop", Need::Optional),
        ("braking_signal", Need::Optional),
        ("speed_reduction_signal", Need::Optional),
        ("duration", Need::Optional),
    ],
    write,
};

fn write(spec: &ManoeuvreSpec<'_>, made: &mut Made) {
    let [speed, deceleration, start] = ["speed", "deceleration", "start"].map(|key| spec.text(key));
    let over = format!("{speed} / {deceleration}");
    let force = format!("{} * {deceleration}", spec.of_car("mass"));
    // One pulse: the next one is long after the end.
    let period = format!("1000 * {over}");
    let pulse = [("kind", "pulses"), ("high", force.as_str()), ("width", &over), ("period", &period)];
    made.share(spec, ("braking_signal", "braking"), &[&pulse[..], &[("start", start.as_str())]].concat());
    let ramp = [("kind", "ramp"), ("to", speed.as_str()), ("start", &start), ("over", &over)];
    made.share(spec, ("speed_reduction_signal", "slowed"), &ramp);
    let closed_loop = spec.word("closed_loop") == Some("yes");
    let straight = if closed_loop { &mut made.path } else { &mut made.angle };
    *straight = Some(if closed_loop { "0 m" } else { "0 deg" }.into());
    made.duration = spec.value("duration").or(Some(format!("{start} + {over}")));
    for (name, word, display) in [
        ("yaw_rate", "yaw_rate", "deg/s"),
        ("heading", "heading", "deg"),
        ("offset", "y", "m"),
        ("lack", "braking_lack", "N"),
    ] {
        let signal = spec.of_car(word);
        made.figure(spec, name, &[("signal", &signal), ("measure", "max_abs"), ("display_unit", display)]);
    }
    if let Some(wheel) = &spec.wheel {
        let angle = super::quoted(&format!("{wheel}.phi"));
        made.figure(spec, "correction", &[("signal", &angle), ("measure", "max_abs"), ("display_unit", "deg")]);
    }
    if let Some(torque) = &spec.torque {
        made.figure(spec, "torque", &[("signal", torque), ("measure", "max_abs")]);
    }
    let signal = spec.of_car("v_x");
    made.figure(spec, "speed", &[("signal", &signal), ("measure", "min")]);
    made.criterion(spec, "lack", ("below", "1 N"));
    made.criterion(spec, "speed", ("above", "-1e-6 m/s"));
}

//! The manoeuvre `sine_steer` of ISO 7401.

use super::kind::{Made, ManoeuvreKind, ManoeuvreSpec, Need};

pub(super) const SINE_STEER: ManoeuvreKind = ManoeuvreKind {
    keyword: "sine_steer",
    summary: "One period of the sinusoidal input of ISO 7401.",
    measures: "`yaw_lag_1`, `yaw_lag_2`: delay of the peaks of the yaw rate after the first and the second peak of the wave; `a_y_lag_1`, \
               `a_y_lag_2`: the same of the lateral acceleration; `yaw_rate`, `a_y`: largest magnitudes. Criteria: none.",
    keys: &[
        ("amplitude", Need::Required),
        ("start", Need::Default("1 s")),
        ("frequency", Need::Default("0.5 Hz")),
        ("duration", Need::Optional),
    ],
    write,
};

fn write(spec: &ManoeuvreSpec<'_>, made: &mut Made) {
    let [amplitude, start, frequency] = ["amplitude", "start", "frequency"].map(|key| spec.text(key));
    made.steer(spec, &[("kind", "sine_with_dwell"), ("dwell", "0 s")], &["amplitude", "start", "frequency"]);
    made.duration = spec.value("duration").or(Some(format!("{start} + 1 / {frequency} + 2 s")));
    for (word, name) in [("yaw_rate", "yaw"), ("a_y", "a_y")] {
        let signal = spec.of_car(word);
        let normalised = format!("{signal} / {amplitude}");
        for (number, measure, part) in [(1, "time_of_max", "0.25"), (2, "time_of_min", "0.75")] {
            let peak = format!("{name}_peak_{number}");
            made.figure(spec, &peak, &[("signal", &normalised), ("measure", measure), ("from", &start)]);
            let own = super::quoted(&spec.own(&peak));
            let lag = format!("{own} - {part} / {frequency}");
            made.figure(spec, &format!("{name}_lag_{number}"), &[("value", &lag), ("display_unit", "ms")]);
        }
    }
    for name in ["yaw_rate", "a_y"] {
        made.figure(spec, name, &[("signal", &spec.of_car(name)), ("measure", "max_abs")]);
    }
}

//! The manoeuvre `sine_with_dwell` of FMVSS 126 and UN R140.

use super::kind::{Made, ManoeuvreKind, ManoeuvreSpec, Need};

pub(super) const SINE_WITH_DWELL: ManoeuvreKind = ManoeuvreKind {
    keyword: "sine_with_dwell",
    summary: "The sine with dwell of FMVSS 126 and UN R140.",
    measures: "`peak`: largest yaw rate opposite to the first half wave, over the amplitude, from the middle of the wave to its end; `ratio_1`, \
               `ratio_2`: yaw rate 1.0 s and 1.75 s after the end, over `peak`; `way`: magnitude of y 1.07 s after the start, with y = 0 at the \
               start. Criteria: `ratio_1` below 0.35, `ratio_2` below 0.2, `way` above 1.83 m (cars up to 3.5 t, at five times the angle for 0.3 g \
               or more).",
    keys: &[
        ("amplitude", Need::Required),
        ("start", Need::Default("1 s")),
        ("frequency", Need::Default("0.7 Hz")),
        ("dwell", Need::Default("0.5 s")),
        ("duration", Need::Optional),
    ],
    write,
};

fn write(spec: &ManoeuvreSpec<'_>, made: &mut Made) {
    let keys = ["amplitude", "dwell", "start", "frequency"];
    let [amplitude, dwell, start, frequency] = keys.map(|key| spec.text(key));
    made.steer(spec, &[("kind", "sine_with_dwell")], &keys);
    let end = format!("{start} + 1 / {frequency} + {dwell}");
    made.duration = spec.value("duration").or(Some(format!("{end} + 2 s")));
    let against = format!("-{} / {amplitude}", spec.of_car("yaw_rate"));
    let middle = format!("{start} + 0.5 / {frequency}");
    let window = [("from", middle.as_str()), ("until", end.as_str())];
    made.figure(spec, "peak", &[&[("signal", against.as_str()), ("measure", "max")][..], &window].concat());
    let peak = super::quoted(&spec.own("peak"));
    for (number, later, bound) in [(1, "1 s", "0.35"), (2, "1.75 s", "0.2")] {
        let (rest, at) = (format!("rest_{number}"), format!("{end} + {later}"));
        made.figure(spec, &rest, &[("signal", &against), ("measure", "at"), ("at", &at)]);
        let ratio = format!("{} / {peak}", super::quoted(&spec.own(&rest)));
        let name = format!("ratio_{number}");
        made.figure(spec, &name, &[("value", &ratio)]);
        made.criterion(spec, &name, ("below", bound));
    }
    let way = format!("abs({})", spec.of_car("y"));
    made.figure(spec, "way", &[("signal", &way), ("measure", "at"), ("at", &format!("{start} + 1.07 s"))]);
    made.criterion(spec, "way", ("above", "1.83 m"));
}

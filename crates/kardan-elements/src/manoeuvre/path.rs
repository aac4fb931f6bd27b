//! Lanes between cones.

use super::kind::{Cones, Made, ManoeuvreSpec, Need};
use crate::element::quoted;
use kardan_math::units::Dimension;
use kardan_schema::entries::{Entries, RawValue};
use kardan_schema::schema::{EntryValue, Names, Sign, keys};

keys! {
    /// `[path.<name>]`.
    table Path {
        required {
            kind: Choice(&["iso_3888_1", "iso_3888_2"]), "Double lane change of ISO 3888-1, or obstacle avoidance of ISO 3888-2.";
            width: Quantity(Dimension::LENGTH, Sign::Positive), "Width of the car, which defines the lane widths.";
        }
        optional {
            start: Quantity(Dimension::LENGTH, Sign::Any) = "0 m", "The x where the first lane begins.";
            offset: Quantity(Dimension::LENGTH, Sign::Positive),
                "Of part 1 the distance of the centre lines of first and second lane, left out: 3.5 m; of part 2 that of their facing edges, left \
                 out: 1 m.";
            side: Choice(&["left", "right"]) = "left", "The side of the second lane.";
        }
    }
}

/// Lengths of the sections, m; widths of the three lanes by that of the car.
struct Track {
    lengths: [&'static str; 5],
    widths: [&'static str; 3],
    offset: &'static str,
}

const PART_1: Track = Track {
    lengths: ["15 m", "30 m", "25 m", "25 m", "30 m"],
    widths: ["(1.1 * W + 0.25 m)", "(1.2 * W + 0.25 m)", "(1.3 * W + 0.25 m)"],
    offset: "(3.5 m)",
};

const PART_2: Track = Track {
    lengths: ["12 m", "13.5 m", "11 m", "12.5 m", "12 m"],
    widths: ["(1.1 * W + 0.25 m)", "(W + 1 m)", "max(1.3 * W + 0.25 m, 3 m)"],
    offset: "(1 m)",
};

/// A curve through points, as the table of a model.
fn curve(points: &[(String, String)], interpolation: &str) -> Entries {
    let (x, values) = points.iter().cloned().unzip();
    let mut lists = Entries::default();
    lists.set("x", Names(x).raw());
    lists.set("value", Names(values).raw());
    let mut out = Entries::default();
    out.set("points", RawValue::Table(lists));
    out.set("interpolation", RawValue::Text(interpolation.into()));
    out
}

impl Track {
    fn of(kind: &str) -> Self {
        if kind == "iso_3888_2" { PART_2 } else { PART_1 }
    }

    /// Start and end of its sections, x.
    fn ends(&self, start: &str) -> Vec<String> {
        let mut ends = vec![start.to_string()];
        for length in self.lengths {
            ends.push(format!("{} + {length}", ends[ends.len() - 1]));
        }
        ends
    }
}

/// The tables of a path: its middle, smooth, and the limits on both sides, which between two lanes are those of the wider choice.
pub fn lanes(kind: &str, width: &str, offset: Option<&str>, start: &str, side: &str) -> [(&'static str, Entries); 3] {
    let track = Track::of(kind);
    let [first, second, third] = track.widths.map(|text| text.replace('W', width));
    let offset = offset.unwrap_or(track.offset);
    let middle = match kind {
        "iso_3888_2" => format!("({first} / 2 + {offset} + {second} / 2)"),
        _ => offset.to_string(),
    };
    let sign = if side == "right" { "-" } else { "" };
    let ends = track.ends(start);
    let at = |k: usize, y: &str| (ends[k].clone(), y.to_string());
    let second_middle = format!("{sign}{middle}");
    let smooth = [(0, "0 m"), (1, "0 m"), (2, &second_middle), (3, &second_middle), (4, "0 m"), (5, "0 m")];
    let centre = curve(&smooth.map(|(k, y)| at(k, y)), "cubic");
    // Limits for a second lane to the left: y and the half widths; for a right one they are mirrored.
    let limit = |outer: bool| {
        let half = |w: &str| format!("{}{w} / 2", if outer { "" } else { "-" });
        let lanes = [half(&first), format!("{middle} + ({})", half(&second)), half(&third)];
        let choice = if outer { "max" } else { "min" };
        let between = |a: &str, b: &str| format!("{choice}({a}, {b})");
        let (outbound, back) = (between(&lanes[0], &lanes[1]), between(&lanes[1], &lanes[2]));
        let mut points = Vec::new();
        for (from, until, y) in
            [(0, 1, &lanes[0]), (1, 2, &outbound), (2, 3, &lanes[1]), (3, 4, &back), (4, 5, &lanes[2])]
        {
            // A millimetre from one to the next: a table has no steps.
            let inside = from % 2 == 1;
            let by =
                |end: usize, sign: &str| if inside { format!("{} {sign} 1 mm", ends[end]) } else { ends[end].clone() };
            let y = if sign.is_empty() { y.clone() } else { format!("-({y})") };
            points.push((by(from, "+"), y.clone()));
            points.push((by(until, "-"), y));
        }
        curve(&points, "linear")
    };
    let (outer, inner) = (limit(true), limit(false));
    let (left, right) = if sign.is_empty() { (outer, inner) } else { (inner, outer) };
    [("", centre), ("_left", left), ("_right", right)]
}

/// The keys of both double lane changes.
pub(super) const KEYS: &[(&str, Need)] = &[
    ("width", Need::Required),
    ("duration", Need::Required),
    ("start", Need::Default("30 m")),
    ("offset", Need::Optional),
    ("side", Need::Default("left")),
];

/// A double lane change: its path, the distance of the corners of the car from the lane limits, and figures of the steering.
pub(super) fn lane_change(spec: &ManoeuvreSpec<'_>, made: &mut Made, kind: &str) {
    let (width, start) = (spec.text("width"), spec.text("start"));
    let side = spec.text("side");
    let (path, offset) = (spec.own("path"), spec.value("offset"));
    for (part, table) in lanes(kind, &width, offset.as_deref(), &start, side.trim_matches(['(', ')'])) {
        made.tables.push(("table", format!("{path}{part}"), table));
    }
    made.path = Some(format!("{}(ahead)", quoted(&path)));
    made.duration = spec.value("duration");
    let [x, y, heading] = ["x", "y", "heading"].map(|word| spec.of_car(word));
    let [left, right] = ["_left", "_right"].map(|part| quoted(&format!("{path}{part}")));
    let mut room = String::new();
    for (sign_forward, axle) in [("", "front_axle"), ("-", "rear_axle")] {
        for sign_sideways in ["", "-"] {
            let (a, b) = (format!("{sign_forward}{}", spec.of_car(axle)), format!("{sign_sideways}{width} / 2"));
            let at = format!("{x} + ({a}) * cos({heading}) - ({b}) * sin({heading})");
            let beside = format!("{y} + ({a}) * sin({heading}) + ({b}) * cos({heading})");
            let own = format!("min({left}({at}) - ({beside}), {beside} - {right}({at}))");
            room = if room.is_empty() { own } else { format!("min({room}, {own})") };
        }
    }
    let signal = spec.own("room");
    made.tables.push(("signal", signal.clone(), Entries::of_texts([("kind", "expression"), ("value", room.as_str())])));
    let signal = quoted(&signal);
    made.figure(spec, "room", &[("signal", &signal), ("measure", "min")]);
    made.criterion(spec, "room", ("above", "0 m"));
    made.cones = Track::of(kind).ends(&start).pop().map(|end| Cones {
        manoeuvre: spec.name.into(),
        figure: spec.own("room"),
        reached: format!("{x} - {} * cos({heading})", spec.of_car("rear_axle")),
        end,
    });
    for (name, word) in [("a_y", "a_y"), ("yaw_rate", "yaw_rate")] {
        made.figure(spec, name, &[("signal", &spec.of_car(word)), ("measure", "max_abs")]);
    }
    if let Some(wheel) = &spec.wheel {
        let [phi, w] = ["phi", "w"].map(|word| quoted(&format!("{wheel}.{word}")));
        made.figure(spec, "angle", &[("signal", &phi), ("measure", "max_abs"), ("display_unit", "deg")]);
        made.figure(spec, "rate", &[("signal", &w), ("measure", "max_abs"), ("display_unit", "deg/s")]);
    }
    if let Some(torque) = &spec.torque {
        made.figure(spec, "torque", &[("signal", torque), ("measure", "max_abs")]);
    }
}

//! The units that are known.

use super::{Dimension, Exact};
use crate::names::nearest;

/// A unit of the table: `factor.0 / factor.1 · π^factor.2` SI units.
pub(super) struct Unit {
    pub name: &'static str,
    factor: (i64, i64, i32),
    dimension: Dimension,
    prefixes: bool,
}

const fn unit(name: &'static str, factor: (i64, i64, i32), dimension: Dimension) -> Unit {
    Unit { name, factor, dimension, prefixes: false }
}

const fn with_prefixes(name: &'static str, factor: (i64, i64, i32), dimension: Dimension) -> Unit {
    Unit { name, factor, dimension, prefixes: true }
}

pub(super) static UNITS: [Unit; 46] = [
    with_prefixes("g", (1, 1000, 0), Dimension::MASS),
    unit("t", (1000, 1, 0), Dimension::MASS),
    with_prefixes("m", (1, 1, 0), Dimension::LENGTH),
    unit("in", (254, 10_000, 0), Dimension::LENGTH),
    unit("inch", (254, 10_000, 0), Dimension::LENGTH),
    unit("ft", (3048, 10_000, 0), Dimension::LENGTH),
    with_prefixes("s", (1, 1, 0), Dimension::TIME),
    unit("min", (60, 1, 0), Dimension::TIME),
    unit("h", (3600, 1, 0), Dimension::TIME),
    with_prefixes("Hz", (1, 1, 0), Dimension::FREQUENCY),
    with_prefixes("N", (1, 1, 0), Dimension::FORCE),
    unit("lbf", (44_482_216_152_605, 10_000_000_000_000, 0), Dimension::FORCE),
    with_prefixes("Nm", (1, 1, 0), Dimension::TORQUE),
    unit("Ncm", (1, 100, 0), Dimension::TORQUE),
    unit("Nmm", (1, 1000, 0), Dimension::TORQUE),
    with_prefixes("Nms", (1, 1, 0), Dimension::ANGULAR_MOMENTUM),
    with_prefixes("J", (1, 1, 0), Dimension::TORQUE),
    with_prefixes("W", (1, 1, 0), Dimension::TORQUE_RATE),
    with_prefixes("Wh", (3600, 1, 0), Dimension::TORQUE),
    unit("%", (1, 100, 0), Dimension::NONE),
    with_prefixes("rad", (1, 1, 0), Dimension::ANGLE),
    unit("deg", (1, 180, 1), Dimension::ANGLE),
    unit("°", (1, 180, 1), Dimension::ANGLE),
    unit("arcmin", (1, 10_800, 1), Dimension::ANGLE),
    unit("arcsec", (1, 648_000, 1), Dimension::ANGLE),
    unit("rev", (2, 1, 1), Dimension::ANGLE),
    unit("turn", (2, 1, 1), Dimension::ANGLE),
    unit("turns", (2, 1, 1), Dimension::ANGLE),
    // `U/min`, as data sheets in German write it.
    unit("U", (2, 1, 1), Dimension::ANGLE),
    unit("rpm", (2, 60, 1), Dimension::ANGULAR_VELOCITY),
    with_prefixes("C", (1, 1, 0), Dimension::CHARGE),
    with_prefixes("A", (1, 1, 0), Dimension::CURRENT),
    with_prefixes("V", (1, 1, 0), Dimension::VOLTAGE),
    with_prefixes("Ohm", (1, 1, 0), Dimension::RESISTANCE),
    with_prefixes("ohm", (1, 1, 0), Dimension::RESISTANCE),
    with_prefixes("\u{3a9}", (1, 1, 0), Dimension::RESISTANCE),
    with_prefixes("\u{2126}", (1, 1, 0), Dimension::RESISTANCE),
    with_prefixes("H", (1, 1, 0), Dimension::INDUCTANCE),
    with_prefixes("F", (1, 1, 0), Dimension::CAPACITANCE),
    with_prefixes("K", (1, 1, 0), Dimension { exponents: [0, 0, 0, 0, 1, 0, 0], angle: 0 }),
    unit("mol", (1, 1, 0), Dimension { exponents: [0, 0, 0, 0, 0, 1, 0], angle: 0 }),
    unit("cd", (1, 1, 0), Dimension { exponents: [0, 0, 0, 0, 0, 0, 1], angle: 0 }),
    // Written out.
    unit("degree", (1, 180, 1), Dimension::ANGLE),
    unit("degrees", (1, 180, 1), Dimension::ANGLE),
    unit("radian", (1, 1, 0), Dimension::ANGLE),
    unit("radians", (1, 1, 0), Dimension::ANGLE),
];

/// SI prefixes and their powers of ten.
const PREFIXES: [(char, i32); 12] = [
    ('p', -12),
    ('n', -9),
    ('u', -6),
    ('\u{b5}', -6),
    ('\u{3bc}', -6),
    ('m', -3),
    ('c', -2),
    ('d', -1),
    ('h', 2),
    ('k', 3),
    ('M', 6),
    ('G', 9),
];

/// The unit of this name, with or without a prefix.
pub(super) fn find_unit(name: &str) -> Option<(Exact, Dimension)> {
    let plain = |name: &str, prefixed: bool| UNITS.iter().find(|u| u.name == name && (u.prefixes || !prefixed));
    let exact = |u: &Unit| Exact::new(Exact::from_ratio(u.factor.0, u.factor.1).rational, u.factor.2);
    if let Some(unit) = plain(name, false) {
        return Some((exact(unit), unit.dimension));
    }
    let mut letters = name.chars();
    let first = letters.next()?;
    let power = PREFIXES.iter().find(|(letter, _)| *letter == first)?.1;
    let unit = plain(letters.as_str(), true)?;
    // No one means 10^9 rad: "30 Grad" is German for 30 deg.
    if unit.name == "rad" && power > 0 {
        return None;
    }
    Some((&exact(unit) * &Exact::from_integer(10).pow(power)?, unit.dimension))
}

/// Common words for units, and the replacement.
const MISSPELLED_UNITS: [(&[&str], &str); 6] = [
    (&["sec", "secs", "second", "seconds"], "did you mean `s`?"),
    (&["msec", "msecs", "millisecond", "milliseconds"], "did you mean `ms`?"),
    (&["mins", "minute", "minutes"], "did you mean `min`?"),
    (&["hr", "hrs", "hour", "hours"], "did you mean `h`?"),
    (&["lb", "lbs", "lbm", "pound", "pounds"], "write a mass in `kg` (1 lb = 0.45359237 kg), a force in `lbf`"),
    (&["degc", "°c", "celsius", "degcelsius"], "temperatures are in kelvin: 25 degrees Celsius are `298.15 K`"),
];

/// The suggestion for an unknown unit.
pub(super) fn unit_help(name: &str) -> String {
    let lower = name.to_lowercase();
    if let Some((_, help)) = MISSPELLED_UNITS.iter().find(|(spellings, _)| spellings.contains(&lower.as_str())) {
        return (*help).to_string();
    }
    if let Some(one) =
        name.strip_suffix('s').filter(|one| one.to_lowercase().ends_with("ohm") && find_unit(one).is_some())
    {
        return format!("did you mean `{one}`?");
    }
    let prefixed =
        ["kg", "mm", "cm", "km", "ms", "kN", "mNm", "kNm", "mrad", "kHz", "mA", "mH", "kW", "mV", "uF", "nF", "uH"];
    let unit_names = || UNITS.iter().map(|unit| unit.name).chain(prefixed);
    if let Some(unit) = unit_names().find(|unit| unit.eq_ignore_ascii_case(name)) {
        return format!("did you mean `{unit}`?");
    }
    for (at, _) in name.char_indices().skip(1) {
        let (left, right) = name.split_at(at);
        if find_unit(left).is_some() && find_unit(right).is_some() {
            return format!("put a space between two units: `{left} {right}`");
        }
    }
    if name.eq_ignore_ascii_case("grad") {
        return "did you mean `deg` or `rad`?".to_string();
    }
    let length = name.chars().count();
    match nearest(name, unit_names().filter(|unit| unit.chars().count() == length))
        .or_else(|| nearest(name, unit_names()))
    {
        Some(nearest_unit) => format!("did you mean `{nearest_unit}`?"),
        None => "known units are kg g t m in ft s min h N lbf Nm J W Hz rpm rad deg rev V A C Ohm H F K, with prefixes"
            .into(),
    }
}

//! Dimensions in words, and what to do about a wrong one.

use super::{Dimension, parse_quantity, unit_as_written};

/// A dimension that has a name.
pub(super) struct Known {
    pub dimension: Dimension,
    pub word: &'static str,
    pub si: &'static str,
    pub example: &'static str,
}

const fn known(dimension: Dimension, word: &'static str, si: &'static str, example: &'static str) -> Known {
    Known { dimension, word, si, example }
}

pub(super) static KNOWN: [Known; 30] = [
    known(Dimension::NONE, "number without a unit", "", "51/50"),
    known(Dimension::ANGLE, "angle", "rad", "30 deg"),
    known(Dimension::ANGULAR_VELOCITY, "angular velocity", "rad/s", "60 rpm"),
    known(Dimension::ANGULAR_ACCELERATION, "angular acceleration", "rad/s^2", "10 rad/s^2"),
    known(Dimension::TORQUE, "torque", "N m", "1.3 N m"),
    known(Dimension::TORQUE_RATE, "torque rate", "N m/s", "10 N m/s"),
    known(Dimension::INERTIA, "moment of inertia", "kg m^2", "130 kg mm^2"),
    known(Dimension::STIFFNESS, "torsional stiffness", "N m/rad", "100 N m/rad"),
    known(Dimension::DAMPING, "torsional damping", "N m s/rad", "0.01 N m s/rad"),
    known(Dimension::TIME, "time", "s", "2 ms"),
    known(Dimension::mechanical(0, 0, -1, 0), "frequency", "Hz", "1 kHz"),
    known(Dimension::MASS, "mass", "kg", "2 kg"),
    known(Dimension::LENGTH, "length", "m", "20 mm"),
    known(Dimension::VELOCITY, "velocity", "m/s", "0.1 m/s"),
    known(Dimension::ACCELERATION, "acceleration", "m/s^2", "10 m/s^2"),
    known(Dimension::FORCE, "force", "N", "10 N"),
    known(Dimension::FORCE_RATE, "force rate", "N/s", "100 N/s"),
    known(Dimension::LINEAR_STIFFNESS, "stiffness along masses", "N/m", "20 N/mm"),
    known(Dimension::LINEAR_DAMPING, "damping along masses", "N s/m", "50 N s/m"),
    known(Dimension::LENGTH_PER_ANGLE, "length per angle", "m/rad", "50 mm/rev"),
    known(Dimension::mechanical(1, 2, -1, 0), "angular momentum", "N m s", "2 N m s"),
    known(Dimension::mechanical(1, 1, -1, 0), "momentum", "N s", "2 N s"),
    known(Dimension::CHARGE, "charge", "C", "2 uC"),
    known(Dimension::CURRENT, "current", "A", "5 A"),
    known(Dimension::VOLTAGE, "voltage", "V", "24 V"),
    known(Dimension::RESISTANCE, "resistance", "Ohm", "0.5 Ohm"),
    known(Dimension::INDUCTANCE, "inductance", "H", "2 mH"),
    known(Dimension::CAPACITANCE, "capacitance", "F", "10 uF"),
    known(Dimension::TORQUE_CONSTANT, "torque constant", "N m/A", "50 mN m/A"),
    known(Dimension::FORCE_CONSTANT, "force constant", "N/A", "12 N/A"),
];

impl Dimension {
    fn known(&self) -> Option<&'static Known> {
        KNOWN.iter().find(|known| known.dimension == *self)
    }

    /// The field's word for it (`torsional stiffness`), if it has one.
    ///
    /// ```
    /// use kardan::units::Dimension;
    /// assert_eq!(Dimension::DAMPING.word(), Some("torsional damping"));
    /// assert_eq!(Dimension::mechanical(3, 0, 0, 0).word(), None);
    /// ```
    pub fn word(&self) -> Option<&'static str> {
        self.known().map(|known| known.word)
    }

    /// Its SI unit, written so that [`parse_quantity`] reads it; empty for a number without a unit.
    ///
    /// ```
    /// use kardan::units::Dimension;
    /// assert_eq!(Dimension::INERTIA.si(), "kg m^2");
    /// assert_eq!(Dimension::mechanical(1, 0, -2, 1).si(), "kg rad/s^2");
    /// ```
    pub fn si(&self) -> String {
        if let Some(known) = self.known() {
            return known.si.to_string();
        }
        let names = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];
        let powers = self.exponents.iter().chain([&self.angle]);
        let (mut above, mut below) = (Vec::new(), String::new());
        for (name, &power) in names.iter().zip(powers) {
            let factor = match power.unsigned_abs() {
                1 => name.to_string(),
                size => format!("{name}^{size}"),
            };
            match power.signum() {
                1 => above.push(factor),
                -1 => below = below + "/" + &factor,
                _ => (),
            }
        }
        if above.is_empty() {
            above.push("1".to_string());
        }
        above.join(" ") + &below
    }

    /// A quantity of this dimension as an author writes it, in quotes.
    ///
    /// ```
    /// use kardan::units::Dimension;
    /// assert_eq!(Dimension::STIFFNESS.example(), "\"100 N m/rad\"");
    /// ```
    pub fn example(&self) -> String {
        match self.known() {
            Some(known) => format!("\"{}\"", known.example),
            None => format!("\"1 {}\"", self.si()),
        }
    }

    /// The dimension with an article, for a sentence: `an angle`, `a quantity in kg rad/s^2`.
    ///
    /// ```
    /// use kardan::units::Dimension;
    /// assert_eq!(Dimension::INERTIA.noun(), "a moment of inertia");
    /// assert_eq!(Dimension::NONE.noun(), "a number without a unit");
    /// ```
    pub fn noun(&self) -> String {
        match self.word() {
            Some(word) if word.starts_with(['a', 'e', 'i', 'o', 'u']) => format!("an {word}"),
            Some(word) => format!("a {word}"),
            None => format!("a quantity in {}", self.si()),
        }
    }

    /// What to do about a text that was read with another dimension than this one.
    ///
    /// ```
    /// use kardan::units::Dimension;
    /// assert_eq!(Dimension::STIFFNESS.hint("100 N m"), "did you mean \"100 N m/rad\"?");
    /// assert_eq!(Dimension::STIFFNESS.hint("3 kg"), "write it like \"100 N m/rad\"");
    /// assert_eq!(Dimension::ANGULAR_VELOCITY.hint("0.5 kHz"), "write it as \"500 rev/s\": a turn is 2 pi rad");
    /// ```
    pub fn hint(&self, text: &str) -> String {
        let text = text.trim();
        if *self == Self::NONE {
            return "write the number without a unit".to_string();
        }
        if let (true, Ok((value, found))) = (*self == Self::ANGULAR_VELOCITY, parse_quantity(text))
            && found == Self::mechanical(0, 0, -1, 0)
        {
            return match per_minute(text) {
                true => format!("write it as \"{} rpm\": a turn is 2 pi rad", 60.0 * value.to_f64()),
                false => format!("write it as \"{} rev/s\": a turn is 2 pi rad", value.to_f64()),
            };
        }
        if let (true, Ok((value, Self::ANGULAR_VELOCITY))) = (*self == Self::FREQUENCY, parse_quantity(text)) {
            let turns = value.to_f64() / std::f64::consts::TAU;
            return match per_minute(text) {
                true => format!("write it as \"{} 1/min\": a turn is 2 pi rad", 60.0 * turns),
                false => format!("write it as \"{turns} Hz\": a turn is 2 pi rad"),
            };
        }
        let bare = matches!(parse_quantity(text), Ok((_, Self::NONE)));
        let candidates = if !bare {
            vec![format!("{text}/rad")]
        } else if *self == Self::ANGLE {
            vec![format!("{text} deg"), format!("{text} rad")]
        } else {
            vec![format!("{text} {}", self.si())]
        };
        let meant: Vec<String> = candidates
            .into_iter()
            .filter(|candidate| matches!(parse_quantity(candidate), Ok((_, found)) if found == *self))
            .map(|candidate| format!("\"{candidate}\""))
            .collect();
        match (meant.is_empty(), bare) {
            (true, _) if text.split(|c: char| !c.is_alphanumeric()).any(|word| word == "t") => {
                format!("write it like {}; `t` is a tonne here, and no time", self.example())
            }
            (true, _) => format!("write it like {}", self.example()),
            (false, true) => format!("write the unit too: {}", meant.join(" or ")),
            (false, false) => format!("did you mean {}?", meant.join(" or ")),
        }
    }
}

/// Whether the unit of a text counts what happens, or turns, in a minute.
fn per_minute(text: &str) -> bool {
    let unit = |text: &str| unit_as_written(text).map(|(_, size, _)| size);
    let (own, counted) = (unit(text), ["1 1/min", "1 rpm"].map(unit));
    own.is_some() && counted.contains(&own)
}

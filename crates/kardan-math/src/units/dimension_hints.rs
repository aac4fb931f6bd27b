//! Names of dimensions, and the help for a wrong one.

use super::dimension::{NAMED_DIMENSIONS, NamedDimension};
use super::{Dimension, parse_quantity, split_unit};

impl Dimension {
    fn named(&self) -> Option<&'static NamedDimension> {
        NAMED_DIMENSIONS.iter().find(|named| named.dimension == *self)
    }

    /// The field's word for it (`torsional stiffness`), if it has one.
    ///
    /// ```
    /// use kardan_math::units::Dimension;
    /// assert_eq!(Dimension::DAMPING.word(), Some("torsional damping"));
    /// assert_eq!(Dimension::mechanical(3, 0, 0, 0).word(), None);
    /// ```
    pub fn word(&self) -> Option<&'static str> {
        self.named().map(|named| named.word)
    }

    /// Its SI unit, written so that [`parse_quantity`] reads it; empty for a number without a unit.
    ///
    /// ```
    /// use kardan_math::units::Dimension;
    /// assert_eq!(Dimension::INERTIA.si(), "kg m^2");
    /// assert_eq!(Dimension::mechanical(1, 0, -2, 1).si(), "kg rad/s^2");
    /// ```
    pub fn si(&self) -> String {
        if let Some(named) = self.named() {
            return named.si.to_string();
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
    /// use kardan_math::units::Dimension;
    /// assert_eq!(Dimension::STIFFNESS.example(), "\"100 N m/rad\"");
    /// ```
    pub fn example(&self) -> String {
        match self.named() {
            Some(named) => format!("\"{}\"", named.example),
            None => format!("\"1 {}\"", self.si()),
        }
    }

    /// The dimension with an article, for a sentence: `an angle`, `a quantity in kg rad/s^2`.
    ///
    /// ```
    /// use kardan_math::units::Dimension;
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

    /// The help for a text that was read with another dimension than this one.
    ///
    /// ```
    /// use kardan_math::units::Dimension;
    /// assert_eq!(Dimension::STIFFNESS.hint("100 N m"), "did you mean \"100 N m/rad\"?");
    /// assert_eq!(Dimension::STIFFNESS.hint("3 kg"), "write it like \"100 N m/rad\"");
    /// assert_eq!(Dimension::ANGULAR_VELOCITY.hint("0.5 kHz"), "write it as \"500 rev/s\": a turn is 2 pi rad");
    /// ```
    pub fn hint(&self, text: &str) -> String {
        let text = text.trim();
        if *self == Self::NONE {
            return "write the number without a unit".to_string();
        }
        let read = parse_quantity(text);
        let turns = match (*self, &read) {
            (Self::ANGULAR_VELOCITY, Ok((value, Self::FREQUENCY))) => Some((value.to_f64(), ["rpm", "rev/s"])),
            (Self::FREQUENCY, Ok((value, Self::ANGULAR_VELOCITY))) => {
                Some((value.to_f64() / std::f64::consts::TAU, ["1/min", "Hz"]))
            }
            _ => None,
        };
        if let Some((turns, [slow, fast])) = turns {
            let (rate, unit) = if per_minute(text) { (60.0 * turns, slow) } else { (turns, fast) };
            return format!("write it as \"{rate} {unit}\": a turn is 2 pi rad");
        }
        let bare = matches!(read, Ok((_, Self::NONE)));
        let candidates = if !bare {
            vec![format!("{text}/rad")]
        } else if *self == Self::ANGLE {
            vec![format!("{text} deg"), format!("{text} rad")]
        } else {
            vec![format!("{text} {}", self.si())]
        };
        let suggestions: Vec<String> = candidates
            .into_iter()
            .filter(|candidate| matches!(parse_quantity(candidate), Ok((_, found)) if found == *self))
            .map(|candidate| format!("\"{candidate}\""))
            .collect();
        match (suggestions.is_empty(), bare) {
            (true, _) if text.split(|c: char| !c.is_alphanumeric()).any(|word| word == "t") => {
                format!("write it like {}; `t` is a tonne here, not a time", self.example())
            }
            (true, _) => format!("write it like {}", self.example()),
            (false, true) => format!("write the unit too: {}", suggestions.join(" or ")),
            (false, false) => format!("did you mean {}?", suggestions.join(" or ")),
        }
    }
}

/// Whether the unit of a text counts events or turns per minute.
fn per_minute(text: &str) -> bool {
    let unit = |text: &str| split_unit(text).map(|(_, size, _)| size);
    let (own, counted) = (unit(text), ["1 1/min", "1 rpm"].map(unit));
    own.is_some() && counted.contains(&own)
}

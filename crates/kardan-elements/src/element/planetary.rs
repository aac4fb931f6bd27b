//! The element `planetary`: an epicyclic gear with three shafts.

use super::shared::shafts::check_different;
use super::{Element, KeyError};
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::equations::{Direction, Domain, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// A three-shaft epicyclic gear.
    element Planetary("planetary") {
        optional {
            sun: Shaft, "The shaft of the sun; needed, as the next four keys, unless `coefficients` replace them.";
            ring: Shaft, "The shaft of the ring.";
            carrier: Shaft, "The shaft of the carrier.";
            sun_teeth: Number(Sign::Positive), "Teeth of the sun, z_s. Only the ratio to those of the ring counts.";
            ring_teeth: Number(Sign::Positive), "Teeth of the ring, z_r, more than those of the sun.";
            coefficients: Coefficients,
                "In place of the five keys above, for other gears with three shafts (differentials, stepped planets): three \
                 numbers by shaft, such as { left = 1, right = 1, cage = -2 }.";
            offset: Quantity(Dimension::ANGLE, Sign::Any) = "0 deg", "Value of the sum of coefficient times angle.";
        }
    }
}

const SHAFTS: [&str; 3] = ["sun", "ring", "carrier"];
const TEETH: [&str; 2] = ["sun_teeth", "ring_teeth"];

pub(super) const PLANETARY: Element = Element {
    keyword: Planetary::KEYWORD,
    summary: "A planetary gear of sun, ring and carrier, none of them fixed: z_s w_s + z_r w_r - (z_s + z_r) w_c = 0.",
    sketch: r"
    ring  r ======[     ]
    carrier c ====[  o  ]      z_s w_s + z_r w_r - (z_s + z_r) w_c = 0
    sun   s ======[     ]",
    signs: "With the ring fixed, the carrier rotates z_s/(z_s + z_r) times as fast as the sun, in the same direction; with the carrier fixed, the \
            ring rotates z_s/z_r times as fast, backwards. To fix one, give it a shaft and add `[constraint.NAME]` with `coefficients = { SHAFT = 1 \
            }`. `<name>.tau` is the multiplier of the row as written: the torque on a shaft is its coefficient (z_s, z_r, -(z_s + z_r)) times it.",
    symbol: Symbol::PlanetaryGear,
    fields: Planetary::FIELDS,
    example: "\
[planetary.split]
sun = \"motor\"
ring = \"housing_ring\"
carrier = \"wheel\"
sun_teeth = 30
ring_teeth = 70
",
    check,
    terms,
};

fn check(values: &Values) -> Vec<KeyError> {
    let named: Vec<&'static str> = SHAFTS.into_iter().chain(TEETH).filter(|key| values.has(key)).collect();
    match (values.map("coefficients"), named.first()) {
        (Some(_), None) if values.measure("coefficients") == Some(Domain::Translation) => vec![KeyError::new(
            "coefficients",
            "a planetary gear joins shafts by numbers without a unit",
            "write numbers of teeth, or use `[constraint.NAME]` for masses and lengths",
        )],
        (Some(coefficients), None) => check_coefficients(coefficients),
        (Some(_), Some(key)) => {
            let message = format!("`{key}` and `coefficients` both define the ratio of the gear");
            vec![KeyError::new(
                key,
                message,
                "keep `coefficients` alone, or the shafts and teeth of sun, ring and carrier",
            )]
        }
        (None, _) => check_named(values),
    }
}

fn check_coefficients(coefficients: &[(String, Exact)]) -> Vec<KeyError> {
    let zeros = coefficients.iter().filter(|(_, x)| x.is_zero()).map(|(shaft, _)| {
        let message = format!("the coefficient of `{shaft}` is zero, so the gear does not act on it");
        KeyError::new("coefficients", message, "give three coefficients other than zero, or use `gear` for two shafts")
    });
    let count = coefficients.len();
    if count == 3 {
        return zeros.collect();
    }
    vec![KeyError::new(
        "coefficients",
        format!("a planetary gear joins three shafts, here are {count}"),
        "give three coefficients; use `gear` for two shafts or `constraint` for any other number",
    )]
}

fn check_named(values: &Values) -> Vec<KeyError> {
    let missing = |key: &&'static str| !values.has(key);
    let missing: Vec<&'static str> = SHAFTS.into_iter().chain(TEETH).filter(missing).collect();
    if let Some(first) = missing.first() {
        let keys: Vec<String> = missing.iter().map(|key| format!("`{key}`")).collect();
        let help = "name the three shafts and the teeth: `sun = \"...\"`, `ring = \"...\"`, `carrier = \"...\"`, `sun_teeth = 30`, `ring_teeth = \
                    70`; a fixed part has a shaft too, fixed by `[constraint.NAME]` with `coefficients = { SHAFT = 1 }`";
        return vec![KeyError::new(first, format!("it needs {}", keys.join(", ")), help)];
    }
    let mut out = check_different(values, &SHAFTS);
    let [sun, ring] = TEETH.map(|key| values.exact_or_default(key));
    if ring.to_rational() <= sun.to_rational() {
        let message = format!("no planet fits between a sun of {} teeth and a ring of {}", sun.to_f64(), ring.to_f64());
        let help = "the ring has more teeth than the sun: were they swapped? For a differential use `coefficients`";
        out.push(KeyError::new("ring_teeth", message, help));
    }
    out
}

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let direction = match values.map("coefficients") {
        Some(coefficients) => coefficients.to_vec(),
        None => {
            let [sun, ring] = TEETH.map(|key| values.exact_or_default(key));
            let carrier = -&sun.plus(&ring);
            let shafts = SHAFTS.map(|key| values.word_or_default(key).to_string());
            shafts.into_iter().zip([sun, ring, carrier]).collect()
        }
    };
    vec![Term::Constraint { direction: Direction { entries: direction }, offset: values.exact_or_default("offset") }]
}

#[cfg(test)]
#[path = "../../tests/unit/element/planetary.rs"]
mod tests;

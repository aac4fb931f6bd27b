use super::{Element, Mistake, Values};
use crate::equations::{Direction, Term};
use crate::results::Symbol;
use crate::schema::{ElementKeys, Keys, Sign, keys};
use crate::units::Dimension;

keys! {
    /// A three-shaft epicyclic gear in its general form.
    element Planetary("planetary") {
        required {
            coefficients: Coefficients,
                "The three coefficients by shaft, such as tooth numbers { sun = 30, ring = 70, carrier = -100 }.";
        }
        optional {
            offset: Quantity(Dimension::ANGLE, Sign::Any) = "0 deg", "Value of r1 q1 + r2 q2 + r3 q3.";
        }
    }
}

/// A three-shaft epicyclic gear in its general form.
pub const PLANETARY: Element = Element {
    keyword: Planetary::KEYWORD,
    summary: "A planetary gear in general form: r1 w1 + r2 w2 + r3 w3 = 0 over three shafts.",
    sketch: r"
    ring  r ======[     ]
    carrier c ====[  o  ]      z_s w_s + z_r w_r - (z_s + z_r) w_c = 0
    sun   s ======[     ]",
    signs: "`<name>.tau` is the multiplier of the row as written: the torque on shaft k is r_k times it. With numbers of \
            teeth z of sun and ring the coefficients are z_s, z_r and -(z_s + z_r) for sun, ring and carrier; with the carrier \
            held sun and ring then turn opposite ways, the sun z_r/z_s times as fast.",
    symbol: Symbol::PlanetaryGear,
    fields: Planetary::FIELDS,
    example: "\
[planetary.split]
coefficients = { sun = 30, ring = 70, carrier = -100 }
",
    check,
    terms,
};

fn check(values: &Values) -> Vec<Mistake> {
    let coefficients = values.map("coefficients").unwrap_or_default();
    let zeros = coefficients.iter().filter(|(_, x)| x.is_zero()).map(|(shaft, _)| {
        let message = format!("the coefficient of `{shaft}` is zero, so the gear does not act on it");
        Mistake::new("coefficients", message, "give three coefficients other than zero, or use `gear` for two shafts")
    });
    let count = coefficients.len();
    if count == 3 {
        return zeros.collect();
    }
    vec![Mistake::new(
        "coefficients",
        format!("a planetary gear joins three shafts, here are {count}"),
        "give three coefficients; use `gear` for two shafts or `constraint` for any other number",
    )]
}

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let along = Direction { entries: values.map("coefficients").unwrap_or_default().to_vec() };
    vec![Term::Constraint { along, offset: values.exact_or_default("offset") }]
}

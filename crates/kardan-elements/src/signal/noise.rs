//! The signal `noise`: seeded random numbers.

use super::writer::times;
use super::{Refused, SignalKind, SignalWriter};
use crate::element::KeyError;
use kardan_expr::expr::Expr;
use kardan_math::num::Random;
use kardan_math::units::Dimension;
use kardan_schema::schema::{Keys, Sign, SignalKeys, Values, keys};

keys! {
    /// Seeded noise.
    signal Noise("noise") {
        required {
            deviation: AnyQuantity, "Standard deviation; its unit is that of the signal.";
            hold: Quantity(Dimension::TIME, Sign::Period), "How long each value is held, `1 ms`.";
        }
        optional {
            mean: AnyQuantity, "Mean, which is the value before the start; left out: zero.";
            seed: Number(Sign::NonNegative),
                "Seed, a whole number, combined with the name of the signal; left out: that of the scenario.";
            start: Quantity(Dimension::TIME, Sign::NonNegative) = "0 s", "When it begins.";
        }
    }
}

pub(super) const NOISE: SignalKind = SignalKind {
    keyword: Noise::KEYWORD,
    summary: "Normally distributed noise with zero-order hold: the same seed gives the same bits on every machine.",
    formula: "mean + deviation x_k from start + k hold on, with independent standard normal x_k; before the start: mean.",
    fields: Noise::FIELDS,
    example: "\
[signal.rumble]
kind = \"noise\"
deviation = \"0.1 N m\"
hold = \"5 ms\"
seed = 7
",
    check,
    write,
};

fn check(values: &Values) -> Vec<KeyError> {
    let mut out = Vec::new();
    if let Some(deviation) = values.number("deviation").filter(|deviation| *deviation < 0.0) {
        let message = format!("a standard deviation has no sign, found {deviation}");
        out.push(KeyError::new("deviation", message, "write zero or a number above zero"));
    }
    if let Some(seed) = values.number("seed").filter(|seed| seed.fract() != 0.0 || *seed > 9e15) {
        out.push(KeyError::new(
            "seed",
            format!("expected a whole number, found {seed}"),
            "write a whole number, such as 1",
        ));
    }
    out
}

fn write(values: &Values, writer: &mut SignalWriter<'_>) -> Result<Expr, Refused> {
    let [mean, deviation] = ["mean", "deviation"].map(|key| values.number_or_default(key));
    let [start, hold] = ["start", "hold"].map(|key| values.exact_or_default(key));
    let seed = values.number("seed").map_or(writer.seed, |seed| seed as u64);
    let mut random = Random::named(seed, writer.name);
    let draws = times(&start, &hold).map(|time| (time, [mean + deviation * random.normal(), 0.0, 0.0, 0.0]));
    let before = (!start.is_zero()).then_some((0.0, [mean, 0.0, 0.0, 0.0]));
    writer.pieces("", (writer.dimension, false), before.into_iter().chain(draws))
}

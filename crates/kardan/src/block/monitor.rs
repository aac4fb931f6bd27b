use super::builder::{BlockBuilder, BlockKind, key_error};
use crate::element::KeyError;
use crate::expr::Traced;
use crate::schema::{BlockKeys, Keys, Sign, keys};
use crate::units::{Dimension, Exact};

keys! {
    /// Watches a residual.
    block Monitor("monitor") {
        required {
            residual: Expression, "What is to be near zero.";
            threshold: Expression, "The largest size of it that is no alarm.";
        }
        optional {
            debounce: Quantity(Dimension::TIME, Sign::NonNegative), "How long it must be beyond that for an alarm; left out: one sample.";
            hold: Quantity(Dimension::TIME, Sign::NonNegative), "How long it must be within it for the alarm to end; left out: it never ends.";
        }
    }
}

pub(super) const MONITOR: BlockKind = BlockKind {
    keyword: Monitor::KEYWORD,
    summary: "Watches a residual: 1 where it stays beyond its threshold, until it stays within; it needs a sample time.",
    formula: "An alarm after as many samples beyond the threshold, one after the other, as fill `debounce`; its end after as many within it as\n\
              fill `hold`. A residual that is no number counts as beyond.",
    fields: Monitor::FIELDS,
    example: "\
[block.encoder_lost]
kind = \"monitor\"
residual = \"encoder.phi - column.phi\"
threshold = \"0.5 deg\"
debounce = \"5 ms\"
sample_time = \"1 ms\"
",
    crosses: false,
    write,
};

/// More samples than are ever counted.
const NEVER: usize = 1 << 25;

fn write(builder: &mut BlockBuilder<'_>) -> Result<(), KeyError> {
    let (residual, of) = builder.input("residual")?;
    builder.period("it counts in samples")?;
    let threshold = builder.needed("threshold", of)?;
    builder.not_negative("threshold", of, "every residual is beyond that, so there always is an alarm")?;
    if let Some(value) = builder.constant(residual) {
        let message = format!("`residual` never changes: it is {value} in SI units, whatever happens");
        return Err(key_error("residual", message, "write the difference of two things that should agree"));
    }
    // As many samples as fill the time, the first at its begin.
    let count = |key, fallback: usize| -> Traced<'_> {
        let samples = |time: &Exact, period: &Exact| (time.to_rational() / period.to_rational()).ceil();
        let found = match (builder.values.exact(key), &builder.sample_time) {
            (Some(time), Some(period)) => usize::try_from(samples(time, period)).unwrap_or(NEVER),
            _ => fallback,
        };
        Traced::Fraction(found.clamp(1, NEVER) as i64, 1)
    };
    let watch = kardan_rt::Monitor { threshold, debounce: count("debounce", 1), hold: count("hold", NEVER) };
    let [alarm, _] = builder.go_on(|memory| watch.step(residual, memory), [BlockBuilder::zero(); 2]);
    builder.answer(alarm, Dimension::NONE);
    Ok(())
}

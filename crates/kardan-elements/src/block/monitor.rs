//! The block `monitor` of a residual.

use super::builder::{BlockBuilder, BlockKind};
use crate::element::KeyError;
use kardan_expr::expr::Traced;
use kardan_math::units::{Dimension, Exact};
use kardan_schema::schema::{BlockKeys, Keys, Sign, keys};

keys! {
    /// A monitor of a residual.
    block Monitor("monitor") {
        required {
            residual: Expression, "The residual, near zero without a fault.";
            threshold: Expression, "The largest magnitude without an alarm.";
        }
        optional {
            debounce: Quantity(Dimension::TIME, Sign::NonNegative), "How long it must exceed that for an alarm; left out: one sample.";
            hold: Quantity(Dimension::TIME, Sign::NonNegative),
                "How long it must be within the threshold to end the alarm; left out: the alarm never ends.";
        }
    }
}

pub(super) const MONITOR: BlockKind = BlockKind {
    keyword: Monitor::KEYWORD,
    summary: "Monitors a residual: 1 from when it stays above its threshold until it stays within; it needs a sample time.",
    formula: "An alarm begins after as many consecutive samples beyond the threshold as fill `debounce`, and ends after as many within it as\n\
              fill `hold`. A NaN residual counts as beyond the threshold.",
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

/// More samples than any count.
const NEVER: usize = 1 << 25;

fn write(builder: &mut BlockBuilder<'_>) -> Result<(), KeyError> {
    let (residual, of) = builder.input("residual")?;
    builder.period("it counts in samples")?;
    let threshold = builder.needed("threshold", of)?;
    builder.not_negative("threshold", of, "every residual exceeds that, so there always is an alarm")?;
    if let Some(value) = builder.constant(residual) {
        let message = format!("`residual` is constant: it is always {value} in SI units");
        return Err(KeyError::new("residual", message, "write the difference of two signals that should agree"));
    }
    // As many samples as fill the time, the first at its start.
    let count = |key, fallback: usize| -> Traced<'_> {
        let samples = |time: &Exact, period: &Exact| (time.to_rational() / period.to_rational()).ceil();
        let found = match (builder.values.exact(key), &builder.sample_time) {
            (Some(time), Some(period)) => usize::try_from(samples(time, period)).unwrap_or(NEVER),
            _ => fallback,
        };
        Traced::Fraction(found.clamp(1, NEVER) as i64, 1)
    };
    let watch = kardan_rt::Monitor { threshold, debounce: count("debounce", 1), hold: count("hold", NEVER) };
    let [alarm, _] = builder.go_on(|state| watch.step(residual, state), [BlockBuilder::zero(); 2]);
    builder.output(alarm, Dimension::NONE);
    Ok(())
}

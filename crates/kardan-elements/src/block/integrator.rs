//! The block `integrator`.

use super::builder::{BlockBuilder, BlockKind};
use crate::element::KeyError;
use kardan_math::units::Dimension;
use kardan_schema::schema::{BlockKeys, Keys, keys};

keys! {
    /// The integral of a signal over time.
    block Integrator("integrator") {
        required {
            input: Expression, "The input signal.";
        }
        optional {
            initial: Expression, "Output at the start; left out: 0.";
            low: Expression, "Lower limit of the output; left out: -`high`, if `high` is given.";
            high: Expression, "Upper limit of the output; left out: no limit.";
            reset: Expression, "While it is above 0.5 the output is `reset_to`; left out: never. It needs a sample time.";
            reset_to: Expression, "Output after a reset; left out: 0.";
            rule: Choice(&["forward", "trapezoidal"]) = "forward",
                "At a sample time: the integration rule. `forward` has no direct feedthrough, so it may close a loop.";
        }
    }
}

pub(super) const INTEGRATOR: BlockKind = BlockKind {
    keyword: Integrator::KEYWORD,
    summary: "The integral of a signal over time, with bounds and reset.",
    formula: "rate of the output = input within the bounds; at a sample time h: y + h input at the next sample, or y- + h (input + input-)/2.",
    fields: Integrator::FIELDS,
    example: "\
[block.angle_of_rate]
kind = \"integrator\"
input = \"column.w\"
high = \"2 rad\"
sample_time = \"1 ms\"
",
    crosses: false,
    write,
};

fn write(builder: &mut BlockBuilder<'_>) -> Result<(), KeyError> {
    let (input, of) = builder.input("input")?;
    let dimension = builder.over("input", of, Dimension::TIME, 1)?;
    let zero = BlockBuilder::zero();
    let start = builder.of("initial", dimension)?.unwrap_or(zero);
    let [low, high] = builder.bounds(dimension)?;
    if builder.inputs.contains_key("initial") {
        low.map_or(Ok(()), |low| builder.in_order(["low", "initial"], [low, start], dimension))?;
        high.map_or(Ok(()), |high| builder.in_order(["initial", "high"], [start, high], dimension))?;
    }
    let (reset, reset_to) = (builder.of("reset", Dimension::NONE)?, builder.of("reset_to", dimension)?);
    if reset.is_none() && reset_to.is_some() {
        return Err(KeyError::new("reset_to", "`reset_to` is for a `reset`, which is not given", "add `reset`"));
    }
    let output = match builder.sample_time.clone() {
        Some(time) => {
            let sum = kardan_rt::Integrator { sample_time: builder.exact(&time), low, high };
            let (reset, reset_to) = (reset.unwrap_or(zero), reset_to.unwrap_or(zero));
            let trapezoidal = builder.values.word_or_default("rule") == "trapezoidal";
            builder.step(
                |state| match trapezoidal {
                    true => sum.step_trapezoidal(input, reset, reset_to, state),
                    false => sum.step(input, reset, reset_to, state),
                },
                [zero, start],
            )
        }
        None if builder.values.has("rule") => {
            return builder.idle(
                "rule",
                "without a sample time it is a differential equation",
                "remove it, or add a `sample_time`",
            );
        }
        None if reset.is_some() => {
            return Err(KeyError::new("reset", "a reset needs a `sample_time`", "write `sample_time = \"1 ms\"`"));
        }
        None => {
            let sum = builder.new_state(start);
            // At a bound it stops until its input leads away from the bound.
            let rate = builder.away_from(sum, [low, high], input);
            builder.next(&[rate]);
            builder.clamped(sum, [low, high])
        }
    };
    builder.output(output, dimension);
    Ok(())
}

//! The block `rate_limit`.

use super::builder::{BlockBuilder, BlockKind};
use crate::element::KeyError;
use kardan_math::units::Dimension;
use kardan_schema::schema::{BlockKeys, Keys, keys};

keys! {
    /// A rate limiter.
    block RateLimit("rate_limit") {
        required {
            input: Expression, "The input signal.";
            rise: Expression, "The fastest rise, above zero, in the unit of the input over time.";
        }
        optional {
            fall: Expression, "The fastest fall, above zero; left out: as fast as it rises.";
        }
    }
}

pub(super) const RATE_LIMIT: BlockKind = BlockKind {
    keyword: RateLimit::KEYWORD,
    summary: "A rate limiter; it needs a sample time.",
    formula: "The input, limited between y- - fall h and y- + rise h; the first sample is that of the input.",
    fields: RateLimit::FIELDS,
    example: "\
[block.gentle]
kind = \"rate_limit\"
input = \"wish\"
rise = \"30 N m/s\"
sample_time = \"1 ms\"

[signal.wish]
kind = \"sine\"
amplitude = \"2 N m\"
frequency = \"1 Hz\"
",
    crosses: false,
    write,
};

fn write(builder: &mut BlockBuilder<'_>) -> Result<(), KeyError> {
    let (input, dimension) = builder.input("input")?;
    let h = builder.period("it defines the largest change between two samples")?;
    let rate = builder.over("rise", dimension, Dimension::TIME, -1)?;
    let rise = builder.needed("rise", rate)?;
    builder.positive("rise", rate, "it is the fastest rise, so the output could not rise")?;
    let fall =
        builder.positive("fall", rate, "it is the magnitude of the fastest fall, without a sign")?.unwrap_or(rise);
    let limit = kardan_rt::RateLimit { rise: rise * h, fall: fall * h };
    let [output, _] = builder.go_on(|state| limit.step(input, state), [BlockBuilder::zero(); 2]);
    builder.output(output, dimension);
    Ok(())
}

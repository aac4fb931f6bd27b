use super::builder::{BlockBuilder, BlockKind};
use crate::element::KeyError;
use crate::schema::{BlockKeys, Keys, keys};
use crate::units::Dimension;

keys! {
    /// A signal that changes no faster than it may.
    block RateLimit("rate_limit") {
        required {
            input: Expression, "What it follows.";
            rise: Expression, "The fastest rise, above zero: the unit of the input by a time.";
        }
        optional {
            fall: Expression, "The fastest fall, above zero; left out: as fast as it rises.";
        }
    }
}

pub(super) const RATE_LIMIT: BlockKind = BlockKind {
    keyword: RateLimit::KEYWORD,
    summary: "A signal that changes no faster than it may; it needs a sample time.",
    formula: "The nearest number to the input between y- - fall h and y- + rise h; the first sample is that of the input.",
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
    let h = builder.period("how far it may go from one sample to the next follows from that")?;
    let rate = builder.over("rise", dimension, Dimension::TIME, -1)?;
    let rise = builder.needed("rise", rate)?;
    builder.positive("rise", rate, "it is the fastest rise, and nothing would rise")?;
    let fall = builder.positive("fall", rate, "it is the size of the fastest fall, without a sign")?.unwrap_or(rise);
    let limit = kardan_rt::RateLimit { rise: rise * h, fall: fall * h };
    let [answer, _] = builder.go_on(|memory| limit.step(input, memory), [BlockBuilder::zero(); 2]);
    builder.answer(answer, dimension);
    Ok(())
}

use super::wiring::{BlockKind, Wiring};
use crate::element::Mistake;
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

fn write(wiring: &mut Wiring<'_>) -> Result<(), Mistake> {
    let (input, dimension) = wiring.input("input")?;
    let h = wiring.period("how far it may go from one sample to the next follows from that")?;
    let rate = wiring.over("rise", dimension, Dimension::TIME, -1)?;
    let rise = wiring.needed("rise", rate)?;
    wiring.positive("rise", rate, "it is the fastest rise, and nothing would rise")?;
    let fall = wiring.positive("fall", rate, "it is the size of the fastest fall, without a sign")?.unwrap_or(rise);
    let limit = kardan_rt::RateLimit { rise: rise * h, fall: fall * h };
    let [answer, _] = wiring.go_on(|memory| limit.step(input, memory), [Wiring::zero(); 2]);
    wiring.answer(answer, dimension);
    Ok(())
}

use super::wiring::{BlockKind, Wiring, mistake};
use crate::element::Mistake;
use crate::schema::{BlockKeys, Keys, Sign, keys};
use crate::units::Dimension;

keys! {
    /// A signal some samples later.
    block Delay("delay") {
        required {
            input: Expression, "What it reads.";
        }
        optional {
            time: Quantity(Dimension::TIME, Sign::Positive), "How much later: a whole multiple of the sample time; left out: one sample.";
            initial: Expression, "Its answer until then; left out: 0.";
        }
    }
}

pub(super) const DELAY: BlockKind = BlockKind {
    keyword: Delay::KEYWORD,
    summary: "A signal some samples later; it needs a sample time. What it answers does not depend on its input at once, so it may close a loop.",
    formula: "The input of so many samples ago.",
    fields: Delay::FIELDS,
    example: "\
[block.late]
kind = \"delay\"
input = \"encoder.phi\"
time = \"3 ms\"
sample_time = \"1 ms\"
",
    crosses: false,
    write,
};

fn write(wiring: &mut Wiring<'_>) -> Result<(), Mistake> {
    let (input, dimension) = wiring.input("input")?;
    wiring.period("it counts in samples")?;
    let start = wiring.of("initial", dimension)?.unwrap_or(Wiring::zero());
    let count = match (wiring.values.exact("time"), &wiring.sample_time) {
        (Some(time), Some(period)) => wiring.samples("time", time, period)?,
        _ => 1,
    };
    if count == 0 {
        return Err(mistake("time", "`time` is shorter than a sample", "make it one sample, or take the block out"));
    }
    let first = wiring.memory.len();
    let mut memory = vec![Wiring::zero()];
    memory.extend((0..count).map(|_| wiring.remember(start)));
    let _ = kardan_rt::Delay.step(input, &mut memory);
    wiring.next(first, &memory[1..]);
    wiring.answer(memory[0], dimension);
    Ok(())
}

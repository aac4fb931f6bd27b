use super::rational::filtered;
use super::wiring::{BlockKind, Wiring};
use crate::element::Mistake;
use crate::schema::{BlockKeys, Keys, keys};
use crate::units::Dimension;

keys! {
    /// A lead or a lag of first order.
    block LeadLag("lead_lag") {
        required {
            input: Expression, "What it reads.";
            lead: Expression, "T1, the time constant of the numerator.";
            lag: Expression, "T2, the time constant of the denominator.";
        }
        optional {
            initial: Expression, "Its answer at the start, where it is at rest; left out: 0.";
        }
    }
}

pub(super) const LEAD_LAG: BlockKind = BlockKind {
    keyword: LeadLag::KEYWORD,
    summary: "A lead or a lag of first order.",
    formula: "(1 + T1 s)/(1 + T2 s). At a sample time h by the bilinear rule, s = (2/h)(z - 1)/(z + 1).",
    fields: LeadLag::FIELDS,
    example: "\
[block.lead]
kind = \"lead_lag\"
input = \"torque_sensor.tau\"
lead = \"20 ms\"
lag = \"4 ms\"
sample_time = \"1 ms\"
",
    crosses: false,
    write,
};

fn write(wiring: &mut Wiring<'_>) -> Result<(), Mistake> {
    let (input, dimension) = wiring.input("input")?;
    wiring.positive("lag", Dimension::TIME, "what it answers would grow by itself, or be a derivative")?;
    let [lead, lag] = [wiring.needed("lead", Dimension::TIME)?, wiring.needed("lag", Dimension::TIME)?];
    let start = wiring.of("initial", dimension)?.unwrap_or(Wiring::zero());
    let one = Wiring::one();
    let answer = filtered(wiring, (&[one, lead], &[one, lag]), input, start)?;
    wiring.answer(answer, dimension);
    Ok(())
}

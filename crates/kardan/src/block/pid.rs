use kardan_rt::Manual;

use super::wiring::{BlockKind, Wiring, mistake};
use crate::element::Mistake;
use crate::expr::Traced;
use crate::schema::{BlockKeys, Keys, keys};
use crate::units::Dimension;

keys! {
    /// A controller of proportional, integral and filtered derivative parts.
    block Pid("pid") {
        required {
            reference: Expression, "What the measurement is to be.";
            measured: Expression, "The measurement.";
            proportional: Expression, "K, with its unit: what it answers by what it measures.";
        }
        optional {
            integral: Expression, "Ki: that by a time; left out: none.";
            derivative: Expression, "Kd: that times a time; left out: none.";
            filter: Expression, "Tf, the time constant of the derivative's filter; left out: none, which needs a sample time.";
            reference_weight: Expression, "b, the share of the reference in the proportional part; left out: 1.";
            rate_weight: Expression, "c, the share of the reference in the derivative part; left out: 0.";
            low: Expression, "The smallest answer; left out: that below zero which `high` is above, if there is one.";
            high: Expression, "The largest answer; left out: no bound.";
            tracking_time: Expression, "Tt, how fast the integral follows where a bound holds the answer; left out: K/Ki, with a K of 0 the sample time.";
            on: Expression, "Whether it is on: above 0.5. Left out: always.";
            manual: Expression, "What it answers while it is not on; it takes over from there without a jump. Left out: 0.";
        }
    }
}

pub(super) const PID: BlockKind = BlockKind {
    keyword: Pid::KEYWORD,
    summary: "A PID controller: filtered derivative, setpoint weights, bounds with anti-windup by back-calculation, bumpless switching.",
    formula: "v = K (b r - y) + I + D, answer = v within the bounds, rate of I = Ki (r - y) + (answer - v)/Tt, D = Kd s (c r - y)/(1 + Tf s).\n\
              At a sample time h: I by the forward, D by the backward difference (Åström and Hägglund, Advanced PID Control).",
    fields: Pid::FIELDS,
    example: "\
[block.position]
kind = \"pid\"
reference = \"ref_rack\"
measured = \"encoder.phi\"
proportional = \"20 N m/rad\"
integral = \"50 N m/rad/s\"
derivative = \"0.4 N m s/rad\"
filter = \"2 ms\"
high = \"4 N m\"
sample_time = \"1 ms\"
",
    crosses: false,
    write,
};

/// What a controller is made of, with the units checked.
struct Read<'g> {
    pid: kardan_rt::Pid<Traced<'g>>,
    reference: Traced<'g>,
    measured: Traced<'g>,
    manual: Option<Manual<Traced<'g>>>,
    /// What it answers is of.
    dimension: Dimension,
}

fn read<'g>(wiring: &Wiring<'g>) -> Result<Read<'g>, Mistake> {
    let (measured, of) = wiring.input("measured")?;
    let reference = wiring.needed("reference", of)?;
    let (proportional, gain) = wiring.input("proportional")?;
    let dimension = wiring.over("proportional", of, gain, 1)?;
    let (by_time, times) =
        (wiring.over("integral", gain, Dimension::TIME, -1)?, wiring.over("derivative", gain, Dimension::TIME, 1)?);
    let (zero, one) = (Wiring::zero(), Wiring::one());
    let integral = wiring.of("integral", by_time)?;
    let derivative = wiring.of("derivative", times)?;
    let filter = wiring.of("filter", Dimension::TIME)?;
    if let (Some(_), None, None) = (derivative, filter, &wiring.sample_time) {
        return Err(mistake(
            "derivative",
            "a derivative at every instant needs a filter",
            "add `filter = \"5 ms\"`, or a `sample_time`",
        ));
    }
    let weight = |key, left_out| Ok(wiring.of(key, Dimension::NONE)?.unwrap_or(left_out));
    let weights = [weight("reference_weight", one)?, weight("rate_weight", zero)?];
    let bounds = wiring.bounds(dimension)?;
    let tracking = match (wiring.of("tracking_time", Dimension::TIME)?, integral) {
        (Some(given), _) => given,
        // Without a proportional part K/Ki is no time.
        (None, Some(_)) if wiring.is_zero(proportional) => match &wiring.sample_time {
            Some(time) => wiring.exact(time),
            None if bounds.iter().all(Option::is_none) => one,
            None => {
                let message = "`tracking_time` is missing: with a `proportional` of 0, K/Ki is no time";
                return Err(mistake("proportional", message, "say how fast the integral is to follow at a bound"));
            }
        },
        (None, Some(integral)) => proportional / integral,
        (None, None) => one,
    };
    let on = wiring.of("on", Dimension::NONE)?;
    let value = wiring.of("manual", dimension)?;
    if on.is_none() && value.is_some() {
        return Err(mistake("manual", "`manual` is answered while it is not `on`, which is not given", "add `on`"));
    }
    Ok(Read {
        pid: kardan_rt::Pid {
            proportional,
            integral: integral.unwrap_or(zero),
            derivative: derivative.unwrap_or(zero),
            filter: filter.unwrap_or(zero),
            weights,
            bounds,
            tracking,
            sample_time: one,
        },
        reference,
        measured,
        manual: on.map(|on| Manual { on, value: value.unwrap_or(zero) }),
        dimension,
    })
}

fn write(wiring: &mut Wiring<'_>) -> Result<(), Mistake> {
    let Read { mut pid, reference, measured, manual, dimension } = read(wiring)?;
    let (zero, one) = (Wiring::zero(), Wiring::one());
    let answer = match wiring.sample_time.clone() {
        Some(time) => {
            pid.sample_time = wiring.exact(&time);
            let manual = manual.unwrap_or(Manual { on: one, value: zero });
            wiring.step(|memory| pid.step(reference, measured, manual, memory), [zero; 5])
        }
        None if manual.is_some() => {
            return Err(mistake("on", "switching needs a `sample_time`", "write `sample_time = \"1 ms\"`"));
        }
        None => flowing(wiring, &pid, [reference, measured]),
    };
    wiring.answer(answer, dimension);
    Ok(())
}

/// At every instant: two states, the integral and the filtered e.
fn flowing<'g>(
    wiring: &mut Wiring<'g>,
    pid: &kardan_rt::Pid<Traced<'g>>,
    [reference, measured]: [Traced<'g>; 2],
) -> Traced<'g> {
    let zero = Wiring::zero();
    let [b, c] = pid.weights;
    let mut direct = pid.proportional * (b * reference - measured);
    if !wiring.is_zero(pid.derivative) {
        let first = wiring.memory.len();
        let [filtered] = wiring.zeros();
        let late = (c * reference - measured - filtered) / pid.filter;
        wiring.next(first, &[late]);
        direct = direct + pid.derivative * late;
    }
    if wiring.is_zero(pid.integral) {
        return wiring.within(direct, pid.bounds);
    }
    let first = wiring.memory.len();
    let integral = wiring.remember(zero);
    let free = direct + integral;
    let answer = wiring.within(free, pid.bounds);
    wiring.next(first, &[pid.integral * (reference - measured) + (answer - free) / pid.tracking]);
    answer
}

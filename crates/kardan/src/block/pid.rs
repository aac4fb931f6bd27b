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
            reference: Expression, "What the measurement is to be. A new name introduces a reference, as in laws: events and `signals` of the scenario set it.";
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
            tracking_time: Expression, "Tt, how fast the integral follows where a bound holds the answer; left out: K/Ki, with a K of 0 the sample time. \
                 Without `integral`: how fast what bridges a switching fades.";
            on: Expression, "Whether it is on: above 0.5. Left out: always.";
            manual: Expression, "What it answers while it is not on; it takes over from there without a jump. Left out: 0.";
        }
    }
}

pub(super) const PID: BlockKind = BlockKind {
    keyword: Pid::KEYWORD,
    summary: "A PID controller: filtered derivative, setpoint weights, bounds with anti-windup by back-calculation, bumpless switching.",
    formula: "v = K (b r - y) + I + D, answer = v within the bounds, rate of I = Ki (r - y) + (answer - v)/Tt, D = Kd s (c r - y)/(1 + Tf s).\n\
              At a sample time h: I by the forward, D by the backward difference (Åström and Hägglund, Advanced PID Control). Without Ki, I is\n\
              what bridges a switching, and fades: rate of I = -I/Tt. At every instant the filter of D starts at zero, so that a measurement which does not\n\
              is a step for it; at a sample time it starts where the first sample finds it.",
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
    let filter = match &wiring.sample_time {
        Some(_) => wiring.not_negative("filter", Dimension::TIME, "it is a time constant")?,
        None => wiring.positive("filter", Dimension::TIME, "at every instant a derivative needs a filter")?,
    };
    if derivative.is_none() {
        for key in ["filter", "rate_weight"] {
            wiring.idle(key, "there is no `derivative`", "take it out, or add `derivative`")?;
        }
    }
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
    let on = wiring.of("on", Dimension::NONE)?;
    let integral = integral.filter(|integral| !wiring.is_zero(*integral));
    let tracking = tracking(wiring, (proportional, integral), &bounds, on.is_some())?;
    let value = wiring.of("manual", dimension)?;
    if on.is_none() && value.is_some() {
        return Err(mistake("manual", "`manual` is answered while it is not `on`, which is not given", "add `on`"));
    }
    Ok(Read {
        pid: kardan_rt::Pid {
            proportional,
            integral,
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

/// Tt, with its sense checked.
fn tracking<'g>(
    wiring: &Wiring<'g>,
    (proportional, integral): (Traced<'g>, Option<Traced<'g>>),
    bounds: &[Option<Traced<'g>>; 2],
    switched: bool,
) -> Result<Traced<'g>, Mistake> {
    let (one, bounded) = (Wiring::one(), bounds.iter().any(Option::is_some));
    let given = wiring.positive("tracking_time", Dimension::TIME, "the integral would run away from a bound")?;
    match integral {
        Some(_) if !bounded => {
            wiring.idle("tracking_time", "no bound holds the answer", "take it out, or add `high`")?;
            return Ok(one);
        }
        None if !switched => {
            wiring.idle(
                "tracking_time",
                "there is no `integral` that would follow",
                "take it out, or add `integral`",
            )?;
            return Ok(one);
        }
        None if given.is_none() => {
            let message = "without an `integral` what bridges a switching from `manual` would stay for ever";
            return Err(mistake("on", message, "say how fast it is to fade: `tracking_time = \"0.2 s\"`"));
        }
        _ => {}
    }
    let found = match (given, integral) {
        (Some(given), _) => given,
        // Without a proportional part K/Ki is no time.
        (None, Some(_)) if wiring.is_zero(proportional) => match &wiring.sample_time {
            Some(time) => wiring.exact(time),
            None => {
                let message = "`tracking_time` is missing: with a `proportional` of 0, K/Ki is no time";
                return Err(mistake("proportional", message, "say how fast the integral is to follow at a bound"));
            }
        },
        (None, Some(integral)) => proportional / integral,
        (None, None) => one,
    };
    let shortest = wiring.sample_time.as_ref().map_or(0.0, |time| time.to_f64() / 2.0);
    match wiring.constant(found) {
        Some(time) if time <= shortest => {
            let key = if given.is_some() { "tracking_time" } else { "integral" };
            let what = if given.is_some() {
                "`tracking_time`"
            } else {
                "`proportional`/`integral`, which stands for `tracking_time`,"
            };
            let message = match &wiring.sample_time {
                Some(_) => format!(
                    "{what} is {time} s, not above half of the sample time: at a bound the integral would swing up"
                ),
                None => format!("{what} is {time} s: at a bound the integral would run away"),
            };
            Err(mistake(key, message, "write a longer `tracking_time`"))
        }
        _ => Ok(found),
    }
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
    let Some(by_time) = pid.integral else { return wiring.within(direct, pid.bounds) };
    let first = wiring.memory.len();
    let integral = wiring.remember(zero);
    let free = direct + integral;
    let answer = wiring.within(free, pid.bounds);
    wiring.next(first, &[by_time * (reference - measured) + (answer - free) / pid.tracking]);
    answer
}

//! The block `pid`: a PID controller with filtered derivative.

use kardan_rt::Manual;

use super::builder::{BlockBuilder, BlockKind};
use crate::element::KeyError;
use kardan_expr::expr::Traced;
use kardan_math::units::Dimension;
use kardan_schema::schema::{BlockKeys, Keys, keys};

keys! {
    /// A PID controller with filtered derivative.
    block Pid("pid") {
        required {
            reference: Expression, "The setpoint. A new name introduces a reference, as in laws: events and `signals` of the scenario set it.";
            measured: Expression, "The measurement.";
            proportional: Expression, "K, with the unit of the output over that of the measurement.";
        }
        optional {
            integral: Expression, "Ki, with the unit of K over time; left out: none.";
            derivative: Expression, "Kd, with the unit of K times time; left out: none.";
            filter: Expression, "Tf, the time constant of the derivative's filter; left out: none, which needs a sample time.";
            reference_weight: Expression, "b, the setpoint weight of the proportional part; left out: 1.";
            rate_weight: Expression, "c, the setpoint weight of the derivative part; left out: 0.";
            low: Expression, "Lower limit of the output; left out: -`high`, if `high` is given.";
            high: Expression, "Upper limit of the output; left out: no limit.";
            tracking_time: Expression,
                "Tt, time constant of anti-windup while the output is at a bound; left out: K/Ki, with a K of 0 the sample time. Without \
                 `integral`: decay time of the bumpless-transfer offset.";
            on: Expression, "Whether it is on: above 0.5. Left out: always.";
            manual: Expression, "Output while it is off; it takes over from there without a jump. Left out: 0.";
        }
    }
}

pub(super) const PID: BlockKind = BlockKind {
    keyword: Pid::KEYWORD,
    summary: "A PID controller: filtered derivative, setpoint weights, bounds with anti-windup by back-calculation, bumpless switching.",
    formula: "v = K (b r - y) + I + D, output = v within the bounds, rate of I = Ki (r - y) + (output - v)/Tt, D = Kd s (c r - y)/(1 + Tf s).\n\
              At a sample time h: I by the forward, D by the backward difference (Åström and Hägglund, Advanced PID Control). Without Ki, I is\n\
              the bumpless-transfer offset, and decays: rate of I = -I/Tt. In continuous time the filter of D starts at zero, so that a measurement\n\
              with another initial value is a step for it; at a sample time it starts at the first sample.",
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

/// The parameters of a controller, with checked units.
struct Read<'g> {
    pid: kardan_rt::Pid<Traced<'g>>,
    reference: Traced<'g>,
    measured: Traced<'g>,
    manual: Option<Manual<Traced<'g>>>,
    /// Dimension of the output.
    dimension: Dimension,
}

fn read<'g>(builder: &BlockBuilder<'g>) -> Result<Read<'g>, KeyError> {
    let (measured, of) = builder.input("measured")?;
    let reference = builder.needed("reference", of)?;
    let (proportional, gain) = builder.input("proportional")?;
    let dimension = builder.over("proportional", of, gain, 1)?;
    let (by_time, times) =
        (builder.over("integral", gain, Dimension::TIME, -1)?, builder.over("derivative", gain, Dimension::TIME, 1)?);
    let (zero, one) = (BlockBuilder::zero(), BlockBuilder::one());
    let integral = builder.of("integral", by_time)?;
    let derivative = builder.of("derivative", times)?;
    let filter = match &builder.sample_time {
        Some(_) => builder.not_negative("filter", Dimension::TIME, "it is a time constant")?,
        None => builder.positive("filter", Dimension::TIME, "in continuous time a derivative needs a filter")?,
    };
    if derivative.is_none() {
        for key in ["filter", "rate_weight"] {
            builder.idle(key, "there is no `derivative`", "remove it, or add `derivative`")?;
        }
    }
    if let (Some(_), None, None) = (derivative, filter, &builder.sample_time) {
        return Err(KeyError::new(
            "derivative",
            "a derivative in continuous time needs a filter",
            "add `filter = \"5 ms\"`, or a `sample_time`",
        ));
    }
    let weight = |key, fallback| Ok(builder.of(key, Dimension::NONE)?.unwrap_or(fallback));
    let weights = [weight("reference_weight", one)?, weight("rate_weight", zero)?];
    let bounds = builder.bounds(dimension)?;
    let on = builder.of("on", Dimension::NONE)?;
    let integral = integral.filter(|integral| !builder.is_zero(*integral));
    let tracking = tracking(builder, (proportional, integral), &bounds, on.is_some())?;
    let value = builder.of("manual", dimension)?;
    if on.is_none() && value.is_some() {
        return Err(KeyError::new(
            "manual",
            "`manual` is the output while `on` is false, and there is no `on`",
            "add `on`",
        ));
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

/// Tt, with its sign checked.
fn tracking<'g>(
    builder: &BlockBuilder<'g>,
    (proportional, integral): (Traced<'g>, Option<Traced<'g>>),
    bounds: &[Option<Traced<'g>>; 2],
    switched: bool,
) -> Result<Traced<'g>, KeyError> {
    let (one, bounded) = (BlockBuilder::one(), bounds.iter().any(Option::is_some));
    let explicit = builder.positive("tracking_time", Dimension::TIME, "at a bound the integral would diverge")?;
    match integral {
        Some(_) if !bounded => {
            builder.idle("tracking_time", "the output has no bound", "remove it, or add `high`")?;
            return Ok(one);
        }
        None if !switched => {
            builder.idle(
                "tracking_time",
                "there is no `integral` for the anti-windup",
                "remove it, or add `integral`",
            )?;
            return Ok(one);
        }
        None if explicit.is_none() => {
            let message = "without an `integral` the offset after a switch from `manual` would never decay";
            return Err(KeyError::new("on", message, "give its decay time: `tracking_time = \"0.2 s\"`"));
        }
        _ => {}
    }
    let found = match (explicit, integral) {
        (Some(explicit), _) => explicit,
        // Without a proportional part K/Ki is not a time.
        (None, Some(_)) if builder.is_zero(proportional) => match &builder.sample_time {
            Some(time) => builder.exact(time),
            None => {
                let message = "`tracking_time` is missing: with a `proportional` of 0, the default K/Ki is not defined";
                return Err(KeyError::new("proportional", message, "give the time constant of anti-windup at a bound"));
            }
        },
        (None, Some(integral)) => proportional / integral,
        (None, None) => one,
    };
    let shortest = builder.sample_time.as_ref().map_or(0.0, |time| time.to_f64() / 2.0);
    match builder.constant(found) {
        Some(time) if time <= shortest => {
            let key = if explicit.is_some() { "tracking_time" } else { "integral" };
            let what = if explicit.is_some() {
                "`tracking_time`"
            } else {
                "`proportional`/`integral`, the default of `tracking_time`,"
            };
            let message = match &builder.sample_time {
                Some(_) => format!(
                    "{what} is {time} s, not above half of the sample time: at a bound the integral would oscillate with growing amplitude"
                ),
                None => format!("{what} is {time} s: at a bound the integral would diverge"),
            };
            Err(KeyError::new(key, message, "write a longer `tracking_time`"))
        }
        _ => Ok(found),
    }
}

fn write(builder: &mut BlockBuilder<'_>) -> Result<(), KeyError> {
    let Read { mut pid, reference, measured, manual, dimension } = read(builder)?;
    let (zero, one) = (BlockBuilder::zero(), BlockBuilder::one());
    let output = match builder.sample_time.clone() {
        Some(time) => {
            pid.sample_time = builder.exact(&time);
            let manual = manual.unwrap_or(Manual { on: one, value: zero });
            builder.step(|state| pid.step(reference, measured, manual, state), [zero; 5])
        }
        None if manual.is_some() => {
            return Err(KeyError::new("on", "switching needs a `sample_time`", "write `sample_time = \"1 ms\"`"));
        }
        None => flowing(builder, &pid, [reference, measured]),
    };
    builder.output(output, dimension);
    Ok(())
}

/// In continuous time: two states, the integral and the filtered e.
fn flowing<'g>(
    builder: &mut BlockBuilder<'g>,
    pid: &kardan_rt::Pid<Traced<'g>>,
    [reference, measured]: [Traced<'g>; 2],
) -> Traced<'g> {
    let zero = BlockBuilder::zero();
    let [b, c] = pid.weights;
    let mut direct = pid.proportional * (b * reference - measured);
    if !builder.is_zero(pid.derivative) {
        let filtered = builder.new_state(zero);
        let late = (c * reference - measured - filtered) / pid.filter;
        builder.next(&[late]);
        direct = direct + pid.derivative * late;
    }
    let Some(by_time) = pid.integral else { return builder.clamped(direct, pid.bounds) };
    let integral = builder.new_state(zero);
    let free = direct + integral;
    let output = builder.clamped(free, pid.bounds);
    builder.next(&[by_time * (reference - measured) + (output - free) / pid.tracking]);
    output
}

//! Noninteracting control that is designed for its sample time: the law with its keyword, its references and its design.

mod channel_tasks;
mod description;
mod governor;
mod keys;
mod observer;
mod position_design;
mod sampled_law;
mod schedule;

pub use keys::{SampledNoninteracting, SampledNoninteractingChannel};

use std::sync::Arc;

use kardan_rt::Bounds;

use crate::channels::{once, reference};
use crate::observed::Reading;
use crate::outputs::{channels, paired_channels, paired_inputs};
use crate::sampled::on_their_way;
use crate::{Law, LawKind, Reference, Request, SynthesisError, clock};
use kardan_mechanics::reduce::Kinematics;
use kardan_results::{DataNumber, Physical};
use kardan_schema::schema::Values;
use kardan_schema::schema::{Keys, LawKeys};

use channel_tasks::{DesignSpec, position, tasks};
use description::describe;
use observer::Observer;
use position_design::{Designed, designed};
use sampled_law::Sampled;
use schedule::{Follows, follows, schedule};

/// Noninteracting control that is designed for its sample time, the delay and the motors: what is left of a decoupling is
/// minimised, instead of the plant inverted.
pub const SAMPLED_NONINTERACTING: LawKind = LawKind {
    keyword: SampledNoninteracting::KEYWORD,
    summary: "Noninteracting control designed for its sample time: the exactly sampled plant with delay and lag of the \
              motors, reference models, and a quadratic cost on the interaction itself, the residual between each \
              output and the ideal decoupled loop. Observer, torque limits and a reference governor are part of the law.",
    fields: SampledNoninteracting::FIELDS,
    example: "\
[control.column]
law = \"sampled_noninteracting\"
sample_time = \"1 ms\"
delay = \"1 ms\"

[[control.column.channels]]
output = \"rk.phi\"
input = \"rk_motor\"
kind = \"position\"
bandwidth = \"31 rad/s\"
reference = \"ref_rk\"

[[control.column.channels]]
output = \"fs.phi\"
input = \"wg_motor\"
kind = \"torque\"
bandwidth = \"31 rad/s\"
reference = \"u2\"

[control.column.observer]
sensors = [\"wg.phi\", \"cs.phi\", \"rk.phi\"]
disturbances = [\"rk\", \"fs\"]
",
    template: |inputs, outputs| {
        let channel =
            |output: &str, input: &str, reference| SampledNoninteractingChannel::new(output, input, reference);
        let channels = paired_channels(inputs, outputs, channel)?;
        Some(SampledNoninteracting::new(channels).sample_time("1 ms").delay("1 ms").entries())
    },
    inputs: paired_inputs,
    references,
    samples: true,
    design,
};

/// Acceptable rate of a torque over its limit, 1/s.
const RATE_OVER_LIMIT: f64 = 80.0;
/// Acceptable rate of a torque without a limit, N m/s.
const RATE: f64 = 100.0;

/// The references: of an angle under a torque channel it is a torque.
fn references(values: &Values) -> Vec<Reference> {
    let one = |channel: &Values| {
        let own = reference(channel)?;
        let is_torque = own.physical == Physical::Torque || channel.word("kind") == Some("torque");
        let description = format!("torque reference along {}", channel.word("output")?);
        Some(if is_torque { Reference { physical: Physical::Torque, description, ..own } } else { own })
    };
    channels(values).filter_map(one).collect()
}

fn design(request: &Request<'_>) -> Result<Arc<dyn Law>, SynthesisError> {
    let (plant, values) = (request.plant, request.values);
    let Some(clock) = clock(values)? else {
        return Err(SynthesisError::sampled_only(SAMPLED_NONINTERACTING.keyword));
    };
    let inputs = paired_inputs(values);
    let references = references(values);
    let (tasks, outputs) = tasks(plant, values)?;
    let names: Vec<String> = outputs.iter().map(|output| output.name.clone()).collect();
    once(names.iter().map(String::as_str), "output")?;
    once(inputs.iter().map(String::as_str), "input")?;
    once(references.iter().map(|r| r.name.as_str()), "reference")?;
    let motor = |input: &String| plant.motor(plant.input(input)?);
    let limit = |input: &String| motor(input)?.torque_limit.as_ref().map(|limit| limit.to_f64());
    let rate = |input: &String| motor(input)?.rate_limit.as_ref().map(|rate| rate.to_f64());
    let lag = |input: &String| motor(input).and_then(|motor| motor.lag.as_ref()).map_or(0.0, |lag| lag.to_f64());
    let lags: Vec<f64> = inputs.iter().map(lag).collect();
    let effort = values.number_or_default("effort");
    let changes: Vec<f64> = channels(values)
        .zip(&inputs)
        .map(|(channel, input)| {
            let otherwise = limit(input).map_or(RATE, |limit| RATE_OVER_LIMIT * limit);
            effort * channel.number("torque_rate").unwrap_or(otherwise) * clock.period
        })
        .collect();
    let bound = |input: &String| Bounds {
        torque: plant.torque_reserve(input),
        change: rate(input).map(|rate| rate * clock.period),
    };
    let bounds: Vec<Bounds<f64>> = inputs.iter().map(bound).collect();
    let spec = DesignSpec {
        inputs: &inputs,
        tasks: &tasks,
        outputs: &outputs,
        lags: &lags,
        changes: &changes,
        bounds: &bounds,
        clock,
    };
    let follows = follows(request)?;
    let straight = designed(request, &spec, matches!(follows, Follows::Turns { .. }))?;
    let kinematics = Kinematics::at_rest(&plant.reduced, &vec![0.0; plant.reduced.degrees_of_freedom()]);
    let read = |one: &Reading| one.read(&kinematics.angles, &kinematics.speeds);
    let offsets: Vec<f64> = straight.observed.readings.iter().map(read).collect();
    let schedule = match &follows {
        Follows::Turns { coordinate, count } => {
            Some(schedule(request, &spec, &straight, *coordinate, *count, &offsets)?)
        }
        _ => None,
    };
    let mut design = describe(request, &straight, schedule.as_ref(), &inputs, &names, &references);
    if let Follows::Cannot(reason) = &follows {
        design.notes.push(format!(
            "the law is designed straight ahead and does not follow the position of its joints: {reason}"
        ));
    }
    let Designed { observed, data, .. } = straight;
    let zeros =
        observed.sensors.iter().zip(&offsets).map(|(sensor, x)| DataNumber::new(format!("{} offset", sensor.name), *x));
    design.controller_data.numbers.extend(zeros.chain([DataNumber::new("delay", clock.delay)]));
    let states = state_names(&observed, &spec, &references);
    Ok(Arc::new(Sampled {
        clock,
        inputs,
        references,
        positions: tasks.iter().zip(&outputs).map(|(task, output)| position(task, output, plant)).collect(),
        kinematics,
        schedule,
        sensors: if observed.full { Vec::new() } else { observed.sensors },
        readings: observed.readings,
        offsets,
        coordinates: plant.reduced.coordinates.clone(),
        shafts: plant.coordinates().len(),
        states,
        data,
        design,
    }))
}

/// Names of the states: estimates, delayed commands, reference models, and values of the last sample.
fn state_names(observed: &Observer, spec: &DesignSpec<'_>, references: &[Reference]) -> Vec<String> {
    let DesignSpec { inputs, lags, clock, .. } = spec;
    let mut states: Vec<String> = observed.states.iter().map(|state| format!("estimate of {state}")).collect();
    states.extend(inputs.iter().zip(*lags).filter(|(_, lag)| **lag > 0.0).map(|(i, _)| format!("estimate of {i}.tau")));
    states.extend(observed.disturbances.iter().map(|shaft| format!("estimate of {shaft}.disturbance")));
    let past = on_their_way(*clock).max(1);
    states.extend((1..=past).flat_map(|k| inputs.iter().map(move |input| format!("{input} {k} samples before"))));
    states.extend(
        references.iter().flat_map(|r| [format!("model of {}", r.name), format!("rate of the model of {}", r.name)]),
    );
    states.extend(observed.sensors.iter().map(|sensor| format!("last {}", sensor.name)));
    states.extend(references.iter().map(|r| format!("governed {}", r.name)));
    states.extend(inputs.iter().map(|input| format!("command of {input}")));
    states
}

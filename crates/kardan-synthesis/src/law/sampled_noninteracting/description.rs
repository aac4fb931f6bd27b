//! The design as a result: channels, gains, notes, and the numbers of the block for a file.

use crate::observed::sensor_table;
use crate::sampled::{PERIOD, ScheduleData, Target, on_their_way};
use crate::{Reference, Request, rounded};
use kardan_math::num::Matrix;
use kardan_results::signal_name::{Quantity, SignalName};
use kardan_results::{ChannelResult, ControllerData, DataMatrix, DataNumber, Design, Physical, Pole, ReadSignal};
use kardan_schema::schema::LawKeys;

use super::keys::SampledNoninteracting;
use super::position_design::Designed;

/// The numbers of the block for a file.
fn controller_data(
    straight: &Designed,
    schedule: Option<&ScheduleData>,
    inputs: &[String],
    references: &[Reference],
) -> ControllerData {
    let Designed { problem, observed, data, .. } = straight;
    let clock = problem.clock;
    let sensors =
        observed.sensors.iter().map(|sensor| ReadSignal::new(&sensor.name, SignalName::new(&sensor.name).unit()));
    let reads = sensors.chain(references.iter().map(|r| ReadSignal::new(&r.name, r.physical.unit())));
    let named = |(name, matrix): (&str, &Matrix<f64>)| (name.to_string(), matrix.to_rows());
    let models = [("model", &data.model), ("model_input", &data.model_input)];
    let mut matrices: Vec<(String, Vec<Vec<f64>>)> = match schedule {
        Some(schedule) => {
            let shape = |(name, rows, columns): (&str, usize, usize)| {
                (format!("shape of {name}"), vec![vec![rows as f64, columns as f64]])
            };
            let entries = schedule.entries.iter().map(|(shaft, x)| vec![*shaft as f64, *x]).collect();
            let own = [
                ("schedule".to_string(), schedule.rows()),
                ("sensors".into(), sensor_table(&schedule.sensors)),
                ("sensor_entries".into(), entries),
            ];
            let of_points = own.into_iter().chain(schedule.layout().into_iter().map(shape));
            models.map(named).into_iter().chain(of_points).chain(schedule.mechanism.tables(|x| x)).collect()
        }
        None => {
            let [model, model_input] = models;
            let [prediction, input, output] =
                [("prediction", &data.prediction), ("input", &data.input), ("output", &data.output)];
            let (correction, feedback) = (("correction", &data.correction), ("feedback", &data.feedback));
            [prediction, input, output, correction, model, model_input, feedback].map(named).to_vec()
        }
    };
    if let Some(governor) = &data.governor {
        if schedule.is_none() {
            matrices.push(("governor".into(), governor.prediction.to_rows()));
        }
        matrices.push(("governor_bounds".into(), governor.bounds.iter().map(|x| vec![*x]).collect()));
    }
    let mut numbers = Vec::new();
    for (input, bounds) in inputs.iter().zip(&data.bounds) {
        numbers.extend(bounds.torque.map(|torque| DataNumber::new(format!("{input} torque_limit"), torque)));
        numbers.extend(bounds.change.map(|change| DataNumber::new(format!("{input} change_limit"), change)));
    }
    if let Some(schedule) = schedule {
        numbers.push(DataNumber::new("shafts", schedule.mechanism.shafts.len() as f64));
        numbers.push(DataNumber::new("schedule_coordinate", schedule.coordinate as f64));
        numbers.push(DataNumber::new("schedule_period", PERIOD));
    }
    ControllerData {
        block: if schedule.is_some() { "ScheduledRegulator" } else { "Regulator" }.into(),
        reads: reads.collect(),
        writes: inputs.to_vec(),
        sample_time: Some(clock.period),
        single: clock.single,
        matrices: matrices.into_iter().map(|(name, rows)| DataMatrix::new(name, rows)).collect(),
        numbers,
    }
}

/// Notes on the design.
fn notes(
    request: &Request<'_>,
    straight: &Designed,
    schedule: Option<&ScheduleData>,
    outputs: &[String],
) -> Vec<String> {
    let Designed { problem, solution, observed, .. } = straight;
    let clock = problem.clock;
    let mut notes = vec![format!(
        "designed for a sample time of {} s and a delay of {} s; the relative residual of the \
         Riccati equation of the feedback is {:.1e}",
        clock.period, clock.delay, solution.regulator.residual
    )];
    for (output, target) in outputs.iter().zip(&problem.targets) {
        notes.push(format!("reference model of {output}: critically damped, {} rad/s", target.bandwidth));
    }
    if let Some(schedule) = schedule {
        let coordinate = &request.plant.linear.coordinates[schedule.coordinate];
        notes.push(format!(
            "its numbers follow the estimated {coordinate}.phi through {} positions over half a turn, linear between \
             them (the feedback then differs from a design there by about {:.1e} of the motor's largest gain); \
             readings and velocity-dependent forces are those at the actual joint position",
            schedule.points.len(),
            schedule.interpolation_error()
        ));
        notes.push(format!(
            "the listed gains, observer, sampled loop, margins and tolerances are those at {coordinate}.phi = 0; \
             kardan evaluates the loop at other positions one by one, each at rest there, which is no proof for a \
             rotating column"
        ));
    }
    if observed.result.is_none() {
        notes.push(
            "without an observer all angles and speeds are taken as measured, and no disturbance is known".into(),
        );
    }
    notes
}

pub(super) fn describe(
    request: &Request<'_>,
    straight: &Designed,
    schedule: Option<&ScheduleData>,
    inputs: &[String],
    outputs: &[String],
    references: &[Reference],
) -> Design {
    let Designed { problem, observed, data, definitions, .. } = straight;
    let clock = problem.clock;
    let past: Vec<String> = (1..=on_their_way(clock).max(1))
        .flat_map(|k| inputs.iter().map(move |input| format!("{input} {k} before")))
        .collect();
    let lagged: Vec<String> = inputs
        .iter()
        .zip(&problem.lags)
        .filter(|(_, lag)| **lag > 0.0)
        .map(|(i, _)| request.plant.effort_of(i).signal)
        .collect();
    let disturbed: Vec<String> = observed.disturbances.iter().map(|shaft| Quantity::Disturbance.of(shaft)).collect();
    let reference_names: Vec<String> = references.iter().map(|r| r.name.clone()).collect();
    let models: Vec<String> =
        reference_names.iter().flat_map(|name| [format!("{name} model"), format!("{name} model rate")]).collect();
    let columns: Vec<String> =
        [observed.states.clone(), lagged, disturbed, past, models, reference_names.clone()].concat();
    let controller_data = controller_data(straight, schedule, inputs, references);
    let notes = notes(request, straight, schedule, outputs);
    let channel = |(k, (output, target)): (usize, (&String, &Target))| {
        let w = target.bandwidth;
        ChannelResult {
            output: output.clone(),
            reference: reference_names[k].clone(),
            kind: match references[k].physical {
                Physical::Angle | Physical::Position => "position",
                Physical::Speed | Physical::Velocity => "speed",
                Physical::Force => "force",
                _ => "torque",
            }
            .into(),
            transfer: format!("ideally {}/(s^2 + {} s + {})", w * w, 2.0 * w, w * w),
            poles: vec![Pole::new(-w, 0.0); 2],
        }
    };
    Design {
        controller: request.name.into(),
        channels: outputs.iter().zip(&problem.targets).enumerate().map(channel).collect(),
        law: SampledNoninteracting::KEYWORD.into(),
        design_model: match schedule {
            Some(schedule) => format!(
                "linear, at {} positions of {}.phi, sampled at {} s",
                schedule.points.len(),
                request.plant.linear.coordinates[schedule.coordinate],
                clock.period
            ),
            None => format!("{}, sampled at {} s", request.plant.linear_where(), clock.period),
        },
        states: observed.states.clone(),
        inputs: inputs.to_vec(),
        outputs: outputs.to_vec(),
        definitions: definitions.clone(),
        gains: vec![rounded(
            ("K", "gain K of u = -K [estimate; reference model; references]", ""),
            inputs,
            &columns,
            &data.feedback,
        )],
        observer: observed.result.clone(),
        controller_data,
        notes,
        ..Design::default()
    }
}

//! What each channel controls: an angle, a speed or a torque, with the output that shows it.

use kardan_rt::Bounds;

use crate::outputs::channels;
use crate::{Clock, Plant, SynthesisError};
use kardan_analysis::OutputSignal;
use kardan_mechanics::equations::Measured;
use kardan_schema::schema::Values;

/// The controlled quantity of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Task {
    Position,
    Speed,
    /// A torque along a shaft, in addition to external torques there.
    Torque(usize),
    /// The net torque on a shaft's own inertia.
    NetTorque(usize),
    /// The reading of a torque sensor.
    Sensor,
}

/// The specification of the law, at any position of the joints.
pub(super) struct DesignSpec<'a> {
    pub(super) inputs: &'a [String],
    pub(super) tasks: &'a [Task],
    pub(super) outputs: &'a [OutputSignal],
    pub(super) lags: &'a [f64],
    pub(super) changes: &'a [f64],
    pub(super) bounds: &'a [Bounds<f64>],
    pub(super) clock: Clock,
}

/// The shaft whose angle follows a reference.
pub(super) fn position(task: &Task, output: &OutputSignal, plant: &Plant) -> Option<usize> {
    match (task, &output.measured) {
        (Task::Position, Measured::Angle(shaft)) => plant.reduced.coordinate(shaft),
        _ => None,
    }
}

/// The controlled quantity of each channel, with the output that shows it: for a torque along a shaft its speed.
pub(super) fn tasks(plant: &Plant, values: &Values) -> Result<(Vec<Task>, Vec<OutputSignal>), SynthesisError> {
    let (mut tasks, mut outputs) = (Vec::new(), Vec::new());
    for channel in channels(values) {
        let output = plant.output(channel.word_or_default("output"))?;
        let torque = channel.word("kind") == Some("torque");
        let (task, output) = match &output.measured {
            Measured::Angle(shaft) if torque => {
                let number = plant.reduced.coordinate(shaft).expect("an output names a shaft");
                plant.check_accelerates(number, &output.name)?;
                (Task::Torque(number), OutputSignal { measured: Measured::Speed(shaft.clone()), ..output })
            }
            Measured::Angle(_) => (Task::Position, output),
            Measured::Speed(_) => (Task::Speed, output),
            Measured::NetTorque(shaft) => {
                let number = plant.reduced.coordinate(shaft).expect("a sensor names a shaft");
                (Task::NetTorque(number), OutputSignal { measured: Measured::Speed(shaft.clone()), ..output })
            }
            _ => (Task::Sensor, output),
        };
        let (idle, kind): (&[&'static str], _) = match task {
            Task::Position => (&["acceptable_speed", "acceptable_torque", "coasting_time"], "an angle"),
            Task::Speed => (&["acceptable_angle", "acceptable_torque", "coasting_time", "kind"], "a speed"),
            Task::Torque(_) => (&["acceptable_angle", "acceptable_speed"], "a torque"),
            Task::NetTorque(_) => (&["acceptable_angle", "acceptable_speed", "kind"], "a net torque"),
            Task::Sensor => {
                (&["acceptable_angle", "acceptable_speed", "coasting_time", "kind"], "the torque of a sensor")
            }
        };
        if let Some(key) = idle.iter().copied().find(|key| channel.has(key)) {
            let name = &output.name;
            return Err(SynthesisError::at(
                format!("the channel of `{name}` controls {kind}, so that `{key}` has no meaning for it"),
                name,
                "this channel",
                format!("remove `{key}`"),
            ));
        }
        tasks.push(task);
        outputs.push(output);
    }
    Ok((tasks, outputs))
}

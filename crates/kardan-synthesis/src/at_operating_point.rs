//! A law around an operating point: it is designed for deviations, reads deviations, and its commands are added to the equilibrium torques.

use std::sync::Arc;

use super::{Block, Clock, ExactLoop, Frozen, Law, LinearLaw, Observation, Plant, Reference, SynthesisError};
use kardan_analysis::OutputSignal;
use kardan_results::signal_name::{SignalName, carrier};
use kardan_results::{DataNumber, Design};
use kardan_schema::schema::Values;

/// The values of angles, readings, references and torques at an operating point.
#[derive(Debug, Clone, PartialEq, Default)]
struct Rest {
    /// Of all shafts, less those at zero coordinates, rad.
    angles: Vec<f64>,
    /// Of all shafts: currents that flow.
    speeds: Vec<f64>,
    readings: Vec<f64>,
    references: Vec<f64>,
    /// Of the law's inputs, N m.
    torques: Vec<f64>,
}

/// A law whose state is measured from an operating point.
struct AtOperatingPoint {
    law: Arc<dyn Law>,
    rest: Rest,
    /// Names of all shafts.
    shafts: Vec<String>,
}

impl AtOperatingPoint {
    /// Value at the operating point of a signal that the law reads, if it is not zero.
    fn rest_value(&self, signal: &str) -> Option<f64> {
        let angle = || {
            let name = SignalName::new(signal).angle_of()?;
            Some(self.rest.angles[self.shafts.iter().position(|shaft| shaft == name)?])
        };
        let speed = || {
            let name = Some(carrier(signal)).filter(|_| SignalName::new(signal).is_rate())?;
            Some(self.rest.speeds[self.shafts.iter().position(|shaft| shaft == name)?])
        };
        let reference = || Some(self.rest.references[self.law.references().iter().position(|r| r.name == signal)?]);
        let reading = || Some(self.rest.readings[self.law.sensors().iter().position(|s| s.name == signal)?]);
        reference().or_else(reading).or_else(angle).or_else(speed).filter(|rest| *rest != 0.0)
    }
}

/// The law around the operating point of its plant; as it is where that is zero without torques, and where it knows the full model.
///
/// # Errors
/// If it is not known what an output is there.
pub(super) fn at_operating_point(
    law: Arc<dyn Law>,
    values: &Values,
    plant: &Plant,
) -> Result<Arc<dyn Law>, SynthesisError> {
    if !plant.is_moved() || law.on_full_model() {
        return Ok(law);
    }
    // A reference of the kind of its output follows that one; one of another kind, such as a torque along an angle, is zero at rest.
    let tables: Vec<&Values> =
        values.tables("channels").unwrap_or_default().iter().chain(std::iter::once(values)).collect();
    let output = |reference: &Reference| {
        let own = tables.iter().find(|table| table.word("reference") == Some(reference.name.as_str()));
        own.and_then(|table| table.word("output"))
    };
    let followed = |reference: &Reference| {
        let Some(output) = output(reference) else { return Ok(0.0) };
        let unit = plant.unit_of(output);
        if unit != reference.physical.unit() {
            return Ok(0.0);
        }
        let measured = plant.output(output)?.measured;
        plant.at_rest(&measured).ok_or_else(|| SynthesisError::not_at_rest(output))
    };
    let read = |sensor: &OutputSignal| {
        plant.at_rest(&sensor.measured).ok_or_else(|| SynthesisError::not_at_rest(&sensor.name))
    };
    let rest = Rest {
        angles: plant.angles_at_rest(),
        speeds: plant.speeds_at_rest(),
        readings: law.sensors().iter().map(read).collect::<Result<_, _>>()?,
        references: law.references().iter().map(followed).collect::<Result<_, _>>()?,
        torques: law.inputs().iter().map(|input| plant.trim_torque(input)).collect(),
    };
    Ok(Arc::new(AtOperatingPoint { law, rest, shafts: plant.coordinates().to_vec() }))
}

/// A block that reads deviations.
struct DeviationBlock {
    block: Box<dyn Block>,
    rest: Rest,
    /// Its inputs: angles, readings, references, torques.
    deviations: Rest,
}

impl DeviationBlock {
    fn set_inputs(&mut self, observation: &Observation<'_>) {
        let less = |values: &[f64], rest: &[f64], out: &mut Vec<f64>| {
            out.clear();
            out.extend(values.iter().zip(rest).map(|(value, rest)| value - rest));
        };
        less(observation.angles, &self.rest.angles, &mut self.deviations.angles);
        less(observation.speeds, &self.rest.speeds, &mut self.deviations.speeds);
        less(observation.readings, &self.rest.readings, &mut self.deviations.readings);
        less(observation.references, &self.rest.references, &mut self.deviations.references);
    }
}

impl Block for DeviationBlock {
    fn command(&mut self, observation: Observation<'_>, out: &mut [f64]) -> bool {
        self.set_inputs(&observation);
        let Rest { angles, speeds, readings, references, .. } = &self.deviations;
        let found = self.block.command(Observation { angles, speeds, readings, references, ..observation }, out);
        out.iter_mut().zip(&self.rest.torques).for_each(|(torque, rest)| *torque += rest);
        found
    }

    fn states(&mut self, observation: Observation<'_>, torques: &[f64], out: &mut [f64]) -> bool {
        self.set_inputs(&observation);
        self.deviations.torques.clear();
        self.deviations.torques.extend(torques.iter().zip(&self.rest.torques).map(|(torque, rest)| torque - rest));
        let Rest { angles, speeds, readings, references, torques } = &self.deviations;
        self.block.states(Observation { angles, speeds, readings, references, ..observation }, torques, out)
    }

    forward_rest! { block }
}

impl Law for AtOperatingPoint {
    forward! {
        law;
        fn inputs(&self) -> &[String];
        fn references(&self) -> &[Reference];
        fn states(&self) -> Vec<String>;
        fn friction_width(&self) -> Option<f64>;
        fn linear(&self) -> LinearLaw;
        fn linear_sampled(&self, clock: Clock) -> Option<LinearLaw>;
        fn is_nonlinear(&self) -> bool;
        fn linear_at(&self, position: &[f64], clock: Option<Clock>) -> Option<LinearLaw>;
        fn sensors(&self) -> &[OutputSignal];
        fn clock(&self) -> Option<Clock>;
        fn keeps(&self) -> Frozen;
        fn exact(&self) -> Option<ExactLoop>;
    }

    fn references_at_rest(&self) -> Vec<f64> {
        self.rest.references.clone()
    }

    /// Angles, speeds and torques of motors are deviations there.
    fn estimates(&self) -> Vec<(String, usize)> {
        self.law.estimates().into_iter().filter(|(name, _)| name.ends_with(".disturbance")).collect()
    }

    fn start(&self, angles: &[f64], speeds: &[f64], out: &mut [f64]) {
        let angles: Vec<f64> = angles.iter().zip(&self.rest.angles).map(|(angle, rest)| angle - rest).collect();
        let speeds: Vec<f64> = speeds.iter().zip(&self.rest.speeds).map(|(speed, rest)| speed - rest).collect();
        self.law.start(&angles, &speeds, out);
    }

    fn block(&self, clock: Option<Clock>) -> Option<Box<dyn Block>> {
        let block = self.law.block(clock)?;
        Some(Box::new(DeviationBlock { block, rest: self.rest.clone(), deviations: self.rest.clone() }))
    }

    fn describe(&self) -> Design {
        let mut design = self.law.describe();
        let data = &mut design.controller_data;
        let (reads, writes) = (data.reads.iter().map(|read| read.signal.clone()), data.writes.clone());
        let numbers: Vec<DataNumber> = reads
            .filter_map(|signal| Some((self.rest_value(&signal)?, signal)))
            .chain(self.rest.torques.iter().copied().zip(writes))
            .map(|(rest, signal)| DataNumber::new(format!("{signal} at rest"), rest))
            .collect();
        data.numbers.extend(numbers);
        design.notes.push(
            "the block reads the deviations of its signals from the operating point, and its torques are added to the \
             equilibrium torques there: `<signal> at rest` among its numbers"
                .into(),
        );
        design
    }
}

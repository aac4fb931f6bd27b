//! A regulator of the runtime with its memory.

use kardan_rt::{Bounds, Gain, Governor, Health, Regulator, RegulatorState};

use super::{RegulatorData, ScheduleData, Scheduled, archive_health, entries};
use crate::observed::Reading;
use crate::{Block, Observation};
use kardan_math::num::{Float, StateArchive};

/// The block [`Regulator`] or [`kardan_rt::ScheduledRegulator`] with its memory. Of a law's states it is estimate, reference
/// model, last good readings, governed references and commands, one after the other.
#[derive(Debug, Clone)]
pub(crate) struct RegulatorBlock<T> {
    sizes: [usize; 5],
    numbers: Numbers<T>,
    model: Vec<T>,
    model_input: Vec<T>,
    bounds: Vec<Bounds<T>>,
    governor_bounds: Vec<T>,
    readings: Vec<Reading>,
    /// The readings of the sensors at zero coordinates.
    offsets: Vec<f64>,
    memory: Vec<T>,
    read: Vec<T>,
    references: Vec<T>,
    work: Vec<T>,
    health: Health,
}

#[derive(Debug, Clone)]
enum Numbers<T> {
    /// Those of [`RegulatorData::parts`].
    Fixed(Vec<Vec<T>>),
    Scheduled(Box<Scheduled<T>>),
}

impl<T: Float> RegulatorBlock<T> {
    pub fn new(data: &RegulatorData, schedule: Option<&ScheduleData>, readings: &[Reading], offsets: &[f64]) -> Self {
        let sizes = data.sizes();
        let [n, k, r, p, m] = sizes;
        let zeros = |count: usize| vec![T::ZERO; count];
        let bounds = |bounds: &Bounds<f64>| Bounds {
            torque: bounds.torque.map(T::from_f64),
            change: bounds.change.map(T::from_f64),
        };
        let numbers = match schedule {
            Some(schedule) => Numbers::Scheduled(Box::new(Scheduled::new(schedule))),
            None => Numbers::Fixed(data.parts().iter().map(entries).collect()),
        };
        let governor_bounds = data.governor.as_ref().map_or(Vec::new(), |governor| T::list(&governor.bounds));
        Self {
            sizes,
            numbers,
            model: entries(&data.model),
            model_input: entries(&data.model_input),
            bounds: data.bounds.iter().map(bounds).collect(),
            governor_bounds,
            readings: readings.to_vec(),
            offsets: offsets.to_vec(),
            memory: zeros(n + k + p + r + m),
            read: zeros(p),
            references: zeros(r),
            work: zeros(Regulator::<T>::work(n, k, r, p)),
            health: Health::default(),
        }
    }
}

impl<T: Float> Block for RegulatorBlock<T> {
    fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.numbers(&mut self.memory);
        archive_health(&mut self.health, archive);
    }

    fn command(&mut self, observation: Observation<'_>, out: &mut [f64]) -> bool {
        let [n, k, r, p, m] = self.sizes;
        for (number, reading) in self.readings.iter().enumerate() {
            let value = match observation.readings.get(number) {
                Some(value) => *value,
                None => reading.read(observation.angles, observation.speeds),
            };
            self.read[number] = T::from_f64(value - self.offsets[number]);
        }
        T::narrow(observation.references, &mut self.references);
        T::narrow(observation.states, &mut self.memory);
        let (estimate, rest) = self.memory.split_at_mut(n);
        let (model, rest) = rest.split_at_mut(k);
        let (readings, rest) = rest.split_at_mut(p);
        let (references, commands) = rest.split_at_mut(r);
        let memory = RegulatorState { estimate, model, readings, references, commands, work: &mut self.work };
        let gain = |matrix, columns: usize| Gain::new(matrix, columns.max(1));
        let (read, references, bounds) = (&self.read, &self.references, &self.bounds);
        let found = match &mut self.numbers {
            Numbers::Fixed(parts) => {
                let fit = || {
                    let [prediction, input, output, correction, feedback, _, _, governor @ ..] = &parts[..] else {
                        return None;
                    };
                    let governor = match governor {
                        [state, model, references] => Some(Governor {
                            on_state: gain(state, n)?,
                            on_model: gain(model, k)?,
                            on_references: gain(references, r)?,
                            bounds: &self.governor_bounds,
                        }),
                        _ => None,
                    };
                    Some(Regulator {
                        prediction: gain(prediction, n)?,
                        input: gain(input, m)?,
                        output: gain(output, n)?,
                        correction: gain(correction, p)?,
                        model: gain(&self.model, k)?,
                        model_input: gain(&self.model_input, r)?,
                        feedback: gain(feedback, n + k + r)?,
                        bounds,
                        governor,
                    })
                };
                fit().map(|block| block.step(read, references, memory))
            }
            Numbers::Scheduled(scheduled) => {
                let fixed = gain(&self.model, k).zip(gain(&self.model_input, r));
                fixed.and_then(|fixed| scheduled.step(fixed, bounds, &self.governor_bounds, (read, references), memory))
            }
        };
        let Some(health) = found else { unreachable!("matrices are made of whole rows by the design") };
        self.health = health;
        T::widen(&self.memory[n + k + p + r..], out);
        true
    }

    fn states(&mut self, _: Observation<'_>, _: &[f64], out: &mut [f64]) -> bool {
        T::widen(&self.memory, out);
        true
    }

    fn health(&self) -> Health {
        self.health
    }
}

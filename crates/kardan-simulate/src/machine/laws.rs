//! Laws in a run: their starts, their samples, and their inputs from the scenario.

use super::Machine;
use super::connected_law::{Computer, ConnectedLaw};
use crate::counts::{EncoderReading, FlippedReading};
use crate::drive::Drive;
use crate::sampled_runtime::SampledRuntime;

impl Machine {
    /// Whether the whole loop is linear between the breakpoints of the scenario, and no part of it ever changes its
    /// mode: no friction, no limit, no ripple, no law that is nonlinear or has a clock.
    pub fn is_linear(&self) -> bool {
        let linear = |connected: &ConnectedLaw| {
            let law = &connected.law;
            connected.sampled_runtime().is_none() && !law.is_nonlinear() && law.friction_width().is_none()
        };
        let is_free = |drive: &Drive| drive.limit.is_none() && drive.rate.is_none() && drive.ripple.is_none();
        self.dynamics.is_linear()
            && self.flow.is_none()
            && self.modes.is_empty()
            && self.timed.affine
            && self.laws.iter().all(linear)
            && self.drives.iter().all(|drive| drive.faults.is_empty() && is_free(drive))
    }

    /// The shortest time between two samples of a law, s; infinite without such laws.
    pub(crate) fn shortest_period(&self) -> f64 {
        let clocks = self.laws.iter().filter_map(|connected| connected.law.clock());
        clocks.map(|clock| clock.period).fold(f64::INFINITY, f64::min)
    }

    /// Sets a constant value of a source from a time on, in place of the scenario.
    pub(crate) fn take_over(&mut self, source: usize, from: f64, value: f64) {
        self.profiles[source].set_constant(from, value);
        self.timed.take_over(source);
    }

    /// Sets the state at the start of a run: the motion, then the states of the laws.
    pub(crate) fn start(&mut self, motion: &[f64], state: &mut [f64]) {
        state.fill(0.0);
        state[..motion.len()].copy_from_slice(motion);
        if let Some(flow) = &self.flow {
            let entries = &flow.task.states;
            state[flow.states.clone()].iter_mut().zip(entries).for_each(|(state, entry)| *state = entry.start);
        }
        self.update(state);
        let kinematics = &self.work.kinematics;
        for ConnectedLaw { law, computer, exported, states, .. } in &mut self.laws {
            match computer {
                Computer::SampledRuntime(sampled) => {
                    sampled.start(&**law, &kinematics.angles, &kinematics.speeds);
                    for (source, exported) in exported {
                        self.profiles[*source].set_constant(0.0, sampled.exported(*exported));
                    }
                }
                Computer::Linear(_) | Computer::Inlined(_) | Computer::Continuous(_) => {
                    law.start(&kinematics.angles, &kinematics.speeds, &mut state[states.clone()]);
                }
            }
        }
    }

    /// Records from now on the readings of counting sensors of sampled laws; flips some readings.
    pub(crate) fn note_counts(&mut self, flipped: &[FlippedReading]) {
        self.sampled_runtimes().fold(0, |first, sampled| sampled.note_counts(first, flipped));
    }

    /// Their readings.
    pub(crate) fn encoder_readings(&mut self) -> Vec<EncoderReading> {
        self.sampled_runtimes().flat_map(SampledRuntime::encoder_readings).collect()
    }

    /// The laws with a clock.
    pub(super) fn sampled_runtimes(&mut self) -> impl Iterator<Item = &mut SampledRuntime> {
        self.laws.iter_mut().filter_map(|connected| match &mut connected.computer {
            Computer::SampledRuntime(sampled) => Some(&mut **sampled),
            Computer::Linear(_) | Computer::Inlined(_) | Computer::Continuous(_) => None,
        })
    }

    /// The next instant at which a sampled law reads, computes or changes its torques, s; infinite if there is none.
    pub(crate) fn next_tick(&self) -> f64 {
        let clocks = self.laws.iter().filter_map(ConnectedLaw::sampled_runtime);
        clocks.map(SampledRuntime::next_time).fold(f64::INFINITY, f64::min)
    }

    /// Notes on the sampled laws, as sentences.
    pub(crate) fn notes_of_laws(&self) -> Vec<String> {
        let notes = |connected: &ConnectedLaw| Some(connected.sampled_runtime()?.notes(&*connected.law));
        self.laws.iter().filter_map(notes).flatten().collect()
    }

    /// Executes the due actions of sampled laws at a time.
    pub(crate) fn tick(&mut self, time: f64, state: &[f64]) {
        let r = self.degrees_of_freedom;
        self.give_time(time, state);
        self.dynamics.update_shafts(&state[..r], &state[r..2 * r], &mut self.work);
        self.set_sources(time);
        self.timed.find_sources(&self.sources, time, state);
        for connected in &mut self.laws {
            let ConnectedLaw { law, computer, limits, outputs, exported, .. } = connected;
            let Computer::SampledRuntime(sampled) = computer else { continue };
            for (value, &source) in connected.reference_values.iter_mut().zip(&connected.references) {
                *value = self.timed.values[source];
            }
            sampled.advance(time, &**law, &connected.reference_values, (&self.dynamics, &self.work), limits);
            if outputs.is_empty() && exported.is_empty() {
                continue;
            }
            let outputs = outputs.iter().copied().zip(sampled.zoh_output.iter().copied());
            let exported = exported.iter().map(|(source, exported)| (*source, sampled.exported(*exported)));
            for (source, value) in outputs.chain(exported) {
                self.lines[source] = (value, 0.0, time);
                self.profiles[source].set_constant(time, value);
                self.sources[source] = value + 0.0;
                self.timed.output(source, value);
            }
            self.timed.find_sources(&self.sources, time, state);
        }
    }
}

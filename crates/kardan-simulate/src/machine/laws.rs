//! Laws in a run: their starts, their samples, and their inputs from the scenario.

use super::Machine;
use super::connected_law::{Computer, ConnectedLaw};
use crate::counts::{EncoderReading, FlippedReading};
use crate::sampled_runtime::SampledRuntime;
use crate::scenario::Profile;
use kardan_expr::expr::Part;

impl Machine {
    /// Whether the whole loop is linear between the breakpoints of the scenario, and no part of it ever changes its
    /// mode: no friction, no limit, no ripple, no law that is nonlinear or has a clock.
    pub fn is_linear(&self) -> bool {
        let linear = |connected_law: &ConnectedLaw| {
            connected_law.sampled_runtime().is_none()
                && !connected_law.law.is_nonlinear()
                && connected_law.law.friction_width().is_none()
        };
        self.dynamics.is_linear()
            && self.flow.is_none()
            && self.modes.is_empty()
            && self.timed.affine
            && self.drives.iter().all(|drive| drive.faults.is_empty())
            && self.laws.iter().all(linear)
            && self.drives.iter().all(|drive| drive.limit.is_none() && drive.rate.is_none() && drive.ripple.is_none())
    }

    /// The shortest time between two samples of a law, s; infinite without such laws.
    pub(crate) fn shortest_period(&self) -> f64 {
        let clocks = self.laws.iter().filter_map(|connected_law| connected_law.law.clock());
        clocks.map(|clock| clock.period).fold(f64::INFINITY, f64::min)
    }

    /// Sets a constant value of a source from a time on, in place of the scenario.
    pub(crate) fn take_over(&mut self, source: usize, from: f64, value: f64) {
        self.profiles[source].set_constant(from, value);
        self.timed.take_over(source);
    }

    /// The profile of a source.
    pub(crate) fn profile(&self, source: usize) -> &Profile {
        &self.profiles[source]
    }

    /// The first breakpoint of a function of time after a time, s; infinite if there is none.
    pub(crate) fn next_timed(&self, time: f64) -> f64 {
        self.timed.next(time)
    }

    /// Breakpoints of functions of time up to a time.
    pub(crate) fn timed_breakpoints(&self, until: f64) -> usize {
        self.timed.breakpoints(until)
    }

    /// Parts of functions of time that have a jump or kink at a time, where a run reports that.
    pub(crate) fn reported_at(&self, time: f64) -> impl Iterator<Item = &Part> {
        self.timed.reported(time)
    }

    /// The time-dependent inputs, at a time of the segment.
    pub(crate) fn timed_at(&mut self, time: f64) -> &[f64] {
        self.timed.at(time)
    }

    /// Sets the states of the laws at the start of a run.
    pub(crate) fn start_laws(&mut self, state: &mut [f64]) {
        if let Some(flow) = &self.flow {
            let entries = &flow.task.states;
            state[flow.states.clone()].iter_mut().zip(entries).for_each(|(state, entry)| *state = entry.start);
        }
        self.update(state);
        let kinematics = &self.work.kinematics;
        for connected_law in &mut self.laws {
            match &mut connected_law.computer {
                Computer::SampledRuntime(sampled_runtime) => {
                    sampled_runtime.start(&*connected_law.law, &kinematics.angles, &kinematics.speeds);
                    for (source, exported) in &connected_law.exported {
                        self.profiles[*source].set_constant(0.0, sampled_runtime.exported(*exported));
                    }
                }
                Computer::Linear(_) | Computer::Inlined(_) | Computer::Continuous(_) => connected_law.law.start(
                    &kinematics.angles,
                    &kinematics.speeds,
                    &mut state[connected_law.states.clone()],
                ),
            }
        }
    }

    /// Records from now on the readings of counting sensors of sampled laws; flips some readings.
    pub(crate) fn note_counts(&mut self, flipped: &[FlippedReading]) {
        self.laws
            .iter_mut()
            .filter_map(ConnectedLaw::sampled_runtime_mut)
            .fold(0, |first, sampled_runtime| sampled_runtime.note_counts(first, flipped));
    }

    /// Their readings.
    pub(crate) fn encoder_readings(&mut self) -> Vec<EncoderReading> {
        self.laws
            .iter_mut()
            .filter_map(ConnectedLaw::sampled_runtime_mut)
            .flat_map(SampledRuntime::encoder_readings)
            .collect()
    }

    /// The next instant at which a sampled law reads, computes or changes its torques, s; infinite if there is none.
    pub(crate) fn next_tick(&self) -> f64 {
        let clocks = self.laws.iter().filter_map(ConnectedLaw::sampled_runtime);
        clocks.map(SampledRuntime::next_time).fold(f64::INFINITY, f64::min)
    }

    /// Notes on the sampled laws, as sentences.
    pub(crate) fn notes_of_laws(&self) -> Vec<String> {
        let sampled =
            self.laws.iter().filter_map(|connected_law| Some((connected_law, connected_law.sampled_runtime()?)));
        sampled.flat_map(|(connected_law, sampled_runtime)| sampled_runtime.notes(&*connected_law.law)).collect()
    }

    /// Executes the due actions of sampled laws at a time.
    pub(crate) fn tick(&mut self, time: f64, state: &[f64]) {
        let r = self.degrees_of_freedom;
        self.give_time(time, state);
        self.dynamics.update_shafts(&state[..r], &state[r..2 * r], &mut self.work);
        self.set_sources(time);
        self.timed.find_sources(&self.sources, time, state);
        for connected_law in &mut self.laws {
            let Computer::SampledRuntime(sampled_runtime) = &mut connected_law.computer else { continue };
            for (value, &source) in connected_law.reference_values.iter_mut().zip(&connected_law.references) {
                *value = self.timed.values[source];
            }
            let model = (&self.dynamics, &self.work);
            sampled_runtime.advance(
                time,
                &*connected_law.law,
                &connected_law.reference_values,
                model,
                &connected_law.limits,
            );
            if connected_law.outputs.is_empty() && connected_law.exported.is_empty() {
                continue;
            }
            let outputs = connected_law.outputs.iter().copied().zip(sampled_runtime.zoh_output.iter().copied());
            let exported =
                connected_law.exported.iter().map(|(source, exported)| (*source, sampled_runtime.exported(*exported)));
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

//! External inputs of blocks: coordinates, sensors, references, disturbances, the time.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use super::{Blocks, Commands, Outside, Programs, unit_of};
use crate::document::{Document, Instance};
use crate::functions::Functions;
use crate::resolve::ControlSpec;
use crate::table_reader::TableReader;
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Domain, Measured, NamedTerm, Term};
use kardan_mechanics::program::Read;
use kardan_results::signal_name::SignalName;
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::schema::Resolved;

/// The dimension of a torque, or of a force on masses.
fn effort(masses: bool) -> Dimension {
    if masses { Dimension::TORQUE.translational() } else { Dimension::TORQUE }
}

impl Document {
    /// The outputs of the blocks of a model; program controllers get their commands.
    pub(crate) fn programs<'a, 'd>(
        &'a self,
        reader: &'a TableReader<'d>,
        functions: &mut Functions<'a, 'd>,
        (controls, idle): (&mut [ControlSpec], &[ControlSpec]),
        out: &mut Vec<Diagnostic>,
    ) -> Programs {
        let expressions = |name: &str| self.controls.get(name)?.table.map("commands");
        let laws: Vec<Commands<'a>> = controls
            .iter()
            .filter_map(|control| {
                let period = control.values.exact("sample_time").cloned();
                Some(Commands { control: control.name.clone(), period, expressions: expressions(&control.name)? })
            })
            .collect();
        let formulas = self.signals.iter().any(|signal| signal.formula.is_some());
        for control in laws.iter().filter_map(|law| self.controls.get(&law.control)) {
            for (k, reference) in control.table.tables("references").iter().enumerate() {
                let what = format!("entry {} of `references` of control `{}`", k + 1, control.name);
                unit_of(reference, &what, out);
            }
            if let Some(design) = control.table.values.get("design") {
                let message =
                    format!("`design` of control `{}` has no effect: kardan does not design a program", control.name);
                let diagnostic = Diagnostic::warning("control::design", message).at(&design.place, "not read");
                out.push(
                    diagnostic.help("remove it; kardan linearises a nonlinear program where all that it reads is zero"),
                );
            }
        }
        if self.blocks.is_empty() && laws.is_empty() && !formulas && self.signal_sensors().next().is_none() {
            return Programs::default();
        }
        let all: Vec<&ControlSpec> = controls.iter().chain(idle).collect();
        let outside = self.outside(reader, &all);
        let (programs, tasks) = Blocks::new((reader, self), functions, outside).tasks(&laws, out);
        for (name, task) in tasks {
            let own = controls.iter_mut().filter(|control| control.name == name);
            own.for_each(|control| control.values.insert("commands", Resolved::Task(Arc::clone(&task))));
        }
        functions.blocks = programs.outputs().map(|output| (output.name.clone(), output.dimension)).collect();
        functions.broken_blocks = programs.broken;
        programs
    }

    fn outside(&self, reader: &TableReader<'_>, controls: &[&ControlSpec]) -> Vec<Outside> {
        let mut out = vec![Outside { name: "t".into(), read: Read::Time, dimension: Dimension::TIME }];
        let mut add = |name: String, read: Read, dimension: Dimension| out.push(Outside { name, read, dimension });
        for [position, rate] in reader.all_motions() {
            let body = SignalName::new(&position).element.to_string();
            let [of_position, of_rate] = reader.domain_of(&body).dimensions();
            add(position, Read::Position(body.clone()), of_position);
            add(rate, Read::Rate(body), of_rate);
        }
        for sensor in self.elements.iter().filter(|element| element.kind.keyword == "sensor") {
            let Some((name, dimension)) = self.reading(sensor, reader) else { continue };
            let read = || Read::Sensor(sensor.name.clone());
            add(name, read(), dimension);
            add(sensor.name.clone(), read(), dimension);
        }
        for reference in controls.iter().flat_map(|control| control.law.all_references(&control.values)) {
            if !self.blocks.has(&reference.name) {
                add(reference.name.clone(), Read::Source(reference.name), reference.physical.dimension());
            }
        }
        for disturbance in self.elements.iter().filter(|element| element.kind.keyword == "disturbance") {
            let dimension = effort(disturbance.table.translational);
            add(disturbance.name.clone(), Read::Source(disturbance.name.clone()), dimension);
        }
        out.extend(self.law_signals(reader, controls));
        out
    }

    /// Outputs of sampled laws by name: estimates of their observers, `column.rk.disturbance`, `column.fs.w`, and their last commands,
    /// `column.wg_motor.command`.
    fn law_signals(&self, reader: &TableReader<'_>, controls: &[&ControlSpec]) -> Vec<Outside> {
        let sampled = |control: &&&ControlSpec| control.values.has("sample_time") && !self.blocks.has(&control.name);
        let mut out = Vec::new();
        for control in controls.iter().filter(sampled) {
            let mut add = |name: String, dimension: Dimension| {
                let name = format!("{}.{name}", control.name);
                out.push(Outside { read: Read::Source(name.clone()), name, dimension });
            };
            for input in (control.law.inputs)(&control.values) {
                if let Some(element) = self.elements.all(&input).find(|element| element.kind.keyword == "motor") {
                    add(format!("{input}.command"), effort(element.table.translational));
                }
            }
            if !control.values.has("observer") {
                continue;
            }
            for [position, rate] in reader.all_motions() {
                let body = SignalName::new(&position).element.to_string();
                let domain = reader.domain_of(&body);
                let [of_position, of_rate] = domain.dimensions();
                add(format!("{body}.disturbance"), effort(domain == Domain::Translation));
                add(position, of_position);
                add(rate, of_rate);
            }
        }
        out
    }

    /// Whether a sensor can be read at every instant: coordinates, rates, and the twist of a spring.
    pub fn reads_at_every_instant(&self, sensor: &str) -> bool {
        let Some(sensor) = self.elements.get(sensor) else { return false };
        let twists = |name: &str| {
            let found = self.elements.get(name);
            found.is_some_and(|element| element.kind.keyword == "spring_damper")
        };
        match sensor.table.word("measures") {
            Some("angle" | "speed") => true,
            Some("torque") => sensor.table.word("element").is_some_and(twists),
            _ => false,
        }
    }

    /// The name of the quantity that a sensor reads, and its dimension.
    fn reading(&self, sensor: &Instance, reader: &TableReader<'_>) -> Option<(String, Dimension)> {
        let domain = match (sensor.table.word("shaft"), sensor.table.word("element")) {
            (Some(body), _) => reader.domain_of(body),
            (None, Some(element)) => {
                let masses = self.elements.all(element).any(|one| one.table.translational);
                if masses { Domain::Translation } else { Domain::Rotation }
            }
            (None, None) => return None,
        };
        let ([position, rate], dimensions) = (domain.motion(), domain.dimensions());
        Some(match sensor.table.word("measures")? {
            "angle" => (position.of(&sensor.name), dimensions[0]),
            "speed" => (rate.of(&sensor.name), dimensions[1]),
            _ => (domain.effort().of(&sensor.name), effort(domain == Domain::Translation)),
        })
    }

    /// Rejects sensors whose readings depend on accelerations, which are unknown when blocks compute, and those of a gear with a
    /// stiffness at every instant.
    pub(crate) fn check_readings(
        &self,
        terms: &[NamedTerm],
        programs: &Programs,
        controls: &[ControlSpec],
        out: &mut Vec<Diagnostic>,
    ) {
        let of_laws = controls.iter().filter_map(|control| control.values.task("commands"));
        let reads = programs.tasks.iter().chain(of_laws).flat_map(|task| {
            let sensors = task.reads.iter().filter_map(|(_, read)| read.sensor());
            sensors.map(|name| (name, task.period.is_some()))
        });
        let mut reported: BTreeSet<&str> = BTreeSet::new();
        let outputs = terms.iter().rev().filter_map(|named| match &named.term {
            Term::Output(sensor) => Some((named.element.as_str(), &sensor.measured)),
            _ => None,
        });
        let outputs: HashMap<&str, &Measured> = outputs.collect();
        for (name, sampled) in reads {
            let measured = outputs.get(name).copied();
            let itself;
            let (message, help) = match measured {
                Some(Measured::ConstraintTorque(..) | Measured::NetTorque(_)) => (
                    format!(
                        "no block can read the sensor `{name}`: constraint torques and net torques depend on accelerations"
                    ),
                    "measure the twist of a spring_damper, or give the gear a stiffness",
                ),
                Some(Measured::ComplianceTorque(..)) if !sampled => (
                    format!(
                        "no continuous block can read the sensor `{name}`: its torque is that of a spring and a damper"
                    ),
                    "give the blocks that read it a `sample_time`",
                ),
                Some(Measured::Signal(signal)) if !sampled => {
                    itself = format!(
                        "give the blocks that read it a `sample_time`, or let them read the signal itself: `{signal}`"
                    );
                    let message = format!(
                        "no continuous block can read the sensor `{name}`: a sensor of a signal is read at samples"
                    );
                    (message, itself.as_str())
                }
                _ => continue,
            };
            let Some(sensor) = self.elements.get(name) else { continue };
            if !reported.insert(name) {
                continue;
            }
            out.push(Diagnostic::error("block::sensor", message).at(&sensor.place, "this sensor").help(help));
        }
    }
}

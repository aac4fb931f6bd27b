//! The model that laws are designed on.

use std::collections::{BTreeMap, BTreeSet};

use super::SynthesisError;
use super::matrix_parts::spread;
use super::sampled::ScheduleCache;
use kardan_analysis::{ConstrainedSystem, LinearSystem, OutputSignal, linear_system};
use kardan_expr::expr::Side;
use kardan_math::names::backquoted;
use kardan_math::num::{Matrix, Rational, Scalar};
use kardan_mechanics::assemble::{DirectionalTerm, SpringLaw};
use kardan_mechanics::equations::{InputKind, Measured, Motor};
use kardan_mechanics::reduce::{
    Dynamics, Kinematics, LinearModel, OperatingPoint, Reduced, law_slopes_at, laws_are_linear, linearise_at,
};
use kardan_results::ReadSignal;
use kardan_results::signal_name::{Quantity, SignalName, carrier};

/// The model that a law is designed on: the file's, with the design values of the controller, without Coulomb friction.
#[derive(Debug, Clone)]
pub struct Plant {
    /// In explicit form.
    pub reduced: Reduced,
    /// The operating point of the design, and its equilibrium torques.
    pub point: OperatingPoint,
    /// Description of that point, and what of it is proven, if there is a note.
    pub point_note: Option<String>,
    /// Why no torques balance it there, if that is so.
    pub no_equilibrium: Option<String>,
    /// Linear there.
    pub linear: LinearModel,
    /// The angles of all shafts there, rad, where the linear model freezes rotating rows at their values there: the inputs of a law are measured from them.
    pub frozen: Option<Vec<f64>>,
    /// Kind and name of each element, for messages.
    pub elements: Vec<(String, String)>,
    /// Initial values of signals, by name.
    pub signals: BTreeMap<String, f64>,
    /// The designs of a law that follows its joints at other positions.
    pub(super) schedule_cache: ScheduleCache,
}

impl Plant {
    /// The model at a position.
    ///
    /// # Panics
    /// If `position` has not one entry per coordinate or gives a slope that is not finite.
    pub fn new(reduced: Reduced, position: Vec<f64>) -> Self {
        Self::at(reduced, OperatingPoint::unloaded(&position))
    }

    /// The model at an operating point, under its equilibrium torques.
    ///
    /// # Panics
    /// As [`Self::new`].
    pub fn at(reduced: Reduced, point: OperatingPoint) -> Self {
        let linear = linearise_at(&reduced, &point);
        Self {
            reduced,
            point,
            point_note: None,
            no_equilibrium: None,
            linear,
            frozen: None,
            elements: Vec::new(),
            signals: BTreeMap::new(),
            schedule_cache: ScheduleCache::default(),
        }
    }

    /// The same, linearised on one side of the kinks of its torques.
    #[must_use]
    pub fn on_side(&self, side: &Side) -> Self {
        if law_slopes_at(&self.reduced, &self.point).iter().all(|slopes| slopes.kinks.is_empty()) {
            return self.clone();
        }
        let point = OperatingPoint { side: side.clone(), ..self.point.clone() };
        Self { linear: linearise_at(&self.reduced, &point), point, ..self.clone() }
    }

    /// Whether its law is one around an operating point other than zero, or with equilibrium torques.
    pub fn is_moved(&self) -> bool {
        self.point.torques.is_some() || self.frozen.iter().flatten().any(|angle| *angle != 0.0)
    }

    /// The default operating point of a design, as text.
    pub fn default_point(&self) -> &'static str {
        if self.frozen.is_some() { "the start of the run" } else { "zero angles" }
    }

    /// Where it is linear, as text.
    pub fn linear_where(&self) -> &'static str {
        if self.is_moved() { "linear, at the operating point" } else { "linear, at zero angles" }
    }

    /// The constant torque of an input at the operating point, N m.
    pub fn trim_torque(&self, input: &str) -> f64 {
        self.input(input).zip(self.point.torques.as_ref()).map_or(0.0, |(number, torques)| torques[number])
    }

    /// The number of an input.
    pub(super) fn input(&self, name: &str) -> Option<usize> {
        self.reduced.equations.inputs.iter().position(|input| input.element == name)
    }

    /// The margin between the torque at the operating point and the torque limit of an input's motor in each direction, N m; `None` if it has none.
    pub fn torque_reserve(&self, input: &str) -> Option<f64> {
        Some(self.torque_limit(self.input(input)?)? - self.trim_torque(input).abs())
    }

    /// The angles of all shafts at the operating point, rad; less those at zero coordinates where no rows are frozen.
    pub fn angles_at_rest(&self) -> Vec<f64> {
        if let Some(angles) = &self.frozen {
            return angles.clone();
        }
        let at = |position: &[f64]| Kinematics::at_rest(&self.reduced, position).angles;
        let before = at(&vec![0.0; self.reduced.degrees_of_freedom()]);
        at(&self.point.position).iter().zip(before).map(|(angle, before)| angle - before).collect()
    }

    /// The angles of all shafts at the operating point, rad.
    pub fn true_angles(&self) -> Vec<f64> {
        self.frozen.clone().unwrap_or_else(|| self.kinematics().angles)
    }

    /// Angles and speeds at the operating point.
    pub(super) fn kinematics(&self) -> Kinematics {
        Kinematics::at(&self.reduced, &self.point.position, &self.point.rates)
    }

    /// The speeds of all shafts at the operating point: currents that flow there.
    pub fn speeds_at_rest(&self) -> Vec<f64> {
        self.kinematics().speeds
    }

    /// The value of a reading at the operating point, less that at zero coordinates; `None` where it depends directly on torques.
    pub fn at_rest(&self, measured: &Measured) -> Option<f64> {
        let angles = self.angles_at_rest();
        match measured {
            Measured::Angle(shaft) => self.reduced.coordinate(shaft).map(|shaft| angles[shaft]),
            Measured::Speed(shaft) => self.reduced.coordinate(shaft).map(|shaft| self.speeds_at_rest()[shaft]),
            Measured::NetTorque(_) => Some(0.0),
            Measured::SpringTorque(element) => {
                let springs = self.reduced.equations.springs.iter().filter(|spring| spring.element == *element);
                let torque = |spring: &DirectionalTerm<SpringLaw>| {
                    let twist: f64 = spring.row_f64().iter().map(|(shaft, x)| x * angles[*shaft]).sum();
                    let rest = self.frozen.as_ref().map_or(0.0, |_| spring.value.rest.to_f64());
                    spring.value.stiffness.to_f64() * (twist - rest)
                };
                Some(springs.map(torque).sum())
            }
            Measured::ConstraintTorque(..) | Measured::ComplianceTorque(..) | Measured::Signal(_) => None,
        }
    }

    /// An element as text: ``the harmonic drive `hd` ``.
    pub fn element(&self, name: &str) -> String {
        match self.elements.iter().find(|(_, candidate)| candidate == name) {
            Some((kind, _)) => format!("the {} `{name}`", kind.replace('_', " ")),
            None => format!("`{name}`"),
        }
    }

    /// The names of angle and speed of each coordinate, of a mass those of position and speed, of a charge those of charge and current.
    pub fn motion_names(&self) -> Vec<[String; 2]> {
        let equations = &self.reduced.equations;
        let names = |(k, name): (usize, &String)| equations.domain(k).motion().map(|quantity| quantity.of(name));
        equations.coordinates.iter().enumerate().map(names).collect()
    }

    /// Names of all shafts, sorted.
    pub fn coordinates(&self) -> &[String] {
        &self.reduced.equations.coordinates
    }

    /// The time constant of each input's motor, s; zero for an ideal one.
    pub fn lags(&self) -> Vec<f64> {
        self.reduced.equations.lags()
    }

    /// The torque limit of an input's motor, N m; `None` if it has none.
    pub fn torque_limit(&self, input: usize) -> Option<f64> {
        self.motor(input)?.torque_limit.as_ref().map(|limit| limit.to_f64())
    }

    /// The motor of an input.
    pub(super) fn motor(&self, input: usize) -> Option<&Motor> {
        match &self.reduced.equations.inputs[input].value {
            InputKind::Motor(motor) => Some(motor),
            InputKind::Disturbance => None,
        }
    }

    /// Whether the equations of motion have constant coefficients.
    pub fn is_constant(&self) -> bool {
        Kinematics::new(&self.reduced).is_constant()
    }

    /// Whether the equations of motion are those of the linear model: constant coefficients, laws of torque that are linear, and no
    /// force at zero angles.
    pub fn is_linear(&self) -> bool {
        let forces = || {
            let (dynamics, mut work) = Dynamics::new(&self.reduced);
            let zero = vec![0.0; self.reduced.degrees_of_freedom()];
            dynamics.update(&zero, &zero, &mut work);
            work.passive
        };
        self.is_constant() && laws_are_linear(&self.reduced) && forces().iter().all(|force| *force == 0.0)
    }

    /// Elements whose torques are given by expressions.
    pub fn elements_with_laws(&self) -> Vec<String> {
        let mut elements: Vec<String> = self.reduced.equations.laws.iter().map(|law| law.element.clone()).collect();
        elements.dedup();
        elements
    }

    /// Names of `[q_r; q̇_r]`, of which [`Self::state_places`] are states.
    pub fn states(&self) -> Vec<String> {
        [0, 1].into_iter().flat_map(|rate| self.motions(rate)).map(|read| read.signal).collect()
    }

    /// The states as places among `[q_r; q̇_r]`: all but the rates of coordinates without inertia, which follow from states and inputs.
    pub fn state_places(&self) -> Vec<usize> {
        let r = self.reduced.degrees_of_freedom();
        (0..r).chain(self.linear.moving().into_iter().map(|k| r + k)).collect()
    }

    /// Rejects an output along a shaft that moves with coordinates without inertia, for a law that needs accelerations.
    pub(super) fn check_accelerates(&self, shaft: usize, output: &str) -> Result<(), SynthesisError> {
        match self.linear.accelerates(shaft) {
            true => Ok(()),
            false => Err(SynthesisError::at(
                format!("`{output}` moves without inertia, so it has no acceleration that a motor acts on"),
                output,
                "it has no acceleration",
                "take `lqr`, `pole_placement` or `decoupling`, or give it an inertia",
            )),
        }
    }

    /// Refuses coordinates without inertia, for the block of the full nonlinear model.
    pub(super) fn check_inertia(&self) -> Result<(), SynthesisError> {
        let moving = self.linear.moving();
        let names = self.linear.coordinates.iter().enumerate().filter(|(k, _)| !moving.contains(k));
        let coordinates: Vec<String> = names.map(|(_, name)| name.clone()).collect();
        if coordinates.is_empty() {
            return Ok(());
        }
        let names = backquoted(&coordinates);
        let message =
            format!("the block of the full nonlinear model uses accelerations only, and there are none for {names}");
        let help = "design on the linear model: `plant = \"linear\"`, or give them an inertia";
        Err(SynthesisError::of(message, &coordinates, "no inertia", help))
    }

    /// Names of the states.
    pub fn state_names(&self) -> Vec<String> {
        let all = self.states();
        self.state_places().into_iter().map(|k| all[k].clone()).collect()
    }

    /// Columns over the states as columns over `[q_r; q̇_r]`.
    pub(super) fn over_motions<S: Scalar>(&self, rows: &Matrix<S>) -> Matrix<S> {
        spread(rows, &self.state_places(), 2 * self.reduced.degrees_of_freedom())
    }

    /// Positions (`rate` 0) or rates (1) of the coordinates, with their units.
    pub fn motions(&self, rate: usize) -> Vec<ReadSignal> {
        let equations = &self.reduced.equations;
        let quantity = |k: usize| equations.domain(k).motion()[rate];
        let signal = |&k: &usize| ReadSignal::new(quantity(k).of(&equations.coordinates[k]), quantity(k).unit());
        self.reduced.coordinates.iter().map(signal).collect()
    }

    /// The torque of a motor, or its force or voltage, with its unit.
    pub fn effort_of(&self, input: &str) -> ReadSignal {
        let equations = &self.reduced.equations;
        let found = equations.inputs.iter().find(|candidate| candidate.element == input);
        let effort = found.map_or(Quantity::Torque, |found| equations.domain_of(found).effort());
        ReadSignal::new(effort.of(input), effort.unit())
    }

    /// The unit of an output: of a sensor, or of a coordinate's motion.
    pub fn unit_of(&self, output: &str) -> &'static str {
        let signal = SignalName::new(output);
        let sensor = self.reduced.equations.sensors.iter().find(|(sensor, _)| sensor == signal.element);
        match sensor {
            Some((_, sensor)) => self.reduced.equations.reading(&sensor.measured).unit(),
            None => signal.unit(),
        }
    }

    /// The linear model as terms along directions, with these inputs.
    ///
    /// # Panics
    /// If an input is not there.
    pub fn constrained(&self, inputs: &[String]) -> ConstrainedSystem {
        ConstrainedSystem::at_point(&self.reduced, &self.point, &BTreeSet::new(), inputs)
    }

    /// The linear model as `ẋ = A x + B u`, `y = C x + D u` with `x = [q_r; q̇_r]` without rates of coordinates that have no inertia, exact.
    ///
    /// # Panics
    /// If an input, or what an output names, does not exist, or the inertia is singular in more than coordinates that dampers determine (the model checks this
    /// before).
    pub fn system(&self, inputs: &[String], outputs: &[OutputSignal]) -> LinearSystem {
        self.explicit(&self.constrained(inputs), outputs)
    }

    fn explicit(&self, system: &ConstrainedSystem, outputs: &[OutputSignal]) -> LinearSystem {
        let pencil = linear_system(system, &self.reduced.coordinates, &self.linear.basis, outputs);
        let places = self.state_places();
        let pencil = LinearSystem { states: self.states(), ..pencil };
        let regular = if places.len() == pencil.states.len() { Some(pencil) } else { pencil.over(&places) };
        regular.and_then(|system| system.explicit()).expect("reduced inertia is positive definite")
    }
}

impl Plant {
    /// The output of a name: `rk.phi`, `rk.w`, or a sensor with or without the end of its reading.
    ///
    /// # Errors
    /// If the name of a sensor that measures no torque lacks the ending of its reading.
    ///
    /// # Panics
    /// If there is no such output (the model checks this before).
    pub fn output(&self, name: &str) -> Result<OutputSignal, SynthesisError> {
        let signal = SignalName::new(name);
        let head = signal.element;
        let equations = &self.reduced.equations;
        let moves = carrier(name);
        if self.reduced.coordinate(moves).is_some() {
            let measured = if signal.is_rate() { Measured::Speed(moves.into()) } else { Measured::Angle(moves.into()) };
            return Ok(OutputSignal { name: name.into(), measured });
        }
        let sensor = equations.sensors.iter().find(|(sensor, _)| sensor == head);
        let measured =
            sensor.map(|(_, sensor)| sensor.measured.clone()).unwrap_or_else(|| panic!("no output `{name}`"));
        let quantity = equations.reading(&measured);
        let full = quantity.of(head);
        if name == full || matches!(quantity, Quantity::Torque | Quantity::Force) && signal.word.is_none() {
            return Ok(OutputSignal { name: full, measured });
        }
        let message = format!("`{name}` measures no torque; write `{full}`");
        Err(SynthesisError::at(message, name, "which reading?", format!("write `{full}`")))
    }

    /// How torques on shafts act: `ẋ = … + W τ`, `y = … + F τ`, with W states × shafts and F outputs × shafts.
    ///
    /// # Panics
    /// As [`Self::system`].
    pub fn torques(&self, shafts: &[usize], outputs: &[OutputSignal]) -> (Matrix<Rational>, Matrix<Rational>) {
        let mut system = self.constrained(&[]);
        system.inputs = shafts
            .iter()
            .map(|&shaft| DirectionalTerm {
                element: self.coordinates()[shaft].clone(),
                row: vec![(shaft, Rational::ONE)],
                value: (),
            })
            .collect();
        let explicit = self.explicit(&system, outputs);
        (explicit.b, explicit.d)
    }

    /// The twists of the springs as rows over the states.
    pub fn twists(&self) -> Vec<Vec<Rational>> {
        let basis = &self.linear.basis;
        let (r, states) = (basis.columns(), self.state_places().len());
        let row = |spring: &DirectionalTerm<_>| -> Vec<Rational> {
            let twist_of = |j: usize| spring.row.iter().fold(Rational::ZERO, |sum, (k, x)| sum + x * &basis[(*k, j)]);
            (0..states).map(|j| if j < r { twist_of(j) } else { Rational::ZERO }).collect()
        };
        self.reduced.equations.springs.iter().map(row).filter(|row| row.iter().any(|x| !x.is_zero())).collect()
    }
}

/// The angle of a shaft as an output of the linear model.
pub(super) fn angle_output(signal: &str) -> OutputSignal {
    OutputSignal { name: signal.into(), measured: Measured::Angle(SignalName::new(signal).element.into()) }
}

/// The shaft number behind a signal `<shaft>.phi`.
pub(super) fn output_shaft(signal: &str, shafts: &[String]) -> Result<usize, SynthesisError> {
    let found = SignalName::new(signal).angle_of().and_then(|name| shafts.iter().position(|shaft| shaft == name));
    found.ok_or_else(|| {
        let example = Quantity::Angle.of(shafts.first().map_or("shaft", String::as_str));
        let message = format!("`{signal}` is not the angle of a shaft; a law controls an output such as `{example}`");
        SynthesisError::at(message, signal, "not an angle", format!("name the angle of a shaft, such as `{example}`"))
    })
}

/// `1/(c H⁻¹ cᵀ)`: the effective inertia of a torque along the output, kg m², exact.
///
/// For the flexspline of the steering system this is J̃_fs \[diss. (6.129)\].
///
/// # Panics
/// If the inertia matrix is singular or the direction has no motion (the model checks the first before).
pub fn effective_inertia(model: &LinearModel, shaft: usize) -> Rational {
    inertia_between(model, shaft, &model.direction(shaft).transpose())
        .expect("a shaft that can move feels its own torque")
}

/// `1/(c H⁻¹ f)`: torque of an input per acceleration of an output, kg m², exact; `None` if the input does not act on it.
///
/// The effective inertia where the input acts on the output's own shaft; through a gear, that over the ratio.
///
/// # Panics
/// If the inertia matrix is singular (the model checks this before).
pub fn input_inertia(model: &LinearModel, shaft: usize, input: usize) -> Option<Rational> {
    let f = Matrix::from_fn(model.inertia.rows(), 1, |i, _| model.input[(i, input)].clone());
    inertia_between(model, shaft, &f)
}

fn inertia_between(model: &LinearModel, shaft: usize, f: &Matrix<Rational>) -> Option<Rational> {
    let [_, mobility] = model.accelerations(&[shaft], f);
    let mobility = mobility[(0, 0)].clone();
    (!mobility.is_zero()).then(|| Rational::ONE / mobility)
}

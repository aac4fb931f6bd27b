//! The law `computed_torque`.

use std::sync::Arc;

use kardan_rt::{PositionLoop, Task};

use crate::channels::{
    CROSSOVER, DAMPING_RATIO, NATURAL_FREQUENCY, POLES, check_dynamics, compensation, once, reference,
};
use crate::decoupling::{decouple, relative_degrees};
use crate::exact::{decoupling_matrix, gain_matrices};
use crate::linear_law::{Linear, LinearBlock};
use crate::nonlinear_law::Nonlinear;
use crate::outputs::{channels, paired_channels, paired_inputs};
use crate::zeros::check_zeros;
use crate::{ExactLoop, Law, LawKind, Plant, Request, SynthesisError};
use kardan_analysis::OutputSignal;
use kardan_math::names::backquoted;
use kardan_math::num::{Polynomial, Scalar};
use kardan_math::units::Dimension;
use kardan_mechanics::equations::Measured;
use kardan_results::{Design, Feedback};
use kardan_schema::schema::Values;
use kardan_schema::schema::{Field, Keys, Kind, LawKeys, Sign, keys};

keys! {
    /// A channel of the law `computed_torque`.
    table ComputedTorqueChannel {
        required {
            output: Output, "The output: the angle of a shaft, `<shaft>.phi`, or a sensor of a constraint torque.";
            input: Element(&["motor"]), "The motor of this channel; any pairing gives the same law.";
            reference: Name, "Name of the reference signal, set by the scenario.";
        }
        optional {
            natural_frequency: Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive) as NATURAL_FREQUENCY;
            damping_ratio: Number(Sign::Positive) as DAMPING_RATIO;
            crossover_frequency: Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive) as CROSSOVER;
            poles: Poles as POLES;
        }
    }
}

law_keys! {
    /// Computed torque, full and partial, \[diss. (6.17), (6.20)-(6.27)\].
    law ComputedTorque("computed_torque") {
        required {
            channels: Tables(ComputedTorqueChannel), "One table for each output and its motor.";
        }
        optional {
            friction_width: Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive) as FRICTION_WIDTH;
        }
    }
}

/// Computed torque, full and partial, \[diss. (6.17), (6.20)-(6.27)\].
pub const COMPUTED_TORQUE: LawKind = LawKind {
    keyword: ComputedTorque::KEYWORD,
    summary: "Computed torque on the full nonlinear model: chosen shaft angles become double integrators of their own, \
              chosen constraint torques equal their references at once (partial computed torque).",
    fields: ComputedTorque::FIELDS,
    example: "\
[sensor.fs_torque]
measures = \"torque\"
element = \"hd\"
shaft = \"fs\"

[control.drive]
law = \"computed_torque\"

[[control.drive.channels]]
output = \"rk.phi\"
input = \"rk_motor\"
poles = [-20, -20]
reference = \"ref_rk\"

[[control.drive.channels]]
output = \"fs_torque\"
input = \"wg_motor\"
reference = \"ref_torque\"
",
    template: |inputs, outputs| {
        let channel = |output: &str, input: &str, reference| ComputedTorqueChannel::new(output, input, reference);
        Some(ComputedTorque::new(paired_channels(inputs, outputs, channel)?).entries())
    },
    inputs: paired_inputs,
    references: |values| channels(values).filter_map(reference).collect(),
    samples: false,
    design,
};

/// Coulomb friction fed forward.
pub(super) const FRICTION_WIDTH: Field = Field::optional(
    "friction_width",
    Kind::Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive),
    "Feeds the Coulomb friction of the model forward, c w/sqrt(w^2 + width^2) along each friction direction with the speed \
     w: full beyond a few widths, none at rest; left out: no friction is fed forward.",
);

fn design(request: &Request<'_>) -> Result<Arc<dyn Law>, SynthesisError> {
    let (plant, values) = (request.plant, request.values);
    let inputs = (COMPUTED_TORQUE.inputs)(values);
    let references = (COMPUTED_TORQUE.references)(values);
    let outputs: Vec<OutputSignal> =
        channels(values).map(|channel| plant.output(channel.word_or_default("output"))).collect::<Result<_, _>>()?;
    let names: Vec<String> = outputs.iter().map(|output| output.name.clone()).collect();
    once(names.iter().map(String::as_str), "output")?;
    once(inputs.iter().map(String::as_str), "input")?;
    once(references.iter().map(|r| r.name.as_str()), "reference")?;
    let (polynomials, tasks) = channel_tasks(values, plant, &outputs)?;
    plant.check_inertia()?;
    let system = plant.system(&inputs, &outputs);
    let relative = relative_degrees(&system);
    for (output, (degree, polynomial)) in names.iter().zip(relative.degrees.iter().zip(&polynomials)) {
        if *degree != Some(polynomial.degree()) {
            return Err(no_direct_input(output, &inputs, *degree));
        }
    }
    let (torques, direct) = plant.torques(request.disturbances, &outputs);
    let found = decouple(&system, &torques, Some(&direct), &polynomials)
        .map_err(|error| SynthesisError::not_static(&names, &error, &[]))?;
    check_zeros(&system, &names)?;
    let reference_names: Vec<String> = references.iter().map(|r| r.name.clone()).collect();
    let states = plant.states();
    let friction_width = values.number("friction_width");
    let mut notes = Vec::new();
    if !plant.is_constant() {
        notes.push(
            "the gains are those at the design point; the law evaluates the full nonlinear model at every step".into(),
        );
    }
    if let Some(width) = friction_width {
        notes.push(format!("Coulomb friction is fed forward, smoothed over {width} rad/s"));
    }
    let disturbed: Vec<String> = request.disturbances.iter().map(|&k| plant.coordinates()[k].clone()).collect();
    let columns: [&[String]; 3] = [&states, &reference_names, &disturbed];
    let design = Design {
        controller: request.name.into(),
        law: COMPUTED_TORQUE.keyword.into(),
        design_model: if plant.is_constant() { String::new() } else { "full nonlinear model".into() },
        gains: gain_matrices(&inputs, columns, [&found.k, &found.l, &found.m]),
        states,
        decoupling_matrix: decoupling_matrix(&names, &inputs, &relative),
        relative_degrees: relative.degrees,
        inputs,
        outputs: names,
        feedback: Some(Feedback::Static),
        notes,
        ..Design::default()
    };
    let block = LinearBlock::gains(&found.k.to_f64(), &found.l.to_f64(), &found.m.to_f64());
    let exact = ExactLoop::feedback(system.clone(), system, [&found.k, &found.l], &references);
    let reference_places = (0..references.len()).collect();
    let cuts = outputs.iter().filter_map(|output| match &output.measured {
        Measured::ConstraintTorque(element, shaft) => Some((element.as_str(), shaft.as_str())),
        _ => None,
    });
    let cuts: Vec<(&str, &str)> = cuts.collect();
    let linear = Linear::new(request, design, Some(exact), references, block);
    Ok(Arc::new(Nonlinear::new(request, Arc::new(linear), tasks, &cuts, reference_places, friction_width)?))
}

/// The motors do not act on the required acceleration or torque of an output of this relative degree.
fn no_direct_input(output: &str, inputs: &[String], degree: Option<usize>) -> SynthesisError {
    let otherwise = match degree {
        Some(degree) => format!(", but only on its derivative of order {degree}"),
        None => " nor in any other way".into(),
    };
    let message = format!("the motors {} do not act on `{output}` directly{otherwise}", backquoted(inputs));
    let help = "choose motors that act on it without a spring in between, or use `law = \"decoupling\"`";
    SynthesisError::at(message, output, "not reached directly", help)
}

/// For each channel the characteristic polynomial of its error and the task of its block.
fn channel_tasks(
    values: &Values,
    plant: &Plant,
    outputs: &[OutputSignal],
) -> Result<(Vec<Polynomial>, Vec<Task<f64>>), SynthesisError> {
    let (mut polynomials, mut tasks, mut cut) = (Vec::new(), Vec::new(), 0);
    for (channel, output) in channels(values).zip(outputs) {
        check_dynamics(channel, &output.name)?;
        let degree = match &output.measured {
            Measured::Angle(_) => 2,
            Measured::ConstraintTorque(..) => 0,
            _ => {
                let name = &output.name;
                return Err(SynthesisError::at(
                    format!(
                        "computed torque controls angles of shafts and constraint torques, and `{name}` is neither"
                    ),
                    name,
                    "neither angle nor constraint torque",
                    "name `<shaft>.phi` or a sensor of a constraint torque, or use `law = \"decoupling\"`",
                ));
            }
        };
        let has_dynamics =
            ["natural_frequency", "damping_ratio", "crossover_frequency", "poles"].iter().find(|k| channel.has(k));
        if let (0, Some(key)) = (degree, has_dynamics) {
            let name = &output.name;
            return Err(SynthesisError::at(
                format!("`{name}` follows the motors without delay, so `{key}` has no meaning for its channel"),
                name,
                "no dynamics",
                format!("remove `{key}`: the torque equals its reference at once"),
            ));
        }
        let polynomial = compensation(channel)
            .polynomial(degree)
            .map_err(|error| SynthesisError::compensation(&output.name, &error))?;
        tasks.push(match &output.measured {
            Measured::Angle(shaft) => Task::Position {
                shaft: plant.reduced.coordinate(shaft).expect("an output names a shaft"),
                position_loop: position_loop(&polynomial),
            },
            _ => {
                cut += 1;
                Task::ConstraintTorque { cut: cut - 1 }
            }
        });
        polynomials.push(polynomial);
    }
    Ok((polynomials, tasks))
}

/// The loop around a double integrator with that characteristic polynomial.
fn position_loop(polynomial: &Polynomial) -> PositionLoop<f64> {
    let coefficient = |k: usize| Scalar::to_f64(&polynomial.coefficient(k));
    let natural_frequency = coefficient(0).sqrt();
    PositionLoop { natural_frequency, damping_ratio: coefficient(1) / (2.0 * natural_frequency) }
}

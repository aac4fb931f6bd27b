//! The law `flatness`: trajectories by inversion of the model.

use std::ops::Range;
use std::sync::Arc;

use crate::channels::{CROSSOVER, DAMPING_RATIO, NATURAL_FREQUENCY};
use crate::inversion::{FlatnessError, flat_parametrisation, planner, reasons};
use crate::linear_law::{Linear, LinearBlock};
use crate::matrix_parts::{joined, side_by_side, stacked, window};
use crate::outputs::{
    AS_MANY_INPUTS, OUTPUT, REFERENCE, Task, channels_for, decaying_poles, exact, inputs, references,
};
use crate::regulator::{Weights, lqr, place_poles};
use crate::{ExactLoop, Law, LawKind, Request, SynthesisError, rounded};
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Rational};
use kardan_results::Design;
use kardan_schema::schema::{Keys, LawKeys, keys};

keys! {
    /// A channel of the law `flatness`.
    table FlatnessChannel {
        required {
            output: Output as OUTPUT;
            reference: Name as REFERENCE;
        }
        optional {
            natural_frequency: Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive) as NATURAL_FREQUENCY;
            damping_ratio: Number(Sign::Positive) as DAMPING_RATIO;
            crossover_frequency: Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive) as CROSSOVER;
        }
    }
}

law_keys! {
    /// Trajectories planned by inversion of the model, \[diss. Theorem 6.4\].
    law Flatness("flatness") {
        required {
            inputs: Elements(&["motor", "voltage_source"]) as AS_MANY_INPUTS;
            channels: Tables(FlatnessChannel),
                "One table for each output, as many as motors.";
        }
        optional {
            poles: Poles,
                "Poles of the feedback, as many as states; left out: feedback of least cost that weighs outputs of 0.1 \
                 rad (N m) and torques of 1 N m equally.";
        }
    }
}

/// Trajectories planned by inversion of the model, \[diss. Theorem 6.4\].
pub const FLATNESS: LawKind = LawKind {
    keyword: Flatness::KEYWORD,
    summary: "Trajectory planner by inversion: references pass smooth filters, states and torques follow from the outputs \
              and their derivatives (through a stable filter where the outputs are not flat), and feedback u = u_ref - \
              K (x - x_ref) keeps the plant on its trajectory.",
    fields: Flatness::FIELDS,
    example: "\
[control.column]
law = \"flatness\"
inputs = [\"wg_motor\", \"rk_motor\"]

[[control.column.channels]]
output = \"fs.phi\"
reference = \"ref_fs\"
crossover_frequency = \"30 rad/s\"

[[control.column.channels]]
output = \"cj.phi\"
reference = \"ref_cj\"
crossover_frequency = \"30 rad/s\"
",
    template: |inputs, outputs| {
        let channels = channels_for(outputs, |output, reference| FlatnessChannel::new(output, reference));
        Some(Flatness::new(inputs.to_vec(), channels).entries())
    },
    inputs,
    references,
    samples: false,
    design,
};

fn design(request: &Request<'_>) -> Result<Arc<dyn Law>, SynthesisError> {
    let mut task = Task::new(request)?;
    task.leave_counters(request.plant);
    let system = &task.system;
    let flat = flat_parametrisation(system).map_err(|error| match error {
        FlatnessError::Dependent(obstruction) => {
            let constrained = request.plant.constrained(&task.inputs);
            let reasons = reasons(&obstruction, &task.outputs, &constrained, &|name| format!("`{name}`"));
            SynthesisError::impossible(&task.names, &reasons)
        }
        FlatnessError::NotSquare { .. } => {
            SynthesisError::of(error.to_string(), &task.names, "these outputs", "name as many outputs as motors")
        }
    })?;
    let mut filters = Vec::new();
    for ((dynamics, output), degree) in task.dynamics.iter().zip(&task.names).zip(flat.derivatives()) {
        let filter = dynamics.polynomial(degree.max(1));
        filters.push(filter.map_err(|error| SynthesisError::compensation(output, &error))?);
    }
    let plan = planner(&flat, &filters).map_err(|error| {
        let message = format!("no trajectory can be planned: {error}");
        SynthesisError::of(message, &task.names, "not invertible", "choose other outputs")
    })?;
    let (k, how) = feedback(request, &task)?;
    let mut notes = vec![how];
    notes.push(if flat.is_flat() {
        "the outputs are flat: states and torques are functions of them and finitely many derivatives".into()
    } else {
        format!("the outputs are not flat: the planner contains the stable filter 1/({})", flat.z)
    });
    if !task.disturbed.is_empty() {
        notes.push("the planner does not feed estimated disturbances forward".into());
    }
    let k_exact = exact(&k).ok_or_else(SynthesisError::too_large)?;
    let block = block(&plan, &task, &k);
    let states = system.states.clone();
    let design = Design {
        controller: request.name.into(),
        law: FLATNESS.keyword.into(),
        gains: vec![rounded(("K", "gain K of u = u_ref - K (x - x_ref)", ""), &task.inputs, &states, &k)],
        states,
        inputs: task.inputs.clone(),
        outputs: task.names.clone(),
        notes,
        ..Design::default()
    };
    let exact = ExactLoop {
        plant: system.clone(),
        system: system.clone(),
        closed: closed(&task, &plan, &k_exact),
        units: task.references.iter().map(|r| r.physical.unit().to_string()).collect(),
        channels: (0..task.references.len()).collect(),
        behind: None,
        inverts: true,
        law: None,
    };
    Ok(Arc::new(Linear::new(request, design, Some(exact), task.references.clone(), block)))
}

/// K and how it was found.
fn feedback(request: &Request<'_>, task: &Task) -> Result<(Matrix<f64>, String), SynthesisError> {
    if request.values.has("poles") {
        let found = place_poles(&task.system, &decaying_poles(request.values)?)?;
        return Ok((found.gain, format!("the poles of the feedback are met with the residual {:.1e}", found.residual)));
    }
    let c = task.system.c.to_f64();
    let (n, m) = (c.columns(), task.inputs.len());
    let square = |i: usize, j: usize| 100.0 * (0..c.rows()).map(|k| c[(k, i)] * c[(k, j)]).sum::<f64>();
    let weights = Weights { state: Matrix::from_fn(n, n, square), input: Matrix::identity(m), cross: None };
    let found = lqr(&task.system, &weights)?;
    Ok((found.gain, format!("feedback of least cost; the residual of its Riccati equation is {:.1e}", found.residual)))
}

/// `ξ̇ = A ξ + B r`, `u = (C_u + K C_x) ξ + (D_u + K D_x) r − K x`.
fn block(plan: &LinearSystem, task: &Task, k: &Matrix<f64>) -> LinearBlock {
    let (m, n, own, disturbances) = (k.rows(), k.columns(), plan.states.len(), task.disturbed.len());
    let (c, d) = (plan.c.to_f64(), plan.d.to_f64());
    let with_feedback = |of: &Matrix<f64>| {
        Matrix::from_fn(m, of.columns(), |i, j| of[(n + i, j)] + (0..n).map(|l| k[(i, l)] * of[(l, j)]).sum::<f64>())
    };
    let minus = task.over_motions(k).scale(&-1.0);
    let from_plant = Matrix::zeros(own, minus.columns());
    LinearBlock {
        states: plan.states.iter().map(|state| format!("planned {state}")).collect(),
        a: plan.a.to_f64(),
        b: side_by_side(&[&from_plant, &plan.b.to_f64(), &Matrix::zeros(own, disturbances)]),
        c: with_feedback(&c),
        d: side_by_side(&[&minus, &with_feedback(&d), &Matrix::zeros(m, disturbances)]),
    }
}

/// From the references to the outputs, with plant and planner.
fn closed(task: &Task, plan: &LinearSystem, k: &Matrix<Rational>) -> LinearSystem {
    let LinearSystem { a, b, c, d, states, outputs, .. } = &task.system;
    let (n, m, own) = (a.rows(), b.columns(), plan.states.len());
    let rows = |of: &Matrix<Rational>, rows: Range<usize>| window(of, rows, 0..of.columns());
    let command = |of: &Matrix<Rational>| rows(of, n..n + m).plus(&k.multiply(&rows(of, 0..n)));
    let (on_states, on_references) = (command(&plan.c), command(&plan.d));
    let minus = k.scale(&Rational::NEG_ONE);
    let (loop_a, loop_c) = (a.plus(&b.multiply(&minus)), c.plus(&d.multiply(&minus)));
    let (drive, drive_b) = (b.multiply(&on_states), b.multiply(&on_references));
    let through = d.multiply(&on_states);
    let names = plan.states.iter().map(|state| format!("planned {state}"));
    LinearSystem {
        states: states.iter().cloned().chain(names).collect(),
        inputs: task.reference_names(),
        outputs: outputs.clone(),
        e: Matrix::identity(n + own),
        a: joined([&loop_a, &drive], [&Matrix::zeros(own, n), &plan.a]),
        b: stacked(&[&drive_b, &plan.b]),
        c: side_by_side(&[&loop_c, &through]),
        d: d.multiply(&on_references),
        degrees_of_freedom: None,
    }
}

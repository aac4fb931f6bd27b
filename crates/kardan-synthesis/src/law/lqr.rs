//! The law `lqr`: a linear quadratic regulator.

use std::sync::Arc;

use kardan_rt::functions::powi;

use crate::outputs::{AS_MANY_INPUTS, OUTPUT, REFERENCE, Task, channels, channels_for, inputs, references};
use crate::regulator::{Weights, lqr};
use crate::state_feedback::state_feedback;
use crate::{Law, LawKind, Request, SynthesisError, rounded};
use kardan_math::names::backquoted;
use kardan_math::num::Matrix;
use kardan_schema::schema::{Keys, LawKeys, Sign, keys};

keys! {
    /// A channel of the law `lqr`.
    table LqrChannel {
        required {
            output: Output as OUTPUT;
            reference: Name as REFERENCE;
        }
        optional {
            max_acceptable: Number(Sign::Positive) = "0.1",
                "Largest acceptable deviation of the output in SI units (rad, rad/s, N m).";
        }
    }
}

law_keys! {
    /// Linear quadratic regulator.
    law Lqr("lqr") {
        required {
            inputs: Elements(&["motor", "voltage_source"]) as AS_MANY_INPUTS;
        }
        optional {
            channels: Tables(LqrChannel),
                "One table for each output, as many as motors; left out: none.";
            max_acceptable: Overrides,
                "Largest acceptable torques of motors, angles and speeds of coordinates: { wg_motor = \"1.3 N m\", \
                 \"cj.w\" = \"10 rad/s\" }; a motor that is left out: 1 N m, a state: no cost.";
        }
    }
}

/// Linear quadratic regulator.
pub const LQR: LawKind = LawKind {
    keyword: Lqr::KEYWORD,
    summary: "State feedback u = -K x + L r of least cost, the integral of (y/max_acceptable)^2 over the outputs, (x/max_acceptable)^2 over \
              chosen states and (u/max_acceptable)^2 over the motors (Bryson's rule); references are reached at rest.",
    fields: Lqr::FIELDS,
    example: "\
[control.column]
law = \"lqr\"
inputs = [\"wg_motor\", \"rk_motor\"]
max_acceptable = { wg_motor = \"1.3 N m\", rk_motor = \"60 N m\", \"rk.w\" = \"20 rad/s\" }

[[control.column.channels]]
output = \"rk.phi\"
reference = \"ref_rk\"
max_acceptable = 0.1

[[control.column.channels]]
output = \"fs.phi\"
reference = \"ref_fs\"
max_acceptable = 0.05
",
    template: |inputs, outputs| {
        let channels = channels_for(outputs, |output, reference| LqrChannel::new(output, reference));
        Some(Lqr::new(inputs.to_vec()).channels(channels).entries())
    },
    inputs,
    references,
    samples: false,
    design,
};

fn design(request: &Request<'_>) -> Result<Arc<dyn Law>, SynthesisError> {
    let mut task = Task::new(request)?;
    task.leave_counters(request.plant);
    let states = task.system.states.clone();
    let (n, m) = (states.len(), task.inputs.len());
    let largest = request.values.map("max_acceptable").unwrap_or_default();
    for (name, value) in largest {
        if !states.contains(name) && !task.inputs.contains(name) {
            let message = format!(
                "`max_acceptable` names `{name}`, which is neither a motor of the law nor an angle or speed of a coordinate"
            );
            let all = backquoted(&[task.inputs, states].concat());
            return Err(SynthesisError::at(message, name, "no weight", format!("there are {all}")));
        }
        if value.signum() <= 0 {
            let message = format!("the largest acceptable value of `{name}` must be more than zero");
            return Err(SynthesisError::at(message, name, "not a size", "write a value above zero"));
        }
    }
    let weight =
        |name: &String| largest.iter().find(|(candidate, _)| candidate == name).map(|(_, x)| powi(x.to_f64(), -2));
    let of_outputs: Vec<f64> =
        channels(request.values).map(|channel| powi(channel.number_or_default("max_acceptable"), -2)).collect();
    let (c, d) = (task.system.c.to_f64(), task.system.d.to_f64());
    let product = |a: &Matrix<f64>, b: &Matrix<f64>, i: usize, j: usize| -> f64 {
        of_outputs.iter().enumerate().map(|(k, w)| w * a[(k, i)] * b[(k, j)]).sum()
    };
    let on_diagonal = |i: usize, j: usize, w: f64| if i == j { w } else { 0.0 };
    let weights = Weights {
        state: Matrix::from_fn(n, n, |i, j| {
            product(&c, &c, i, j) + on_diagonal(i, j, weight(&states[i]).unwrap_or(0.0))
        }),
        input: Matrix::from_fn(m, m, |i, j| {
            product(&d, &d, i, j) + on_diagonal(i, j, weight(&task.inputs[i]).unwrap_or(1.0))
        }),
        cross: Some(Matrix::from_fn(n, m, |i, j| product(&c, &d, i, j))),
    };
    let found = lqr(&task.system, &weights)?;
    let notes = vec![format!("the relative residual of the Riccati equation is {:.1e}", found.residual)];
    let solution = rounded(("X", "solution X of the Riccati equation", ""), &states, &states, &found.solution);
    state_feedback(request, &task, LQR.keyword, &found.gain, vec![solution], notes)
}

//! The design at one position of the joints: feedback, observer and governor, and the matrices of the block from them.

use kardan_rt::Bounds;

use crate::decoupling::observable_quotient;
use crate::matrix_parts::{column_range, side_by_side, stacked};
use crate::outputs::channels;
use crate::sampled::{Problem, RegulatorData, Solution, Target, zoh_plant};
use crate::{Request, SynthesisError, effective_inertia};
use kardan_math::num::{Matrix, rational_to_f64};
use kardan_results::Definition;

use super::channel_tasks::{DesignSpec, Task};
use super::governor::governor;
use super::observer::{Observer, observer};

/// The design at one position.
pub(super) struct Designed {
    pub(super) problem: Problem,
    pub(super) solution: Solution,
    pub(super) observed: Observer,
    pub(super) data: RegulatorData,
    pub(super) definitions: Vec<Definition>,
}

/// The design at the position of the plant. `forces`: including the response of the law to forces on the coordinates that it gets as inputs.
pub(super) fn designed(request: &Request<'_>, spec: &DesignSpec<'_>, forces: bool) -> Result<Designed, SynthesisError> {
    let (plant, values) = (request.plant, request.values);
    let DesignSpec { inputs, tasks, outputs, lags, clock, .. } = *spec;
    // What the channels do not see of the plant (the angle of a free wheel) is left out of the design.
    let shown = plant.system(inputs, outputs);
    let quotient = observable_quotient(&shown, &plant.twists());
    let external: &[usize] = if forces { &plant.reduced.coordinates } else { &[] };
    let disturbed = [request.disturbances, external].concat();
    let (torques, direct) = plant.torques(&disturbed, outputs);
    let (a, b, w) = (quotient.system.a.to_f64(), quotient.system.b.to_f64(), quotient.project(&torques).to_f64());
    let (c, d, f) = (quotient.system.c.to_f64(), quotient.system.d.to_f64(), direct.to_f64());
    let mut targets = Vec::new();
    for (k, (channel, task)) in channels(values).zip(tasks).enumerate() {
        let bandwidth = channel.number_or_default("bandwidth");
        let acceptable = match task {
            Task::Position => channel.number_or_default("acceptable_angle"),
            Task::Speed => channel.number_or_default("acceptable_speed"),
            _ => channel.number_or_default("acceptable_torque"),
        };
        let (mut on_state, mut on_torque, mut on_disturbance) =
            (c.row(k).to_vec(), d.row(k).to_vec(), f.row(k).to_vec());
        if let Task::Torque(shaft) | Task::NetTorque(shaft) = task {
            // J ÿ + J ẏ/T, less what acts on the shaft from outside, for the speed ẏ = c z.
            let inertia = rational_to_f64(&match task {
                Task::NetTorque(_) => plant.reduced.equations.own_inertia(*shaft),
                _ => effective_inertia(&plant.linear, *shaft),
            });
            let row = Matrix::from_fn(1, c.columns(), |_, j| c[(k, j)]);
            let coasting = channel.number_or_default("coasting_time");
            let acceleration = row.multiply(&a).plus(&row.scale(&(1.0 / coasting)));
            on_state = acceleration.scale(&inertia).row(0).to_vec();
            on_torque = row.multiply(&b).scale(&inertia).row(0).to_vec();
            on_disturbance = row.multiply(&w).scale(&inertia).row(0).to_vec();
            let outside = matches!(task, Task::Torque(_));
            for (share, disturbed) in on_disturbance.iter_mut().zip(request.disturbances) {
                *share -= f64::from(u8::from(outside && disturbed == shaft));
            }
        }
        if on_state.iter().chain(&on_torque).all(|x| *x == 0.0) {
            let name = &outputs[k].name;
            let message = format!("no motor of the law acts on `{name}`");
            return Err(SynthesisError::at(message, name, "not reached", "choose other motors or another output"));
        }
        targets.push(Target { on_state, on_torque, on_disturbance, acceptable, bandwidth });
    }
    let problem = Problem { a, b, w, lags: lags.to_vec(), targets, changes: spec.changes.to_vec(), clock };
    let solution = problem.solve().ok_or_else(|| {
        SynthesisError::whole(
            "the Riccati equation of the feedback has no stabilising solution in floating point",
            "choose another sample time, a smaller bandwidth, larger acceptable errors, or a shorter `coasting_time`",
        )
    })?;
    let lift = quotient.projection.to_f64();
    let observed = observer(request, spec)?;
    let compensation = values.table("observer").and_then(|observer| observer.number("compensation")).unwrap_or(1.0);
    let force_input = pushed(request, external, spec)?;
    let mut data = assemble(&problem, &solution, &lift, &observed, compensation, &force_input, spec.bounds)
        .ok_or_else(SynthesisError::too_large)?;
    if values.word("governor") != Some("off") {
        let responses = unit_torque_responses(request, spec)?;
        data.governor = governor(&data, &problem, &responses);
    }
    Ok(Designed { problem, solution, observed, data, definitions: quotient.definitions })
}

/// The effect of a torque of 1 N m along each of these shafts, constant over a sample, on the plant's states, those of lagging motors
/// included.
fn pushed(request: &Request<'_>, shafts: &[usize], spec: &DesignSpec<'_>) -> Result<Matrix<f64>, SynthesisError> {
    let DesignSpec { inputs, lags, clock, .. } = *spec;
    let system = request.plant.system(inputs, &[]);
    let (torques, _) = request.plant.torques(shafts, &[]);
    let discrete = zoh_plant(&system.a.to_f64(), &system.b.to_f64(), &torques.to_f64(), lags, clock)
        .ok_or_else(|| SynthesisError::sampled_overflow(clock.period))?;
    let own = discrete.flow.rows() - shafts.len();
    Ok(Matrix::from_fn(own, shafts.len(), |i, j| discrete.state[(i, own + j)]))
}

/// The block's matrices from feedback, observer and reference models.
fn assemble(
    problem: &Problem,
    solution: &Solution,
    lift: &Matrix<f64>,
    observed: &Observer,
    compensation: f64,
    pushed: &Matrix<f64>,
    bounds: &[Bounds<f64>],
) -> Option<RegulatorData> {
    let (m, p, own) = (problem.b.columns(), observed.output.rows(), observed.output.columns());
    let (past, forces, disturbances) = (solution.on_past.columns(), pushed.columns(), observed.disturbances.len());
    let n = own + past;
    let unit = |here: bool| f64::from(u8::from(here));
    // The command becomes the last one, the others move on.
    let moved = Matrix::from_fn(past, n, |i, j| unit(i >= m && j == own + i - m));
    let commanded = Matrix::from_fn(past, m, |i, j| unit(i == j));
    let (model, model_input) = problem.models()?;
    let feedback = [
        &solution.on_state.multiply(lift),
        &solution.on_lagged,
        &column_range(&solution.on_disturbance, 0..disturbances).scale(&compensation),
        &solution.on_past,
        &solution.on_model,
        &solution.on_reference,
    ];
    Some(RegulatorData {
        prediction: stacked(&[&column_range(&observed.prediction, 0..n), &moved]),
        input: stacked(&[&column_range(&observed.prediction, n..n + m), &commanded]),
        output: side_by_side(&[&observed.output, &Matrix::zeros(p, past)]),
        correction: stacked(&[&observed.correction, &Matrix::zeros(past, p)]),
        model,
        model_input,
        feedback: side_by_side(&feedback),
        bounds: bounds.to_vec(),
        governor: None,
        on_forces: column_range(&solution.on_disturbance, disturbances..disturbances + forces),
        force_input: stacked(&[pushed, &Matrix::zeros(n - pushed.rows(), forces)]),
    })
}

/// Channels of torques whose shaft carries no estimated disturbance, each with the effect of a torque of 1 N m along it on the
/// plant's states in one sample.
fn unit_torque_responses(
    request: &Request<'_>,
    spec: &DesignSpec<'_>,
) -> Result<Vec<(usize, Vec<f64>)>, SynthesisError> {
    let unknown = spec.tasks.iter().enumerate().filter_map(|(k, task)| match task {
        Task::Torque(shaft) if !request.disturbances.contains(shaft) => Some((k, *shaft)),
        _ => None,
    });
    unknown.map(|(k, shaft)| Ok((k, pushed(request, &[shaft], spec)?.as_slice().to_vec()))).collect()
}

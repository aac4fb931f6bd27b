//! Motor loads of a design in the scenario of the file: its real steps, not steps by one unit.

use rayon::prelude::*;

use crate::study::progress::run_with_progress;
use crate::study::{Prepared, PreparedVariant, Progress};
use kardan_results::{Design, MotorLoad, Outcome, ScenarioMotorLoad};
use kardan_simulate::{Ready, Setup, Tolerance};

/// Limit of integrator steps of a run of the scenario.
const MOST_STEPS: usize = 2_000_000;

/// Runs the scenario of every variant that has the controller of a design in its loop, and records the motor loads in the design.
/// Variants without events are left out.
pub(in crate::study) fn scenario_motor_loads(prepared: &Prepared, design: &mut Design, progress: &dyn Progress) {
    let with = |variant: &&PreparedVariant| {
        let scenario = &variant.scenario;
        let moves = !scenario.events.is_empty() || scenario.speed.iter().chain(&scenario.position).any(|x| *x != 0.0);
        moves && variant.model.controls.iter().any(|control| control.name == design.controller)
    };
    let limited = |variant: &&PreparedVariant| {
        let inputs = &variant.reduced.equations.inputs;
        inputs.iter().any(|input| design.inputs.contains(&input.element) && input.value.limited())
    };
    let chosen: Vec<&PreparedVariant> = prepared.all().filter(with).filter(limited).collect();
    let first = design.cross_coupling.len() + 1;
    let run = |(k, variant): (usize, &&PreparedVariant)| {
        let name = format!("scenario of {}", variant.name);
        let setup = Setup { reduced: &variant.reduced, laws: &variant.implemented, scenario: &variant.scenario };
        let most_steps = prepared.tolerance.most_steps.min(MOST_STEPS).min(progress.most_steps());
        let tolerance = Tolerance { most_steps, ..prepared.tolerance };
        (variant.name.clone(), run_with_progress(Ready::new(setup, tolerance), (first + k, &name), progress).run)
    };
    let runs: Vec<_> = chosen.par_iter().enumerate().map(run).collect();
    for (variant, run) in runs {
        if let Outcome::Failed { cause, .. } = &run.outcome {
            let warning = format!("the scenario of the file (variant `{variant}`) does not run to its end: {cause}");
            design.warnings.push(warning);
        }
        add_usage(design, &variant, run.length(), &run.motor_loads);
    }
    warn(design);
}

/// Records in a design the motor loads of a run of a variant.
pub(in crate::study) fn add_usage(design: &mut Design, variant: &str, duration: f64, motor_loads: &[MotorLoad]) {
    let own = motor_loads.iter().filter(|motor_load| design.inputs.contains(&motor_load.motor));
    let found =
        own.map(|motor_load| ScenarioMotorLoad { variant: variant.into(), duration, motor_load: motor_load.clone() });
    design.motor_loads.extend(found);
}

/// Warns of each motor that the scenario drives to its limits, with the variant in which it is at the limit the longest.
pub(in crate::study) fn warn(design: &mut Design) {
    let time = |found: &ScenarioMotorLoad| {
        let MotorLoad { at_torque_limit, .. } = &found.motor_load;
        let seconds = found.motor_load.seconds_at_limit(0.0, found.duration);
        seconds
            + if at_torque_limit.is_empty() { found.motor_load.seconds_at_rate_limit(0.0, found.duration) } else { 0.0 }
    };
    for input in &design.inputs {
        let of_motor = || design.motor_loads.iter().filter(|found| found.motor_load.motor == *input);
        let Some(worst) = of_motor().max_by(|a, b| time(a).total_cmp(&time(b))) else { continue };
        let Some(usage) = worst.motor_load.describe(worst.duration) else { continue };
        let (all, strained_count) =
            (of_motor().count(), of_motor().filter(|found| found.motor_load.at_limit()).count());
        let of = if all > 1 { format!(", the worst of {strained_count} of {all} variants") } else { String::new() };
        design.warnings.push(format!(
            "in the scenario of the file (variant `{}`{of}) {usage}: statements about the outputs are not valid \
             meanwhile; demand less, filter the reference, or take a stronger motor",
            worst.variant
        ));
    }
}

//! The loop of law and observer with the parameters of the variant at the positions of its joints, before any run.

use kardan_rt::functions::ln;

use super::loop_blocks::{blocks, blocks_at};
use super::stepped_loop::{NO_PERIOD_MAP, NotJudged, Shown, Subject, any_subject, window};
use crate::study::PreparedVariant;
use kardan_math::num::{Matrix, Rational, echelon};
use kardan_mechanics::reduce::{Kinematics, LinearModel, Reduced, linearise};
use kardan_model::ControlSpec;
use kardan_results::{LoopAlongPath, PassedInteraction, Span, Stability};
use kardan_schema::diagnostics::Diagnostic;
use kardan_synthesis::SampledPart;

/// Positions in half a turn of a joint, after which its transmission repeats.
const POSITIONS: usize = 24;
/// Largest number of half turns of the slowest joint in which faster ones are followed.
const MOST_HALF_TURNS: f64 = 4.0;
/// Steps for relaxing springs at a position.
const RELAXATIONS: usize = 20;
/// Twist below which a spring counts as relaxed, rad.
const LARGEST_TWIST: f64 = 1e-10;

/// Positions along one motion of the joints.
pub(in crate::study) struct Path {
    /// Names of the coordinates that rotate.
    pub coordinates: Vec<String>,
    /// Angle of the first of them, rad, and the position.
    pub points: Vec<(f64, Vec<f64>)>,
}

/// The coordinates that rotate along each of these paths, as text.
pub(in crate::study) fn rotated_coordinates(paths: &[Path]) -> String {
    paths.iter().map(|path| path.coordinates.join(" and ")).collect::<Vec<_>>().join("; then ")
}

/// The loop of a controller along all motions of the variant's joints that stretch no spring; `None` where the linear loop of the
/// design is that of the variant.
///
/// # Errors
/// Why there is nothing to compute.
pub(in crate::study) fn loop_along_path(
    variant: &PreparedVariant,
    number: usize,
    steps: bool,
) -> Option<Result<LoopAlongPath, String>> {
    let own = variant.linear_model();
    let same = variant.design_models.iter().all(|plant| plant.linear == own);
    let paths = match turns(variant) {
        Some(paths) => paths,
        None if same && !variant.implemented.iter().any(|law| law.is_nonlinear() && law.on_full_model()) => {
            return None;
        }
        None => vec![Path { coordinates: Vec::new(), points: vec![(0.0, variant.point.position.clone())] }],
    };
    Some(loops_along_paths(variant, number, &paths, steps))
}

/// All motions of the variant's joints that stretch no spring; `None` without such joints, or if the loop is at an operating point.
pub(in crate::study) fn turns(variant: &PreparedVariant) -> Option<Vec<Path>> {
    let straight = Kinematics::new(&variant.reduced).is_constant();
    (!straight && variant.point.torques.is_none()).then(|| paths(&variant.reduced, &variant.linear_model()))
}

/// The loop of a controller, as its laws run, at a position of the joints.
pub(in crate::study) fn loop_at(variant: &PreparedVariant, number: usize, position: &[f64]) -> Result<Subject, String> {
    let model = match variant.point.position == position {
        true => variant.linear_model(),
        false => linearise(&variant.reduced, position),
    };
    let (laws, plant) = (&variant.implemented, variant.varied_plant(&model));
    let parts: Option<Vec<SampledPart>> =
        laws.iter().map(|law| SampledPart::at_position(&**law, plant.nominal(), position)).collect();
    let mut subject = any_subject(variant, number, laws, plant);
    let parts = parts.ok_or("a number of the linearised law is not finite")?;
    let between = match variant.point.position == position {
        true => blocks(variant, subject.plant.nominal()),
        false => blocks_at(variant, subject.plant.nominal(), position),
    };
    subject.parts = between.of_loop.join(parts);
    Ok(subject)
}

fn loops_along_paths(
    variant: &PreparedVariant,
    number: usize,
    paths: &[Path],
    steps: bool,
) -> Result<LoopAlongPath, String> {
    let subject_at = |position: &[f64]| {
        let mut subject = loop_at(variant, number, position)?;
        if !steps {
            subject.steps.clear();
        }
        Ok::<_, String>(subject)
    };
    let points: Vec<&(f64, Vec<f64>)> = paths.iter().flat_map(|path| &path.points).collect();
    let Some((_, first)) = points.first() else { return Err("springs are deflected at every position".into()) };
    let first = subject_at(first)?;
    let factors = vec![1.0; first.plant.names().len()];
    let judged = |shown: Result<Shown, NotJudged>| shown.map_err(|NotJudged| NO_PERIOD_MAP.to_string());
    let length = window(&judged(first.evaluate(&factors))?, variant.scenario.duration);
    let evaluate = |(_, position): &&(f64, Vec<f64>)| {
        let mut subject = subject_at(position)?;
        subject.window = if steps { length } else { 0.0 };
        judged(subject.evaluate(&factors))
    };
    // The laws are evaluated one by one: they are not for several threads.
    let shown: Vec<Shown> = points.iter().map(evaluate).collect::<Result<_, _>>()?;
    let growth = |shown: &Shown| if shown.radius > 0.0 { ln(shown.radius) / shown.sample_time } else { f64::MIN };
    let most = (0..shown.len()).max_by(|&a, &b| growth(&shown[a]).total_cmp(&growth(&shown[b]))).unwrap_or(0);
    let mut interactions = Vec::new();
    for (i, step) in first.steps.iter().enumerate() {
        for (j, watched) in first.watched.iter().enumerate().filter(|(_, watched)| watched.reference != step.name) {
            let size = |k: &usize| shown[*k].sizes[i][j];
            let worst = (0..shown.len()).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(0);
            interactions.push(PassedInteraction {
                reference: step.name.clone(),
                step: step.size,
                step_unit: step.unit.into(),
                signal: watched.name.clone(),
                unit: watched.unit.into(),
                largest: size(&worst),
                at: points[worst].0,
                acceptable: watched.acceptable,
            });
        }
    }
    let angles = || points.iter().map(|(angle, _)| *angle);
    Ok(LoopAlongPath {
        rotated_coordinates: rotated_coordinates(paths),
        positions: points.len(),
        range: Span { start: angles().fold(f64::INFINITY, f64::min), end: angles().fold(f64::NEG_INFINITY, f64::max) },
        stable: shown.iter().all(|shown| shown.stable),
        stability: [Stability::Unstable, Stability::Undecided]
            .into_iter()
            .find(|word| shown.iter().any(|shown| shown.word == *word))
            .unwrap_or(Stability::Stable),
        growth: growth(&shown[most]),
        growth_at: points[most].0,
        interactions,
    })
}

/// Motions that stretch no spring and turn a joint, half a turn each.
fn paths(reduced: &Reduced, own: &LinearModel) -> Vec<Path> {
    let basis = &own.basis;
    let r = basis.columns();
    let reduced_row = |row: &[(usize, Rational)]| -> Vec<Rational> {
        let entry = |j: usize| row.iter().fold(Rational::ZERO, |sum, (shaft, x)| sum + x * &basis[(*shaft, j)]);
        (0..r).map(entry).collect()
    };
    let springs: Vec<Vec<Rational>> = reduced.equations.springs.iter().map(|spring| reduced_row(&spring.row)).collect();
    let twists = Matrix::from_fn(springs.len(), r, |i, j| springs[i][j].clone());
    let free =
        if springs.is_empty() { Matrix::identity(r) } else { echelon(&twists, &(0..r).collect::<Vec<_>>()).kernel() };
    let free = free.to_f64();
    let curves = reduced.steps.iter().filter(|step| step.curve.is_some());
    let joints = curves.map(|step| reduced_row(&step.argument.terms));
    let joints: Vec<Vec<f64>> = joints.map(|row| row.iter().map(kardan_math::num::rational_to_f64).collect()).collect();
    let names = reduced.coordinate_names();
    let mut out = Vec::new();
    for column in 0..free.columns() {
        let direction: Vec<f64> = (0..r).map(|i| free[(i, column)]).collect();
        let turns: Vec<f64> = joints
            .iter()
            .map(|row| row.iter().zip(&direction).map(|(a, b)| a * b).sum::<f64>().abs())
            .filter(|turn| *turn > 1e-9)
            .collect();
        let (slowest, fastest) =
            turns.iter().fold((f64::INFINITY, 0.0f64), |(low, high), turn| (low.min(*turn), high.max(*turn)));
        let Some(first) = direction.iter().position(|x| *x != 0.0).filter(|_| fastest > 0.0) else { continue };
        let length = std::f64::consts::PI * (1.0 / slowest).min(MOST_HALF_TURNS / fastest);
        let count = (POSITIONS as f64 * length * fastest / std::f64::consts::PI).ceil() as usize;
        let position = |k: usize| {
            let by = length * k as f64 / count as f64;
            let guess: Vec<f64> = direction.iter().map(|x| by * x).collect();
            let position = unloaded_position(reduced, guess)?;
            Some((position[first], position))
        };
        let coordinates = names.iter().zip(&direction).filter(|(_, x)| **x != 0.0).map(|(name, _)| name.clone());
        out.push(Path { coordinates: coordinates.collect(), points: (0..count).filter_map(position).collect() });
    }
    out
}

/// The position next to this one with the same spring twists as at zero; `None` if none is found.
fn unloaded_position(reduced: &Reduced, mut position: Vec<f64>) -> Option<Vec<f64>> {
    let rows: Vec<Vec<(usize, f64)>> = reduced.equations.springs.iter().map(|spring| spring.row_f64()).collect();
    let r = position.len();
    let mut kinematics = Kinematics::new(reduced);
    let still = vec![0.0; r];
    let twists = |kinematics: &Kinematics| -> Vec<f64> {
        rows.iter().map(|row| row.iter().map(|(shaft, x)| x * kinematics.angles[*shaft]).sum()).collect()
    };
    kinematics.update(&still, &still);
    let rest = twists(&kinematics);
    for _ in 0..RELAXATIONS {
        kinematics.update(&position, &still);
        let twist: Vec<f64> = twists(&kinematics).iter().zip(&rest).map(|(now, rest)| now - rest).collect();
        if twist.iter().all(|twist| twist.abs() < LARGEST_TWIST) {
            return Some(position);
        }
        let slopes = Matrix::from_fn(rows.len(), r, |i, j| {
            rows[i].iter().map(|(shaft, x)| x * kinematics.row(*shaft)[j]).sum::<f64>()
        });
        // The smallest change of position; parallel springs make it singular without the small term.
        let normal = slopes.multiply(&slopes.transpose());
        let normal = normal.plus(&Matrix::identity(rows.len()).scale(&1e-12));
        let multipliers = normal.solve(&Matrix::from_fn(rows.len(), 1, |i, _| twist[i]))?;
        let change = slopes.transpose().multiply(&multipliers);
        position.iter_mut().enumerate().for_each(|(j, x)| *x -= change[(j, 0)]);
    }
    None
}

/// Warnings of controllers whose loop is unstable at a position of the joints of the variant, or whose observer couples it there.
pub(in crate::study) fn check_loop_along_path(variant: &PreparedVariant, out: &mut Vec<Diagnostic>) {
    if variant.model.controls.is_empty() {
        return;
    }
    let observed = |control: &ControlSpec| control.values.table("observer").is_some() && !control.law.samples;
    let mut unstable_reported = false;
    for (number, control) in variant.model.controls.iter().enumerate() {
        let steps = observed(control);
        if number > 0 && !steps {
            continue;
        }
        let Some(Ok(found)) = loop_along_path(variant, number, steps) else { continue };
        if !found.stable {
            if !unstable_reported {
                unstable_reported = true;
                let message = format!(
                    "control `{}`: the loop is unstable with the parameters of the variant{}: a motion grows with {:.4} 1/s (linear \
                     loop with all controllers, computed in floating point)",
                    control.name,
                    place(&found.rotated_coordinates, found.growth_at),
                    found.growth
                );
                let help =
                    "design with the values of the variant, or choose slower poles; `kardan design` shows the loop";
                out.push(
                    Diagnostic::warning("control::unstable-at-position", message)
                        .at(&control.place, "this controller")
                        .help(help),
                );
            }
            continue;
        }
        let Some(worst) = found.worst().filter(|worst| worst.largest > worst.acceptable) else { continue };
        let message = format!(
            "control `{}`: behind its observer the loop is coupled with the parameters of the variant: {}, of which {} are acceptable \
             (linear loop with all controllers, computed in floating point)",
            control.name,
            describe_interaction(worst, &found.rotated_coordinates),
            worst.acceptable
        );
        let help = "let law and observer use the values of the variant, with `plant = \"nonlinear\"` in both; a \
                    faster observer helps where they cannot";
        out.push(
            Diagnostic::warning("control::coupled-at-position", message)
                .at(&control.place, "this controller")
                .help(help),
        );
    }
}

/// ` with rk and cj at 40 deg`.
fn place(coordinates: &str, at: f64) -> String {
    if coordinates.is_empty() {
        return String::new();
    }
    format!(" with {coordinates} at {:.1} deg", at.to_degrees())
}

/// The effect of the step of one reference on the output of another channel.
fn describe_interaction(one: &PassedInteraction, coordinates: &str) -> String {
    let PassedInteraction { reference, step, step_unit, signal, largest, unit, at, .. } = one;
    let place = place(coordinates, *at);
    format!("{reference} by {step:.4} {step_unit} moves {signal} by {largest:.4} {unit}{place}")
}

/// Important warnings for a design.
pub(in crate::study) fn warnings(found: &LoopAlongPath) -> Vec<String> {
    let mut out = Vec::new();
    if !found.stable {
        out.push(format!(
            "with the parameters of the variant the loop is unstable{}: a motion grows with {:.4} 1/s",
            place(&found.rotated_coordinates, found.growth_at),
            found.growth
        ));
    }
    let beyond = found.interactions.iter().filter(|one| found.stable && one.largest > one.acceptable);
    out.extend(beyond.map(|one| {
        format!(
            "with the parameters of the variant the loop is coupled: {}; {} are acceptable",
            describe_interaction(one, &found.rotated_coordinates),
            one.acceptable
        )
    }));
    out
}

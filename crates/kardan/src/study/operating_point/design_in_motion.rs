//! The loop of programs at an operating point in motion: speeds, torques or a time in `at` of a controller.

use std::collections::BTreeSet;

use super::point_in_motion::{MovingPoint, PointRequest, balancing, point_in_motion};
use crate::study::PreparedVariant;
use crate::study::loops::margins::with_plants;
use crate::study::requests::analysis_spec::OperatingConditions;
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::entries::Place;
use kardan_schema::schema::LawKeys;
use kardan_synthesis::{Program, design_law, implemented};

/// The operating point in motion that the controllers of a variant name together.
#[derive(Debug, Clone)]
pub(in crate::study) struct MotionRequest {
    /// Positions of coordinates by name, rad.
    pub at: Vec<(String, f64)>,
    /// Speeds, torques, the time.
    pub conditions: OperatingConditions,
    /// Its span in the file.
    pub place: Place,
}

/// A variant with its loop at the operating point in motion that its controllers name, if they do.
pub(in crate::study) fn with_motion(
    mut variant: PreparedVariant,
    request: Option<MotionRequest>,
    out: &mut Vec<Diagnostic>,
) -> PreparedVariant {
    let complete = variant.designed.len() == variant.model.controls.len();
    match request.filter(|_| complete).map(|request| loop_in_motion(&variant, &request)) {
        Some(Ok(looped)) => variant.looped = Some(Box::new(looped)),
        Some(Err(diagnostic)) => out.push(diagnostic),
        None => {}
    }
    variant
}

/// The loop of a variant in a motion: programs are linearised there, other laws stay as designed.
///
/// # Errors
/// Why there is no such motion, or why a program has no linearisation there.
fn loop_in_motion(variant: &PreparedVariant, request: &MotionRequest) -> Result<PreparedVariant, Diagnostic> {
    let MovingPoint { model, point, notes, .. } = found(variant, request).map_err(|why| {
        let message = format!("`at` of a controller: {}", why.message);
        Diagnostic { code: "control::operating-point", message, ..why }.at(&request.place, "at this point")
    })?;
    let mut out = with_plants(variant, model, point);
    let point_note = notes.join("; ").replacen("operating point: ", "", 1);
    out.design_models.iter_mut().for_each(|plant| plant.point_note = Some(point_note.clone()));
    for (number, control) in variant.model.controls.iter().enumerate() {
        if control.law.keyword != Program::KEYWORD || variant.leaves_out(number) {
            continue;
        }
        let law = design_law(control.law, &control.name, &control.values, &out.design_models[number]);
        let both = law.and_then(|law| Ok((std::sync::Arc::clone(&law), implemented(law, &control.values)?)));
        (out.designed[number], out.implemented[number]) = both.map_err(|why| {
            let message = format!("`at` of control `{}`: {why}", control.name);
            Diagnostic::error("control::operating-point", message).at(&request.place, "at this point")
        })?;
    }
    Ok(out)
}

fn found(variant: &PreparedVariant, request: &MotionRequest) -> Result<MovingPoint, Diagnostic> {
    let commanded = variant.model.controls.iter().flat_map(|control| (control.law.inputs)(&control.values));
    let stuck: BTreeSet<String> = variant.analysis.stuck.iter().cloned().collect();
    let request = PointRequest {
        at: &request.at,
        conditions: &request.conditions,
        inputs: &balancing(variant, &commanded.collect::<Vec<_>>()),
        stuck: &stuck,
        start: &variant.scenario.position,
    };
    point_in_motion(variant, &request)
}

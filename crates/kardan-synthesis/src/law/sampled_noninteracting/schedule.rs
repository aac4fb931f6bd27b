//! Whether the law follows the position of its joints, and its design at positions over half a turn.

use crate::observed::sensors;
use crate::sampled::{PERIOD, ScheduleData, turning};
use crate::{Plant, Request, SynthesisError};
use kardan_mechanics::reduce::MechanismData;

use super::channel_tasks::DesignSpec;
use super::position_design::{Designed, designed};

/// Positions over half a turn of the joints at which the law is designed.
const POINTS: f64 = 16.0;
/// Relative difference of ratios that are the same but for rounding.
const SAME_RATIO: f64 = 1e-13;
/// The most of them.
const MOST_POINTS: f64 = 256.0;

/// Whether the law follows the position of its joints.
pub(super) enum Follows {
    /// The law has no joint to follow, or the model file switches it off.
    Nothing,
    /// A joint is bent, but cannot be followed, for this reason.
    Cannot(String),
    /// This coordinate, at so many points.
    Turns { coordinate: usize, count: usize },
}

pub(super) fn follows(request: &Request<'_>) -> Result<Follows, SynthesisError> {
    let setting = request.values.number("schedule");
    if let Some(points) = setting.filter(|points| points.fract() != 0.0 || !(1.0..=MOST_POINTS).contains(points)) {
        let message = format!("`schedule` is {points}: it must be a whole number of positions from 1 to 256");
        return Err(SynthesisError::whole(message, "write a whole number, such as 16"));
    }
    if request.plant.is_moved() {
        return match setting {
            Some(points) if points != 1.0 => Err(no_schedule("it is designed at one operating point")),
            _ => Ok(Follows::Nothing),
        };
    }
    let count = setting.unwrap_or(POINTS);
    if count == 1.0 || request.plant.is_constant() {
        return Ok(Follows::Nothing);
    }
    match turning(&request.plant.reduced) {
        Ok(coordinate) => Ok(Follows::Turns { coordinate, count: count as usize }),
        Err(reason) if setting.is_some() => Err(no_schedule(&reason)),
        Err(reason) => Ok(Follows::Cannot(reason)),
    }
}

/// The law cannot follow the position of the joints, and why, as the end of a sentence.
fn no_schedule(reason: &str) -> SynthesisError {
    let help = "write `schedule = 1`, or leave it out: the law is then designed straight ahead";
    SynthesisError::whole(format!("the law cannot follow the position of its joints: {reason}"), help)
}

/// The same design at positions over half a turn. Where the joints have the ratios of a point before, its numbers are taken.
pub(super) fn schedule(
    request: &Request<'_>,
    spec: &DesignSpec<'_>,
    straight: &Designed,
    coordinate: usize,
    count: usize,
    offsets: &[f64],
) -> Result<ScheduleData, SynthesisError> {
    let reduced = &request.plant.reduced;
    let (mut sensors, entries) = sensors(&straight.observed.readings);
    sensors.iter_mut().zip(offsets).for_each(|(sensor, offset)| sensor.rest += offset);
    let mechanism = MechanismData::new(reduced);
    let all = |points| ScheduleData { coordinate, points, mechanism, sensors, entries };
    if let Some(points) = request.plant.schedule_cache.of(request.values, request.disturbances) {
        return Ok(all(points));
    }
    let mut points = vec![straight.data.clone()];
    let mut ratios = vec![request.plant.linear.basis.to_f64()];
    for k in 1..count {
        let mut position = vec![0.0; reduced.degrees_of_freedom()];
        position[coordinate] = PERIOD * k as f64 / count as f64;
        let plant = Plant { elements: request.plant.elements.clone(), ..Plant::new(reduced.clone(), position) };
        let basis = plant.linear.basis.to_f64();
        let before = ratios.iter().position(|candidate| {
            candidate.as_slice().iter().zip(basis.as_slice()).all(|(x, y)| (x - y).abs() <= SAME_RATIO * y.abs())
        });
        points.push(match before {
            Some(before) => points[before].clone(),
            None => designed(&Request { plant: &plant, ..*request }, spec, true)?.data,
        });
        ratios.push(basis);
    }
    request.plant.schedule_cache.store(request.values, request.disturbances, &points);
    Ok(all(points))
}

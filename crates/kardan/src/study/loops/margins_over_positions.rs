//! Margins of the motors at the positions of the joints of the variant, and over a box of plants.

use rayon::prelude::*;

use super::loop_along_path::{loop_at, rotated_coordinates, turns};
use super::stepped_loop::Subject;
use crate::study::PreparedVariant;
use kardan_results::{BoxMargin, ChannelMargin, MarginsOverPositions, PositionMargins};

/// Number of plants of a box whose margins are computed, besides its worst corners.
const PLANTS: usize = 12;

/// The margins of a controller's motors along all motions of the joints; `None` without joints.
pub(in crate::study) fn margins_over_positions(
    variant: &PreparedVariant,
    number: usize,
) -> Option<MarginsOverPositions> {
    let paths = turns(variant)?;
    let motors = variant.implemented[number].inputs();
    let points = || paths.iter().flat_map(|path| &path.points);
    let evaluate = |(angle, position): &(f64, Vec<f64>)| {
        let subject = loop_at(variant, number, position).ok();
        let found = subject.and_then(|subject| subject.margins(&ones(&subject), motors));
        PositionMargins { angle: *angle, motors: found.unwrap_or_default() }
    };
    // The laws are evaluated one by one: they are not for several threads.
    let positions: Vec<PositionMargins> = points().map(evaluate).collect();
    positions
        .iter()
        .any(|one| !one.motors.is_empty())
        .then(|| MarginsOverPositions { rotated_coordinates: rotated_coordinates(&paths), positions })
}

fn ones(subject: &Subject) -> Vec<f64> {
    vec![1.0; subject.plant.names().len()]
}

/// The least margins of each motor over some plants of a box and these corners of it; empty if they cannot be computed.
pub(in crate::study) fn margins_over_box(
    subject: &Subject,
    motors: &[String],
    points: &[Vec<f64>],
    corners: &[Vec<f64>],
) -> Vec<BoxMargin> {
    let Some(nominal) = subject.margins(&ones(subject), motors) else { return Vec::new() };
    let mut plants: Vec<&Vec<f64>> = corners.iter().chain(points.iter().take(PLANTS)).collect();
    plants.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    plants.dedup();
    let found: Vec<(&Vec<f64>, Vec<ChannelMargin>)> =
        plants.par_iter().filter_map(|plant| Some((*plant, subject.margins(plant, motors)?))).collect();
    let of = |(k, motor): (usize, &String)| {
        let all = || found.iter().map(|(_, margins)| &margins[k]).chain([&nominal[k]]);
        let worst = found.iter().min_by(|a, b| a.1[k].disk.total_cmp(&b.1[k].disk));
        BoxMargin {
            motor: motor.clone(),
            plants: found.len(),
            unstable: plants.len() - found.len(),
            nominal: nominal[k].disk,
            disk: all().map(|one| one.disk).fold(f64::INFINITY, f64::min),
            gain: [
                all().map(|one| one.gain[0]).fold(0.0, f64::max),
                all().map(|one| one.gain[1]).fold(f64::INFINITY, f64::min),
            ],
            phase: all().map(|one| one.phase).fold(f64::INFINITY, f64::min),
            at: worst.map(|(plant, _)| (*plant).clone()).unwrap_or_default(),
        }
    };
    motors.iter().enumerate().map(of).collect()
}

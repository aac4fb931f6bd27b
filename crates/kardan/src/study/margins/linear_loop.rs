//! The linear loop of a variant, as margins look at it.

use crate::model::ControlSpec;
use crate::reduce::{LinearModel, linearise};
use crate::study::PreparedVariant;
use crate::synthesis::{Clock, LoopPlant, Plant, Survey, clock};

pub(super) fn clocks(controls: &[ControlSpec]) -> Vec<Option<Clock>> {
    controls.iter().map(|control| clock(&control.values).ok().flatten()).collect()
}

/// The shortest sample time, s.
pub(super) fn shortest(clocks: &[Option<Clock>]) -> f64 {
    clocks.iter().flatten().map(|clock| clock.period).fold(f64::INFINITY, f64::min)
}

/// The linear plant of a variant at zero angles, with its motors.
pub(super) fn linear(variant: &PreparedVariant) -> LoopPlant {
    let model = model_of(variant);
    let lags = variant.design_models.first().map(Plant::lags).unwrap_or_default();
    LoopPlant::new(&model, &lags).with_sensors(&variant.reduced)
}

/// The linear model of a variant at zero angles.
pub(super) fn model_of(variant: &PreparedVariant) -> LinearModel {
    linearise(&variant.reduced, &vec![0.0; variant.reduced.degrees_of_freedom()])
}

/// How many motions of the loop of the file's controllers nobody holds.
pub(in crate::study) fn left_out(variant: &PreparedVariant, number: usize, plant: &LoopPlant) -> usize {
    let (laws, clocks) = (&variant.designed, clocks(&variant.model.controls));
    let survey = Survey { plant, laws, clocks: &clocks, number };
    survey.slowest(survey.unchanged()).map_or(0, |found| found.left_out)
}

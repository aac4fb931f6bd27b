//! Cars that a run has driven backwards.

use crate::model::Model;
use crate::results::Series;

/// Sentences about cars whose speed falls below zero, where no tyre knows what happens. Looked at in the rows of the run.
pub(super) fn backwards(model: &Model, series: &Series) -> Vec<String> {
    let cars = model.elements.iter().filter(|element| element.kind == "vehicle").map(|element| element.name.as_str());
    let sentence = |car: &str| {
        let speed = series.signal(&format!("{car}.v_x"))?;
        let (row, _) = speed.values.iter().enumerate().find(|(_, speed)| **speed < 0.0)?;
        let least = speed.values.iter().copied().fold(f64::INFINITY, f64::min);
        Some(format!(
            "`{car}` drives backwards from {:.4} s on, at up to {:.4} m/s: its tyres are those of a car that drives forwards, so nothing of it is right from there on; \
             keep `speed` at zero or more, `max(0 m/s, ...)`.",
            series.time[row], -least
        ))
    };
    cars.filter_map(sentence).collect()
}

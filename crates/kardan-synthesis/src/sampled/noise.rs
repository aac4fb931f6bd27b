//! Variances of the readings of sensors.

use crate::Plant;
use kardan_analysis::OutputSignal;
use kardan_mechanics::equations::Measured;
use kardan_results::signal_name::SignalName;

/// Variance of a reading of an ideal sensor times the sample time: 3 µrad (or µN m) at 1 ms.
const IDEAL: f64 = 1e-14;

/// Variance of a reading at a sample time in s (that of the sensor, if it has one): of the noise given (unit of the sensor times √s), else that of the sensor's own noise and of
/// rounding to its resolution, a twelfth of its square, else that of a nearly ideal sensor.
pub fn reading_variance(plant: &Plant, noise: Option<f64>, signal: &OutputSignal, period: f64) -> f64 {
    let head = SignalName::new(&signal.name).element;
    let sensor = plant.reduced.equations.sensors.iter().find(|(name, _)| name == head).map(|(_, sensor)| sensor);
    let period = sensor.and_then(|sensor| sensor.sample_time.as_ref()).map_or(period, |time| time.to_f64());
    if let Some(noise) = noise {
        return noise * noise / period;
    }
    let own = sensor.and_then(|sensor| sensor.noise).map_or(0.0, |noise| noise * noise);
    let Some(step) = sensor.and_then(|sensor| sensor.resolution) else {
        return if own > 0.0 { own } else { IDEAL / period };
    };
    let step = match &signal.measured {
        Measured::SpringTorque(element) => {
            let springs = plant.reduced.equations.springs.iter().filter(|spring| spring.element == *element);
            step * springs.map(|spring| spring.value.stiffness.to_f64()).sum::<f64>()
        }
        // The difference of two rounded angles.
        Measured::Speed(_) => 2f64.sqrt() * step / period,
        _ => step,
    };
    step * step / 12.0 + own
}

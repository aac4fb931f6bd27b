//! The parts of blocks of firmware: numbers in their precision, and their snapshot.

use kardan_rt::{Health, PositionLoop, Sensor};

use kardan_math::num::{Float, Matrix, StateArchive};

/// Entries of a matrix in a precision.
pub(crate) fn entries<T: Float>(matrix: &Matrix<f64>) -> Vec<T> {
    T::list(matrix.as_slice())
}

/// A position loop in a precision.
pub(crate) fn position_loop_in<T: Float>(of: &PositionLoop<f64>) -> PositionLoop<T> {
    let [natural_frequency, damping_ratio] = [of.natural_frequency, of.damping_ratio].map(T::from_f64);
    PositionLoop { natural_frequency, damping_ratio }
}

/// Sensors, and the entries of their rows, in a precision.
pub(crate) fn sensors_in<T: Float>(
    sensors: &[Sensor<f64>],
    entries: &[(usize, f64)],
) -> (Vec<Sensor<T>>, Vec<(usize, T)>) {
    let sensor = |of: &Sensor<f64>| Sensor { row: of.row, speed: of.speed, rest: T::from_f64(of.rest) };
    let entry = |(shaft, x): &(usize, f64)| (*shaft, T::from_f64(*x));
    (sensors.iter().map(sensor).collect(), entries.iter().map(entry).collect())
}

/// The status of a block at its last sample.
pub(crate) fn archive_health(health: &mut Health, archive: &mut StateArchive<'_>) {
    let Health { invalid_readings, invalid_references, commands_bounded, governed, estimate_frozen } = health;
    [invalid_readings, invalid_references, commands_bounded].into_iter().for_each(|count| archive.count(count));
    [governed, estimate_frozen].into_iter().for_each(|flag| archive.flag(flag));
}

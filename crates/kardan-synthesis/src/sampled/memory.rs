//! The parts of blocks of firmware: numbers in their precision, and their snapshot.

use kardan_rt::Health;

use kardan_math::num::{Float, Matrix, StateArchive};

/// Entries of a matrix in a precision.
pub(crate) fn entries<T: Float>(matrix: &Matrix<f64>) -> Vec<T> {
    T::list(matrix.as_slice())
}

/// The status of a block at its last sample.
pub(crate) fn archive_health(health: &mut Health, archive: &mut StateArchive<'_>) {
    let Health { invalid_readings, invalid_references, commands_bounded, governed, estimate_frozen } = health;
    [invalid_readings, invalid_references, commands_bounded].into_iter().for_each(|count| archive.count(count));
    [governed, estimate_frozen].into_iter().for_each(|flag| archive.flag(flag));
}

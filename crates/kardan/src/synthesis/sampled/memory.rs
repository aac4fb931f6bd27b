//! What blocks of firmware are made of: numbers in their precision, and what a snapshot keeps of them.

use kardan_rt::Health;

use crate::num::{Float, Keeper, Matrix};

/// Entries of a matrix in a precision.
pub(in crate::synthesis) fn entries<T: Float>(matrix: &Matrix<f64>) -> Vec<T> {
    T::list(matrix.as_slice())
}

/// What a block says of its last sample.
pub(in crate::synthesis) fn keep_health(health: &mut Health, keeper: &mut Keeper<'_>) {
    let Health { readings_held, references_held, commands_bounded, governed, estimate_kept } = health;
    [readings_held, references_held, commands_bounded].into_iter().for_each(|count| keeper.count(count));
    [governed, estimate_kept].into_iter().for_each(|flag| keeper.flag(flag));
}

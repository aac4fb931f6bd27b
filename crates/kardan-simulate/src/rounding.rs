//! Rounding errors of the rates of a state: no error estimate resolves less, and shorter steps do not reduce them.
//!
//! They are measured: states that differ by one unit in the last place of each component have rates that differ by the
//! rounding error. Components are moved up and down in patterns of which at least one moves any two of them in the same
//! direction and one in opposite directions, so that the cancellation of two large terms shows for any signs.

use kardan_math::num::StateArchive;

/// The rounding error of a step, and memory to measure it.
#[derive(Debug, Clone)]
pub(super) struct Rounding {
    perturbed: Vec<f64>,
    changes: Vec<f64>,
    /// How much each component may change.
    pub noise: Vec<f64>,
    /// The largest error that rounding alone caused in each component in a measured step.
    pub largest: Vec<f64>,
    /// The same in tolerances, of all components.
    pub tolerances: f64,
}

impl Rounding {
    pub(super) fn new(size: usize) -> Self {
        let zero = vec![0.0; size];
        Self { perturbed: zero.clone(), changes: zero.clone(), noise: zero.clone(), largest: zero, tolerances: 0.0 }
    }

    pub(super) fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.numbers(&mut self.largest);
        archive.number(&mut self.tolerances);
    }

    /// Scales the noise of rates to that of a step, and stores the largest. `sizes`: the allowed errors of the
    /// components.
    pub(super) fn in_step(&mut self, times: f64, sizes: impl Iterator<Item = f64>) {
        for ((noise, largest), size) in self.noise.iter_mut().zip(&mut self.largest).zip(sizes) {
            *noise *= times;
            *largest = largest.max(*noise);
            self.tolerances = self.tolerances.max(*noise / size);
        }
    }

    /// Measures it at a state. `change` writes the change of rates, or of results of them, at a moved state, and may
    /// overwrite the state. Returns how often it was called.
    pub(super) fn measure(&mut self, state: &[f64], mut change: impl FnMut(&mut [f64], &mut [f64])) -> u64 {
        let Self { perturbed, changes, noise, .. } = self;
        noise.fill(0.0);
        let patterns = 1 + usize::BITS - state.len().saturating_sub(1).leading_zeros();
        for pattern in 0..patterns {
            for (k, (perturbed, x)) in perturbed.iter_mut().zip(state).enumerate() {
                let down = pattern > 0 && k >> (pattern - 1) & 1 == 1;
                *perturbed = x * if down { 1.0 - f64::EPSILON } else { 1.0 + f64::EPSILON };
            }
            change(perturbed, changes);
            for (noise, change) in noise.iter_mut().zip(&*changes) {
                // An overflow is not a rounding error.
                if change.is_finite() {
                    // Rounding is at most half a unit.
                    *noise = noise.max(0.5 * change.abs());
                }
            }
        }
        u64::from(patterns)
    }
}

#[cfg(test)]
#[path = "../tests/unit/rounding.rs"]
mod tests;

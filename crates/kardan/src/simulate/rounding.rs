//! What rounding alone makes of the rates of a state: no error estimate sees anything below it, and shorter steps do not make it smaller.
//!
//! It is measured: states that differ by one unit in the last place of each component have rates that differ by so much. Components are
//! moved up and down in patterns of which at least one moves any two of them the same way and one against each other, so that what two
//! large terms leave of each other is seen whatever their signs.

use crate::num::StateArchive;

/// What rounding makes of a step, and memory to measure it.
#[derive(Debug, Clone)]
pub(super) struct Rounding {
    perturbed: Vec<f64>,
    changes: Vec<f64>,
    /// How much each component may change.
    pub noise: Vec<f64>,
    /// The largest error that rounding alone was seen to make of each component in a step.
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

    /// Turns the noise of rates into that of a step, which is so many times as much, and remembers the largest. `sizes`: what errors of the
    /// components the tolerance allows.
    pub(super) fn in_step(&mut self, times: f64, sizes: impl Iterator<Item = f64>) {
        for ((noise, largest), size) in self.noise.iter_mut().zip(&mut self.largest).zip(sizes) {
            *noise *= times;
            *largest = largest.max(*noise);
            self.tolerances = self.tolerances.max(*noise / size);
        }
    }

    /// Measures it at a state. `change` writes what rates, or what comes of them, change by where the state has moved, and may write over
    /// the state. Tells how often it was called.
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
                // What overflows is no rounding.
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
mod tests {
    use super::*;

    /// Rates that are differences of two large numbers, of whatever signs and places.
    #[test]
    fn cancelling_terms_are_detected_in_every_pair_of_places() {
        for size in 2..20 {
            let mut rounding = Rounding::new(size);
            for (i, j, sign) in (0..size).flat_map(|i| (0..i).flat_map(move |j| [(i, j, 1.0), (i, j, -1.0)])) {
                let mut state = vec![0.0; size];
                (state[i], state[j]) = (1.0, sign);
                // The rate is zero where it stands.
                rounding.measure(&state, |x, change| {
                    change.fill(0.0);
                    change[i] = 1e6 * (x[i] - sign * x[j]);
                });
                assert!((rounding.noise[i] / (1e6 * f64::EPSILON) - 1.0).abs() < 0.5, "{size} {i} {j} {sign}");
                assert!(rounding.noise[j] == 0.0);
            }
        }
    }
}

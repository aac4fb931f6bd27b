//! The sampled loop lifted over its common period, with a search of its disk margin.

use std::f64::consts::PI;

use faer::{Mat, c64};
use kardan_rt::functions::hypot;

use super::SampledLoop;
use kardan_math::num::{AtZero, Rounding, at_zero};

/// Directions in which the disk is searched, over half a turn.
const DIRECTIONS: usize = 24;
/// Smallest and largest disk that is tried, and the factor from one to the next.
const DISKS: [f64; 3] = [0.01, 2.0, 1.25];
/// Steps of the phase, over half a turn.
const TURNS: usize = 36;
/// Halvings of what has been bracketed.
const HALVINGS: usize = 40;
/// Excess of the radius over one that rounding alone may cause.
const BEYOND: f64 = 1e-10;

/// A sampled loop over the common period of all its clocks, opened at one motor, for errors that are the same at each sample: the
/// torque times a complex number.
///
/// The loop is periodic; its map over the common period, with the factor at each command, is exact. The margins are searched: the
/// eigenvalues of the map decide for each factor that is tried, and factors between those are not checked.
#[derive(Debug, Clone)]
pub struct Lifted {
    map: SampledLoop,
    split: AtZero,
}

impl Lifted {
    /// `free`: the number of uncontrolled rigid-body modes; `None` if the map has another number.
    pub(super) fn new(map: SampledLoop, free: usize) -> Option<Self> {
        let split = at_zero(&map.change(), Rounding::OfOne)?;
        (split.motions.columns() == free).then_some(Self { map, split })
    }

    /// Spectral radius of the map over the common period with this factor, without uncontrolled rigid-body modes; `None` if the
    /// iteration fails.
    pub fn radius(&self, (re, im): (f64, f64)) -> Option<f64> {
        let [re, im] =
            self.map.with_factor(c64::new(re, im)).map(|m| self.split.left.multiply(&m).multiply(&self.split.right));
        let n = re.rows();
        let all = Mat::from_fn(n, n, |i, j| c64::new(re[(i, j)], im[(i, j)])).eigenvalues().ok()?;
        let largest = all.iter().map(|x| hypot(x.re, x.im)).fold(0.0, f64::max);
        largest.is_finite().then_some(largest)
    }

    fn stable(&self, factor: c64) -> bool {
        self.radius((factor.re, factor.im)).is_some_and(|radius| radius < 1.0 + BEYOND)
    }

    /// The least phase change, rad, at which the loop is unstable; infinite if none is. Evaluated every 5°.
    pub fn phase(&self) -> f64 {
        let turn = |angle: f64| self.stable(c64::cis(angle));
        let step = PI / TURNS as f64;
        let Some(k) = (1..=TURNS).find(|k| !turn(step * *k as f64)) else { return f64::INFINITY };
        let (mut low, mut high) = (step * (k as f64 - 1.0), step * k as f64);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if turn(middle) { low = middle } else { high = middle }
        }
        low
    }

    /// The balanced disk: the least |δ| at which the factor `(1 + δ/2)/(1 − δ/2)` makes the loop unstable, in 25 directions of
    /// δ; 2 if none does below that.
    pub fn disk(&self) -> f64 {
        let [least, most, step] = DISKS;
        let stable = |size: f64, direction: usize| {
            let delta = c64::cis(PI * direction as f64 / DIRECTIONS as f64) * size;
            self.stable((1.0 + 0.5 * delta) / (1.0 - 0.5 * delta))
        };
        let mut low = 0.0;
        let mut size = least;
        loop {
            let wrong: Vec<usize> = (0..=DIRECTIONS).filter(|k| !stable(size, *k)).collect();
            let mut high = size;
            for &direction in &wrong {
                // Only a direction that is worse than those before counts.
                if stable(high * (1.0 - 1e-9), direction) {
                    continue;
                }
                let mut below = low;
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (below + high);
                    if stable(middle, direction) { below = middle } else { high = middle }
                }
            }
            if !wrong.is_empty() || size >= most {
                return high;
            }
            low = size;
            // At 2 a factor is infinite in one direction.
            size = (size * step).min(most * (1.0 - 1e-9));
            if low >= size {
                return most;
            }
        }
    }
}

//! The search for a Stribeck speed: all other parameters enter linearly.

use kardan_rt::functions::{exp, ln};

use super::FitOptions;
use super::solution::Solution;
use super::whitened::Whitened;

/// Places in which the Stribeck speed is bracketed, and steps of the golden section after that.
const BRACKETS: usize = 24;

const SECTIONS: usize = 40;

/// The Stribeck speed of one extra column with the smallest residual, between the lowest and the highest speed; whether it is at an end.
pub(super) fn search(data: &mut Whitened, extra: usize, options: &FitOptions, first: bool) -> Option<bool> {
    let speeds = data.speeds.iter().skip(extra).step_by(data.extras.max(1)).copied().filter(|v| *v > 0.0);
    let (low, high) = speeds.fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
    if !(low < high) {
        return Some(true);
    }
    let (low, high) = (ln(low / 2.0), ln(high));
    let mut cost = |log: f64| -> Option<f64> {
        if let Some((scale, _)) = &mut data.shapes[extra] {
            *scale = exp(log);
        }
        Solution::of(data, options).map(|found| found.estimate.residual)
    };
    let grid = |k: usize| low + (high - low) * k as f64 / (BRACKETS - 1) as f64;
    let mut best = (0, f64::INFINITY);
    for k in 0..BRACKETS {
        let found = cost(grid(k))?;
        if found < best.1 {
            best = (k, found);
        }
    }
    let (mut a, mut b) = (grid(best.0.saturating_sub(1)), grid((best.0 + 1).min(BRACKETS - 1)));
    let ratio = (5.0_f64.sqrt() - 1.0) / 2.0;
    let (mut x, mut y) = (b - ratio * (b - a), a + ratio * (b - a));
    let (mut fx, mut fy) = (cost(x)?, cost(y)?);
    for _ in 0..if first { SECTIONS / 2 } else { SECTIONS } {
        if fx < fy {
            (b, y, fy) = (y, x, fx);
            x = b - ratio * (b - a);
            fx = cost(x)?;
        } else {
            (a, x, fx) = (x, y, fy);
            y = a + ratio * (b - a);
            fy = cost(y)?;
        }
    }
    let middle = (a + b) / 2.0;
    cost(middle)?;
    Some(middle - low < 1e-3 || high - middle < 1e-3)
}

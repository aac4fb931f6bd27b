//! Finds a zero of a function between two points of opposite sign.

use kardan_rt::functions::{log2, powi};

/// Halvings after which no number lies between two.
const MOST: f64 = 2200.0;
/// Most evaluations in addition to those of halving.
const SLACK: i32 = 1;
/// How far the step of the secant is drawn to the middle, of the square of the bracket over its first length.
const DRAWN: f64 = 0.2;

/// Where a function changes its sign, between a place at which it is negative and one at which it is positive, with its values
/// there: the two places once they are no further apart than a tolerance, or next to each other.
///
/// Only the sign decides on which side a place lies; sizes make it fast, and may be infinite. Method: interpolate, truncate,
/// project (Oliveira, Takahashi 2020): as fast as the secant where the function is smooth, never more than two evaluations more than
/// halving.
///
/// ```
/// use kardan_math::num::bracket;
/// let mut count = 0;
/// let cube = |x: f64| { count += 1; x * x * x - 2.0 };
/// let [low, high] = bracket([(1.0, -1.0), (2.0, 6.0)], 1e-14, cube);
/// assert!(low.powi(3) < 2.0 && high.powi(3) >= 2.0 && high - low <= 1e-14);
/// assert!(count < 16, "{count}");
/// ```
pub fn bracket([negative, positive]: [(f64, f64); 2], tolerance: f64, mut f: impl FnMut(f64) -> f64) -> [f64; 2] {
    let ((mut low, mut below), (mut high, mut above)) = (negative, positive);
    let length = (high - low).abs();
    // A tolerance may be below the least number there is.
    let most = log2(length / tolerance).ceil().clamp(0.0, MOST) as i32 + SLACK;
    for count in 0..=most {
        let middle = 0.5 * (low + high);
        if (high - low).abs() <= tolerance || middle == low || middle == high {
            break;
        }
        // How far from the middle a place may be, so that no more evaluations are needed than halving needs.
        let reach = (0.5 * tolerance * powi(2.0, most - count) - 0.5 * (high - low).abs()).max(0.0);
        let secant = low - below * (high - low) / (above - below);
        let drawn = DRAWN * powi(high - low, 2) / length;
        let side = (middle - secant).signum();
        let truncated = if drawn <= (middle - secant).abs() { secant + side * drawn } else { middle };
        let projected = if (truncated - middle).abs() <= reach { truncated } else { middle - side * reach };
        let inside = (projected - low) * (projected - high) < 0.0;
        let place = if inside { projected } else { middle };
        let value = f(place);
        if value < 0.0 { (low, below) = (place, value) } else { (high, above) = (place, value) }
    }
    [low, high]
}

#[cfg(test)]
#[path = "../../tests/unit/num/bracket.rs"]
mod tests;

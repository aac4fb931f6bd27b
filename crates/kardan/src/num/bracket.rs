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
/// use kardan::num::bracket;
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
mod tests {
    use kardan_rt::functions::{cbrt, sin};

    use super::*;

    /// Where the ends are as small as numbers get, and the tolerance vanishes.
    #[test]
    fn ends_may_be_as_small_as_numbers_are() {
        for least in [f64::MIN_POSITIVE, 5e-324, 1e-310] {
            let f = |x: f64| x - 0.7 * least;
            let [low, high] = bracket([(0.0, f(0.0)), (least, f(least))], f64::EPSILON * least, f);
            assert!(f(low) < 0.0 && f(high) >= 0.0 && 0.5 * (low + high) <= high, "{least:e}: {low:e} {high:e}");
        }
    }

    /// Steps, steep and flat functions, either way round: the sign changes between the two places, at the cost of halving at most.
    #[test]
    fn signs_change_between_the_places() {
        type Named = (&'static str, fn(f64) -> f64);
        let functions: [Named; 6] = [
            ("step", |x| if x < 0.7311 { -1.0 } else { 1.0 }),
            ("infinite beyond", |x| if x < 0.7311 { x - 0.7311 } else { f64::INFINITY }),
            ("flat", |x| powi(x - 0.3, 9)),
            ("steep", |x| cbrt(x - 0.9)),
            ("bent", |x| if x < 0.5 { x - 0.5 } else { 1e6 * (x - 0.5) }),
            ("wave", |x| sin(40.0 * x) + 8.0 * (x - 0.4)),
        ];
        for (name, f) in functions {
            for mirrored in [false, true] {
                let f = |x: f64| if mirrored { f(1.0 - x) } else { f(x) };
                let ends = [0.0, 1.0].map(|x| (x, f(x)));
                let ends = if mirrored { [ends[1], ends[0]] } else { ends };
                let mut count = 0;
                let [low, high] = bracket(ends, 1e-13, |x| {
                    count += 1;
                    f(x)
                });
                assert!(f(low) < 0.0 && f(high) >= 0.0 && (high - low).abs() <= 1e-13, "{name}: {low} {high}");
                assert!(count <= 46, "{name}: {count}");
            }
        }
    }
}

//! The map of a sampled loop with the exact numbers of its plant, to so many digits that its stability can be certified.

use std::cell::{Cell, OnceCell};

use kardan_rt::functions::{exp2, log2};

use super::event_sequence::{EventSequence, Periods, map_from};
use super::jump::Jump;
use super::places::{FirstOrderPlant, Places};
use super::{LoopPlant, SampledPart};
use kardan_analysis::{Plane, stability_of};
use kardan_math::num::{
    ExactZoh, Matrix, Polynomial, Rational, Scalar, cayley, characteristic_polynomial, contracts, root_sides, selected,
};
use kardan_results::{Stability, StabilityEvidence, StabilityVerdict};

/// Binary digits to which exponentials are computed: more where fewer decide nothing.
const DIGITS: [usize; 3] = [128, 256, 1024];
/// Most states of a map for this test.
const MOST: usize = 32;
/// Distances to the unit circle that are tried, as powers of two.
const DISTANCES: [i32; 6] = [4, 8, 16, 32, 64, 128];

/// The map over one period of a loop, `z(t + T) = Φ z(t)`: its plant is exact, its laws have the gains that run, those at every instant before rounding
/// where that is known; times are as they are written.
#[derive(Debug, Clone)]
pub struct ExactMap {
    /// Φ, off by less than 2^off in the largest sum of sizes in a row.
    map: Matrix<Rational>,
    /// log₂; −∞ where the map is exact, as all exponentials end.
    off: f64,
    /// T, s.
    period: f64,
}

impl ExactMap {
    /// Whether the loop of a plant that is known before rounding is stable, but for this many motions, which are known to stay whatever the clocks:
    /// exactly at one. `None` of another plant, above 32 states, where clocks have no short common period, or a number is too large.
    pub fn stability_of(plant: &LoopPlant, parts: &[SampledPart], at_one: usize) -> Option<StabilityVerdict> {
        let mut found = None;
        for digits in DIGITS {
            found = Self::new(plant, parts, digits).map(|map| map.stability(at_one)).or(found);
            if found.as_ref().is_some_and(|verdict| verdict.word != Stability::Undecided) {
                break;
            }
        }
        found
    }

    fn new(plant: &LoopPlant, parts: &[SampledPart], digits: usize) -> Option<Self> {
        let periods = Periods::of(parts, None).ok()?;
        let places = Places::of(FirstOrderPlant::exact(plant)?, parts, false);
        if places.size > MOST {
            return None;
        }
        let (flow, _) = places.flow();
        let worst = Cell::new(f64::NEG_INFINITY);
        let exponential = |time: f64| {
            let (jump, off) = exponential(&flow, time, digits)?;
            worst.set(worst.get().max(off));
            Some(jump)
        };
        let event_sequence = EventSequence::over(parts, &periods, &places, exponential).ok()?;
        let (mut map, mut off) = (event_sequence.map(places.size), event_sequence.off(worst.get()));
        if off > f64::NEG_INFINITY {
            // Products have many more digits than are known.
            map = Matrix::from_fn(map.rows(), map.columns(), |i, j| cut(&map[(i, j)], digits));
            off = off.max(log2(map.rows() as f64) - digits as f64) + 1.0;
        }
        (off < 0.0).then_some(Self { map, off, period: periods.period })
    }

    /// The map of a driven loop over the time between the commands of a law, each entry rounded once; `None` as of
    /// [`stability_of`](Self::stability_of), or where the law commands more than once in a period.
    pub(super) fn between_commands(plant: &LoopPlant, parts: &[SampledPart], law: usize) -> Option<Matrix<f64>> {
        let periods = Periods::of(parts, None).ok()?;
        let places = Places::of(FirstOrderPlant::exact(plant)?, parts, true);
        if places.size > MOST {
            return None;
        }
        let (flow, _) = places.flow();
        let waited = |time: f64| Some(exponential(&flow, time, DIGITS[1])?.0);
        let EventSequence { events, jumps, applied, .. } =
            EventSequence::over(parts, &periods, &places, waited).ok()?;
        let [first] = applied[law][..] else { return None };
        Some(map_from(first, &events, &jumps, places.size).to_f64())
    }

    /// Whether the loop is stable but for this many motions.
    ///
    /// Method: where the map is exact, as where all exponentials end, [`stability_of`]. Else it may be shown to contract ([`contracts`]), which
    /// takes least. If not, its characteristic polynomial p̃ is that of a
    /// map next to the true one. Circles on either side of the border contain equally many roots of p̃, counted exactly, so that on the border, of
    /// radius c, |p̃| is at least (half their distance)ⁿ. That is more than p̃ is off there, so the true polynomial has as many roots inside
    /// (Rouché).
    fn stability(&self, at_one: usize) -> StabilityVerdict {
        if self.off == f64::NEG_INFINITY {
            let mut found = stability_of(&self.map, Plane::Discrete);
            for motion in &mut found.border {
                motion.uncontrolled = motion.frequency == 0.0 && motion.poles == at_one && motion.growth_exponent <= 1;
                motion.frequency /= self.period;
            }
            return match found.border.is_empty() {
                true => found,
                false => StabilityVerdict::exact(false, found.border),
            };
        }
        let word = |word| StabilityVerdict::plain(word, StabilityEvidence::Certified);
        let free = || StabilityVerdict { evidence: StabilityEvidence::Certified, ..StabilityVerdict::free(at_one) };
        if contracts(&self.map, self.off, at_one) {
            return if at_one == 0 { word(Stability::Stable) } else { free() };
        }
        let n = self.map.rows();
        // On circles of radius below 1.5: n ‖E‖ (‖z − Φ‖ + ‖E‖)ⁿ⁻¹.
        let size = log_norm(&self.map).max(0.0) + 2.0;
        let off = log2(n as f64) + self.off + (n as f64 - 1.0) * size;
        let whole = OnceCell::new();
        let mut tried = 0;
        for distance in DISTANCES {
            // Half the width of the ring that is free of roots, to the power n, less what cutting digits adds.
            let least = -(n as f64) * f64::from(distance + 2);
            if least < off + 1.0 {
                break;
            }
            tried = distance;
            let digits = (2.0 - least) as usize + n + 8;
            let polynomial = whole.get_or_init(|| characteristic_polynomial(&self.map));
            let polynomial = Polynomial::new(polynomial.coefficients().iter().map(|c| cut(c, digits)).collect());
            let ring = |centre: i32| {
                // Radii 1 + (centre ± 1/2) 2^−distance.
                [2 * centre - 1, 2 * centre + 1].map(|half_steps| {
                    let step = Rational::ONE / power_of_two(distance + 1);
                    inside(&polynomial, &(Rational::ONE + Rational::from(half_steps) * step))
                })
            };
            match at_one {
                0 => match ring(0) {
                    [Some(low), Some(high)] if low == high && low == n => return word(Stability::Stable),
                    [Some(low), Some(high)] if low == high => return word(Stability::Unstable),
                    _ => {}
                },
                _ => match (ring(-1), ring(1)) {
                    ([Some(low), Some(high)], _) if low == high && low == n - at_one => {
                        return free();
                    }
                    (_, [Some(low), Some(high)]) if low == high && low < n => return word(Stability::Unstable),
                    _ => {}
                },
            }
        }
        StabilityVerdict::undecided(format!(
            "a pole is within {:.0e} of the unit circle, or on it, and the exponentials of the map are no fractions",
            exp2(-f64::from(tried))
        ))
    }
}

/// How many roots lie inside a circle; `None` if some are on it.
fn inside(polynomial: &Polynomial, radius: &Rational) -> Option<usize> {
    let mut power = Rational::ONE;
    let scaled = polynomial.coefficients().iter().map(|c| {
        let scaled = c * &power;
        power = &power * radius;
        scaled
    });
    let scaled = Polynomial::new(scaled.collect());
    let transformed = cayley(&scaled);
    let sides = root_sides(&transformed);
    (transformed.degree() == scaled.degree() && sides.border == 0).then_some(sides.left)
}

/// The number with so many binary digits behind the point.
fn cut(x: &Rational, digits: usize) -> Rational {
    let scale = power_of_two(digits as i32);
    Rational::from((x * &scale).round()) / scale
}

fn power_of_two(exponent: i32) -> Rational {
    Rational::from(dashu_int::UBig::ONE << exponent.unsigned_abs() as usize)
}

/// log₂ of the largest sum of sizes in a row, rounded up.
fn log_norm(matrix: &Matrix<Rational>) -> f64 {
    let row = |i: usize| matrix.row(i).iter().map(|x| Scalar::to_f64(x).abs()).sum::<f64>();
    log2((0..matrix.rows()).map(row).fold(0.0, f64::max) * (1.0 + 1e-9))
}

/// The map over a time without events, and log₂ of its error bound.
fn exponential(flow: &Matrix<Rational>, time: f64, digits: usize) -> Option<(Jump<Rational>, f64)> {
    let n = flow.rows();
    let (moving, still): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| flow.row(i).iter().any(|x| !x.is_zero()));
    let part = |columns: &[usize]| selected(flow, &moving, columns);
    // Times are differences of doubles: as many digits as the times in the model file have.
    let time = super::places::exact_time(time)?;
    let ExactZoh { transition, integral, off } = ExactZoh::new(&part(&moving), &time, digits)?;
    let driving = part(&still);
    let driven = integral.multiply(&driving);
    let mut jump = Jump::new();
    for (i, &row) in moving.iter().enumerate() {
        let own = moving.iter().copied().zip(transition.row(i).iter().cloned());
        let driven = still.iter().copied().zip(driven.row(i).iter().cloned());
        jump.push(row, own.chain(driven).filter(|(_, x)| !x.is_zero()).collect());
    }
    let size = log_norm(&part(&moving)).max(log_norm(&driving)).max(0.0);
    Some((jump, off + size + 1.0))
}

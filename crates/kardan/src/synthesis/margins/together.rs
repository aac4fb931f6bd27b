use faer::{Mat, c64};
use kardan_rt::functions::{exp, hypot, ln, powi};

use super::Response;
use super::response::largest_singular;

/// By how much the bound may be larger than the largest value that was found.
const LOOSE: f64 = 1e-3;
/// Scalings that are tried.
const SCALINGS: usize = 200;
/// Places at which the worst errors are searched.
const PLACES: usize = 5;
/// Phases of one channel that are tried, before the best is refined.
const PHASES: usize = 24;
/// Steps of a search along a line.
const LINE: usize = 30;

/// How wrong all channels of a loop may be at once, each in its own way.
#[derive(Debug, Clone, PartialEq)]
pub struct Together {
    /// α: every set of errors `(1 + δ/2)/(1 − δ/2)` with |δ| below the first leaves the loop stable; with the second one set is
    /// known that does not. The worst lies between.
    pub disk: [f64; 2],
    /// The frequency of that set, rad/s.
    pub frequency: f64,
    /// That set: of each channel the complex factor, real and imaginary part, with which the loop is just not stable.
    pub worst: Vec<(f64, f64)>,
}

/// The disk margin of all channels at once, from both sides.
///
/// The structured singular value of M + ½ with one complex error for each channel. From above: scalings `D M D⁻¹`, each the best
/// at some frequency, and for each the frequencies between which a level test proves it small enough, until all are covered.
/// From below: the largest spectral radius of M + ½ with its rows turned. With up to three channels both agree at each
/// frequency. `None` if an iteration fails.
pub fn together(response: &Response) -> Option<Together> {
    let m = response.channels();
    let half = response.balanced();
    let best_at = |place: f64| best_scaling(&half.at(place));
    let mut looked: Vec<(f64, f64)> = Vec::new();
    let mut level = 0.0f64;
    let look = |place: f64, level: &mut f64, looked: &mut Vec<(f64, f64)>| {
        let (size, scaling) = best_at(place);
        looked.push((size, place));
        *level = level.max(size * (1.0 + LOOSE));
        scaling
    };
    for place in half.first_places() {
        look(place, &mut level, &mut looked);
    }
    for k in 0..m {
        look(response.channel(k).balanced().peak()?.1, &mut level, &mut looked);
    }
    // What is not yet covered; the worst place first.
    let mut open = vec![(0.0f64, f64::INFINITY)];
    let worst_place = looked.iter().max_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |x| x.1);
    let mut next = Some(worst_place);
    let mut proven = false;
    for _ in 0..SCALINGS {
        let Some(&(low, high)) = open.last() else {
            proven = true;
            break;
        };
        let middle = match (low, high) {
            (0.0, f64::INFINITY) => 1.0,
            (low, f64::INFINITY) => 2.0 * low,
            (0.0, high) => 0.5 * high,
            (low, high) => (low * high).sqrt(),
        };
        let place = next.take().unwrap_or(middle);
        let before = level;
        let scaling = look(place, &mut level, &mut looked);
        if level > before && place == middle {
            // A higher level holds for what was covered before, too.
            next = None;
        }
        let scaled = half.scaled(&scaling);
        let places = scaled.level(level)?;
        let real = places.into_iter().filter(|place| scaled.size(*place) > level * (1.0 - 1e-6));
        let (mut from, mut to) = (0.0f64, f64::INFINITY);
        for other in real {
            if other < place {
                from = from.max(other);
            } else if other > place {
                to = to.min(other);
            }
        }
        open = without(open, from, to);
    }
    looked.sort_by(|a, b| b.0.total_cmp(&a.0));
    looked.dedup_by(|a, b| a.1 == b.1);
    if !proven {
        // One scaling for all frequencies.
        level = half.scaled(&best_at(looked.first()?.1).1).peak()?.0;
    }
    let found = looked.iter().take(PLACES).map(|(_, place)| {
        let (size, turns) = worst_turns(&half.at(*place));
        (size, *place, turns)
    });
    let (size, place, turns) = found.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let worst = turns.iter().map(|turn| {
        let delta = *turn / size;
        let factor = (1.0 + 0.5 * delta) / (1.0 - 0.5 * delta);
        (factor.re, factor.im)
    });
    Some(Together { disk: [1.0 / level, 1.0 / size], frequency: response.frequency(place), worst: worst.collect() })
}

/// Bounds of the structured singular value of a square matrix, for one complex error of each channel: below by errors that were
/// found, above by a scaling.
///
/// # Panics
/// If the matrix is not square.
pub fn structured_singular_value(matrix: &Mat<c64>) -> [f64; 2] {
    assert_eq!(matrix.nrows(), matrix.ncols(), "an error for each channel");
    [worst_turns(matrix).0, best_scaling(matrix).0]
}

/// What intervals leave of theirs outside another one; what is too narrow to tell its ends apart goes too.
fn without(intervals: Vec<(f64, f64)>, from: f64, to: f64) -> Vec<(f64, f64)> {
    let mut left = Vec::new();
    for (low, high) in intervals {
        if to <= low || from >= high {
            left.push((low, high));
            continue;
        }
        if low < from {
            left.push((low, from));
        }
        if to < high {
            left.push((to, high));
        }
    }
    left.retain(|(low, high)| high - low > 1e-9 * high || high.is_infinite());
    left
}

/// The largest singular value of `D M D⁻¹` with the best diagonal D, and D.
///
/// First rows and columns alike in size (Osborne), then line searches in log D, in which the value is convex.
fn best_scaling(matrix: &Mat<c64>) -> (f64, Vec<f64>) {
    let m = matrix.nrows();
    let mut d = vec![0.0f64; m];
    let size = |i: usize, j: usize| hypot(matrix[(i, j)].re, matrix[(i, j)].im);
    for _ in 0..20 {
        for k in 0..m {
            let others = || (0..m).filter(|i| *i != k);
            let row: f64 = others().map(|j| powi(size(k, j) * exp(d[k] - d[j]), 2)).sum();
            let column: f64 = others().map(|i| powi(size(i, k) * exp(d[i] - d[k]), 2)).sum();
            if row > 0.0 && column > 0.0 {
                d[k] += 0.25 * ln(column / row);
            }
        }
    }
    let value = |d: &[f64]| {
        largest_singular(&Mat::from_fn(m, m, |i, j| {
            matrix[(i, j)] * c64::new(exp((d[i] - d[j]).clamp(-60.0, 60.0)), 0.0)
        }))
    };
    let mut best = value(&d);
    // Along single channels, then along sums of them, as kinks stop the former.
    let directions: Vec<Vec<f64>> = (1..1usize << m.saturating_sub(1).min(4))
        .map(|bits| (0..m).map(|k| f64::from(u8::from(bits >> k & 1 == 1))).collect())
        .chain((1..m).flat_map(|k| (k + 1..m).map(move |j| (k, j))).map(|(k, j)| {
            (0..m)
                .map(|i| {
                    if i == k {
                        1.0
                    } else if i == j {
                        -1.0
                    } else {
                        0.0
                    }
                })
                .collect()
        }))
        .collect();
    for round in 0..if m > 1 { 12 } else { 0 } {
        let before = best;
        for direction in &directions {
            let along = |t: f64| -> Vec<f64> { d.iter().zip(direction).map(|(d, x)| d + t * x).collect() };
            let reach = if round == 0 { 4.0 } else { 0.5 };
            let t = golden(-reach, reach, &|t| value(&along(t)));
            let found = value(&along(t));
            if found < best {
                (best, d) = (found, along(t));
            }
        }
        if before - best <= 1e-9 * best {
            break;
        }
    }
    (best, d.iter().map(|x| exp(x.clamp(-60.0, 60.0))).collect())
}

/// Turns of the channels with the largest spectral radius of `diag(turns) M`, such that one eigenvalue is real and positive.
fn worst_turns(matrix: &Mat<c64>) -> (f64, Vec<c64>) {
    let m = matrix.nrows();
    let largest = |angles: &[f64]| {
        let turned = Mat::from_fn(m, m, |i, j| matrix[(i, j)] * c64::cis(angles[i]));
        let all = turned.eigenvalues().unwrap_or_default();
        all.into_iter().max_by(|a, b| a.norm_sqr().total_cmp(&b.norm_sqr())).unwrap_or_default()
    };
    let value = |angles: &[f64]| largest(angles).norm_sqr().sqrt();
    let mut best = (value(&vec![0.0; m]), vec![0.0; m]);
    let step = std::f64::consts::TAU / PHASES as f64;
    for start in 0..4 {
        let mut angles: Vec<f64> = (0..m).map(|k| f64::from(start * (k as i32)) * 1.7).collect();
        let mut now = value(&angles);
        for _ in 0..12 {
            let before = now;
            for k in 1..m {
                let with = |x: f64| {
                    let mut other = angles.clone();
                    other[k] = x;
                    other
                };
                let tried = (0..PHASES).map(|j| angles[k] + step * j as f64);
                let rough = tried.map(|x| (value(&with(x)), x)).max_by(|a, b| a.0.total_cmp(&b.0));
                let rough = rough.map_or(angles[k], |x| x.1);
                let fine = golden(rough - step, rough + step, &|x| -value(&with(x)));
                let found = value(&with(fine));
                if found > now {
                    (now, angles) = (found, with(fine));
                }
            }
            if now - before <= 1e-12 * now {
                break;
            }
        }
        if now > best.0 {
            best = (now, angles);
        }
    }
    let value = largest(&best.1);
    let back = value.conj() / best.0;
    (best.0, best.1.iter().map(|angle| c64::cis(*angle) * back).collect())
}

/// Where a convex function is smallest between two places (golden section).
fn golden(low: f64, high: f64, value: &dyn Fn(f64) -> f64) -> f64 {
    let part = 0.5 * (5f64.sqrt() - 1.0);
    let (mut low, mut high) = (low, high);
    let (mut a, mut b) = (high - part * (high - low), low + part * (high - low));
    let (mut at_a, mut at_b) = (value(a), value(b));
    for _ in 0..LINE {
        if at_a <= at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - part * (high - low);
            at_a = value(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + part * (high - low);
            at_b = value(b);
        }
    }
    0.5 * (low + high)
}

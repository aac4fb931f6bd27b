//! The Taylor series of the motion in one set of modes, coefficient by coefficient.
//!
//! Everything but the accelerations follows from the expressions of the loop ([`Series`]). With `H(t) a(t) = f(t) − Gᵀ(t) λ(t)` the
//! coefficient k of the accelerations is what the same factors give for `f_k − Σ_j H_j a_(k−j) − Σ_j G_jᵀ λ_(k−j)` over j from 1, and
//! that of the torques that hold makes `Σ_j g_j a_(k−j)` and the bias vanish along each direction.

use crate::plan::Series;
use crate::simulate::drive::{Drive, Limit};
use crate::simulate::friction::Mode;

/// Series of a machine, with memory of its own.
pub(super) struct Expansion {
    pub(super) series: Series,
    /// Coefficients of the accelerations, and of the torques that hold, those of an order one after the other.
    pub(super) accelerations: Vec<f64>,
    pub(super) torques: Vec<f64>,
    /// How many of both there are in an order.
    pub(super) counts: [usize; 2],
    /// Entries of each friction direction that depend on the position, with their places in the plan's memory; and its bias.
    pub(super) rows: Vec<Vec<(usize, usize)>>,
    pub(super) bias: Vec<Option<usize>>,
    /// Entries of the inertia that do: row, column, place.
    pub(super) inertia: Vec<(usize, usize, usize)>,
    /// What is found: forces, rates, powers, speeds along friction directions, commands.
    pub(super) forces: Vec<usize>,
    pub(super) rates: Vec<usize>,
    pub(super) friction_speeds: Vec<usize>,
    pub(super) commands: Vec<usize>,
    pub(super) scratch: Vec<f64>,
    /// The bias at the point of expansion.
    pub(super) friction_bias: Vec<f64>,
}

/// The directions that hold, and the acceleration bias along all directions.
pub(super) struct Holding<'a> {
    pub(super) directions: &'a [usize],
    pub(super) bias: &'a mut [f64],
}

/// Part of a limit that is kept clear of it.
const CLEAR: f64 = 1e-9;

impl Expansion {
    /// Whether modes and limits are certainly kept for so long, by series of that order; `c` are the torques that hold at most.
    pub(super) fn stays(
        &mut self,
        modes: &[Mode],
        holding: &[usize],
        c: &[f64],
        drives: &[Drive],
        (length, order): (f64, usize),
    ) -> bool {
        let Self { series, torques, counts, scratch, .. } = self;
        fn positive(
            scratch: &mut [f64],
            length: f64,
            coefficients: impl Iterator<Item = f64>,
            sign: f64,
            limit: f64,
        ) -> bool {
            let mut power = sign;
            scratch.iter_mut().zip(coefficients).for_each(|(term, coefficient)| {
                *term = coefficient * power;
                power *= length;
            });
            scratch[0] += limit;
            is_positive(scratch)
        }
        let scratch = &mut scratch[..order];
        let moving = modes.iter().zip(&self.friction_speeds).filter(|(mode, _)| **mode != Mode::Stick);
        for (mode, place) in moving {
            if !positive(scratch, length, series.of(*place), mode.sign(), 0.0) {
                return false;
            }
        }
        for (a, &k) in holding.iter().enumerate() {
            let torque = || torques[a..].iter().step_by(counts[1]).copied();
            let limit = c[k] * (1.0 - CLEAR);
            if ![1.0, -1.0].iter().all(|sign| positive(scratch, length, torque(), *sign, limit)) {
                return false;
            }
        }
        for (drive, place) in drives.iter().zip(&self.commands) {
            if drive.rate.is_some() || drive.limit_mode != Limit::Inside {
                return false;
            }
            let Some(limit) = drive.limit.map(|limit| limit * (1.0 - CLEAR)) else { continue };
            if ![1.0, -1.0].iter().all(|sign| positive(scratch, length, series.of(*place), *sign, limit)) {
                return false;
            }
        }
        true
    }

    /// Keeps the coefficients of order k of accelerations and torques.
    pub(super) fn keep(&mut self, k: usize, accelerations: &[f64], torques: &[f64]) {
        let [r, m] = self.counts;
        self.accelerations[k * r..][..r].copy_from_slice(accelerations);
        self.torques[k * m..][..m].copy_from_slice(torques);
    }

    /// Puts the forces of order k, less what lower orders take of them, and the bias along the directions that hold.
    pub(super) fn forces(&self, k: usize, holding: Holding<'_>, force: &mut [f64]) {
        let Self { series, accelerations, torques, counts: [r, m], .. } = self;
        for (force, place) in force.iter_mut().zip(&self.forces) {
            *force = series.value(*place, k);
        }
        for &(row, column, place) in &self.inertia {
            force[row] -= series.convolution(place, k, |order| accelerations[order * r + column]);
        }
        for (a, &direction) in holding.directions.iter().enumerate() {
            let mut bias = self.bias[direction].map_or(0.0, |place| series.value(place, k));
            for &(i, place) in &self.rows[direction] {
                force[i] -= series.convolution(place, k, |order| torques[order * m + a]);
                bias += series.convolution(place, k, |order| accelerations[order * r + i]);
            }
            holding.bias[direction] = bias;
        }
    }
}

/// Whether `Σ c_k s^k` is certainly positive for 0 < s ≤ 1, with more than its last term to spare where it is not at its begin. The
/// coefficients become others.
fn is_positive(c: &mut [f64]) -> bool {
    let Some((first, rest)) = c.split_first() else { return false };
    let spare = rest.last().map_or(0.0, |last| last.abs());
    let sizes = rest.iter().fold(0.0, |sum, c| sum + c.abs());
    if !(*first >= 0.0) {
        return false;
    }
    if *first > sizes + spare {
        return true;
    }
    // Coefficients of Bernstein's polynomials: b_j = Σ_i (j over i)/(n over i) c_i.
    let n = c.len() - 1;
    let mut binomial = 1.0;
    for (i, c) in c.iter_mut().enumerate() {
        *c /= binomial;
        binomial *= (n - i) as f64 / (i + 1) as f64;
    }
    for i in 1..=n {
        for j in (i..=n).rev() {
            c[j] += c[j - 1];
        }
    }
    c.iter().skip(1).all(|b| *b > spare)
}

#[cfg(test)]
mod tests {
    use super::is_positive;

    #[test]
    fn positive_polynomials_are_told_and_others_never() {
        // (1 − s)² + 1/10, s(1 − s/2), 1: positive; each with a term that is left out next to nothing.
        for c in [vec![1.1, -2.0, 1.0, 0.0], vec![0.0, 1.0, -0.5, 0.0], vec![1.0, 0.0]] {
            assert!(is_positive(&mut c.clone()), "{c:?}");
        }
        // A zero inside, at the end, a negative begin, no number, and a double zero just above the axis that the last term may hide.
        for c in [
            vec![1.0, -3.0, 1.0, 0.0],
            vec![1.0, -1.0, 0.0],
            vec![-1e-30, 1.0, 0.0],
            vec![f64::NAN, 1.0, 0.0],
            vec![1.0, f64::NAN, 0.0],
            vec![0.2501, -1.0, 1.0, 1e-3],
        ] {
            assert!(!is_positive(&mut c.clone()), "{c:?}");
        }
        // Random ones against a fine grid: what is told to be positive is.
        let mut seed = 1u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let mut told = 0;
        for _ in 0..20_000 {
            let c: Vec<f64> = (0..7).map(|k| random() + if k == 0 { 0.5 } else { 0.0 }).collect();
            if is_positive(&mut c.clone()) {
                told += 1;
                let at = |s: f64| c.iter().rev().fold(0.0, |sum, c| sum * s + c);
                assert!((1..=200).all(|k| at(f64::from(k) / 200.0) > 0.0), "{c:?}");
            }
        }
        assert!(told > 2000, "{told}");
    }
}

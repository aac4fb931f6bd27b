//! The Taylor series of the motion in one set of modes, coefficient by coefficient.
//!
//! All values except the accelerations follow from the expressions of the loop ([`PiecedSeries`]). With
//! `H(t) a(t) = f(t) − Gᵀ(t) λ(t)` the coefficient k of the accelerations is the solution with the same factors for
//! `f_k − Σ_j H_j a_(k−j) − Σ_j G_jᵀ λ_(k−j)` over j from 1, and that of the constraint torques makes `Σ_j g_j a_(k−j)`
//! and the bias vanish in each direction.

use kardan_rt::functions::{powf, powi};

use super::unilateral_kinds::{Kind, Unilaterals};
use crate::drive::{Drive, Saturation};
use crate::friction::{Bounds, Mode};
use kardan_expr::plan::PiecedSeries;
use kardan_math::num::bracket;

/// Series of a machine, with memory of its own.
pub(super) struct Expansion {
    pub(super) series: PiecedSeries,
    /// Coefficients of the accelerations, and of the constraint torques, order after order.
    pub(super) accelerations: Vec<f64>,
    pub(super) torques: Vec<f64>,
    /// The number of both per order.
    pub(super) counts: [usize; 2],
    pub(super) by_position: ByPosition,
    /// The outputs: forces, rates, powers, speeds in friction directions, commands.
    pub(super) forces: Vec<usize>,
    pub(super) rates: Vec<usize>,
    pub(super) friction_speeds: Vec<usize>,
    pub(super) commands: Vec<usize>,
    /// Two for each unilateral constraint: see
    /// [`UnilateralTerms::mode_inputs`](super::contact_expressions::UnilateralTerms::mode_inputs).
    pub(super) unilaterals: Vec<usize>,
    /// The coefficients of the power of prescribed speeds for each acceleration, and for the torque of each sticking
    /// friction.
    pub(super) power: [Vec<usize>; 2],
    /// Sliders, each with the place of its torque.
    pub(super) jenkins: Vec<(usize, usize)>,
    pub(super) scratch: Vec<f64>,
    /// Whether rows need values that follow from the states.
    pub(super) rows_follow: bool,
    /// The bias at the point of expansion.
    pub(super) friction_bias: Vec<f64>,
}

/// The indices of position-dependent values in the memory of the plan: entries of the inertia (row, column, index) and
/// of each direction (column, index), biases of directions.
pub(super) struct ByPosition {
    pub inertia: Vec<(usize, usize, usize)>,
    pub rows: Vec<Vec<(usize, usize)>>,
    pub bias: Vec<Option<usize>>,
}

/// The active directions, and the acceleration bias in all directions.
pub(super) struct Holding<'a> {
    pub(super) directions: &'a [usize],
    pub(super) bias: &'a mut [f64],
}

/// The directions that may leave their mode.
pub(super) struct Watch<'a> {
    pub(super) modes: &'a [Mode],
    pub(super) holding: &'a [usize],
    pub(super) unilaterals: &'a Unilaterals,
    pub(super) bounds: Bounds<'a>,
}

/// Safety margin to a limit, as a part of it.
const CLEAR: f64 = 1e-9;
/// Part of a step to which a zero is located at last, and halvings for one margin.
const LEAST: f64 = 1e-10;
const HALVINGS: usize = 200;
/// How often a step is shortened for the terms of the numbers that decide pieces.
const SHORTENINGS: usize = 60;
/// The largest ratio of their last terms to those before.
const FALL: f64 = 0.5;
/// Part of a step to which a zero of a series is found.
const EXACTLY: f64 = 1e-16;
/// A number that modes depend on, and the size of it that is rounding, SI.
const ROUNDED: f64 = 1e-12;
/// Coefficients of a series at most.
const MOST: usize = 32;

/// What the series prove about the modes within a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Prospect {
    /// They certainly stay.
    Stays,
    /// Up to this part of the step they certainly stay; there a margin vanishes.
    Leaves(f64),
    /// The series do not decide.
    Unknown,
}

impl Prospect {
    pub(super) fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Unknown, _) | (_, Self::Unknown) => Self::Unknown,
            (Self::Leaves(a), Self::Leaves(b)) => Self::Leaves(a.min(b)),
            (Self::Stays, other) | (other, Self::Stays) => other,
        }
    }
}

impl Expansion {
    /// Whether modes and limits stay valid for this time, except those of active constraints, by series of that order;
    /// `noise` returns the rounding error of a speed in a direction.
    pub(super) fn prospect(
        &mut self,
        watch: &Watch<'_>,
        noise: impl Fn(usize) -> f64,
        drives: &[Drive],
        (length, order): (f64, usize),
    ) -> Prospect {
        let mut prospect = self.unilateral_prospect(watch, (length, order));
        let Self { series, scratch, jenkins, .. } = self;
        let Watch { modes, unilaterals, bounds, .. } = watch;
        let scratch = &mut scratch[..order];
        let moving = modes.iter().zip(&self.friction_speeds).enumerate();
        let moving = moving.filter(|(k, (mode, _))| **mode != Mode::Stick && unilaterals.slips(*k));
        for (k, (mode, place)) in moving {
            // A direction that begins to slip has a speed of rounding size.
            let begin = mode.sign() * series.value(*place, 0);
            let rounding = if begin < 0.0 && -begin <= noise(k) { -begin } else { 0.0 };
            prospect = prospect.and(margin(scratch, length, series.of(*place), mode.sign(), rounding));
        }
        for (k, place) in jenkins.iter().filter(|(k, _)| modes[*k] == Mode::Stick) {
            // A direction that has just stopped slipping is at its limit except for rounding.
            let limit = bounds.forward[*k].max(series.value(*place, 0).abs());
            for sign in [1.0, -1.0] {
                prospect = prospect.and(margin(scratch, length, series.of(*place), sign, limit));
            }
        }
        for (drive, place) in drives.iter().zip(&self.commands) {
            if drive.rate.is_some() {
                return Prospect::Unknown;
            }
            let Some(limit) = drive.limit else { continue };
            let mut watch_margin = |sign: f64, limit: f64| {
                prospect = prospect.and(margin(scratch, length, series.of(*place), sign, limit));
            };
            match drive.limit_mode {
                Saturation::Free => [1.0, -1.0].into_iter().for_each(|sign| watch_margin(sign, limit)),
                active => watch_margin(active.sign(), -limit),
            }
        }
        prospect
    }

    /// Whether the active constraints stay within their limits, with no torques of those that follow from them.
    pub(super) fn prospect_of_holding(&mut self, watch: &Watch<'_>, (length, order): (f64, usize)) -> Prospect {
        let Self { series, torques, counts, scratch, .. } = self;
        let Watch { modes, holding, unilaterals, bounds } = watch;
        let scratch = &mut scratch[..order];
        let mut prospect = Prospect::Stays;
        for (a, &k) in holding.iter().enumerate().filter(|(_, k)| **k < modes.len()) {
            let torque = || torques[a..].iter().step_by(counts[1]).copied();
            if let Kind::Friction { at_rest } = unilaterals.kind(k)
                && let Some(unilateral) = k.checked_sub(unilaterals.first)
            {
                for sign in [1.0, -1.0] {
                    let reserve = series.of(self.unilaterals[2 * unilateral]).zip(torque());
                    let reserve = reserve.map(|(most, torque)| at_rest * most + sign * torque);
                    prospect = prospect.and(margin(scratch, length, reserve, 1.0, 0.0));
                }
                continue;
            }
            for (sign, limit) in [(1.0, bounds.backward[k]), (-1.0, bounds.forward[k])] {
                if limit.is_finite() {
                    prospect = prospect.and(margin(scratch, length, torque(), sign, limit));
                }
            }
        }
        prospect
    }

    /// Where the first operation with kinks changes to another of its pieces, and the longest step for which that is
    /// known: the last two terms of each number that decides a piece are then within a part of all its terms.
    pub(super) fn kink(&mut self, (length, order): (f64, usize), part: f64) -> (Prospect, f64) {
        let Self { series, scratch, .. } = self;
        if series.jump() {
            return (Prospect::Leaves(0.0), length);
        }
        let scratch = &mut scratch[..order];
        let mut kink_free = length;
        for (x, sign, more) in series.margins() {
            terms(scratch, 1.0, x, sign, more);
            kink_free = kink_free_length(scratch, kink_free, part);
        }
        let margins = series.margins();
        let found = margins.fold(Prospect::Stays, |found, (x, sign, more)| {
            terms(scratch, kink_free, x, sign, more);
            // An undefined value belongs to no piece that is taken.
            let is_nothing = scratch.iter().all(|term| *term == 0.0) || scratch.iter().any(|term| !term.is_finite());
            if is_nothing { found } else { found.and(first_zero(scratch, 0.0, true)) }
        });
        (found, kink_free)
    }

    /// The difference of values of a plan's memory and constraint torques from their series, at a time after the point
    /// of expansion, relative to the largest size of the terms.
    pub(super) fn difference(
        &self,
        watch: &Watch<'_>,
        drives: &[Drive],
        values: &[f64],
        active_torques: &[f64],
        (later, order): (f64, usize),
    ) -> f64 {
        let Self { series, torques, counts, .. } = self;
        let Watch { modes, holding, unilaterals, bounds } = watch;
        let apart = |coefficients: &mut dyn Iterator<Item = f64>, value: f64, limit: f64| {
            let (mut power, mut sum, mut size) = (1.0, 0.0, value.abs() + limit.abs() + ROUNDED);
            for coefficient in coefficients.take(order) {
                sum += coefficient * power;
                size += (coefficient * power).abs();
                power *= later;
            }
            // A value that is not a number counts as far away.
            let part = (sum - value).abs() / size;
            if part.is_nan() { 1.0 } else { part }
        };
        let of_place = |place: usize, limit: f64| apart(&mut series.of(place), values[place], limit);
        let slipping = modes.iter().zip(&self.friction_speeds).enumerate();
        let slipping = slipping.filter(|(k, (mode, _))| **mode != Mode::Stick && unilaterals.slips(*k));
        let mut most = slipping.fold(0.0f64, |most, (_, (_, place))| most.max(of_place(*place, 0.0)));
        for (a, &k) in holding.iter().enumerate().filter(|(_, k)| **k < modes.len()) {
            let limits = [bounds.forward[k], bounds.backward[k]];
            if limits.iter().any(|limit| limit.is_finite()) {
                let limit = limits.into_iter().filter(|limit| limit.is_finite()).fold(0.0, f64::max);
                let own = &mut torques[a..].iter().step_by(counts[1]).copied();
                most = most.max(apart(own, active_torques[a], limit));
            }
        }
        let places = self.unilaterals.iter().map(|place| (*place, 0.0));
        let jenkins = self.jenkins.iter().map(|(k, place)| (*place, bounds.forward[*k]));
        let limited = drives.iter().zip(&self.commands);
        let limited = limited.filter_map(|(drive, place)| Some((*place, drive.limit?)));
        places.chain(jenkins).chain(limited).fold(most, |most, (place, limit)| most.max(of_place(place, limit)))
    }

    /// Whether stops, soft stops and locks stay in their modes for this time.
    fn unilateral_prospect(&mut self, watch: &Watch<'_>, (length, order): (f64, usize)) -> Prospect {
        let Self { series, scratch, unilaterals: mode_inputs, .. } = self;
        let Watch { modes, unilaterals, .. } = watch;
        let scratch = &mut scratch[..order];
        let mut prospect = Prospect::Stays;
        for (unilateral, kind) in unilaterals.kinds.iter().enumerate() {
            let direction = unilaterals.first + unilateral;
            let [first, second] = [mode_inputs[2 * unilateral], mode_inputs[2 * unilateral + 1]];
            let mut watch_margin = |place: usize, sign: f64, limit: f64| {
                // A contact that opened or closed just now is beyond its limit by rounding.
                let begin = sign * series.value(place, 0) + limit;
                let rounding = if begin < 0.0 && begin > -LEAST { -begin } else { 0.0 };
                prospect = prospect.and(margin(scratch, length, series.of(place), sign, limit + rounding));
            };
            match (kind, modes[direction]) {
                (Kind::Lock, _) if unilaterals.engaged[unilateral] => watch_margin(first, 1.0, -0.5),
                (Kind::Lock, _) => watch_margin(first, -1.0, 0.5),
                (Kind::Stop { .. }, _) if !unilaterals.engaged[unilateral] => watch_margin(first, 1.0, 0.0),
                (Kind::Cushion { .. }, Mode::Stick) => watch_margin(first, 1.0, 0.0),
                (Kind::Cushion { .. }, Mode::Forward) => watch_margin(second, 1.0, 0.0),
                (Kind::Cushion { .. }, Mode::Backward) => {
                    watch_margin(first, -1.0, 0.0);
                    watch_margin(second, -1.0, 0.0);
                }
                _ => {}
            }
        }
        prospect
    }

    /// Stores the coefficients of order k of accelerations and of the torques of active directions.
    pub(super) fn store(&mut self, k: usize, accelerations: &[f64], torques: &[f64]) {
        let [r, m] = self.counts;
        self.accelerations[k * r..][..r].copy_from_slice(accelerations);
        self.torques[k * m..][..torques.len()].copy_from_slice(torques);
    }

    /// The contribution of accelerations and constraint torques to the coefficient of order k of the power of
    /// prescribed speeds.
    pub(super) fn prescribed_power(&self, k: usize, holding: &[usize]) -> f64 {
        let Self { series, accelerations, torques, counts: [r, m], power: [of_accelerations, of_holding], .. } = self;
        // A convolution leaves out the product with the value itself.
        let all = |place: usize, list: &[f64], width: usize, column: usize| {
            let of = |order: usize| list[order * width + column];
            series.value(place, 0) * of(k) + series.convolution(place, k, of)
        };
        let moved = of_accelerations.iter().enumerate().map(|(i, place)| all(*place, accelerations, *r, i));
        let sticking = holding.iter().enumerate();
        moved.sum::<f64>() + sticking.map(|(a, direction)| all(of_holding[*direction], torques, *m, a)).sum::<f64>()
    }

    /// Writes the forces of order k, minus the contributions of lower orders, and the bias in the active directions.
    pub(super) fn forces(&self, k: usize, holding: Holding<'_>, force: &mut [f64]) {
        let Self { series, accelerations, torques, counts: [r, m], by_position, .. } = self;
        for (force, place) in force.iter_mut().zip(&self.forces) {
            *force = series.value(*place, k);
        }
        for &(row, column, place) in &by_position.inertia {
            force[row] -= series.convolution(place, k, |order| accelerations[order * r + column]);
        }
        for (a, &direction) in holding.directions.iter().enumerate() {
            let mut bias = by_position.bias[direction].map_or(0.0, |place| series.value(place, k));
            for &(i, place) in &by_position.rows[direction] {
                force[i] -= series.convolution(place, k, |order| torques[order * m + a]);
                bias += series.convolution(place, k, |order| accelerations[order * r + i]);
            }
            holding.bias[direction] = bias;
        }
    }
}

/// `Σ c_k s^k`, even and odd orders apart, so that they do not wait for each other.
fn sum_of(c: &[f64], s: f64) -> f64 {
    let (square, mut pairs) = (s * s, c.rchunks_exact(2));
    let mut sums = [0.0; 2];
    for pair in &mut pairs {
        sums = [sums[0] * square + pair[0], sums[1] * square + pair[1]];
    }
    match pairs.remainder() {
        [first] => sums[0] * s + sums[1] * square + first,
        _ => sums[0] + sums[1] * s,
    }
}

/// The terms of a sign times a series, and a constant added.
fn terms(scratch: &mut [f64], length: f64, coefficients: impl Iterator<Item = f64>, sign: f64, more: f64) {
    let mut power = sign;
    scratch.iter_mut().zip(coefficients).for_each(|(term, coefficient)| {
        *term = coefficient * power;
        power *= length;
    });
    scratch[0] += more;
}

/// The longest step, at most a length, for which the last two terms of a series are within a part of all, and decrease:
/// a value that is almost zero here, such as `exp(-x²)` from afar, may be large outside the range of its series.
fn kink_free_length(coefficients: &[f64], mut length: f64, part: f64) -> f64 {
    let order = coefficients.len();
    for _ in 0..SHORTENINGS {
        let (mut power, mut sum, mut earlier, mut last) = (1.0, 0.0, 0.0f64, 0.0f64);
        for (k, coefficient) in coefficients.iter().enumerate() {
            let term = (coefficient * power).abs();
            sum += term;
            match k {
                0 => {}
                _ if k + 2 < order => earlier = earlier.max(term),
                1 => {}
                _ => last = last.max(term),
            }
            power *= length;
        }
        let most = if earlier > 0.0 { (part * sum).min(FALL * earlier) } else { part * sum };
        // A value that is not a number belongs to no piece that is taken.
        if !(last > most && sum.is_finite()) {
            break;
        }
        length *= powf(most / last, 1.0 / (order - 1).max(1) as f64).clamp(0.1, 0.95);
    }
    length
}

/// Where a sign times a series and a limit become negative within a step.
pub(super) fn margin(
    scratch: &mut [f64],
    length: f64,
    coefficients: impl Iterator<Item = f64>,
    sign: f64,
    limit: f64,
) -> Prospect {
    terms(scratch, length, coefficients, sign, limit);
    first_zero(scratch, CLEAR * limit.abs(), false)
}

/// Where `Σ c_k s^k` becomes negative first for 0 < s ≤ 1, if it is not certainly positive, with a margin above its
/// last term and `clear` where it is not at its begin. `open`: where it is not negative at the end, a value near zero
/// there is accepted.
///
/// Method: Bernstein coefficients bound the polynomial; where they do not decide, the interval is halved (de Casteljau).
fn first_zero(c: &[f64], clear: f64, open: bool) -> Prospect {
    let Some((first, rest)) = c.split_first() else { return Prospect::Unknown };
    let last = rest.last().map_or(0.0, |last| last.abs());
    let spare = last + clear;
    let sizes = rest.iter().fold(0.0, |sum, c| sum + c.abs());
    if !(*first >= 0.0 && sizes < f64::INFINITY && c.len() <= MOST) {
        return Prospect::Unknown;
    }
    if *first > sizes + spare {
        return Prospect::Stays;
    }
    // Coefficients of Bernstein's polynomials: b_j = Σ_i (j over i)/(n over i) c_i.
    let n = c.len() - 1;
    let (mut b, mut binomial) = ([0.0; MOST], 1.0);
    for (i, (b, c)) in b.iter_mut().zip(c).enumerate() {
        *b = c / binomial;
        binomial *= (n - i) as f64 / (i + 1) as f64;
    }
    for i in 1..=n {
        for j in (i..=n).rev() {
            b[j] += b[j - 1];
        }
    }
    let mut halvings = HALVINGS;
    let zero = Part { c, last, clear, from: 0.0, to: 1.0, open }.first_zero(&b, &mut halvings);
    match zero {
        _ if halvings == 0 => Prospect::Unknown,
        Some(at) => Prospect::Leaves(at),
        None => Prospect::Stays,
    }
}

/// A part of the interval on which a polynomial is evaluated.
struct Part<'a> {
    c: &'a [f64],
    /// The size of the last term at the end of the step, and the margin required besides.
    last: f64,
    clear: f64,
    from: f64,
    to: f64,
    open: bool,
}

impl Part<'_> {
    /// Where it becomes negative first in this part, whose Bernstein coefficients are given, if it is not certainly positive there.
    fn first_zero(&self, b: &[f64; MOST], halvings: &mut usize) -> Option<f64> {
        let Self { c, last, clear, from, to, open } = *self;
        let n = c.len() - 1;
        // The truncation error is smaller nearer to the begin.
        let spare = last * powi(to, n as i32) + clear;
        let own = &b[..=n];
        if own.iter().skip(1).all(|b| *b > spare) {
            return None;
        }
        if own[0] > 0.0 && own[n] < 0.0 && own.windows(2).all(|pair| pair[1] <= pair[0]) {
            // It decreases, so it vanishes once.
            let at = |s: f64| sum_of(c, s);
            return Some(bracket([(to, own[n]), (from, own[0])], EXACTLY, at)[0]);
        }
        if to - from < LEAST || *halvings == 0 {
            // At the begin the modes define the sign; elsewhere a value that does not become negative proves nothing.
            if own[n] < 0.0 {
                return Some(to);
            }
            if open && to == 1.0 {
                return None;
            }
            if from > 0.0 || own.iter().any(|b| *b < 0.0) {
                *halvings = 0;
            }
            return None;
        }
        *halvings -= 1;
        let (mut left, mut right) = ([0.0; MOST], *b);
        for i in 0..=n {
            left[i] = right[0];
            for j in 0..n - i {
                right[j] = 0.5 * (right[j] + right[j + 1]);
            }
        }
        // The remainder is the right half.
        let middle = 0.5 * (from + to);
        let earlier = Part { to: middle, ..*self }.first_zero(&left, halvings);
        earlier.or_else(|| Part { from: middle, ..*self }.first_zero(&right, halvings))
    }
}

#[cfg(test)]
#[path = "../../tests/unit/machine/expansion.rs"]
mod tests;

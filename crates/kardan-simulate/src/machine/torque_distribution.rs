//! Distribution of redundant friction: how sticking directions that depend on each other share their torque.

use super::expansion::{Prospect, margin};
use kardan_math::num::{Cholesky, dot};

/// The smallest torques relative to the stick limit of each direction, `min Σ (λ/c)²`; memory of its own.
pub(super) struct TorqueDistribution {
    /// Sticking directions: the independent ones, then the dependent ones.
    pub(super) sticking: Vec<usize>,
    /// Rows of B: each of them as a combination of the independent ones.
    combination: Vec<f64>,
    /// Bᵀ C² B, and its factor.
    normal: Vec<f64>,
    factor: Cholesky,
    regular: bool,
    weights: Vec<f64>,
    /// Torque of each sticking direction, N m.
    pub(super) torques: Vec<f64>,
    /// For evenly shared torques: the factor, and the weights; for series: torques of an order, and terms of all.
    even: Cholesky,
    ease: Vec<f64>,
    own: Vec<f64>,
    series: Vec<f64>,
    before: Vec<f64>,
}

/// Steps of Lawson's iteration, and the least part of the largest torque that counts in one.
const LAWSON: usize = 6;
const EASE: f64 = 0.1;

/// The independent ones among the sticking directions: their rows times the inverse inertia, and the factor of their Gram matrix.
pub(super) struct Holding<'a> {
    pub(super) directions: &'a [usize],
    pub(super) weighted: &'a [f64],
    pub(super) factor: &'a Cholesky,
}

impl TorqueDistribution {
    /// Memory for m directions over r coordinates.
    pub(super) fn new(m: usize, r: usize) -> Self {
        let least = m.min(r);
        Self {
            sticking: Vec::with_capacity(m),
            combination: vec![0.0; m * least],
            normal: vec![0.0; least * least],
            factor: Cholesky::new(0),
            regular: false,
            weights: vec![0.0; least],
            torques: vec![0.0; m],
            even: Cholesky::new(0),
            ease: Vec::with_capacity(m),
            own: Vec::with_capacity(least),
            series: Vec::new(),
            before: Vec::with_capacity(m),
        }
    }

    /// The directions that stick from now on.
    pub(super) fn choose(&mut self, holding: &[usize], following: &[usize]) {
        self.sticking.clear();
        self.sticking.extend(holding.iter().chain(following));
        (self.factor, self.even) = (Cholesky::new(holding.len()), Cholesky::new(holding.len()));
    }

    /// The position-dependent parts: B, and the factor of `Bᵀ C² B`. `rows` are all directions, c their largest
    /// torques.
    pub(super) fn prepare(&mut self, holding: &Holding<'_>, rows: &[f64], c: &[f64]) {
        let count = holding.directions.len();
        let r = rows.len() / c.len().max(1);
        for (row, &k) in self.sticking.iter().enumerate() {
            let coefficients = &mut self.combination[row * count..(row + 1) * count];
            if row < count {
                coefficients.fill(0.0);
                coefficients[row] = 1.0;
                continue;
            }
            for (a, value) in coefficients.iter_mut().enumerate() {
                *value = dot(&holding.weighted[a * r..(a + 1) * r], &rows[k * r..(k + 1) * r]);
            }
            holding.factor.solve(coefficients);
        }
        let normal = &mut self.normal[..count * count];
        let rows = self.combination.chunks_exact(count.max(1)).zip(&self.sticking).map(|(b, &k)| (b, 1.0, c[k]));
        find_normal(rows, count, normal);
        self.regular = self.factor.factor(normal);
    }

    /// The torques, from those of the independent directions; false if they are not determined.
    pub(super) fn share(&mut self, active_torque: &[f64], c: &[f64]) -> bool {
        if !self.regular {
            return false;
        }
        // (Bᵀ C² B) z = μ, λ = C² B z.
        let count = active_torque.len();
        let z = &mut self.weights[..count];
        z.copy_from_slice(active_torque);
        self.factor.solve(z);
        for (row, &k) in self.sticking.iter().enumerate() {
            self.torques[row] = c[k] * c[k] * dot(&self.combination[row * count..(row + 1) * count], z);
        }
        true
    }

    /// Whether some distribution of the torques certainly stays within the limit of each direction, for this time;
    /// `term` returns the terms of the orders of the series of the independent ones, `limit` those of a direction's
    /// limit. c are about those, and finite.
    ///
    /// Method: the torques are distributed in some way at the begin, and their changes with the smallest torques. The
    /// first try uses the smallest torques at the begin, the second one torques whose margins are nearly equal.
    pub(super) fn stays(
        &mut self,
        holding: usize,
        c: &[f64],
        (length, order): (f64, usize),
        term: impl Fn(usize, usize) -> f64,
        limit: impl Fn(usize, usize) -> f64,
    ) -> bool {
        let (mut own, mut series) = (std::mem::take(&mut self.own), std::mem::take(&mut self.series));
        let mut before = std::mem::take(&mut self.before);
        before.clone_from(&self.torques);
        own.resize(holding, 0.0);
        series.resize(order * self.sticking.len(), 0.0);
        let stays = (0..order).all(|k| {
            own.iter_mut().enumerate().for_each(|(a, torque)| *torque = term(k, a));
            let determined = self.share(&own, c);
            let terms = series.iter_mut().skip(k).step_by(order);
            terms.zip(&self.torques).for_each(|(term, torque)| *term = *torque);
            determined
        }) && (self.keeps(&series, (length, order), &limit) || {
            own.iter_mut().enumerate().for_each(|(a, torque)| *torque = term(0, a));
            let even = self.share_evenly(&own, c);
            let terms = series.iter_mut().step_by(order);
            terms.zip(&self.torques).for_each(|(term, torque)| *term = *torque);
            even && self.keeps(&series, (length, order), &limit)
        });
        (self.own, self.series) = (own, series);
        self.torques.clone_from(&before);
        self.before = before;
        stays
    }

    /// Whether torques, each with its series, certainly stay within their limits for this time.
    fn keeps(&mut self, series: &[f64], (length, order): (f64, usize), limit: impl Fn(usize, usize) -> f64) -> bool {
        let mut scratch = [0.0; 32];
        let Some(scratch) = scratch.get_mut(..order) else { return false };
        self.sticking.iter().zip(series.chunks_exact(order.max(1))).all(|(&k, series)| {
            let most = limit(k, 0);
            [1.0, -1.0].into_iter().all(|sign| {
                let room = series.iter().enumerate();
                let room = room.map(|(j, torque)| if j == 0 { sign * torque } else { limit(k, j) + sign * torque });
                most == f64::INFINITY || margin(scratch, length, room, 1.0, most) == Prospect::Stays
            })
        })
    }

    /// Torques whose largest ratio to c is as small as a few steps of Lawson's iteration make it: false if it is not
    /// below one.
    ///
    /// Method: weighted least squares, large residuals get more weight in the next iteration (Lawson, Contributions to
    /// the theory of linear least maximum approximation, 1961).
    fn share_evenly(&mut self, active_torque: &[f64], c: &[f64]) -> bool {
        let count = active_torque.len();
        let Self { sticking, combination, normal, even, ease, weights, torques, .. } = self;
        ease.clear();
        ease.resize(sticking.len(), 1.0);
        let mut least = f64::INFINITY;
        for _ in 0..LAWSON {
            let normal = &mut normal[..count * count];
            let rows = || combination.chunks_exact(count.max(1)).zip(&*sticking);
            find_normal(rows().zip(&*ease).map(|((b, &k), ease)| (b, *ease, c[k])), count, normal);
            let z = &mut weights[..count];
            z.copy_from_slice(active_torque);
            if !even.factor(normal) {
                return false;
            }
            even.solve(z);
            let part = |b: &[f64], k: usize, ease: f64| ease * c[k] * dot(b, z);
            let most = rows().zip(&*ease).fold(0.0f64, |most, ((b, &k), ease)| most.max(part(b, k, *ease).abs()));
            if most < least {
                least = most;
                for (((b, &k), ease), torque) in rows().zip(&*ease).zip(&mut *torques) {
                    *torque = c[k] * part(b, k, *ease);
                }
            }
            for ((b, &k), ease) in rows().zip(&mut *ease) {
                *ease *= most / part(b, k, *ease).abs().max(EASE * most);
            }
        }
        least < 1.0
    }
}

/// `Bᵀ E C² B` over `count` directions, from the rows of B, each with its entries of E and of C.
fn find_normal<'a>(rows: impl Iterator<Item = (&'a [f64], f64, f64)>, count: usize, out: &mut [f64]) {
    out.fill(0.0);
    for (b, ease, c) in rows {
        for (i, x) in b.iter().enumerate().filter(|(_, x)| **x != 0.0) {
            for (entry, y) in out[i * count..(i + 1) * count].iter_mut().zip(b) {
                *entry += ease * c * c * x * y;
            }
        }
    }
}

//! Set-valued Coulomb friction: which directions stick and which slip, decided by one convex problem.
//!
//! By Gauss' principle the acceleration minimises `½ (q̈−q̈₀)ᵀH(q̈−q̈₀) + Σ c_i |g_i q̈ + h_i|` over the friction
//! directions at rest. Its dual is a quadratic problem in the friction torques λ with the box `|λ_i| ≤ c_i`: minimise
//! `½ λᵀWλ − rᵀλ` with `W = G H⁻¹ Gᵀ` and `r` the accelerations in the directions without their friction. The
//! acceleration is unique; λ is not where directions depend on each other (parallel friction on geared shafts).
//! Directions that are blocked one way only (stops, one-way clutches) or both ways (locks) have bounds that differ with
//! the sense, or none.

use kardan_math::num::dot;

/// The mode of a friction direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// At rest (stick); the friction torque balances the others, up to c.
    Stick,
    /// Moving forward; friction torque +c against it.
    Forward,
    /// Moving backward; friction torque −c.
    Backward,
}

impl Mode {
    /// The mode of a motion that has, or gains, this speed.
    pub(super) fn of(speed: f64) -> Self {
        match speed {
            speed if speed > 0.0 => Mode::Forward,
            speed if speed < 0.0 => Mode::Backward,
            _ => Mode::Stick,
        }
    }

    /// +1 forward, −1 backward, 0 at rest.
    pub fn sign(self) -> f64 {
        match self {
            Mode::Stick => 0.0,
            Mode::Forward => 1.0,
            Mode::Backward => -1.0,
        }
    }
}

/// Rounding of a speed on the dense output, relative to the terms that cancel in it: units in the last place of 7
/// nested terms whose weights reach some dozens.
pub(super) const NOISE: f64 = 64.0 * f64::EPSILON;

/// The largest torques that oppose motion in each direction.
#[derive(Debug, Clone, Copy)]
pub struct Bounds<'a> {
    /// Against motion forward.
    pub forward: &'a [f64],
    /// Against motion backward.
    pub backward: &'a [f64],
}

impl Bounds<'_> {
    /// Against motion in a sense.
    pub fn of(&self, direction: usize, sense: f64) -> f64 {
        if sense.is_sign_negative() { self.backward[direction] } else { self.forward[direction] }
    }

    /// The larger one of a direction; of one without a bound the size of its torque.
    pub(super) fn scale(&self, direction: usize, torque: f64) -> f64 {
        let most = self.forward[direction].max(self.backward[direction]);
        if most.is_finite() { most } else { torque.abs() }
    }

    /// Whether a torque is within them, with a margin.
    pub fn contains(&self, direction: usize, torque: f64) -> bool {
        torque.abs() < self.of(direction, torque) * (1.0 - 1e-12)
    }
}

/// Violation of an optimality condition, relative to the sizes of the terms that cancel in it, that counts as rounding.
const SETTLED: f64 = 1e-13;
/// Violation that contradicts the others where no bound limits it, relative to the sizes of the terms that cancel in
/// it.
const CONTRADICTS: f64 = 1e-9;
/// Relative curvature of a direction after its dependence on the free ones, below which it is not freed itself.
const DEPENDENT: f64 = 1e-11;
/// Response of a free variable to another one, squared and relative to their sizes, that counts as none: it would reach
/// its bound very far away.
const UNMOVED: f64 = 1e-26;

/// Solver of the box-constrained problem with memory of its own.
#[derive(Debug, Clone, Default)]
pub struct BoxProblem {
    /// Variables whose residual is kept at zero; W over them is regular.
    free: Vec<usize>,
    /// Cholesky factor of W over the free variables.
    lower: Vec<f64>,
    /// Change of the free variables, with opposite sign, per change of the one that enters.
    response: Vec<f64>,
    /// Variables that drove each other indefinitely in the last problem, which then has no solution.
    unbounded: Vec<usize>,
    /// Variables without bounds against each other that contradict each other only by rounding: they stay as they are.
    rejected: Vec<usize>,
}

impl BoxProblem {
    /// Memory for up to `m` directions; it grows if there are more.
    pub fn new(m: usize) -> Self {
        let free = Vec::with_capacity(m);
        Self { free, lower: vec![0.0; m * m], response: vec![0.0; m], unbounded: Vec::new(), rejected: Vec::new() }
    }

    /// The variables without bounds against each other, if the last problem had no solution for them.
    pub fn unbounded(&self) -> &[usize] {
        &self.unbounded
    }

    /// Minimises `½ λᵀWλ − rᵀλ` over `−b_i ≤ λ_i ≤ f_i` for a symmetric positive semidefinite W (m × m, row by row); f and b are not
    /// negative, and may be infinite.
    ///
    /// The remaining accelerations `α = r − Wλ` satisfy: `α_i > 0 ⇒ λ_i = f_i`, `α_i < 0 ⇒ λ_i = −b_i`, and `α_i = 0`
    /// in between. Returns whether this was reached to rounding: not if active constraints contradict each other
    /// without a bound.
    ///
    /// Method: from `λ = 0`, the variable with the largest violation is driven towards its optimum while the free ones
    /// respond so that their α stay zero, until its own α vanishes or a bound is met. A free variable at a bound stops
    /// being free; a variable that depends on the free ones meets no resistance, so it moves on to some bound. Finite,
    /// because every move lowers the objective.
    pub fn solve(&mut self, w: &[f64], r: &[f64], c: Bounds<'_>, lambda: &mut [f64]) -> bool {
        let m = r.len();
        if self.response.len() < m {
            *self = Self::new(m);
        }
        self.free.clear();
        self.unbounded.clear();
        self.rejected.clear();
        lambda.fill(0.0);
        for _ in 0..50 * (m + 1) {
            let mut worst = (SETTLED, None);
            for i in (0..m).filter(|i| !self.free.contains(i) && !self.rejected.contains(i)) {
                let (rest, size) = residual(w, r, lambda, i);
                if c.of(i, rest) - rest.signum() * lambda[i] <= 0.0 {
                    continue;
                }
                if rest.abs() > worst.0 * size {
                    worst = (rest.abs() / size, Some(i));
                }
            }
            let Some(enter) = worst.1 else { return true };
            if !self.drive(enter, w, r, c, lambda) {
                let (rest, size) = residual(w, r, lambda, enter);
                if rest.abs() <= CONTRADICTS * size.max(self.noise(w, r, lambda)) {
                    self.rejected.push(enter);
                    continue;
                }
                let own = w[enter * m + enter];
                let parts = self.free.iter().zip(&self.response);
                let parts = parts.filter(|(i, x)| **x * **x * w[**i * m + **i] > UNMOVED * own).map(|(i, _)| *i);
                self.unbounded = std::iter::once(enter).chain(parts).collect();
                return false;
            }
            self.polish(w, r, c, lambda);
        }
        false
    }

    /// The size of the effect of the free variables on the one that was driven last, if the error of each of their
    /// equations is at the level of cancellation.
    fn noise(&self, w: &[f64], r: &[f64], lambda: &[f64]) -> f64 {
        let off = |(&j, response): (&usize, &f64)| response.abs() * residual(w, r, lambda, j).1;
        self.free.iter().zip(&self.response).map(off).sum()
    }

    /// Moves one variable in the sense of its residual until that vanishes or the variable reaches its bound; false if
    /// it has no bound.
    fn drive(&mut self, enter: usize, w: &[f64], r: &[f64], c: Bounds<'_>, lambda: &mut [f64]) -> bool {
        let m = r.len();
        let sense = residual(w, r, lambda, enter).0.signum();
        loop {
            let own = w[enter * m + enter];
            let mut curvature = own;
            for (a, &i) in self.free.iter().enumerate() {
                self.response[a] = w[i * m + enter];
            }
            self.back_substitute(m);
            for (a, &i) in self.free.iter().enumerate() {
                curvature -= w[i * m + enter] * self.response[a];
            }
            let rest = sense * residual(w, r, lambda, enter).0;
            let (mut way, mut hit) = (c.of(enter, sense) - sense * lambda[enter], Some(None));
            for (a, &i) in self.free.iter().enumerate() {
                let speed = -sense * self.response[a];
                if speed * speed * w[i * m + i] <= UNMOVED * own {
                    continue;
                }
                let room = (c.of(i, speed) - speed.signum() * lambda[i]) / speed.abs();
                if room < way {
                    (way, hit) = (room, Some(Some(a)));
                }
            }
            if rest <= 0.0 {
                return true;
            }
            if way == f64::INFINITY && curvature <= DEPENDENT * own {
                return false;
            }
            if rest <= curvature * way {
                (way, hit) = (rest / curvature, None);
            }
            lambda[enter] += sense * way;
            for (a, &i) in self.free.iter().enumerate() {
                lambda[i] = (lambda[i] - sense * self.response[a] * way).clamp(-c.backward[i], c.forward[i]);
            }
            match hit {
                None => {
                    if curvature > DEPENDENT * own {
                        self.free.push(enter);
                        self.factor(w, m, self.free.len() - 1);
                    }
                    return true;
                }
                Some(None) => {
                    lambda[enter] = sense * c.of(enter, sense);
                    return true;
                }
                Some(Some(a)) => {
                    let speed = -sense * self.response[a];
                    lambda[self.free[a]] = c.of(self.free[a], speed).copysign(speed);
                    self.free.remove(a);
                    self.factor(w, m, a);
                }
            }
        }
    }

    /// Removes the rounding errors in the residuals of the free variables.
    fn polish(&mut self, w: &[f64], r: &[f64], c: Bounds<'_>, lambda: &mut [f64]) {
        for (a, &i) in self.free.iter().enumerate() {
            self.response[a] = residual(w, r, lambda, i).0;
        }
        self.back_substitute(r.len());
        for (a, &i) in self.free.iter().enumerate() {
            lambda[i] = (lambda[i] + self.response[a]).clamp(-c.backward[i], c.forward[i]);
        }
    }

    /// Cholesky factor of W over the free variables, those before `from` being factored already.
    fn factor(&mut self, w: &[f64], m: usize, from: usize) {
        let count = self.free.len();
        for a in from..count {
            for b in 0..=a {
                let mut sum = w[self.free[a] * m + self.free[b]];
                for k in 0..b {
                    sum -= self.lower[a * m + k] * self.lower[b * m + k];
                }
                // Positive in exact arithmetic; the floor prevents rounding from making it negative.
                self.lower[a * m + b] = if a == b {
                    sum.max(1e-15 * w[self.free[a] * m + self.free[a]]).sqrt()
                } else {
                    sum / self.lower[b * m + b]
                };
            }
        }
    }

    /// Overwrites `response` with its product by the inverse of W over the free variables.
    fn back_substitute(&mut self, m: usize) {
        let count = self.free.len();
        for a in 0..count {
            let mut sum = self.response[a];
            for k in 0..a {
                sum -= self.lower[a * m + k] * self.response[k];
            }
            self.response[a] = sum / self.lower[a * m + a];
        }
        for a in (0..count).rev() {
            let mut sum = self.response[a];
            for k in a + 1..count {
                sum -= self.lower[k * m + a] * self.response[k];
            }
            self.response[a] = sum / self.lower[a * m + a];
        }
    }
}

/// `α_i = r_i − (Wλ)_i` and the size of the terms that cancel in it.
fn residual(w: &[f64], r: &[f64], lambda: &[f64], i: usize) -> (f64, f64) {
    let (mut rest, mut size) = (r[i], r[i].abs());
    for (w, x) in w[i * r.len()..(i + 1) * r.len()].iter().zip(lambda) {
        rest -= w * x;
        size += (w * x).abs();
    }
    (rest, size)
}

/// Part of a direction outside a span, relative to its size and squared, that counts as zero.
pub(super) const OUTSIDE: f64 = 1e-20;

/// Independent directions with an orthonormal basis of their span, in the metric of the inverse inertia.
pub(super) struct Span {
    pub(super) members: Vec<usize>,
    basis: Vec<Vec<f64>>,
}

impl Span {
    /// The span of directions with their rows, built from independent ones: the given number of first ones in order,
    /// then the most independent first; at most the given number are independent.
    pub(super) fn new(directions: impl Iterator<Item = (usize, Vec<f64>)>, mut first: usize, most: usize) -> Self {
        let mut span = Self { members: Vec::new(), basis: Vec::new() };
        // Each row with its part outside the span so far, and its size squared.
        let mut rows: Vec<(usize, Vec<f64>, f64)> = directions
            .map(|(k, row)| {
                let size = dot(&row, &row);
                (k, row, size)
            })
            .collect();
        while !rows.is_empty() && span.basis.len() < most {
            // A direction in which no motion is possible depends on all others.
            let rejected =
                |(_, rest, size): &(usize, Vec<f64>, f64)| if *size == 0.0 { 0.0 } else { dot(rest, rest) / size };
            let rejected: Vec<f64> = rows.iter().map(rejected).collect();
            let among = if first > 0 { first } else { rows.len() };
            let best = (0..among).max_by(|&a, &b| rejected[a].total_cmp(&rejected[b]).then(b.cmp(&a))).unwrap_or(0);
            if rejected[best] <= OUTSIDE {
                if first == 0 {
                    break;
                }
                rows.drain(..std::mem::take(&mut first));
                continue;
            }
            first = first.saturating_sub(1);
            let (member, mut vector, _) = rows.remove(best);
            // The rounding remainder of the others in it.
            span.reject(&mut vector);
            let size = dot(&vector, &vector).sqrt();
            vector.iter_mut().for_each(|x| *x /= size);
            rows.iter_mut().for_each(|(_, rest, _)| reject(rest, &vector));
            span.members.push(member);
            span.basis.push(vector);
        }
        span
    }

    /// The part of a row outside the span, relative to its size and squared.
    pub(super) fn rejected(&self, mut row: Vec<f64>) -> f64 {
        let size = dot(&row, &row);
        if size == 0.0 {
            // A direction in which no motion is possible depends on all others.
            return 0.0;
        }
        self.reject(&mut row);
        dot(&row, &row) / size
    }

    fn reject(&self, row: &mut [f64]) {
        // Two passes are enough.
        self.basis.iter().chain(&self.basis).for_each(|vector| reject(row, vector));
    }
}

/// Subtracts the component of a row in the direction of a unit vector.
fn reject(row: &mut [f64], vector: &[f64]) {
    let share = dot(row, vector);
    if share != 0.0 {
        row.iter_mut().zip(vector).for_each(|(x, v)| *x -= share * v);
    }
}

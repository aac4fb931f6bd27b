//! Set-valued Coulomb friction: which directions stick and which slip, decided by one convex problem.
//!
//! By Gauss' principle the acceleration minimises `½ (q̈−q̈₀)ᵀH(q̈−q̈₀) + Σ c_i |g_i q̈ + h_i|` over the friction
//! directions at rest. Its dual is a quadratic problem in the friction torques λ with the box `|λ_i| ≤ c_i`:
//! minimise `½ λᵀWλ − rᵀλ` with `W = G H⁻¹ Gᵀ` and `r` the accelerations along the directions without their friction.
//! The acceleration is unique; λ is not where directions depend on each other (parallel friction on geared shafts).

/// What a friction direction does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// At rest; the friction torque is whatever holds it, up to c.
    Stick,
    /// Moving forward; friction torque +c against it.
    Forward,
    /// Moving backward; friction torque −c.
    Backward,
}

impl Mode {
    /// +1 forward, −1 backward, 0 at rest.
    pub fn sign(self) -> f64 {
        match self {
            Mode::Stick => 0.0,
            Mode::Forward => 1.0,
            Mode::Backward => -1.0,
        }
    }
}

/// Solver of the box-constrained problem with memory of its own.
#[derive(Debug, Clone)]
pub struct BoxProblem {
    free: Vec<usize>,
    lower: Vec<f64>,
    solution: Vec<f64>,
}

impl BoxProblem {
    /// Memory for up to `m` directions.
    pub fn new(m: usize) -> Self {
        Self { free: Vec::with_capacity(m), lower: vec![0.0; m * m], solution: vec![0.0; m] }
    }

    /// Minimises `½ λᵀWλ − rᵀλ` over `|λ_i| ≤ c_i` for a symmetric positive semidefinite W (m × m, row by row).
    ///
    /// The remaining accelerations `α = r − Wλ` satisfy: `α_i > 0 ⇒ λ_i = c_i`, `α_i < 0 ⇒ λ_i = −c_i`, and `α_i = 0`
    /// in between. Method: active set, one variable freed at a time, dependent ones never freed; finite because each
    /// step lowers the objective. Returns whether the optimality conditions were reached to rounding.
    pub fn solve(&mut self, w: &[f64], r: &[f64], c: &[f64], lambda: &mut [f64]) -> bool {
        let m = r.len();
        self.free.clear();
        for i in 0..m {
            lambda[i] = if r[i] < 0.0 { -c[i] } else { c[i] };
        }
        let tolerance = |i: usize| 1e-14 * (r[i].abs() + (0..m).map(|j| (w[i * m + j] * c[j]).abs()).sum::<f64>());
        let mut blocked = vec![false; m];
        for _ in 0..50 * (m + 1) {
            // The bound variable that violates its sign condition most, relative to its own scale.
            let residual = |i: usize, lambda: &[f64]| r[i] - (0..m).map(|j| w[i * m + j] * lambda[j]).sum::<f64>();
            let worst = (0..m)
                .filter(|i| !self.free.contains(i) && !blocked[*i])
                .map(|i| (i, -residual(i, lambda) * lambda[i].signum() / tolerance(i).max(f64::MIN_POSITIVE)))
                .filter(|(_, violation)| *violation > 1.0)
                .max_by(|a, b| a.1.total_cmp(&b.1));
            let Some((enter, _)) = worst else { return true };
            self.free.push(enter);
            if !self.factor(w, m) {
                // Depends on the free ones: its acceleration vanishes with theirs.
                self.free.pop();
                blocked[enter] = true;
                self.factor(w, m);
                continue;
            }
            blocked.fill(false);
            // Move to the minimum over the free variables, stopping at the first bound on the way.
            loop {
                let count = self.free.len();
                for a in 0..count {
                    let i = self.free[a];
                    let bound: f64 =
                        (0..m).filter(|j| !self.free.contains(j)).map(|j| w[i * m + j] * lambda[j]).sum();
                    self.solution[a] = r[i] - bound;
                }
                self.back_substitute(m);
                let mut fraction = 1.0;
                let mut hit = None;
                for a in 0..count {
                    let i = self.free[a];
                    let step = self.solution[a] - lambda[i];
                    let room = if step > 0.0 { c[i] - lambda[i] } else { -c[i] - lambda[i] };
                    if self.solution[a].abs() > c[i] && room / step < fraction {
                        fraction = room / step;
                        hit = Some((a, self.solution[a].signum() * c[i]));
                    }
                }
                for a in 0..count {
                    let i = self.free[a];
                    lambda[i] += fraction * (self.solution[a] - lambda[i]);
                }
                let Some((a, bound)) = hit else { break };
                lambda[self.free[a]] = bound;
                self.free.remove(a);
                if self.free.is_empty() || !self.factor(w, m) {
                    break;
                }
            }
        }
        false
    }

    /// Cholesky factor of W over the free variables; false if the last one depends on the others.
    fn factor(&mut self, w: &[f64], m: usize) -> bool {
        let count = self.free.len();
        for a in 0..count {
            for b in 0..=a {
                let mut sum = w[self.free[a] * m + self.free[b]];
                for k in 0..b {
                    sum -= self.lower[a * m + k] * self.lower[b * m + k];
                }
                if a == b {
                    if !(sum > 1e-11 * w[self.free[a] * m + self.free[a]]) {
                        return false;
                    }
                    self.lower[a * m + a] = sum.sqrt();
                } else {
                    self.lower[a * m + b] = sum / self.lower[b * m + b];
                }
            }
        }
        true
    }

    fn back_substitute(&mut self, m: usize) {
        let count = self.free.len();
        for a in 0..count {
            let mut sum = self.solution[a];
            for k in 0..a {
                sum -= self.lower[a * m + k] * self.solution[k];
            }
            self.solution[a] = sum / self.lower[a * m + a];
        }
        for a in (0..count).rev() {
            let mut sum = self.solution[a];
            for k in a + 1..count {
                sum -= self.lower[k * m + a] * self.solution[k];
            }
            self.solution[a] = sum / self.lower[a * m + a];
        }
    }
}

//! A motion `ż = M z` and integrals of `zᵀ Q z` over it, in steps of one length.
//!
//! With `Φ(h) = e^{Mh}` and `G(h) = ∫₀ʰ Φ(s)ᵀ Q Φ(s) ds`, both over `2h` follow from those over h: `Φ(2h) = Φ(h)²` and
//! `G(2h) = G(h) + Φ(h)ᵀ G(h) Φ(h)` (Van Loan, IEEE Trans. Autom. Control 23, 1978, 395). Over a short h they are Taylor series; that of G
//! has the terms `hᵏ⁺¹/(k+1)! Lᵏ(Q)` with `L(Q) = Mᵀ Q + Q M`, as the derivative of `Φᵀ Q Φ` is `Φᵀ L(Q) Φ`.

use kardan_rt::functions::{ln, powi};

use kardan_math::num::{Matrix, Panels, dot, product, scaled, unscaled};

/// Norm of `M h` up to which h is short.
const SHORT: f64 = 0.5;
/// Terms of a series; those of a short h end far sooner.
const MOST_TERMS: usize = 40;
/// Doublings of a step that are taken as steps: 2 to that power.
const STEPS: u32 = 8;
/// Doublings of a step over which the integrals are taken at once.
const BETWEEN: u32 = 3;
/// Halvings of the whole time; after these there is no result.
const MOST_HALVINGS: f64 = 80.0;

/// z and the integrals on the way through a time. Each doubling of a step doubles the rounding, so that the last ones are steps.
pub(super) struct Recurrence {
    pub(super) z: Vec<f64>,
    /// The integrals so far; between two of their own steps, those before.
    pub(super) work: Vec<f64>,
    /// Steps to come.
    pub(super) remaining_steps: usize,
    step: Panels,
    integrals: Vec<Panels>,
    next: Vec<f64>,
}

impl Recurrence {
    /// The way from z through a time, with the integrals for each Q; `None` if the motion is too fast. The scales are those that balance M.
    pub(super) fn new(m: &Matrix<f64>, q: &[Matrix<f64>], scales: &[f64], z: &[f64], time: f64) -> Option<Self> {
        let n = m.rows();
        let m = scaled(m, scales);
        let norm = (0..n).map(|i| m.row(i).iter().map(|x| x.abs()).sum()).fold(0.0, f64::max) * time;
        let halvings = (ln(norm / SHORT) / std::f64::consts::LN_2).ceil().max(f64::from(STEPS));
        if !(halvings <= MOST_HALVINGS) {
            return None;
        }
        let short = time * powi(2.0, -(halvings as i32));
        let m = m.scale(&short);
        let mut power = Doubling::new(
            &m,
            q.iter().map(|q| Matrix::from_fn(n, n, |i, j| q[(i, j)] * scales[i] * scales[j] * short)),
        );
        (STEPS..halvings as u32).for_each(|_| power.double());
        let step = unscaled(&power.whole, scales);
        if !q.is_empty() {
            (0..BETWEEN).for_each(|_| power.double());
        }
        let integral = |g: &Matrix<f64>| Matrix::from_fn(n, n, |i, j| g[(i, j)] / scales[i] / scales[j]);
        Some(Self {
            z: z.to_vec(),
            work: vec![0.0; q.len()],
            remaining_steps: 1 << STEPS,
            step: Panels::new(&step),
            integrals: power.integrals.iter().map(|g| Panels::new(&integral(g))).collect(),
            next: vec![0.0; n],
        })
    }

    pub(super) fn step(&mut self) {
        if self.remaining_steps.is_multiple_of(1 << BETWEEN) {
            for (work, integral) in self.work.iter_mut().zip(&self.integrals) {
                integral.apply(&self.z, &mut self.next);
                *work += dot(&self.z, &self.next);
            }
        }
        self.step.apply(&self.z, &mut self.next);
        std::mem::swap(&mut self.z, &mut self.next);
        self.remaining_steps -= 1;
    }
}

/// Φ and the integrals over a time that is doubled.
struct Doubling {
    whole: Matrix<f64>,
    integrals: Vec<Matrix<f64>>,
    scratch: [Matrix<f64>; 2],
}

impl Doubling {
    /// Over a short time h, from `M h` and each `Q h`.
    fn new(m: &Matrix<f64>, q: impl Iterator<Item = Matrix<f64>>) -> Self {
        let n = m.rows();
        let whole = series(Matrix::identity(n), m, |term, i, j, k| term[(i, j)] / k as f64);
        let integrals =
            q.map(|q| series(q, m, |term, i, j, k| (term[(i, j)] + term[(j, i)]) / (k + 1) as f64)).collect();
        Self { whole, integrals, scratch: [Matrix::zeros(n, n), Matrix::zeros(n, n)] }
    }

    fn double(&mut self) {
        let [scratch, more] = &mut self.scratch;
        if !self.integrals.is_empty() {
            let transposed = self.whole.transpose();
            for sum in &mut self.integrals {
                product(sum, &self.whole, scratch);
                product(&transposed, scratch, more);
                *sum = sum.plus(more);
            }
        }
        product(&self.whole, &self.whole, scratch);
        std::mem::swap(&mut self.whole, scratch);
    }
}

/// The sum of a series up to where it changes no more. Each term follows from the one before times M: `next(product, i, j, k)` are the
/// entries of term k.
fn series(first: Matrix<f64>, m: &Matrix<f64>, next: impl Fn(&Matrix<f64>, usize, usize, usize) -> f64) -> Matrix<f64> {
    let n = m.rows();
    let [mut sum, mut term, mut times] = [first.clone(), first.clone(), first];
    for k in 1..=MOST_TERMS {
        product(&term, m, &mut times);
        let mut changed = false;
        for i in 0..n {
            for j in 0..n {
                let entry = next(&times, i, j, k);
                let more = sum[(i, j)] + entry;
                changed |= more != sum[(i, j)];
                (term[(i, j)], sum[(i, j)]) = (entry, more);
            }
        }
        if !changed {
            break;
        }
    }
    sum
}

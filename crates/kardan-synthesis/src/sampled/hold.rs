//! The plant with zero-order hold and delay of its inputs.

use kardan_rt::functions::{log2, powi};

use crate::Clock;
use crate::matrix_parts::{is_finite, joined, window};
use kardan_math::num::{Matrix, exponential};

/// A plant `ẋ = A x + B u` with zero-order hold of the inputs, which change with a delay, exactly, over `[x; p₁ … p_h; u]`
/// with the commands p of the samples before (p₁ the last one) and the one computed now, u.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ZohPlant {
    /// `x⁺`, states × (states, past commands, commands).
    pub state: Matrix<f64>,
    /// `∫₀ᵀ [x; u]ᵀ Q [x; u] dt` over the same.
    pub cost: Matrix<f64>,
    /// h, at least one.
    pub past: usize,
}

/// Samples between the computation of a command and the end of its way, rounded up.
pub(crate) fn on_their_way(clock: Clock) -> usize {
    (clock.delay / clock.period - 1e-9).ceil().max(0.0) as usize
}

impl ZohPlant {
    /// Samples a plant exactly. `cost` is Q, over states and inputs in force; the inputs in force change once in a sample.
    /// `None` if a number overflows.
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn new(a: &Matrix<f64>, b: &Matrix<f64>, cost: &Matrix<f64>, clock: Clock) -> Option<Self> {
        let (n, m) = (a.rows(), b.columns());
        assert!(b.rows() == n && cost.rows() == n + m, "a plant whose matrices do not fit");
        let waiting = on_their_way(clock);
        let past = waiting.max(1);
        let all = n + (past + 1) * m;
        // The command of j samples before this one.
        let place = |before: usize| if before == 0 { n + past * m } else { n + (before - 1) * m };
        let flow = joined([a, b], [&Matrix::zeros(m, n), &Matrix::zeros(m, m)]);
        let first = if waiting == 0 { 0.0 } else { clock.delay - (waiting - 1) as f64 * clock.period };
        // [x; u in force] over everything known at the sample.
        let mut now = Matrix::from_fn(n + m, all, |i, j| f64::from(u8::from(i < n && i == j)));
        let mut total = Matrix::zeros(all, all);
        for (length, before) in [(first, waiting), (clock.period - first, waiting.saturating_sub(1))] {
            if length <= 1e-9 * clock.period {
                continue;
            }
            for i in 0..m {
                (0..all).for_each(|j| now[(n + i, j)] = f64::from(u8::from(j == place(before) + i)));
            }
            let (exponential, integral) = integrated(&flow, cost, length)?;
            total = total.plus(&now.transpose().multiply(&integral).multiply(&now));
            now = exponential.multiply(&now);
        }
        Some(Self { state: Matrix::from_fn(n, all, |i, j| now[(i, j)]), cost: total, past })
    }
}

/// A sampled plant with constant disturbances.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DisturbedZohPlant {
    /// `[x; τ of motors with a lag; d]⁺` over `[x; τ; d; p₁ … p_h; u]`.
    pub state: Matrix<f64>,
    /// The plant in continuous time over `[x; τ; d]`.
    pub flow: Matrix<f64>,
}

/// Samples the plant `ẋ = A x + B τ + W d` with motors of these lags (s; zero for none). `None` if a number overflows.
pub(crate) fn zoh_plant(
    a: &Matrix<f64>,
    b: &Matrix<f64>,
    w: &Matrix<f64>,
    lags: &[f64],
    clock: Clock,
) -> Option<DisturbedZohPlant> {
    let (flow, input) = plant_flow(a, b, w, lags);
    let size = flow.rows() + input.columns();
    let discrete = ZohPlant::new(&flow, &input, &Matrix::zeros(size, size), clock)?;
    Some(DisturbedZohPlant { state: discrete.state, flow })
}

/// `[x; τ of motors with a lag; d]` in continuous time: its matrix, and how commands act.
pub(crate) fn plant_flow(
    a: &Matrix<f64>,
    b: &Matrix<f64>,
    w: &Matrix<f64>,
    lags: &[f64],
) -> (Matrix<f64>, Matrix<f64>) {
    let (n, m, d) = (a.rows(), b.columns(), w.columns());
    let lagged: Vec<usize> = (0..m).filter(|&k| lags[k] > 0.0).collect();
    let size = n + lagged.len() + d;
    let mut flow = Matrix::zeros(size, size);
    let mut input = Matrix::zeros(size, m);
    for i in 0..n {
        (0..n).for_each(|j| flow[(i, j)] = a[(i, j)]);
        (0..d).for_each(|j| flow[(i, n + lagged.len() + j)] = w[(i, j)]);
        (0..m).filter(|k| !lagged.contains(k)).for_each(|k| input[(i, k)] = b[(i, k)]);
        lagged.iter().enumerate().for_each(|(place, &k)| flow[(i, n + place)] = b[(i, k)]);
    }
    for (place, &k) in lagged.iter().enumerate() {
        flow[(n + place, n + place)] = -1.0 / lags[k];
        input[(n + place, k)] = 1.0 / lags[k];
    }
    (flow, input)
}

/// Doublings that cost a digit or two.
const FEW: i32 = 4;

/// `e^{At}` and `∫₀ᵗ e^{Aᵀτ} Q e^{Aτ} dτ`; `None` if a number overflows.
///
/// Method: the exponential of `[−Aᵀ Q; 0 A]` over a short time (Van Loan 1978), then doublings, so that fast decay in A does
/// not turn into growth.
pub(crate) fn integrated(a: &Matrix<f64>, q: &Matrix<f64>, time: f64) -> Option<(Matrix<f64>, Matrix<f64>)> {
    let n = a.rows();
    let norm = (0..n).map(|i| a.row(i).iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max) * time;
    let doublings = if norm > 0.5 { log2(norm / 0.5).ceil() as i32 } else { 0 };
    let step = time / powi(2.0, doublings);
    let both = joined([&a.transpose().scale(&-1.0), q], [&Matrix::zeros(n, n), a]);
    let found = exponential(&both.scale(&step))?;
    let mut power = window(&found, n..2 * n, n..2 * n);
    let upper = window(&found, 0..n, n..2 * n);
    let mut integral = power.transpose().multiply(&upper);
    for _ in 0..doublings {
        integral = integral.plus(&power.transpose().multiply(&integral).multiply(&power));
        power = power.multiply(&power);
    }
    // Squared many times, slow motions next to fast ones lose digits.
    if doublings > FEW {
        power = exponential(&a.scale(&time))?;
    }
    (is_finite(&power) && is_finite(&integral)).then_some((power, integral))
}

#[cfg(test)]
#[path = "../../tests/unit/sampled/hold.rs"]
mod tests;

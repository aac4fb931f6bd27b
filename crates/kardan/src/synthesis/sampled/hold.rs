use kardan_rt::functions::{log2, powi};

use crate::num::{Matrix, exponential};
use crate::synthesis::Clock;

/// A plant `ẋ = A x + B u` with zero-order hold of the inputs, which change with a delay, exactly, over `[x; p₁ … p_h; u]`
/// with the commands p of the samples before (p₁ the last one) and the one computed now, u.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::synthesis) struct ZohPlant {
    /// `x⁺`, states × (states, past commands, commands).
    pub state: Matrix<f64>,
    /// `∫₀ᵀ [x; u]ᵀ Q [x; u] dt` over the same.
    pub cost: Matrix<f64>,
    /// h, at least one.
    pub past: usize,
}

/// Samples between the computation of a command and the end of its way, rounded up.
pub(in crate::synthesis) fn on_their_way(clock: Clock) -> usize {
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
        let flow = Matrix::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
            (true, true) => a[(i, j)],
            (true, false) => b[(i, j - n)],
            _ => 0.0,
        });
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
pub(in crate::synthesis) struct DisturbedZohPlant {
    /// `[x; τ of motors with a lag; d]⁺` over `[x; τ; d; p₁ … p_h; u]`.
    pub state: Matrix<f64>,
    /// The plant in continuous time over `[x; τ; d]`.
    pub flow: Matrix<f64>,
}

/// Samples the plant `ẋ = A x + B τ + W d` with motors of these lags (s; zero for none). `None` if a number overflows.
pub(in crate::synthesis) fn zoh_plant(
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
pub(in crate::synthesis) fn plant_flow(
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

/// `e^{At}` and `∫₀ᵗ e^{Aᵀτ} Q e^{Aτ} dτ`; `None` if a number overflows.
///
/// Method: the exponential of `[−Aᵀ Q; 0 A]` over a short time (Van Loan 1978), then doublings, so that fast decay in A does
/// not turn into growth.
pub(in crate::synthesis) fn integrated(
    a: &Matrix<f64>,
    q: &Matrix<f64>,
    time: f64,
) -> Option<(Matrix<f64>, Matrix<f64>)> {
    let n = a.rows();
    let norm = (0..n).map(|i| a.row(i).iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max) * time;
    let doublings = if norm > 0.5 { log2(norm / 0.5).ceil() as i32 } else { 0 };
    let step = time / powi(2.0, doublings);
    let both = Matrix::from_fn(2 * n, 2 * n, |i, j| {
        step * match (i < n, j < n) {
            (true, true) => -a[(j, i)],
            (true, false) => q[(i, j - n)],
            (false, true) => 0.0,
            (false, false) => a[(i - n, j - n)],
        }
    });
    let found = exponential(&both)?;
    let mut power = Matrix::from_fn(n, n, |i, j| found[(n + i, n + j)]);
    let upper = Matrix::from_fn(n, n, |i, j| found[(i, n + j)]);
    let mut integral = power.transpose().multiply(&upper);
    for _ in 0..doublings {
        integral = integral.plus(&power.transpose().multiply(&integral).multiply(&power));
        power = power.multiply(&power);
    }
    let finite = |m: &Matrix<f64>| m.as_slice().iter().all(|x| x.is_finite());
    (finite(&power) && finite(&integral)).then_some((power, integral))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(rows: &[&[f64]]) -> Matrix<f64> {
        Matrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
    }

    fn close(a: &Matrix<f64>, b: &Matrix<f64>, tolerance: f64) {
        assert_eq!((a.rows(), a.columns()), (b.rows(), b.columns()));
        for (x, y) in a.as_slice().iter().zip(b.as_slice()) {
            assert!((x - y).abs() <= tolerance, "{x} {y}");
        }
    }

    /// The sampled plant against exponentials of the system augmented with the input in force, for delays of any part of a
    /// sample and of several: x⁺ = e^{A(T−d)} (e^{Ad} x + Γ(d) v₁) + Γ(T−d) v₂.
    #[test]
    fn any_delay_is_exact() {
        let a = matrix(&[&[0.0, 1.0, 0.0], &[-900.0, -0.5, 40.0], &[0.0, 0.0, -6000.0]]);
        let b = matrix(&[&[0.0], &[0.0], &[6000.0]]);
        let period = 1e-3;
        for delay in [0.0, 0.2e-3, 1e-3, 1.3e-3, 2e-3, 3.7e-3] {
            let discrete = ZohPlant::new(&a, &b, &Matrix::zeros(4, 4), Clock { period, delay, single: false }).unwrap();
            let whole = (delay / period).ceil();
            let first = if delay > 0.0 { delay - (whole - 1.0) * period } else { 0.0 };
            let augmented = |time: f64| {
                let both = Matrix::from_fn(4, 4, |i, j| match (i < 3, j < 3) {
                    (true, true) => a[(i, j)] * time,
                    (true, false) => b[(i, 0)] * time,
                    _ => 0.0,
                });
                exponential(&both).unwrap()
            };
            let (one, two) = (augmented(first), augmented(period - first));
            let waiting = whole as usize;
            assert_eq!(discrete.past, waiting.max(1));
            let place = |before: usize| if before == 0 { 3 + discrete.past } else { 2 + before };
            let mut expected = Matrix::zeros(3, 4 + discrete.past);
            for i in 0..3 {
                for k in 0..3 {
                    (0..3).for_each(|j| expected[(i, j)] += two[(i, k)] * one[(k, j)]);
                    expected[(i, place(waiting))] += two[(i, k)] * one[(k, 3)];
                }
                expected[(i, place(waiting.saturating_sub(1)))] += two[(i, 3)];
            }
            close(&discrete.state, &expected, 1e-12);
        }
    }

    /// The cost against a sum over many short intervals.
    #[test]
    fn the_cost_is_integrated() {
        let a = matrix(&[&[0.0, 1.0], &[-400.0, -8.0]]);
        let b = matrix(&[&[0.0], &[20.0]]);
        let q = matrix(&[&[3.0, 0.5, 0.1], &[0.5, 0.2, 0.0], &[0.1, 0.0, 0.7]]);
        let (period, delay) = (0.02, 0.013);
        let discrete = ZohPlant::new(&a, &b, &q, Clock { period, delay, single: false }).unwrap();
        let (x, before, now) = ([0.3, -2.0], 1.5, -0.7);
        let all = [x[0], x[1], before, now];
        let found: f64 = (0..4)
            .flat_map(|i| (0..4).map(move |j| (i, j)))
            .map(|(i, j)| all[i] * discrete.cost[(i, j)] * all[j])
            .sum();
        // Simpson's rule on the exact motion.
        let motion = |time: f64| {
            let step = |x: [f64; 2], u: f64, time: f64| {
                let both = Matrix::from_fn(3, 3, |i, j| {
                    time * if i == 2 {
                        0.0
                    } else if j == 2 {
                        b[(i, 0)]
                    } else {
                        a[(i, j)]
                    }
                });
                let e = exponential(&both).unwrap();
                [0, 1].map(|i| e[(i, 0)] * x[0] + e[(i, 1)] * x[1] + e[(i, 2)] * u)
            };
            if time <= delay {
                (step(x, before, time), before)
            } else {
                (step(step(x, before, delay), now, time - delay), now)
            }
        };
        let density = |time: f64| {
            let (x, u) = motion(time);
            let s = [x[0], x[1], u];
            (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).map(|(i, j)| s[i] * q[(i, j)] * s[j]).sum::<f64>()
        };
        let simpson = |from: f64, to: f64| {
            let n = 400;
            let h = (to - from) / f64::from(n);
            let inner: f64 =
                (1..n).map(|k| if k % 2 == 1 { 4.0 } else { 2.0 } * density(from + h * f64::from(k))).sum();
            h / 3.0 * (density(from) + inner + density(to))
        };
        let expected = simpson(0.0, delay) + simpson(delay * (1.0 + 1e-15), period);
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
    }

    /// A time constant far below the sample time turns into no growth.
    #[test]
    fn fast_decay_is_no_growth() {
        let (power, integral) = integrated(&matrix(&[&[-1e7]]), &matrix(&[&[2.0]]), 1e-3).unwrap();
        assert!(power[(0, 0)].abs() < 1e-300);
        assert!((integral[(0, 0)] / 1e-7 - 1.0).abs() < 1e-12);
    }
}

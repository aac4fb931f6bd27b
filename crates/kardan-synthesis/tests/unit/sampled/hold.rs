//! Tests of `src/sampled/hold.rs`.

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
    let found: f64 =
        (0..4).flat_map(|i| (0..4).map(move |j| (i, j))).map(|(i, j)| all[i] * discrete.cost[(i, j)] * all[j]).sum();
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
        let inner: f64 = (1..n).map(|k| if k % 2 == 1 { 4.0 } else { 2.0 } * density(from + h * f64::from(k))).sum();
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

//! Tests of `src/window.rs`.

use kardan_rt::functions::{sin, sin_cos};

use super::*;

fn readings(width: f64, times: &[f64], of: impl Fn(f64) -> f64) -> Vec<Reading> {
    let values: Vec<f64> = times.iter().map(|&t| of(t)).collect();
    let mut windows = Windows::new(width, 0.0, 1);
    let mut out = Vec::new();
    windows.add(times, &[&values], &mut |_, readings| out.push(readings[0]));
    windows.finish(&mut |_, readings| out.push(readings[0]));
    out
}

/// A polynomial at times that are not evenly spaced: exact.
#[test]
fn polynomials_are_exact() {
    let times: Vec<f64> = (0..100).map(|k| 0.001 * (f64::from(k) + 0.3 * sin(f64::from(k)) + 0.5)).collect();
    for found in readings(0.05, &times, |t| 3.0 + 2.0 * t) {
        assert!((found.first - 2.0).abs() < 1e-9 && found.second.abs() < 1e-6);
    }
    let quadratic = readings(0.05, &times, |t| 1.0 - t + 4.0 * t * t);
    assert_eq!(quadratic.len(), 2);
    for (k, found) in quadratic.iter().enumerate() {
        let t = 0.05 * (k as f64 + 0.5);
        assert!((found.first - (-1.0 + 8.0 * t)).abs() < 1e-9, "{found:?}");
        assert!((found.second - 8.0).abs() < 1e-6 && found.noise < 1e-9, "{found:?}");
    }
}

/// One kernel: of a sine, value, first and second derivative are damped by the same factor.
#[test]
fn all_derivatives_pass_one_filter() {
    let (width, frequency) = (0.1, 40.0);
    let times: Vec<f64> = (0..1000).map(|k| 1e-4 * (f64::from(k) + 0.5)).collect();
    let found = readings(width, &times, |t| sin(frequency * t))[0];
    let (sine, cosine) = sin_cos(frequency * width / 2.0);
    // Damping: the transform of (1 − x²)³ over its integral, from its series in (frequency T/2)².
    let z = powi(frequency * width / 2.0_f64, 2);
    let mut damping = 0.0;
    let mut term = 1.0;
    for k in 0..20 {
        damping += term;
        term *= -z / ((2.0 * f64::from(k) + 2.0) * (2.0 * f64::from(k) + 9.0));
    }
    assert!((found.value - damping * sine).abs() < 1e-5, "{found:?}");
    assert!((found.first - damping * frequency * cosine).abs() < 1e-5 * frequency, "{found:?}");
    assert!((found.second + damping * frequency * frequency * sine).abs() < 1e-4 * powi(frequency, 2), "{found:?}");
}

/// The stated gains: variances over many windows of white noise, and the noise told by each.
#[test]
fn noise_is_reported_and_passed_on_as_stated() {
    let mut random = kardan_math::num::Random::new(7);
    let (n, count, width) = (50, 4000, 0.05);
    let times: Vec<f64> = (0..n * count).map(|k| 0.001 * (f64::from(k) + 0.5)).collect();
    let noise: Vec<f64> = times.iter().map(|_| (0..12).map(|_| random.unit()).sum::<f64>() - 6.0).collect();
    let mut windows = Windows::new(width, 0.0, 1);
    let mut found = Vec::new();
    windows.add(&times, &[&noise], &mut |_, readings| found.push(readings[0]));
    let mean = |of: &dyn Fn(&Reading) -> f64| found.iter().map(of).sum::<f64>() / found.len() as f64;
    let n = f64::from(n);
    // Standard error of a variance from 4000 draws: 2.2 %.
    assert!((mean(&|r| powi(r.value, 2)) * n / Reading::VALUE_GAIN - 1.0).abs() < 0.08);
    assert!((mean(&|r| powi(r.first, 2)) * n * powi(width, 2) / Reading::FIRST_GAIN - 1.0).abs() < 0.08);
    assert!((mean(&|r| powi(r.second, 2)) * n * powi(width, 4) / Reading::SECOND_GAIN - 1.0).abs() < 0.08);
    assert!((mean(&|r| powi(r.noise, 2)) - 1.0).abs() < 0.02, "{}", mean(&|r| powi(r.noise, 2)));
}

#[test]
fn a_slow_channel_beside_a_fast_one_and_holes() {
    let times: Vec<f64> = (0..200).map(|k| 0.001 * f64::from(k)).collect();
    let fast: Vec<f64> = times.iter().map(|t| 5.0 * t).collect();
    let slow: Vec<f64> = (0..200).map(|k| if k % 10 == 0 { 5.0 * times[k] } else { f64::NAN }).collect();
    let broken: Vec<f64> = (0..200).map(|k| if (30..60).contains(&k) { f64::NAN } else { 1.0 }).collect();
    let mut windows = Windows::new(0.1, 0.0, 3);
    let mut found = Vec::new();
    // In blocks that do not end with windows.
    for from in (0..200).step_by(37) {
        let to = (from + 37).min(200);
        let columns = [&fast[from..to], &slow[from..to], &broken[from..to]];
        windows.add(&times[from..to], &columns, &mut |k, r| found.push((k, r.to_vec())));
    }
    windows.finish(&mut |k, r| found.push((k, r.to_vec())));
    assert_eq!(found.len(), 2);
    for (k, readings) in &found {
        let middle = 0.1 * (*k as f64 + 0.5);
        for reading in &readings[..2] {
            assert!((reading.value - 5.0 * middle).abs() < 1e-9 && (reading.first - 5.0).abs() < 1e-9);
        }
    }
    assert_eq!((found[0].1[1].samples, found[0].1[2].samples), (10, 0));
    assert_eq!(found[1].1[2].samples, 100);
}

//! Tests of `src/study/measure/spectrum.rs`.

use kardan_rt::functions::sin;

use super::*;

/// A sine on a frequency of the spectrum shows its amplitude, whatever its phase and mean, for even and odd numbers of rows; rows between
/// those of the grid change nothing.
#[test]
fn a_sine_shows_its_amplitude() {
    for (count, phase) in [(1000, 0.3), (999, 1.0), (64, -2.0)] {
        let time = |k: f64| 0.5 + 2.0 * k / f64::from(count);
        let mut times: Vec<f64> = (0..=count).map(|k| time(f64::from(k))).collect();
        times.push(time(10.5));
        times.sort_by(f64::total_cmp);
        let values: Vec<f64> = times.iter().map(|t| 7.0 + 3.0 * sin(2.0 * PI * 6.0 * t + phase)).collect();
        let (frequency, amplitude) = amplitudes(&times, &values).unwrap();
        assert!((frequency[11] - 6.0).abs() < 1e-12 && amplitude.len() == count as usize / 2);
        for (k, found) in amplitude.iter().enumerate() {
            let expected = match k {
                11 => 3.0,
                10 | 12 => 1.5,
                _ => 0.0,
            };
            assert!((found - expected).abs() < 1e-11, "{count} {k}: {found}");
        }
    }
    assert!(amplitudes(&[0.0; 10], &[0.0; 10]).is_err());
}

//! Modes from eigenvalues and eigenvectors.

use faer::c64;

use kardan_results::{Complex, Mode, ShapePart};

pub(super) fn root(value: c64) -> Mode {
    let size = value.norm();
    Mode {
        eigenvalue: Complex::new(value.re, value.im),
        natural_frequency: size,
        // Not −0 without damping.
        damping_ratio: if size > 0.0 { 0.0 - value.re / size } else { 1.0 },
        ..Mode::default()
    }
}

pub(super) fn sorted(mut modes: Vec<Mode>) -> Vec<Mode> {
    modes.sort_by(|a, b| {
        let size = a.natural_frequency.total_cmp(&b.natural_frequency);
        size.then(a.eigenvalue.re.total_cmp(&b.eigenvalue.re)).then(a.eigenvalue.im.total_cmp(&b.eigenvalue.im))
    });
    modes
}

pub(super) fn shape(names: &[String], values: impl Iterator<Item = c64>) -> Vec<ShapePart> {
    names
        .iter()
        .zip(values)
        .map(|(name, x)| ShapePart { name: name.clone(), value: Complex::new(x.re, x.im) })
        .collect()
}

pub(super) fn row_dot(row: &[(usize, f64)], x: &[c64]) -> c64 {
    row.iter().map(|(j, factor)| x[*j] * *factor).sum()
}

/// Entry by entry.
pub(super) fn times(x: &[c64], scales: &[f64]) -> Vec<c64> {
    x.iter().zip(scales).map(|(x, scale)| x * *scale).collect()
}

/// With largest entry 1; `None` if that is impossible.
pub(super) fn normalised(x: &[c64]) -> Option<Vec<c64>> {
    // In two steps, so that the size of a complex divisor cannot overflow.
    let size = x.iter().fold(0.0f64, |max, x| max.max(x.re.abs()).max(x.im.abs()));
    let x: Vec<c64> = x.iter().map(|x| c64::new(x.re / size, x.im / size)).collect();
    let largest = largest(&x);
    let x: Vec<c64> = x.iter().map(|x| x / largest).collect();
    x.iter().all(|x| x.re.is_finite() && x.im.is_finite()).then_some(x)
}

pub(super) fn largest(x: &[c64]) -> c64 {
    let larger = |(best, most): (c64, f64), x: c64| match x.norm() {
        size if size > most => (x, size),
        _ => (best, most),
    };
    x.iter().copied().fold((c64::ZERO, 0.0), larger).0
}

//! Slopes of monotone interpolation.

/// Slopes at three or more points of the cubics between them that are monotone where the points are (Steffen, Astron. Astrophys. 239,
/// 1990, (5) to (11)), as many as there are points.
///
/// # Panics
/// With fewer than three points, or not as many x as y.
pub fn steffen(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len();
    let h = |k: usize| x[k + 1] - x[k];
    let s = |k: usize| (y[k + 1] - y[k]) / h(k);
    // That of the parabola through three points, at one end of them.
    let end = |near: usize, far: usize| {
        let part = h(near) / (h(near) + h(far));
        let slope = s(near) * (1.0 + part) - s(far) * part;
        match slope {
            slope if slope * s(near) <= 0.0 => 0.0,
            slope if slope.abs() > 2.0 * s(near).abs() => 2.0 * s(near),
            slope => slope,
        }
    };
    let inner = |k: usize| {
        let (before, behind) = (s(k - 1), s(k));
        if before * behind <= 0.0 {
            return 0.0;
        }
        let parabola = (before * h(k) + behind * h(k - 1)) / (h(k - 1) + h(k));
        2.0 * before.signum() * before.abs().min(behind.abs()).min(0.5 * parabola.abs())
    };
    (0..n)
        .map(|k| match k {
            0 => end(0, 1),
            k if k == n - 1 => end(n - 2, n - 3),
            k => inner(k),
        })
        .collect()
}

#[cfg(test)]
#[path = "../../tests/unit/num/steffen.rs"]
mod tests;

//! The discrete Fourier transform of any number of samples.

use kardan_rt::functions::sin_cos;
use std::f64::consts::PI;

/// A complex number.
type Pair = [f64; 2];

fn times(a: Pair, b: Pair) -> Pair {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

fn rotation(angle: f64) -> Pair {
    let (sine, cosine) = sin_cos(angle);
    [cosine, sine]
}

/// `X_k = Σ x_j exp(-2πi jk/n)` of real samples, `[re, im]` for each k below n.
///
/// Method: a chirp makes a convolution of it, whose length is a power of two (Bluestein, IEEE Trans. Audio Electroacoust. 18 (1970) 451).
/// Cost: n log n.
///
/// ```
/// use kardan_math::num::fourier;
/// let found = fourier(&[1.0, 2.0, 4.0]);
/// assert!((found[0][0] - 7.0).abs() < 1e-14 && (found[1][0] + 2.0).abs() < 1e-14);
/// assert!((found[1][1] - 3.0_f64.sqrt()).abs() < 1e-14);
/// ```
pub fn fourier(samples: &[f64]) -> Vec<[f64; 2]> {
    let n = samples.len();
    if n == 0 {
        return Vec::new();
    }
    let length = (2 * n - 1).next_power_of_two();
    // k² becomes too large for the resolution of an angle; exp(-πi k²/n) has the period 2n in k².
    let chirp = |k: usize| rotation(-PI * ((k as u128 * k as u128) % (2 * n as u128)) as f64 / n as f64);
    let (mut a, mut b) = (vec![[0.0; 2]; length], vec![[0.0; 2]; length]);
    for (k, sample) in samples.iter().enumerate() {
        let [cosine, sine] = chirp(k);
        a[k] = [sample * cosine, sample * sine];
        b[k] = [cosine, -sine];
        b[(length - k) % length] = [cosine, -sine];
    }
    transform(&mut a, -1.0);
    transform(&mut b, -1.0);
    for (a, b) in a.iter_mut().zip(&b) {
        *a = times(*a, *b);
    }
    transform(&mut a, 1.0);
    let scaled = |(k, value): (usize, &Pair)| {
        let [re, im] = times(*value, chirp(k));
        [re / length as f64, im / length as f64]
    };
    a.iter().take(n).enumerate().map(scaled).collect()
}

/// In place, of a power of two samples; with sign 1 the inverse times their number.
fn transform(x: &mut [Pair], sign: f64) {
    let n = x.len();
    let bits = n.trailing_zeros();
    for k in 0..n {
        let other = k.reverse_bits().checked_shr(usize::BITS - bits).unwrap_or(0);
        if k < other {
            x.swap(k, other);
        }
    }
    let mut half = 1;
    while half < n {
        let roots: Vec<Pair> = (0..half).map(|k| rotation(sign * PI * k as f64 / half as f64)).collect();
        for block in x.chunks_exact_mut(2 * half) {
            let (low, high) = block.split_at_mut(half);
            for ((a, b), root) in low.iter_mut().zip(high).zip(&roots) {
                let [re, im] = times(*b, *root);
                (*a, *b) = ([a[0] + re, a[1] + im], [a[0] - re, a[1] - im]);
            }
        }
        half *= 2;
    }
}

#[cfg(test)]
#[path = "../../tests/unit/num/fourier.rs"]
mod tests;

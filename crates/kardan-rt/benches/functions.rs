//! What an elementary function costs, alone and in lanes: `cargo bench -p kardan-rt --bench functions`.

use divan::{Bencher, black_box};
use kardan_rt::{Lanes, Number, functions as f};

fn main() {
    divan::main();
}

/// Numbers from 0.01 to 1.
fn arguments<const N: usize>() -> Vec<Lanes<f64, N>> {
    let count = 1024 / N;
    (0..count).map(|k| Lanes(std::array::from_fn(|lane| ((k * N + lane) as f64 + 10.0) / 1034.0))).collect()
}

/// A thousand values, one for each number: figures are for all of them.
fn all<const N: usize>(bencher: Bencher, function: impl Fn(Lanes<f64, N>) -> Lanes<f64, N> + Sync) {
    let (arguments, mut out) = (arguments::<N>(), arguments::<N>());
    bencher.bench_local(|| {
        for (out, x) in out.iter_mut().zip(&arguments) {
            *out = function(black_box(*x));
        }
        black_box(&out);
    });
}

#[divan::bench(consts = [1, 4, 8])]
fn sine_and_cosine<const N: usize>(bencher: Bencher) {
    all::<N>(bencher, |x| {
        let (sine, cosine) = f::sin_cos(x);
        sine + cosine
    });
}

#[divan::bench(consts = [1, 4, 8])]
fn tangent<const N: usize>(bencher: Bencher) {
    all::<N>(bencher, f::tan);
}

#[divan::bench(consts = [1, 4, 8])]
fn exponential<const N: usize>(bencher: Bencher) {
    all::<N>(bencher, f::exp);
}

#[divan::bench(consts = [1, 4, 8])]
fn logarithm<const N: usize>(bencher: Bencher) {
    all::<N>(bencher, f::ln);
}

#[divan::bench(consts = [1, 4, 8])]
fn arc_sine<const N: usize>(bencher: Bencher) {
    all::<N>(bencher, f::asin);
}

#[divan::bench(consts = [1, 4, 8])]
fn arc_tangent_2<const N: usize>(bencher: Bencher) {
    all::<N>(bencher, |x| f::atan2(x, Number::all(0.5)));
}

/// The functions of the platform, for comparison.
mod platform {
    use super::*;

    #[divan::bench]
    fn sine_and_cosine(bencher: Bencher) {
        all::<1>(bencher, |x| x.map(|x| x.sin() + x.cos()));
    }

    #[divan::bench]
    fn exponential(bencher: Bencher) {
        all::<1>(bencher, |x| x.map(|x| x.exp()));
    }

    #[divan::bench]
    fn arc_tangent_2(bencher: Bencher) {
        all::<1>(bencher, |x| x.map(|x| x.atan2(0.5)));
    }
}

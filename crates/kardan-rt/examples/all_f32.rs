//! The largest error of every function of one `f32`, over all of them; some minutes:
//! `cargo run --release -p kardan-rt --example all_f32`.
//!
//! The functions of `f64` stand for the right value: they are wrong by less than `2⁻²⁸` of a unit in the last place of an `f32`.

use std::thread;

use kardan_rt::functions as f;

type Pair = (&'static str, fn(f32) -> f32, fn(f64) -> f64);

const FUNCTIONS: [Pair; 8] = [
    ("sin", f::sin, f::sin),
    ("cos", f::cos, f::cos),
    ("tan", f::tan, f::tan),
    ("exp", f::exp, f::exp),
    ("ln", f::ln, f::ln),
    ("asin", f::asin, f::asin),
    ("acos", f::acos, f::acos),
    ("atan", f::atan, f::atan),
];

/// The error at a number in units in the last place; infinite where one is a number and the other is not.
fn error(x: f32, (_, single, double): Pair) -> f64 {
    let (found, wanted) = (single(x), double(f64::from(x)));
    // Beyond the largest number, infinity is right from half a unit on.
    let most = f64::from(f32::MAX) * (1.0 + f64::from(f32::EPSILON) / 4.0);
    if found.is_nan() || wanted.is_nan() || found.is_infinite() || wanted.abs() >= most {
        let right = (found.is_nan() && wanted.is_nan())
            || f64::from(found) == wanted
            || (found.is_infinite() && wanted.abs() >= most && (wanted > 0.0) == (found > 0.0));
        return if right { 0.0 } else { f64::INFINITY };
    }
    let exponent = (wanted.abs().to_bits() >> 52) as i32 - 1023;
    let place = f64::from_bits(((exponent.max(-126) - 23 + 1023) as u64) << 52);
    (f64::from(found) - wanted).abs() / place
}

/// The largest error over some numbers, given by their bits. Beyond 6433 rad sine, cosine and tangent are those of `f64`, rounded: of
/// such angles every 64th is enough.
fn largest(pair: Pair, from: u32, to: u32) -> (f64, f32) {
    let far = |bits: u32| f32::from_bits(bits).abs() > 6433.0 && matches!(pair.0, "sin" | "cos" | "tan");
    let all = (from..=to).filter(|bits| !far(*bits) || bits % 64 == 0);
    let errors = all.map(|bits| (error(f32::from_bits(bits), pair), f32::from_bits(bits)));
    errors.fold((0.0, 0.0), |most, own| if own.0 > most.0 { own } else { most })
}

fn main() {
    let parts: u32 = thread::available_parallelism().map_or(1, |n| n.get() as u32);
    let size = u32::MAX / parts;
    let mut failed = false;
    for pair in FUNCTIONS {
        let all = thread::scope(|scope| {
            let range = |k: u32| (k * size, if k + 1 == parts { u32::MAX } else { (k + 1) * size - 1 });
            let tasks: Vec<_> = (0..parts).map(range).map(|(a, b)| scope.spawn(move || largest(pair, a, b))).collect();
            let found = tasks.into_iter().map(|task| task.join().expect("no panic"));
            found.fold((0.0, 0.0), |most, own| if own.0 > most.0 { own } else { most })
        });
        println!("{:5} {:.4} units in the last place at {:e}", pair.0, all.0, all.1);
        failed |= all.0 > 1.0;
    }
    assert!(!failed, "an error above one unit in the last place");
}
